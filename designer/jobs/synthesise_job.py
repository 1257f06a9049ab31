"""The main job with a design folder: what is done, in which order it is written, what is reused.

Nothing here prints; ``cli.verbs`` does.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.defaults import DRAWN_STARTS, SEED
from designer.base.design_folder import (
    COMPARISON,
    DESIGN,
    DESIGN_FILES,
    MODEL,
    Folder,
    is_design_folder,
)
from designer.base.errors import MISSING, InputError
from designer.base.frames import flat_frame, table_html
from designer.base.manifest import StageName
from designer.base.plain_json import plain
from designer.base.progress import Progress
from designer.base.si_unit import DIGITS
from designer.base.version import __version__
from designer.catalog.catalog import Catalog, load_catalog
from designer.check import simulation, synthesis_result
from designer.check.synthesis_result import Synthesis
from designer.jobs import board_files, compare_files, design_files, kicad_files
from designer.jobs.design_files import load
from designer.jobs.json_answers import simulate_json
from designer.jobs.options import Options as Options
from designer.jobs.origin import provenance
from designer.model.measured_values import MEASURED
from designer.model.model_file import ModelFile, naming, read_model_file
from designer.model.si_units import Reader, units_of
from designer.spice.opamp_model import Rung
from designer.spread.part_grades import once_otherwise
from designer.yields.run_result import RunResult

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class JobOutcome:
    """What a verb answers: the JSON object, and whether the answer is yes."""

    answer: dict[str, Any]
    """The JSON object."""
    satisfied: bool
    """Whether the answer is yes."""
    folder: Path | None
    """The design folder; None where nothing was to be written."""
    reused: bool
    """Whether the folder held the answer already."""
    result: RunResult | None = None
    """Everything that was found; None where the answer was reused."""
    shown: bool = False
    """Whether what stands in the answer beside blame and maps was shown before they were worked
    out."""

    def responses(self) -> pd.DataFrame:
        """A row for each response; of what a yield has, columns such as "yield.ok"."""
        return flat_frame(self.answer.get("responses", ()))

    def _repr_html_(self) -> str:
        names = ("omega", "expected", "model", "circuit", "ngspice")
        rows = [
            {**{n: row.get(n) for n in names}, "ok": row["yield"]["ok"]}
            for row in self.answer.get("responses", ())
            if row.get("yield")
        ]
        return table_html(str(self.answer.get("title", "")), rows)


def model_file(path: Path) -> ModelFile:
    """Read a model file; a design folder's has its measured values from the folder's own copy, and
    where it states no title that of the file it was copied from."""
    if path.name != MODEL or not is_design_folder(path.parent):
        return read_model_file(path)
    found = read_model_file(path, measured=path.parent / MEASURED)
    if found.title != path.stem or not (path.parent / DESIGN).is_file():
        return found
    title = Folder(path.parent).json(DESIGN).get("title")
    if not isinstance(title, str) or len(title.splitlines()) != 1:
        return found
    return replace(found, title=title)


def source(path: Path, out: Path | None) -> tuple[ModelFile, Path]:
    """The model file of a verb's argument (a model file or a design folder), and where to write.

    Raises
    ------
    InputError : neither, or a model file without ``out``.
    """
    if not path.is_dir():
        modelfile = model_file(path)
        if out is None:
            raise InputError(
                None, "--out", MISSING, "a folder to write into: this verb writes a design folder"
            )
        return modelfile, out
    if not is_design_folder(path):
        raise InputError(
            path, "the folder", "no manifest.json", "a model file (TOML) or a design folder"
        )
    folder = Folder(path)
    modelfile = model_file(path / MODEL)
    if made_from(folder).get("model") != modelfile.sha256:
        raise InputError(
            path / MODEL,
            "its sha256",
            modelfile.sha256[:12] + "…",
            "the model that this folder was made from; a changed model needs a folder of its own "
            "(give the file and --out)",
        )
    return modelfile, path if out is None else out


def synthesise_into(
    modelfile: ModelFile, out: Path, options: Options, progress: Progress, *, compare: bool = False
) -> JobOutcome:
    """The verb ``synthesise``; with ``compare`` the comparison is a stage of its own."""
    options.check()
    catalog = load_catalog()
    folder = Folder(out)
    wanted = design_inputs(modelfile, catalog)
    if compare:
        wanted["comparison"] = (wanted["design"][0], list(compare_files.NAMES))
    todo = folder.decide(wanted, overwrite=options.overwrite, resume=options.resume)
    if "design" in todo:
        design_files.check(modelfile, catalog)
        progress.stage("responses of the model, parts")
        made = synthesis_result.synthesise(modelfile, catalog)
        progress.stage("start recipes, files of the design")
        with naming(modelfile):
            files = design_files.texts(made)
        inputs = wanted["design"][0]
        project = kicad_files.beside(folder, made, inputs, options.overwrite, progress)
    elif todo:
        made = load(folder, modelfile, catalog)
    compared = compare_files.make(made, progress) if "comparison" in todo else None
    if todo:
        folder.begin({s: wanted[s] for s in todo}, design_files.design_provenance(made))
    if "design" in todo:
        design_files.write(folder, made, files)
        folder.finish("design")
        kicad_files.write(folder, made, inputs, project)
    if compared is not None:
        compare_files.write(folder, compared)
        folder.finish("comparison")
    answer = folder.json(DESIGN)
    if compare:
        answer = compare_files.beside(answer, folder.json(COMPARISON))
    return JobOutcome(answer, _all_found(answer), out, not todo)


def compare_in_memory(modelfile: ModelFile, options: Options, progress: Progress) -> JobOutcome:
    """The verb ``synthesise`` with ``--compare`` and no folder: nothing is written."""
    options.check()
    progress.stage("responses of the model, parts")
    made = synthesis_result.synthesise(modelfile)
    compared = compare_files.make(made, progress)
    answer = compare_files.beside(plain(design_files.answer(made)), plain(compared.file))
    return JobOutcome(answer, _all_found(answer), None, False)


def simulate_answer(
    path: Path,
    omegas: tuple[float, ...],
    engine: simulation.Engine,
    jobs: int | None,
    progress: Progress,
    plots: Path | None = None,
    overwrite: bool = False,
    rung: Rung = "ideal",
    frequencies: tuple[str, ...] = (),
    starts: int = DRAWN_STARTS,
    seed: int = SEED,
) -> tuple[dict[str, Any], bool]:
    """The verb ``simulate``: its JSON object, and whether every wanted response was found
    and can be trusted.

    plots : the directory for pictures; ``overwrite`` replaces those of the same names.
    frequencies : texts such as "10 Hz", asked after ``omegas``.
    """
    began = time.perf_counter()
    made: Synthesis | None = None
    catalog = load_catalog()
    if path.is_dir():
        modelfile, _ = source(path, path)
        if engine != "model":
            made = read_design(path, catalog, progress)
    else:
        modelfile = model_file(path)
    read = Reader(modelfile.model, modelfile.mechanical)
    omegas = tuple(read.omega("--omega", w) for w in omegas)
    omegas += tuple(read.frequency("--frequency", f) for f in frequencies)
    wanted: tuple[float | None, ...] = omegas or tuple(r.omega for r in modelfile.responses)
    names: tuple[str, ...] = ()
    if plots is not None:
        from designer.report import simulate_plots  # matplotlib is not needed but for them

        digits = simulate_plots.DIGITS if modelfile.mechanical is None else DIGITS
        names = simulate_plots.names([w for w in wanted if w is not None], digits)
        simulate_plots.check(plots, names, overwrite)
    simulated = simulation.simulate(
        modelfile,
        omegas,
        engine=engine,
        synthesis=made,
        jobs=jobs,
        progress=progress,
        traces=plots is not None,
        rung=rung,
        starts=starts,
        seed=seed,
    )
    settings = {**simulation.engine_settings(engine, rung), "drawn_starts": starts}
    said = provenance(modelfile, catalog.hash, seed=seed, settings=settings)
    seconds = time.perf_counter() - began
    answer = simulate_json(simulated, engine, said, seconds, modelfile.mechanical)
    if plots is not None:
        progress.stage("pictures")
        units = units_of(modelfile.mechanical)
        answer["files"] = simulate_plots.write(plots, names, simulated, overwrite, units)
    return plain(answer), all(s.found and s.trust.trusted is True for s in simulated)


def read_design(
    path: Path, catalog: Catalog | None = None, progress: Progress | None = None
) -> Synthesis:
    """The design in a design folder; ``progress`` is told of another catalogue or version."""
    modelfile, _ = source(path, path)
    folder, catalog = Folder(path), load_catalog() if catalog is None else catalog
    if progress is not None:
        standing_inputs(folder, modelfile, catalog, progress)
    return load(folder, modelfile, catalog)


GRADES = "grades"
"""Among a design's inputs where the bill once held other grades than the study drew."""


def made_from(folder: Folder) -> dict[str, Any]:
    """Inputs of the folder's design; empty where there is none."""
    made = folder.manifest.stages.get("design") if folder.manifest else None
    return {} if made is None else made.inputs


def design_inputs(
    modelfile: ModelFile, catalog: Catalog
) -> dict[StageName, tuple[dict[str, Any], list[str]]]:
    inputs = {
        "model": modelfile.sha256,
        "catalogue": catalog.hash,
        "version": __version__,
    }
    inputs |= grade_inputs(modelfile, catalog)
    files = [*DESIGN_FILES, *board_files.names(modelfile)]
    if modelfile.measured is not None:
        inputs["measured"] = modelfile.measured.sha256
        files.append(MEASURED)
    return {"design": (inputs, files)}


def grade_inputs(modelfile: ModelFile, catalog: Catalog) -> dict[str, str]:
    """What tells the boards of this file, and its bill, from those of folders that bought other
    grades than they drew; empty where none did."""
    return {GRADES: "drawn as bought"} if once_otherwise(modelfile, catalog) else {}


def standing_inputs(
    folder: Folder, modelfile: ModelFile, catalog: Catalog, progress: Progress
) -> dict[StageName, tuple[dict[str, Any], list[str]]]:
    """As ``design_inputs``, but the design that stands in the folder is not asked for anew.

    A folder may come from elsewhere: where the model file is its own, its parts stand, whatever
    catalogue or version it was made with, and ``progress`` is told of these.
    """
    wanted = design_inputs(modelfile, catalog)
    here, files = wanted["design"]
    origin = made_from(folder)
    if (
        modelfile.source == folder / MODEL
        and folder.state("design", here) == "other"
        and all(origin.get(key) == here.get(key) for key in ("model", "measured"))
    ):
        progress.note(
            f"this design was made with catalogue {_shown(origin, 'catalogue')} and version "
            f"{_shown(origin, 'version')}; here are catalogue {_shown(here, 'catalogue')} and "
            f"version {_shown(here, 'version')}: its parts stand as they are"
        )
        if bills_are_of_old(origin, here):
            progress.note(
                "it is of a version whose bill of materials bought better grades than its study "
                "drew: a study that is made now writes the bill anew"
            )
        wanted["design"] = (origin, files)
    return wanted


def bills_are_of_old(origin: Mapping[str, Any], here: Mapping[str, Any]) -> bool:
    """Whether a folder's bill may list other grades than a study draws now.

    origin, here : inputs of its design, as it was made and as it would be made now.
    """
    return GRADES in here and GRADES not in origin


def _shown(inputs: Mapping[str, Any], key: str) -> str:
    return str(inputs.get(key, "not known"))[:12]


def _all_found(answer: Mapping[str, Any]) -> bool:
    return all(knob["found"] for knob in answer["knobs"])
