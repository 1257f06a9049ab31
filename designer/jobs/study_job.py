"""The study stage of a design folder: the verbs ``run`` and ``tolerance``.

Nothing here prints; ``cli.verbs`` does.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from designer.base.checks import at_least, cores
from designer.base.design_folder import DESIGN, REPORTS, TOLERANCE, Folder, StageName
from designer.base.plain_json import dumps
from designer.base.progress import Progress
from designer.catalog.catalog import Catalog, load_catalog
from designer.check import synthesis_result
from designer.check.checked_design import Checked
from designer.check.synthesis_result import Synthesis, synthesise
from designer.jobs import design_files, kicad_files, rung_choice
from designer.jobs.design_files import load
from designer.jobs.json_answers import run_json
from designer.jobs.options import Options
from designer.jobs.origin import provenance
from designer.jobs.study_folder import FolderStores, layers_of, merged, study_files, write_maps
from designer.jobs.study_json import study_json
from designer.jobs.synthesise_job import Outcome, design_inputs, standing_inputs
from designer.model.model_file import ModelFile, naming, need_responses
from designer.spice import equation_check
from designer.spice.equation_check import EquationCheck
from designer.spice.pool import SpicePool, require_ngspice
from designer.spice.simulator import SimulationFailed
from designer.synthesis.tie_break import SOLVER
from designer.yields.layers import Here, Runner
from designer.yields.run_result import RunResult
from designer.yields.study import SAMPLES, SEED, Study
from designer.yields.study_cache import KEPT, Kept
from designer.yields.study_identity import RULES, checks_hash
from designer.yields.tolerance_study import check, tolerance

SPICE_TIMEOUT = 900.0
"""The longest that one run of ngspice may take in a study, s: a way of thousands of periods."""


def run_into(
    modelfile: ModelFile,
    out: Path,
    options: Options,
    progress: Progress,
    command: Callable[[Options], str],
) -> Outcome:
    """The verbs ``run`` and ``tolerance``: design, check, study, report.

    command : the command line as the report states it (``Options.command``).

    Raises
    ------
    EnvironmentMissing : there is work to do and no ngspice, or no cluster, that it needs.
    """
    options.check()
    need_responses(modelfile)
    catalog = load_catalog()
    folder = Folder(out)
    options = rung_choice.chosen(folder, options, progress)
    wanted, options = _study_wanted(folder, modelfile, catalog, options)
    wanted |= standing_inputs(folder, modelfile, catalog, progress)
    todo = folder.decide(wanted, overwrite=options.overwrite, resume=options.resume)
    if not todo:
        answer = run_json(folder.json(DESIGN), folder.json(TOLERANCE))
        return Outcome(answer, _satisfied(answer), out, True)
    began = time.perf_counter()
    with _Help.of(options, progress) as help_:
        progress.stage("responses of the model, parts")
        if "design" in todo:
            made = synthesis_result.synthesise(modelfile, catalog)
            with naming(modelfile):
                files = design_files.texts(made)
            inputs = wanted["design"][0]
            project = kicad_files.beside(folder, made, inputs, options.overwrite, progress)
            folder.begin({s: wanted[s] for s in todo}, design_files.design_provenance(made))
            design_files.write(folder, made, files)
            folder.finish("design")
            kicad_files.write(folder, made, inputs, project)
        else:
            made = load(folder, modelfile, catalog)
            folder.begin({s: wanted[s] for s in todo}, design_files.design_provenance(made))
        design_seconds = time.perf_counter() - began
        result, blocks = _studied(folder, made, options, help_, progress)
    result.cost["design_seconds"] = design_seconds
    said = result.provenance
    if result.study.maps:
        write_maps(folder, result.study, said)
    folder.write(TOLERANCE, dumps(study_json(result.study, said, result.cost, result.equations)))
    progress.stage("report")
    from designer.report.data import ReportData
    from designer.report.write import write_report  # matplotlib is not needed before this

    data = ReportData.of(result, command(options), design_files.starts(folder))
    write_report(data, *(folder / name for name in REPORTS))
    assert folder.manifest is not None
    folder.manifest.provenance = said
    folder.finish("study", blocks)
    answer = run_json(folder.json(DESIGN), folder.json(TOLERANCE))
    return Outcome(answer, _satisfied(answer), out, False, result)


@dataclass(frozen=True)
class _Help:
    """What a study is helped by. pool : None where ngspice is not asked. runner : who computes
    blocks."""

    jobs: int
    pool: SpicePool | None
    runner: Runner

    @classmethod
    @contextmanager
    def of(cls, options: Options, progress: Progress) -> Iterator[_Help]:
        """What these options need, found before anything is written.

        Raises
        ------
        EnvironmentMissing : it is not there.
        """
        jobs = cores() if options.jobs is None else options.jobs
        with ExitStack() as stack:
            pool = None
            if options.rung != "exact":
                progress.stage("ngspice")
                pool = stack.enter_context(SpicePool(jobs, timeout=SPICE_TIMEOUT))
                require_ngspice(pool)
            runner: Runner = Here(jobs)
            if options.cluster is not None:
                from designer.yields.dask_runner import Cluster

                progress.stage(f"cluster {options.cluster}")
                runner = stack.enter_context(Cluster(options.cluster))
            yield cls(jobs, pool, runner)


def _studied(
    folder: Folder, made: Synthesis, options: Options, help_: _Help, progress: Progress
) -> tuple[RunResult, Iterable[str]]:
    """Checks and study of a design in its folder, and the files of the study's blocks."""
    ready = time.perf_counter()
    kept = Kept(folder / KEPT, folder.write, progress.note, folder.vouches)
    equations, checked = _checks(folder, made, help_.pool, kept, progress)
    if checked[0].gate is not None and checked[0].gate.passed:
        folder.rewrite("circuit.cir", design_files.circuit_deck(made, checked[0]))
        kicad_files.settle(folder, made, checked[0])
    gated = time.perf_counter()
    guard = folder.watch()
    stores = FolderStores(folder.path, guard, progress.note, kept, folder.vouches)
    study = tolerance(
        made,
        samples=options.samples,
        until=options.until,
        rung=options.rung,
        tuned=options.tuned,
        reached=options.reached,
        maps=options.maps,
        seed=options.seed,
        jobs=help_.jobs,
        pool=help_.pool,
        checked=checked,
        stores=stores,
        runner=help_.runner,
        progress=progress,
    )
    guard()
    kept.forget_unused()
    cost = {
        "check_seconds": gated - ready,
        "study_seconds": time.perf_counter() - gated,
        "blame_seconds": 0.0 if study.blame is None else study.blame.seconds,
        "maps_seconds": sum(found.seconds for found in study.maps),
        "jobs": float(help_.jobs),
    }
    result = RunResult(
        made.modelfile,
        made.catalog,
        made.found,
        made.design,
        checked,
        study,
        _study_provenance(made, study, options),
        cost,
        equations,
    )
    return result, stores.names


def _checks(
    folder: Folder, made: Synthesis, pool: SpicePool | None, kept: Kept, progress: Progress
) -> tuple[EquationCheck | None, tuple[Checked, ...]]:
    """What ngspice says of the design's equations and of its nominal responses, or said before."""
    if pool is None:
        return None, check(made, None, progress)
    assert folder.manifest is not None
    key = checks_hash(folder.manifest.files[DESIGN][1], pool.version)
    equations: EquationCheck | None = kept.get("equations", key)
    if equations is None:
        progress.stage("ngspice, equation check")
        equations = equation_check.check(made.design, made.found, pool)
        if not any(finding.reason for finding in equations.findings):
            kept.put("equations", key, equations)
    if not equations.passed:
        progress.note(equations.problem)
    gates = kept.get("gates", key)
    checked = check(made, pool, progress, gates)
    met = tuple(c.gate for c in checked)
    # A run without an answer is asked again the next time.
    if gates is None and not any(g and isinstance(g.read, SimulationFailed) for g in met):
        kept.put("gates", key, met)
    return equations, checked


def _study_wanted(
    folder: Folder, modelfile: ModelFile, catalog: Catalog, options: Options
) -> tuple[dict[StageName, tuple[dict[str, Any], list[str]]], Options]:
    """The stages, and the options with the layers that the folder's study has already."""
    wanted = design_inputs(modelfile, catalog)
    inputs = {
        **wanted["design"][0],
        "seed": options.seed,
        "samples": options.samples,
        "until": options.until,
    }
    options = replace(options, trimmed=modelfile.board.dc_trim == "fitted")
    options = merged(folder, inputs, options)
    files = study_files(options, len(modelfile.responses))
    wanted["study"] = ({**inputs, "layers": layers_of(options)}, files)
    return wanted, options


def _study_provenance(made: Synthesis, study: Study, options: Options) -> dict[str, Any]:
    return provenance(
        made.modelfile,
        made.catalog.hash,
        seed=options.seed,
        settings={
            "highs": SOLVER,
            "rules": RULES,
            "rung": options.rung,
            "ngspice": [
                {"omega": c.model.omega, **c.gate.as_dict()}
                for c in study.checked
                if c.gate is not None
            ],
        },
        spread=study.plan.spread.as_dict(),
    )


def _satisfied(answer: Mapping[str, Any]) -> bool:
    right = answer["equation_check"] is None or answer["equation_check"]["passed"]
    return right and all(
        r["found"] and r["engines_agree"] and _trusted(r.get("trust", {}))
        for r in answer["responses"]
    )


def _trusted(said: Mapping[str, Any]) -> bool:
    """Of the engines' answers, where each has one (null: it has none); a yield says only how far
    it is known. Older folders say nothing."""
    return all(engine["trusted"] is True for name, engine in said.items() if name != "yield")


def run(
    modelfile: ModelFile,
    catalog: Catalog | None = None,
    *,
    samples: int = SAMPLES,
    seed: int = SEED,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """The whole job in memory: synthesis, check in ngspice, tolerance study.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built.
    EnvironmentMissing : ngspice is missing.
    """
    need_responses(modelfile)
    jobs = cores() if jobs is None else jobs
    at_least("--jobs", jobs, 1)
    with SpicePool(jobs) as pool:
        require_ngspice(pool)
        made = synthesise(modelfile, catalog)
        equations = equation_check.check(made.design, made.found, pool)
        study = tolerance(made, samples=samples, seed=seed, jobs=jobs, pool=pool, progress=progress)
    return RunResult(
        made.modelfile,
        made.catalog,
        made.found,
        made.design,
        study.checked,
        study,
        equations=equations,
    )
