"""A study that is a stage of a design folder: what it needs, what is computed, what is written.

The random boards and the built ones of a list are studied and written in the same way, each at its
own place in the folder.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base import progress
from designer.base.design_folder import DESIGN, REPORTS, TOLERANCE, Folder
from designer.base.errors import MISSING, InputError
from designer.base.keyed_store import Note
from designer.base.manifest import StageName, Stages
from designer.base.plain_json import dumps, plain
from designer.base.printed import one_line
from designer.base.progress import Show, quiet
from designer.check.checked_design import CheckedResponse
from designer.check.synthesis_result import Synthesis
from designer.folders import design_files, kicad_files, study_json
from designer.folders.design_source import design_answer
from designer.folders.json_answers import run_json
from designer.folders.origin import provenance
from designer.folders.report_sections import later_sections
from designer.folders.study_cache import CACHE, StudyCache
from designer.folders.study_stores import BOARDS, PIECES, FolderStores, map_files
from designer.jobs.options import Options
from designer.jobs.study_layers import layers_of, study_files
from designer.linear_network.milp import SOLVER
from designer.report import measured_table
from designer.spice import equation_check
from designer.spice.equation_check import EquationCheck
from designer.spice.pool import SpicePool, require_ngspice
from designer.spice.simulator import SimulationFailed
from designer.yields.layers import LocalRunner, Runner
from designer.yields.loss_attribution import AttributionStage
from designer.yields.loss_replay import BUDGET
from designer.yields.study import RunResult, Study
from designer.yields.study_identity import RULES, checks_hash
from designer.yields.tolerance_study import Stores, check, tolerance

if TYPE_CHECKING:
    from designer.answers.shared_rows import TrustVerdict
    from designer.answers.study_answer import RunAnswer, StudyAnswer
    from designer.report.data import ReportData

SPICE_TIMEOUT = 900.0
"""The longest that one run of ngspice may take in a study, s: a way of thousands of periods."""
Checks = tuple[EquationCheck | None, tuple[CheckedResponse, ...]]
"""What ngspice says of a design's equations, and its nominal responses on every engine."""


@dataclass(frozen=True)
class Place:
    """Where a study is in its folder."""

    stage: StageName = "study"
    """Its name in the manifest."""
    prefix: str = ""
    """Prefix of the names of its files, "" or ending in "/"."""

    def stages(
        self, inputs: Mapping[str, Any], options: Options, responses: int, *, census: bool
    ) -> Stages:
        """The stage as the folder is asked for it. census : whether it is of all the boards of a
        list."""
        files = [f"{self.prefix}{name}" for name in study_files(options, responses, census)]
        return {self.stage: ({**inputs, "layers": layers_of(options)}, files)}

    def answer(self, folder: Folder) -> RunAnswer:
        """The answer that stands there."""
        return run_json(design_answer(folder), folder.json(self.prefix + TOLERANCE))

    def cache(self, folder: Folder, note: Note, name: str = CACHE) -> StudyCache:
        """The cache in the file of this name. note : called with a message where it is damaged."""

        def write(name: str, content: bytes) -> None:
            folder.write(self.prefix + name, content)

        def vouch(name: str, content: bytes) -> bool:
            return folder.vouches(self.prefix + name, content)

        return StudyCache(folder / (self.prefix + name), write, note, vouch)


RANDOM, BUILT = Place(), Place("measured", "measured/")
"""The places of the study of random boards and of that of the boards in a list."""


@dataclass(frozen=True)
class StudyHelp:
    """Who computes a study."""

    jobs: int
    """Number of workers."""
    pool: SpicePool | None
    """Runs ngspice; None where it is not asked."""
    runner: Runner
    """Who computes blocks."""

    @classmethod
    @contextmanager
    def of(cls, options: Options) -> Iterator[StudyHelp]:
        """What these options need, looked for before anything is written.

        Raises
        ------
        EnvironmentMissing : it is not there.
        """
        with ExitStack() as stack:
            pool = None
            if options.rung != "exact":
                progress.stage("ngspice")
                pool = stack.enter_context(SpicePool(options.workers, timeout=SPICE_TIMEOUT))
                require_ngspice(pool)
            runner: Runner = LocalRunner(options.workers)
            if options.cluster is not None:
                from designer.jobs.dask_runner import Cluster

                progress.stage(f"cluster {options.cluster}")
                runner = stack.enter_context(Cluster(options.cluster))
            yield cls(options.workers, pool, runner)


@dataclass
class StudyStage:
    """A study that is worked on in a folder."""

    folder: Folder
    place: Place
    """Where in the folder the study is."""
    synthesis: Synthesis
    """The design with its model."""
    options: Options
    command: str
    """The command line that its report states."""
    shown: Show
    """Shows the yields while the work goes on."""
    early: bool = False
    """Whether the yields were shown."""
    data: ReportData | None = None
    """What the report was made of that was written last."""

    def work(
        self,
        help_: StudyHelp,
        design_seconds: float = 0.0,
        checked: Callable[[CheckedResponse], None] = quiet,
    ) -> RunResult:
        """Make the study, write it and finish the stage.

        design_seconds : wall time that the design took. checked : is given the first response on
        every engine.
        """
        folder, place, options = self.folder, self.place, self.options
        began = time.perf_counter()
        cache = place.cache(folder, progress.note)
        equations, responses = checks(folder, self.synthesis, help_.pool, cache)
        checked(responses[0])
        ready, guard = time.perf_counter(), folder.watch()
        stores = FolderStores(
            folder.path,
            guard,
            progress.note,
            cache,
            place.cache(folder, progress.note, PIECES),
            place.prefix,
            folder.vouches,
            noise=options.attribution_anew,
        )

        def result_of(study: Study) -> RunResult:
            cost = {
                "check_seconds": ready - began,
                "study_seconds": time.perf_counter() - ready,
                "blame_seconds": 0.0 if study.blame is None else study.blame.seconds,
                "rare_seconds": sum(each.seconds for each in study.rare),
                "maps_seconds": sum(each.seconds for each in study.maps),
                "jobs": float(help_.jobs),
                "design_seconds": design_seconds,
                **{f"{name}_seconds": seconds for name, seconds in study.seconds.items()},
            }
            return run_result(self.synthesis, study, options, cost, equations)

        def sampled(study: Study) -> None:
            if help_.pool is None:
                return
            progress.note("yields of the exact circuit; ngspice is now asked about boards")
            self.shown(run_json(design_answer(folder), plain(result_json(result_of(study)))))

        def standing(study: Study) -> None:
            guard()
            self._write(result_of(study))
            self.early = True
            self.shown(place.answer(folder))

        study = study_of(self.synthesis, options, help_, responses, stores, sampled, standing)
        guard()
        cache.forget_unused()
        result = result_of(study)
        for name, content in map_files(study, result.modelfile, result.provenance).items():
            folder.write(place.prefix + name, content)
        self._write(result)
        assert folder.manifest is not None
        folder.manifest.provenance = dict(result.provenance)
        if study.blame_status.stage is not AttributionStage.PART:
            (folder / (place.prefix + PIECES)).unlink(missing_ok=True)
        folder.finish(place.stage, stores.names)
        return result

    def _write(self, result: RunResult) -> None:
        """``tolerance.json``, the boards of a list and the report, of what the study has."""
        folder, prefix = self.folder, self.place.prefix
        document = result_json(result)
        folder.write(prefix + TOLERANCE, dumps(document))
        if (boards := document["boards"]) is not None:
            wanted = [(c.model.omega, c.model.expected) for c in result.checked]
            labels = measured_table.response_labels(wanted)
            folder.write(prefix + BOARDS, measured_table.boards_csv(labels, boards))
        progress.stage("report")
        from designer.report.data import ReportData
        from designer.report.write import write_report  # matplotlib is not needed before this

        if self.data is None:
            starts, board = design_files.starts(folder), kicad_files.own_board(folder)
            design = design_answer(folder)
            warnings, failed = tuple(design["warnings"]), tuple(design["failed_rules"])
            name = one_line(folder.path.resolve().name)
            self.data = ReportData(result, self.command, starts, board, warnings, failed, name)
        else:
            self.data = self.data.of_study(result)
        html, text = (folder / f"{prefix}{name}" for name in REPORTS)
        write_report(self.data, html, text, () if prefix else later_sections(folder))


def study_of(
    synthesis: Synthesis,
    options: Options,
    help_: StudyHelp,
    checked: tuple[CheckedResponse, ...],
    stores: Stores | None = None,
    sampled: Callable[[Study], None] = quiet,
    standing: Callable[[Study], None] | None = None,
) -> Study:
    """The study that the options want. checked, stores, sampled, standing : as of ``tolerance``."""
    return tolerance(
        synthesis,
        samples=options.samples,
        until=options.until,
        fidelity=options.rung,
        tuned=options.tuned,
        reached=options.reached,
        attributed=options.blame,
        attribution_budget=BUDGET if options.blame_budget is None else options.blame_budget,
        maps=options.map_,
        rare=options.rare,
        seed=options.seed,
        jobs=help_.jobs,
        pool=help_.pool,
        checked=checked,
        stores=stores,
        runner=help_.runner,
        sampled=sampled,
        standing=standing,
    )


def read_study(path: Path, synthesis: Synthesis, place: Place) -> Study:
    """The study at a place of a folder, as the exact circuit has it: every board and its verdict,
    without the further layers.

    Raises
    ------
    InputError : there is no finished one.
    """
    folder = Folder(path)
    stage = None if folder.manifest is None else folder.manifest.stages.get(place.stage)
    if stage is None or not stage.complete:
        expected = "a finished study (designer tolerance)"
        raise InputError(path, f"stages.{place.stage}", MISSING, expected)
    samples = folder.json(place.prefix + TOLERANCE)["samples"]
    stores = FolderStores(path, lambda: None, prefix=place.prefix, vouch=folder.vouches)
    fidelity = stage.inputs.get("rung", "exact")
    options = Options(stage.inputs["seed"], samples=samples, rung=fidelity, blame=False)
    help_ = StudyHelp(options.workers, None, LocalRunner(options.workers))
    with progress.within_stage():
        return study_of(synthesis, options, help_, check(synthesis, None), stores)


def checks(
    folder: Folder,
    synthesis: Synthesis,
    pool: SpicePool | None,
    cache: StudyCache,
) -> Checks:
    """The checks of a design, made now or taken from the folder."""
    if pool is None:
        return None, check(synthesis, None)
    assert folder.manifest is not None
    key = checks_hash(folder.manifest.files[DESIGN][1], pool.version)
    equations: EquationCheck | None = cache.get("equations", key)
    if equations is None:
        equations = _equations(synthesis, pool)
        if not any(finding.reason for finding in equations.findings):
            cache.put("equations", key, equations)
    if not equations.passed:
        progress.note(equations.problem)
    gates = cache.get("gates", key)
    checked = check(synthesis, pool, gates)
    results = tuple(c.gate for c in checked)
    # A run without an answer is asked again the next time.
    if gates is None and not any(g and isinstance(g.read, SimulationFailed) for g in results):
        cache.put("gates", key, results)
    return equations, checked


def checks_in_memory(synthesis: Synthesis, pool: SpicePool | None) -> Checks:
    """The checks of a design."""
    equations = None if pool is None else _equations(synthesis, pool)
    return equations, check(synthesis, pool)


def _equations(synthesis: Synthesis, pool: SpicePool) -> EquationCheck:
    progress.stage("ngspice, equation check")
    return equation_check.check(synthesis.design, synthesis.model_responses, pool)


def run_result(
    synthesis: Synthesis,
    study: Study,
    options: Options,
    cost: dict[str, float],
    equations: EquationCheck | None,
) -> RunResult:
    """A study with its design, its checks and its provenance."""
    gates = [
        {"omega": c.model.omega, **c.gate.as_dict()} for c in study.checked if c.gate is not None
    ]
    origin = provenance(
        synthesis.modelfile,
        synthesis.catalog.hash,
        seed=options.seed,
        settings={"highs": SOLVER, "rules": RULES, "rung": options.rung, "ngspice": gates},
        spread=study.plan.spread.as_dict(),
    )
    return RunResult(
        synthesis.modelfile,
        synthesis.catalog,
        synthesis.model_responses,
        synthesis.design,
        study.checked,
        study,
        origin,
        cost,
        equations,
    )


def result_json(result: RunResult) -> StudyAnswer:
    """What ``tolerance.json`` holds."""
    return study_json.study_json(
        result.study,
        result.provenance,
        result.cost,
        result.equations,
        result.modelfile.si,
    )


def satisfied(answer: RunAnswer) -> bool:
    """Whether every response was found, the engines agree and can be trusted, and the netlist
    computes the model's equation."""
    equations = answer["equation_check"]
    right = equations is None or equations["passed"]
    return right and all(
        r["found"] and r["engines_agree"] and _trusted(r.get("trust", {}))
        for r in answer["responses"]
    )


def _trusted(trust: Mapping[str, TrustVerdict | None]) -> bool:
    """Whether the engines' answers can be trusted, where each has one (null: it has none); a yield
    says only how far it is known. Older folders say nothing."""
    return all(
        verdict is not None and verdict["trusted"] is True
        for name, verdict in trust.items()
        if name != "yield"
    )
