"""The main job with a design folder: what is done, in which order it is written, what is reused.

Nothing here prints; ``designer.commands`` does.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from designer import __version__, api, deck, matching, topology
from designer.api import RunResult, Synthesis
from designer.blocks import BlockStore, block_names
from designer.bom import bill, bill_csv
from designer.catalog import Catalog, load_catalog
from designer.circuit import nominal_board
from designer.coefficients import coefficient_errors
from designer.deck import Excitation, SolverSettings
from designer.errors import InputError
from designer.folder import (
    DESIGN,
    DESIGN_FILES,
    MODEL,
    REPORTS,
    TOLERANCE,
    Folder,
    StageName,
    is_design_folder,
)
from designer.jsonout import dumps, plain, run_json, simulate_json, study_json, synthesis_json
from designer.modelfile import ModelFile, Response, read_model_file
from designer.pipeline import Checked, nominal_reduction
from designer.progress import Progress
from designer.provenance import provenance
from designer.responses import find, on_circuit, peaks
from designer.selection import SOLVER
from designer.setup_table import scales_csv, setup_csv
from designer.spread import Spread
from designer.synthesis import SWING_SHARE, Certificate, Design
from designer.workers import SpicePool

MOST_SAMPLES = 1_000_000
DECK_PERIODS = 20
"""Drive periods that ``circuit.cir`` runs for."""


@dataclass(frozen=True)
class Options:
    """What the command line says about any verb that writes."""

    seed: int = api.SEED
    jobs: int | None = None
    samples: int = api.SAMPLES
    overwrite: bool = False
    resume: bool = False

    def check(self) -> None:
        """InputError for a number that cannot be."""
        api.at_least("--samples", self.samples, 1)
        if self.samples > MOST_SAMPLES:
            raise InputError(None, "--samples", self.samples, f"at most {MOST_SAMPLES}")
        api.at_least("--seed", self.seed, 0)
        if self.jobs is not None:
            api.at_least("--jobs", self.jobs, 1)


@dataclass(frozen=True)
class Outcome:
    """What a verb answers: the JSON object, and whether the answer is yes.

    reused : whether the folder held the answer already. result : None where it was reused.
    """

    answer: dict[str, Any]
    satisfied: bool
    folder: Path
    reused: bool
    result: RunResult | None = None


def source(path: Path, out: Path | None) -> tuple[ModelFile, Path]:
    """The model file of a verb's argument (a model file or a design folder), and where to write.

    Raises
    ------
    InputError : neither, or a model file without ``out``.
    """
    if not path.is_dir():
        modelfile = read_model_file(path)
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
    modelfile = read_model_file(path / MODEL)
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
    modelfile: ModelFile, out: Path, options: Options, progress: Progress
) -> Outcome:
    """The verb ``synthesise``."""
    options.check()
    catalog = load_catalog()
    folder = Folder(out)
    wanted = _wanted(modelfile, catalog, options, study=False)
    if not folder.decide(wanted, overwrite=options.overwrite, resume=options.resume):
        answer = folder.json(DESIGN)
        return Outcome(answer, _all_found(answer), out, True)
    progress.stage("responses of the model, parts")
    made = api.synthesise(modelfile, catalog)
    with api.naming(modelfile):
        files = _design_files(made)
    folder.begin(wanted, _design_provenance(made))
    answer = _write_design(folder, made, files)
    folder.finish("design")
    return Outcome(answer, _all_found(answer), out, False)


def run_into(modelfile: ModelFile, out: Path, options: Options, progress: Progress) -> Outcome:
    """The verbs ``run`` and ``tolerance``: design, check, study, report.

    Raises
    ------
    EnvironmentMissing : there is work to do and no ngspice.
    """
    options.check()
    api.need_responses(modelfile)
    catalog = load_catalog()
    folder = Folder(out)
    wanted = _wanted(modelfile, catalog, options, study=True)
    made_from = _made_from(folder)
    if (
        folder.state("design", wanted["design"][0]) == "other"
        and made_from.get("model") == modelfile.sha256
        and modelfile.source == out / MODEL
    ):
        # A folder that came from elsewhere: its parts stand, whatever can be bought here.
        progress.note("the catalogue or the tool is not the one this design was made with")
        wanted["design"] = (made_from, wanted["design"][1])
    todo = folder.decide(wanted, overwrite=options.overwrite, resume=options.resume)
    if not todo:
        answer = run_json(folder.json(DESIGN), folder.json(TOLERANCE))
        return Outcome(answer, _satisfied(answer), out, True)
    jobs = api.cores() if options.jobs is None else options.jobs
    began = time.perf_counter()
    with SpicePool(jobs) as pool:
        progress.stage("ngspice")
        api.require_ngspice(pool)
        progress.stage("responses of the model, parts")
        if "design" in todo:
            made = api.synthesise(modelfile, catalog)
            with api.naming(modelfile):
                files = _design_files(made)
            folder.begin({s: wanted[s] for s in todo}, _design_provenance(made))
            _write_design(folder, made, files)
            folder.finish("design")
        else:
            made = load(folder, modelfile, catalog)
            folder.begin({s: wanted[s] for s in todo}, _design_provenance(made))
        ready = time.perf_counter()
        checked = api.check(made, pool, progress)
        if checked[0].gate is not None and checked[0].gate.passed:
            folder.rewrite("circuit.cir", circuit_deck(made, checked[0]))
        gated = time.perf_counter()
        study = api.tolerance_study(
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
    result = RunResult(made.modelfile, catalog, made.found, made.design, checked, study, said, cost)
    folder.write(TOLERANCE, dumps(study_json(study, said, cost)))
    progress.stage("report")
    from designer.report import write_report  # matplotlib is not needed before this

    write_report(result, folder / REPORTS[0], folder / REPORTS[1])
    assert folder.manifest is not None
    folder.manifest.provenance = said
    folder.finish("study")
    answer = run_json(folder.json(DESIGN), folder.json(TOLERANCE))
    return Outcome(answer, _satisfied(answer), out, False, result)


def simulate_answer(
    path: Path,
    omegas: tuple[float, ...],
    engine: api.Engine,
    jobs: int | None,
    progress: Progress,
) -> tuple[dict[str, Any], bool]:
    """The verb ``simulate``: its JSON object, and whether every wanted response was found."""
    began = time.perf_counter()
    made: Synthesis | None = None
    catalog = load_catalog()
    if path.is_dir():
        modelfile, _ = source(path, path)
        if engine != "model":
            made = load(Folder(path), modelfile, catalog)
    else:
        modelfile = read_model_file(path)
    simulated = api.simulate(
        modelfile, omegas, engine=engine, synthesis=made, jobs=jobs, progress=progress
    )
    said = provenance(modelfile, catalog.hash)
    answer = simulate_json(simulated, engine, said, time.perf_counter() - began)
    return plain(answer), all(s.found for s in simulated)


def load(folder: Folder, modelfile: ModelFile, catalog: Catalog) -> Synthesis:
    """The design of a folder, rebuilt from its model and the values of its parts.

    Nothing is chosen again; the errors are computed afresh and must be those that were written.
    """
    said, file = folder.json(DESIGN), folder / DESIGN
    model, spec = modelfile.model, modelfile.circuit
    found = find(model, modelfile.responses)
    with api.naming(modelfile):
        opamp = catalog.opamp(spec.opamp)
    system = model.second_order()
    try:
        values = {str(name): float(value) for name, value in said["parts"].items()}
        circuit = topology.build(
            matching.terms(
                system.damping.tolist(), system.stiffness.tolist(), system.force.tolist()
            ),
            values,
            opamp,
            supply=float(said["circuit"]["supply"]),
            saturation=float(said["circuit"]["saturation"]),
            clearance="A" if model.k0 > 0.0 else None,
        )
        changes = {k: float(said["circuit"][k]) for k in ("gain", "bias")}
        circuit = circuit.__class__(**{**circuit.__dict__, **changes})
        swing = (SWING_SHARE * circuit.saturation, peaks(model, found).states)
        errors = coefficient_errors(circuit, system, swing=None if circuit.stops else swing)
        if abs(errors.max_error - float(said["max_error"])) > 1e-9:
            raise ValueError("parts and max_error do not belong together")
        design = Design(
            model=model,
            circuit=circuit,
            errors=errors,
            certificate=Certificate(**said["certificate"]),
            conditions=dict(said["conditions"]),
            solver=dict(said["solver"]),
            seconds=float(said["cost"]["synthesis_seconds"]),
        )
    except (KeyError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
        raise InputError(
            file, "parts", f"{type(error).__name__}: {error}", "the design of this folder's model"
        ) from None
    return Synthesis(modelfile, catalog, found, design)


def read_design(path: Path, catalog: Catalog | None = None) -> Synthesis:
    """The design in a design folder."""
    modelfile, _ = source(path, path)
    return load(Folder(path), modelfile, load_catalog() if catalog is None else catalog)


def circuit_deck(made: Synthesis, checked: Checked | None = None) -> str:
    """``circuit.cir``: the first response (ω = 1 where there is none), from its own orbit.

    checked : of the first response; its gate's settings are used.
    """
    modelfile, design = made.modelfile, made.design
    first = made.found[0] if made.found else find(design.model, [Response(1.0)])[0]
    excitation = Excitation(design.errors.scales.frequency(first.omega), design.amplitude(first.b))
    if checked is None:
        orbit = on_circuit(nominal_reduction(design).system(), design, first)
    else:
        orbit = checked.circuit
    period = 1.0 / excitation.frequency
    settings = SolverSettings("trap", period / 1000.0)
    if checked is not None and checked.gate is not None:
        settings = checked.gate.settings
    text = deck.write(
        design.circuit,
        nominal_board(design.circuit),
        excitation,
        settings,
        title=modelfile.title,
        stop_time=DECK_PERIODS * period,
        initial=orbit.start if len(orbit.start) else None,
    )
    nets = [*design.circuit.state_nets, *(["fv"] if design.circuit.stops else [])]
    shown = " ".join(f"v({net})" for net in [*nets, design.circuit.generator.net])
    # Without such a line the plain program runs nothing.
    return text.replace("\n.end\n", f"\n.print tran {shown}\n.end\n")


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
    wanted: dict[StageName, tuple[dict[str, Any], list[str]]] = {
        "design": (inputs, list(DESIGN_FILES))
    }
    if study:
        more = {"seed": options.seed, "samples": options.samples}
        names = [TOLERANCE, *REPORTS, *block_names(options.samples)]
        wanted["study"] = ({**inputs, **more}, names)
    return wanted


def _design_files(made: Synthesis) -> dict[str, str]:
    """Everything of the design stage but ``design.json``; made before the folder is touched."""
    modelfile, design = made.modelfile, made.design
    return {
        MODEL: modelfile.text,
        "circuit.cir": circuit_deck(made),
        "bom.csv": bill_csv(bill(design.circuit, modelfile.circuit, made.catalog)),
        "setup.csv": setup_csv(design, made.found),
        "scales.csv": scales_csv(modelfile, design, made.found),
    }


def _write_design(folder: Folder, made: Synthesis, files: Mapping[str, str]) -> dict[str, Any]:
    for name, text in files.items():
        folder.write(name, text)
    folder.write(
        DESIGN,
        dumps(
            synthesis_json(
                made.modelfile, made.design, made.found, _design_provenance(made), made.seconds
            )
        ),
    )
    return folder.json(DESIGN)


def _design_provenance(made: Synthesis) -> dict[str, Any]:
    return provenance(made.modelfile, made.catalog.hash, settings={"highs": SOLVER})


def _study_provenance(
    made: Synthesis, checked: tuple[Checked, ...], options: Options
) -> dict[str, Any]:
    spec = made.modelfile.circuit
    spread = Spread.bench_1(
        made.catalog.opamp(spec.opamp), spec.resistor_grade, spec.capacitor_grade
    )
    return provenance(
        made.modelfile,
        made.catalog.hash,
        seed=options.seed,
        settings={
            "highs": SOLVER,
            "ngspice": [
                {
                    "omega": c.model.omega,
                    "passed": c.gate.passed,
                    "difference": c.gate.difference,
                    **c.gate.settings.as_dict(),
                }
                for c in checked
                if c.gate is not None
            ],
        },
        spread=spread.as_dict(),
    )


def _all_found(answer: Mapping[str, Any]) -> bool:
    return all(knob["found"] for knob in answer["knobs"])


def _satisfied(answer: Mapping[str, Any]) -> bool:
    return all(r["found"] and r["engines_agree"] for r in answer["responses"])
