"""The design that is in a folder, and what it was made from."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.design_folder import DESIGN, DESIGN_FILES, MEASURED, MODEL, Folder
from designer.base.manifest import Stages, object_hash
from designer.base.plain_json import plain
from designer.base.progress import Progress, note, report_to
from designer.base.version import __version__
from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.check.synthesis_result import Synthesis
from designer.folders import board_files
from designer.folders.design_files import load, waveform_names
from designer.folders.design_findings import FINDINGS, findings, subject_of
from designer.folders.model_source import design_inputs_of, source
from designer.model.model_file import ModelFile
from designer.spread.part_grades import once_otherwise

if TYPE_CHECKING:
    from designer.answers.design_answer import DesignAnswer, DesignFindings

GRADES = "grades"
"""Among a design's inputs where the bill once held other grades than the study drew."""


def read_design(
    path: Path | str, catalog: Catalog | None = None, progress: Progress | None = None
) -> Synthesis:
    """The design in a design folder; ``progress`` is told of another catalogue or version."""
    modelfile, place = source(Path(path), path)
    folder, catalog = Folder(place), load_catalog() if catalog is None else catalog
    if progress is not None:
        with report_to(progress):
            standing_design(folder, modelfile, catalog)
    return load(folder, modelfile, catalog)


def design_answer(folder: Folder) -> DesignAnswer:
    """The JSON object of a folder's design; with the findings that older versions did not write,
    judged now."""
    document: DesignAnswer = folder.json(DESIGN)
    if document.keys() >= FINDINGS:
        return document
    return {**document, **_findings(folder.path, object_hash(document))}


@lru_cache(maxsize=4)
def _findings(path: Path, _hash: str) -> DesignFindings:
    """Of a design that was written without them; a run asks more than once."""
    found: DesignFindings = plain(findings(design := read_design(path), subject_of(design)))
    return found


def design_inputs(modelfile: ModelFile, catalog: Catalog) -> dict[str, Any]:
    """What decides the design of a model file."""
    inputs = {"model": modelfile.sha256, "catalogue": catalog.hash, "version": __version__}
    listed = modelfile.measured
    return (
        inputs
        | grade_inputs(modelfile, catalog)
        | ({} if listed is None else {"measured": listed.sha256})
    )


def grade_inputs(modelfile: ModelFile, catalog: Catalog) -> dict[str, str]:
    """What tells the boards of this file, and its bill, from those of folders that bought other
    grades than they drew; empty where none did."""
    return {GRADES: "drawn as bought"} if once_otherwise(modelfile, catalog) else {}


def design_stage(modelfile: ModelFile, inputs: dict[str, Any]) -> Stages:
    """The stage of a design, with the names of its files."""
    files = [*DESIGN_FILES, *waveform_names(modelfile), *board_files.names(modelfile)]
    files += [MEASURED] if modelfile.measured is not None else []
    return {"design": (inputs, files)}


def standing_design(folder: Folder, modelfile: ModelFile, catalog: Catalog) -> Stages:
    """The stage of the design; a design that stands in the folder is not made anew.

    A folder may come from another machine: where the model file is the folder's own, its parts
    stand, whatever catalogue or version they were chosen with, and a note names these.
    """
    inputs, origin = design_inputs(modelfile, catalog), design_inputs_of(folder)
    stands = (
        modelfile.source == folder / MODEL
        and folder.state("design", inputs) == "other"
        and all(origin.get(key) == inputs.get(key) for key in ("model", "measured"))
    )
    if not stands:
        return design_stage(modelfile, inputs)
    note(
        f"this design was made with catalogue {_short(origin, 'catalogue')} and version "
        f"{_short(origin, 'version')}; here are catalogue {_short(inputs, 'catalogue')} and "
        f"version {_short(inputs, 'version')}: its parts stand as they are"
    )
    if bills_are_of_old(origin, inputs):
        note(
            "it is of a version whose bill of materials bought better grades than its study "
            "drew: a study that is made now writes the bill anew"
        )
    return design_stage(modelfile, origin)


def bills_are_of_old(origin: Mapping[str, Any], inputs: Mapping[str, Any]) -> bool:
    """Whether a folder's bill may list other grades than a study draws now.

    origin, inputs : inputs of its design, as it was made and as it would be made now.
    """
    return GRADES in inputs and GRADES not in origin


def _short(inputs: Mapping[str, Any], key: str) -> str:
    return str(inputs.get(key, "not known"))[:12]
