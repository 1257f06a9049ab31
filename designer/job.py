"""The main job with a design folder: what is done, in which order it is written, what is reused.

Nothing here prints; ``designer.commands`` does.
"""

from __future__ import annotations

import os
import shlex
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from designer import (
    __version__,
    api,
    compare_files,
    design_files,
    equation_check,
    simulate_plots,
    simulation,
)
from designer.api import RunResult, Synthesis
from designer.blocks import BlockStore, block_names
from designer.catalog import Catalog, load_catalog
from designer.design_files import load
from designer.errors import InputError
from designer.folder import (
    COMPARISON,
    DESIGN,
    DESIGN_FILES,
    MODEL,
    REPORTS,
    TOLERANCE,
    Folder,
    StageName,
    is_design_folder,
)
from designer.jsonout import (
    dumps,
    plain,
    run_json,
    simulate_json,
    study_json,
    synthesis_json,
)
from designer.measured import MEASURED
from designer.modelfile import ModelFile, read_model_file
from designer.opamp_model import Rung
from designer.pipeline import Checked
from designer.preconditions import at_least, cores, naming, need_responses, require_ngspice
from designer.progress import Progress
from designer.provenance import provenance
from designer.selection import SOLVER
from designer.spread import Spread
from designer.study import SAMPLES, SEED, check, tolerance
from designer.workers import SpicePool

MOST_SAMPLES = 1_000_000


@dataclass(frozen=True)
class Options:
    """What the command line says about any verb that writes."""

    seed: int = SEED
    jobs: int | None = None
    samples: int = SAMPLES
    overwrite: bool = False
    resume: bool = False

    def check(self) -> None:
        """InputError for a number that cannot be."""
        at_least("--samples", self.samples, 1)
        if self.samples > MOST_SAMPLES:
            raise InputError(None, "--samples", self.samples, f"at most {MOST_SAMPLES}")
        at_least("--seed", self.seed, 0)
        if self.jobs is not None:
            at_least("--jobs", self.jobs, 1)

    def command(self, verb: str, model: Path, out: Path | None) -> str:
        """The command line that makes the same results again.

        Files by their last names, so that no path of this machine stands in it; without options
        that change no result.
        """
        said = ["designer", verb, _base(model)]
        said += [] if out is None else ["--out", _base(out)]
        said += ["--samples", str(self.samples), "--seed", str(self.seed)]
        return shlex.join(said)


@dataclass(frozen=True)
class Outcome:
    """What a verb answers: the JSON object, and whether the answer is yes.

    folder : None where nothing was to be written. reused : whether the folder held the answer
    already. result : None where it was reused.
    """

    answer: dict[str, Any]
    satisfied: bool
    folder: Path | None
    reused: bool
    result: RunResult | None = None


def model_file(path: Path) -> ModelFile:
    """Read a model file; a design folder's has its measured values from the folder's own copy."""
    inside = path.name == MODEL and is_design_folder(path.parent)
    return read_model_file(path, measured=path.parent / MEASURED if inside else None)


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
                None, "--out", "nothing", "a folder to write into: this verb writes a design folder"
            )
        return modelfile, out
    if not is_design_folder(path):
        raise InputError(
            path, "the folder", "no manifest.json", "a model file (TOML) or a design folder"
        )
    folder = Folder(path)
    modelfile = model_file(path / MODEL)
    if _made_from(folder).get("model") != modelfile.sha256:
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
) -> Outcome:
    """The verb ``synthesise``; with ``compare`` the comparison is a stage of its own."""
    options.check()
    catalog = load_catalog()
    folder = Folder(out)
    wanted = _wanted(modelfile, catalog, options, study=False)
    if compare:
        wanted["comparison"] = (wanted["design"][0], list(compare_files.NAMES))
    todo = folder.decide(wanted, overwrite=options.overwrite, resume=options.resume)
    if "design" in todo:
        progress.stage("responses of the model, parts")
        made = api.synthesise(modelfile, catalog)
        with naming(modelfile):
            files = design_files.texts(made)
    elif todo:
        made = load(folder, modelfile, catalog)
    compared = compare_files.make(made, progress) if "comparison" in todo else None
    if todo:
        folder.begin({s: wanted[s] for s in todo}, design_files.design_provenance(made))
    if "design" in todo:
        design_files.write(folder, made, files)
        folder.finish("design")
    if compared is not None:
        compare_files.write(folder, compared)
        folder.finish("comparison")
    answer = folder.json(DESIGN)
    if compare:
        answer = compare_files.beside(answer, folder.json(COMPARISON))
    return Outcome(answer, _all_found(answer), out, not todo)


def compare_in_memory(modelfile: ModelFile, options: Options, progress: Progress) -> Outcome:
    """The verb ``synthesise`` with ``--compare`` and no folder: nothing is written."""
    options.check()
    progress.stage("responses of the model, parts")
    made = api.synthesise(modelfile)
    compared = compare_files.make(made, progress)
    said = design_files.design_provenance(made)
    design = plain(synthesis_json(modelfile, made.design, made.found, said, made.seconds))
    answer = compare_files.beside(design, plain(compared.file))
    return Outcome(answer, _all_found(answer), None, False)


def run_into(
    modelfile: ModelFile, out: Path, options: Options, progress: Progress, command: str
) -> Outcome:
    """The verbs ``run`` and ``tolerance``: design, check, study, report.

    command : the command line as the report states it (``Options.command``).

    Raises
    ------
    EnvironmentMissing : there is work to do and no ngspice.
    """
    options.check()
    need_responses(modelfile)
    catalog = load_catalog()
    folder = Folder(out)
    wanted = _wanted(modelfile, catalog, options, study=True)
    made_from = _made_from(folder)
    if (
        folder.state("design", wanted["design"][0]) == "other"
        and made_from.get("model") == modelfile.sha256
        and made_from.get("measured") == wanted["design"][0].get("measured")
        and modelfile.source == out / MODEL
    ):
        # A folder that came from elsewhere: its parts stand, whatever can be bought here.
        progress.note("the catalogue or the tool is not the one this design was made with")
        wanted["design"] = (made_from, wanted["design"][1])
    todo = folder.decide(wanted, overwrite=options.overwrite, resume=options.resume)
    if not todo:
        answer = run_json(folder.json(DESIGN), folder.json(TOLERANCE))
        return Outcome(answer, _satisfied(answer), out, True)
    jobs = cores() if options.jobs is None else options.jobs
    began = time.perf_counter()
    with SpicePool(jobs) as pool:
        progress.stage("ngspice")
        require_ngspice(pool)
        progress.stage("responses of the model, parts")
        if "design" in todo:
            made = api.synthesise(modelfile, catalog)
            with naming(modelfile):
                files = design_files.texts(made)
            folder.begin({s: wanted[s] for s in todo}, design_files.design_provenance(made))
            design_files.write(folder, made, files)
            folder.finish("design")
        else:
            made = load(folder, modelfile, catalog)
            folder.begin({s: wanted[s] for s in todo}, design_files.design_provenance(made))
        ready = time.perf_counter()
        progress.stage("ngspice, equation check")
        equations = equation_check.check(made.design, made.found, pool)
        if not equations.passed:
            progress.note(f"the netlist does not compute the model's equation: {equations.worst}")
        checked = check(made, pool, progress)
        if checked[0].gate is not None and checked[0].gate.passed:
            folder.rewrite("circuit.cir", design_files.circuit_deck(made, checked[0]))
        gated = time.perf_counter()
        study = tolerance(
            made,
            samples=options.samples,
            seed=options.seed,
            jobs=jobs,
            pool=pool,
            checked=checked,
            store=lambda plan: BlockStore.of(folder.path, plan),
            progress=progress,
        )
    cost = {
        "design_seconds": ready - began,
        "check_seconds": gated - ready,
        "study_seconds": time.perf_counter() - gated,
        "jobs": float(jobs),
    }
    said = _study_provenance(made, checked, options)
    result = RunResult(
        made.modelfile, catalog, made.found, made.design, checked, study, said, cost, equations
    )
    folder.write(TOLERANCE, dumps(study_json(study, said, cost, equations)))
    progress.stage("report")
    from designer.report import write_report  # matplotlib is not needed before this
    from designer.report_data import ReportData

    write_report(ReportData.of(result, command), folder / REPORTS[0], folder / REPORTS[1])
    assert folder.manifest is not None
    folder.manifest.provenance = said
    folder.finish("study")
    answer = run_json(folder.json(DESIGN), folder.json(TOLERANCE))
    return Outcome(answer, _satisfied(answer), out, False, result)


def simulate_answer(
    path: Path,
    omegas: tuple[float, ...],
    engine: simulation.Engine,
    jobs: int | None,
    progress: Progress,
    plots: Path | None = None,
    overwrite: bool = False,
    rung: Rung = "ideal",
) -> tuple[dict[str, Any], bool]:
    """The verb ``simulate``: its JSON object, and whether every wanted response was found.

    plots : the directory for pictures; ``overwrite`` replaces those of the same names.
    """
    began = time.perf_counter()
    made: Synthesis | None = None
    catalog = load_catalog()
    if path.is_dir():
        modelfile, _ = source(path, path)
        if engine != "model":
            made = load(Folder(path), modelfile, catalog)
    else:
        modelfile = model_file(path)
    wanted: tuple[float | None, ...] = omegas or tuple(r.omega for r in modelfile.responses)
    names = simulate_plots.names([w for w in wanted if w is not None])
    if plots is not None:
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
    )
    said = provenance(modelfile, catalog.hash, settings=simulation.engine_settings(engine, rung))
    answer = simulate_json(simulated, engine, said, time.perf_counter() - began)
    if plots is not None:
        progress.stage("pictures")
        answer["files"] = simulate_plots.write(plots, names, simulated, overwrite)
    return plain(answer), all(s.found for s in simulated)


def read_design(path: Path, catalog: Catalog | None = None) -> Synthesis:
    """The design in a design folder."""
    modelfile, _ = source(path, path)
    return load(Folder(path), modelfile, load_catalog() if catalog is None else catalog)


def _base(path: Path) -> str:
    """The last name of a path, never an option; ``.`` and ``..`` by the names they stand for."""
    name = os.path.basename(os.path.abspath(path)) or "."
    name = name.encode("utf-8", "replace").decode("utf-8")  # a name that is no text
    return f"./{name}" if name.startswith("-") else name


def _made_from(folder: Folder) -> dict[str, Any]:
    """Inputs of the folder's design; empty where there is none."""
    made = folder.manifest.stages.get("design") if folder.manifest else None
    return {} if made is None else made.inputs


def _wanted(
    modelfile: ModelFile, catalog: Catalog, options: Options, *, study: bool
) -> dict[StageName, tuple[dict[str, Any], list[str]]]:
    inputs = {
        "model": modelfile.sha256,
        "catalogue": catalog.hash,
        "version": __version__,
    }
    files = list(DESIGN_FILES)
    if modelfile.measured is not None:
        inputs["measured"] = modelfile.measured.sha256
        files.append(MEASURED)
    wanted: dict[StageName, tuple[dict[str, Any], list[str]]] = {"design": (inputs, files)}
    if study:
        more = {"seed": options.seed, "samples": options.samples}
        names = [TOLERANCE, *REPORTS, *block_names(options.samples)]
        wanted["study"] = ({**inputs, **more}, names)
    return wanted


def _study_provenance(
    made: Synthesis, checked: tuple[Checked, ...], options: Options
) -> dict[str, Any]:
    spread = Spread.of(made.modelfile, made.design.circuit, made.catalog)
    return provenance(
        made.modelfile,
        made.catalog.hash,
        seed=options.seed,
        settings={
            "highs": SOLVER,
            "ngspice": [
                {"omega": c.model.omega, **c.gate.as_dict()} for c in checked if c.gate is not None
            ],
        },
        spread=spread.as_dict(),
    )


def _all_found(answer: Mapping[str, Any]) -> bool:
    return all(knob["found"] for knob in answer["knobs"])


def _satisfied(answer: Mapping[str, Any]) -> bool:
    right = answer["equation_check"] is None or answer["equation_check"]["passed"]
    return right and all(r["found"] and r["engines_agree"] for r in answer["responses"])
