"""A model file that leaves its design to a search, for verbs that need a design."""

from __future__ import annotations

from pathlib import Path

from designer.base.design_folder import MODEL
from designer.jobs.options import Options
from designer.model.model_file import ModelFile


def design_file(modelfile: ModelFile, out: Path, options: Options) -> ModelFile:
    """The model file that a verb works with: the given one, or, where it leaves the design to a
    search, that of the folder ``out``, in which the search then writes the design.

    A design folder's own model file has its design already.
    """
    if modelfile.circuit.objective != "yield" or modelfile.source == out / MODEL:
        return modelfile
    from designer.jobs.search_stage import searched_into

    return searched_into(modelfile, out, options)
