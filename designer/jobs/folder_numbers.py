"""The numbers that the work in a design folder was made with, for a user who gives none.

A verb on a folder goes on with the folder's own seed, samples and limits. What the user gives
stands, and where that differs from what is there, ``Folder.decide`` refuses it as it always does.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from designer.base.design_folder import Folder, is_design_folder
from designer.base.manifest import StageName
from designer.jobs.options import Options
from designer.jobs.study_folder import blame_budget, blamed
from designer.model.model_file import ModelFile


def own(
    folder: Folder, stage: StageName, names: Collection[str], limits: Collection[str] = ()
) -> dict[str, Any]:
    """The inputs of these names that a stage of the folder was made with, by name.

    names : numbers that the stage always has. limits : inputs that may be None or empty, which
    means that there is no limit; one without a limit is left out. Empty where there is no such
    stage.
    """
    stages = {} if folder.manifest is None else folder.manifest.stages
    inputs = stages[stage].inputs if stage in stages else {}
    found = {name: inputs[name] for name in names if name in inputs}
    return found | {name: inputs[name] for name in limits if inputs.get(name) not in (None, [])}


def goes_on(model: Path, out: Path, resume: bool) -> bool:
    """Whether a verb goes on with what the folder ``out`` has: it is the verb's argument, or its
    work is to be resumed."""
    return resume or (model.is_dir() and model.resolve() == out.resolve())


def of_study(
    model: Path, out: Path, modelfile: ModelFile, options: Options, given: Mapping[str, Any]
) -> Options:
    """The options with the numbers of the folder's own study where the user gave none.

    A study that is new has as many samples as the model file lists measured boards, if it does.
    model : the verb's argument; out : the folder. given : what the command line says, by the names
    of ``Options``; None where it says nothing, and without a name that the verb does not have.
    With ``overwrite`` a width in ``until`` is not taken over, for nothing else could take it away.
    """
    listed = modelfile.measured
    if listed is not None and listed.labels and given["samples"] is None:
        options = replace(options, samples=len(listed.labels))
    if not goes_on(model, out, options.resume):
        return options
    limits = () if options.overwrite else ("until",)
    taken = own(Folder(out), "study", ("samples", "seed", "layers"), limits)
    return _with(options, taken, given)


def of_built(path: Path, options: Options, given: Mapping[str, Any]) -> Options:
    """The same of the study of built boards in a design folder."""
    if not is_design_folder(path):
        return options
    return _with(options, own(Folder(path), "measured", ("seed", "layers")), given)


def _with(options: Options, taken: dict[str, Any], given: Mapping[str, Any]) -> Options:
    """The options with what was taken, where nothing is given."""
    layers = taken.pop("layers", None)
    if layers is not None:
        taken |= {"blamed": blamed(layers), "blame_budget": blame_budget(layers)}
        if "ngspice" not in layers:
            taken["rung"] = "exact"
    options = replace(options, **{k: v for k, v in taken.items() if given.get(k, k) is None})
    return options if options.blamed else replace(options, blame_budget=None)


def of_search(out: Path, options: Options, given: Mapping[str, Any]) -> Options:
    """The same of the search of a model file that is resumed in the folder ``out``."""
    if not options.resume:
        return options
    folder = Folder(out)
    taken = own(folder, "search", ("seed",)) | own(folder, "study", ("samples",))
    return replace(options, **{k: v for k, v in taken.items() if given[k] is None})
