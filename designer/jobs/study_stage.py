"""A study that is a stage of a design folder: what it needs, what is computed, what is written.

The random boards of ``jobs.study_job`` and the built ones of ``jobs.measured_job`` are
studied and written in the same way, each at its own place in the folder.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from designer.base.defaults import cores
from designer.base.design_folder import DESIGN, REPORTS, TOLERANCE, Folder
from designer.base.keyed_store import Note
from designer.base.manifest import StageName
from designer.base.plain_json import dumps
from designer.base.progress import Progress
from designer.check.checked_design import CheckedResponse
from designer.check.synthesis_result import Synthesis
from designer.jobs import design_files
from designer.jobs.json_answers import run_json
from designer.jobs.options import Options
from designer.jobs.origin import provenance
from designer.jobs.study_folder import BOARDS, PIECES, FolderStores, write_maps
from designer.jobs.study_json import study_json
from designer.report import measured_table
from designer.spice import equation_check
from designer.spice.equation_check import EquationCheck
from designer.spice.pool import SpicePool, require_ngspice
from designer.spice.simulator import SimulationFailed
from designer.synthesis.tie_break import SOLVER
from designer.yields.blame_extent import BUDGET
from designer.yields.blame_status import BlameStage
from designer.yields.layers import Here, Runner
from designer.yields.run_result import RunResult
from designer.yields.study import Study
from designer.yields.study_cache import KEPT, Kept
from designer.yields.study_identity import RULES, checks_hash
from designer.yields.tolerance_study import check, tolerance

SPICE_TIMEOUT = 900.0
"""The longest that one run of ngspice may take in a study, s: a way of thousands of periods."""


@dataclass(frozen=True)
class Place:
    """Where a study is in its folder."""

    stage: StageName = "study"
    """Its name in the manifest."""
    prefix: str = ""
    """Prefix of the names of its files, "" or ending in "/"."""

    def names(self, files: Iterable[str]) -> list[str]:
        """These files of a study, in its place."""
        return [f"{self.prefix}{name}" for name in files]

    def answer(self, folder: Folder) -> dict[str, Any]:
        """The answer that stands there."""
        return run_json(folder.json(DESIGN), folder.json(self.prefix + TOLERANCE))

    def kept(self, folder: Folder, note: Note, name: str = KEPT) -> Kept:
        """What is stored there under a name. note : is told of a damaged file."""

        def write(name: str, content: bytes) -> None:
            folder.write(self.prefix + name, content)

        def vouch(name: str, content: bytes) -> bool:
            return folder.vouches(self.prefix + name, content)

        return Kept(folder / (self.prefix + name), write, note, vouch)


@dataclass
class StudyStage:
    """A study that is worked on."""

    folder: Folder
    """The design folder."""
    place: Place
    """Where in the folder the study is."""
    made: Synthesis
    """The design with its model."""
    options: Options
    """Options of the verb."""
    command: str
    """The command line that its report states."""
    progress: Progress
    """Told how far the work is."""
    shown: Callable[[Mapping[str, Any]], None]
    """Called with the answer once the yields of the exact circuit stand, where ngspice is asked
    after that, and once all yields stand, where blame or maps take time after that."""
    design_seconds: float
    """Wall time that the design took [s]."""
    early: bool = False
    """Whether the yields were shown."""

    def done(
        self,
        checked: tuple[EquationCheck | None, tuple[CheckedResponse, ...]],
        kept: Kept,
        help_: Help,
        check_seconds: float,
    ) -> RunResult:
        """Make the study, write it and finish the stage."""
        folder, place = self.folder, self.place
        began, guard = time.perf_counter(), folder.watch()
        equations, responses = checked
        pieces = place.kept(folder, self.progress.note, PIECES)
        stores = FolderStores(
            folder.path,
            guard,
            self.progress.note,
            kept,
            pieces,
            place.prefix,
            folder.vouches,
        )

        def result_of(study: Study) -> RunResult:
            cost = {
                "check_seconds": check_seconds,
                "study_seconds": time.perf_counter() - began,
                "blame_seconds": 0.0 if study.blame is None else study.blame.seconds,
                "maps_seconds": sum(found.seconds for found in study.maps),
                "jobs": float(help_.jobs),
                "design_seconds": self.design_seconds,
            }
            said = _provenance(self.made, study, self.options)
            m = self.made
            return RunResult(
                m.modelfile, m.catalog, m.found, m.design, responses, study, said, cost, equations
            )

        def sampled(study: Study) -> None:
            document = _document(result_of(study))
            self.progress.note("yields of the exact circuit; ngspice is now asked about boards")
            self.shown(run_json(folder.json(DESIGN), json.loads(dumps(document))))

        def standing(study: Study) -> None:
            guard()
            self._write(result_of(study))
            self.early = True
            self.shown(place.answer(folder))

        options = self.options
        study = tolerance(
            self.made,
            samples=options.samples,
            until=options.until,
            rung=options.rung,
            tuned=options.tuned,
            reached=options.reached,
            blamed=options.blamed,
            blame_budget=BUDGET if options.blame_budget is None else options.blame_budget,
            maps=options.maps,
            seed=options.seed,
            jobs=help_.jobs,
            pool=help_.pool,
            checked=responses,
            stores=stores,
            runner=help_.runner,
            progress=self.progress,
            sampled=sampled,
            standing=standing,
        )
        guard()
        kept.forget_unused()
        result = result_of(study)
        if study.maps:
            write_maps(folder, study, result.provenance)
        self._write(result)
        assert folder.manifest is not None
        folder.manifest.provenance = result.provenance
        if study.blame_status.stage is not BlameStage.PART:
            (folder / (place.prefix + PIECES)).unlink(missing_ok=True)
        folder.finish(place.stage, stores.names)
        return result

    def _write(self, result: RunResult) -> None:
        """``tolerance.json``, the boards of a list and the report, of what the study has."""
        folder, place = self.folder, self.place
        document = _document(result)
        folder.write(place.prefix + TOLERANCE, dumps(document))
        if document["boards"] is not None:
            asked = [(c.model.omega, c.model.expected) for c in result.checked]
            labels = measured_table.response_labels(asked)
            text = measured_table.boards_csv(labels, document["boards"])
            folder.write(place.prefix + BOARDS, text)
        self.progress.stage("report")
        from designer.report.data import ReportData
        from designer.report.write import write_report  # matplotlib is not needed before this

        data = ReportData(result, self.command, tuple(design_files.starts(folder)))
        write_report(data, *(folder / name for name in place.names(REPORTS)))


@dataclass(frozen=True)
class Help:
    """What a study is helped by."""

    jobs: int
    """Number of workers."""
    pool: SpicePool | None
    """Runs ngspice; None where it is not asked."""
    runner: Runner
    """Who computes blocks."""

    @classmethod
    @contextmanager
    def of(cls, options: Options, progress: Progress) -> Iterator[Help]:
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


def checks(
    folder: Folder, made: Synthesis, pool: SpicePool | None, kept: Kept, progress: Progress
) -> tuple[EquationCheck | None, tuple[CheckedResponse, ...]]:
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


def _document(result: RunResult) -> dict[str, Any]:
    return study_json(
        result.study,
        result.provenance,
        result.cost,
        result.equations,
        result.modelfile.mechanical,
    )


def _provenance(made: Synthesis, study: Study, options: Options) -> dict[str, Any]:
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


def satisfied(answer: Mapping[str, Any]) -> bool:
    right = answer["equation_check"] is None or answer["equation_check"]["passed"]
    return right and all(
        r["found"] and r["engines_agree"] and _trusted(r.get("trust", {}))
        for r in answer["responses"]
    )


def _trusted(said: Mapping[str, Any]) -> bool:
    """Of the engines' answers, where each has one (null: it has none); a yield says only how far
    it is known. Older folders say nothing."""
    return all(engine["trusted"] is True for name, engine in said.items() if name != "yield")
