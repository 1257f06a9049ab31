"""The verb ``rules``: the design rules on a design folder and its board."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base import atomic_write
from designer.base.atomic_write import NotWritten
from designer.base.design_folder import Folder, is_design_folder
from designer.base.errors import InputError
from designer.base.frames import frame, table_html
from designer.base.manifest import Stages
from designer.base.plain_json import dumps, plain
from designer.base.progress import Progress
from designer.base.seal import sha256
from designer.base.version import __version__
from designer.board.kicad_reader import BoardFile, check_belongs, read_board
from designer.board.kicad_rules import board_rules
from designer.catalog.catalog import load_catalog
from designer.catalog.design_rule import FAIL, NOT_RUN, PASS, RuleOutcome
from designer.catalog.fab import fab_limits, fabs
from designer.check.synthesis_result import Synthesis
from designer.design_rules import on_board as rule_board, rule_reports, run_rules
from designer.design_rules.kicad_program import kicad_version
from designer.design_rules.subject import RuleSubject
from designer.folders.design_source import read_design
from designer.folders.origin import provenance
from designer.folders.report_sections import renew_report
from designer.model.model_file import naming

if TYPE_CHECKING:
    import pandas as pd

NAME = "rules.json"


@dataclass(frozen=True)
class RulesAnswer:
    """What the rules say of a design."""

    outcomes: tuple[RuleOutcome, ...]
    """Every rule and what became of it."""
    kicad: str | None
    """Version of the program that checked the board; None where it was not checked."""

    @property
    def passed(self) -> bool:
        """Whether no rule fails; what was not run does not fail."""
        return all(o.status != FAIL for o in self.outcomes)


@dataclass(frozen=True)
class RulesResult:
    """What the verb ``rules`` answers."""

    answer: dict[str, Any]
    """The JSON object (docs/contract.md), which is the folder's ``rules.json``."""
    passed: bool
    """Whether no rule fails; what was not run does not fail."""

    def table(self) -> pd.DataFrame:
        """A row for each rule."""
        return frame(self.answer["rules"])

    def _repr_html_(self) -> str:
        names = ("id", "status", "found", "limit", "do")
        rows = [{n: r[n] for n in names} for r in self.answer["rules"] if r["status"] != PASS]
        counts = ", ".join(f"{number} {status}" for status, number in self.answer["counts"].items())
        return table_html(self.answer["title"], rows, counts)


def rules(
    folder: Path | str,
    *,
    board: Path | str | None = None,
    fab: Sequence[str] = (),
    junit: Path | str | None = None,
    progress: Progress | None = None,
) -> RulesResult:
    """The verb ``rules``: check a design folder and write ``rules.json`` there.

    An earlier ``rules.json`` is replaced, since a board changes while it is drawn. Where the folder
    cannot be written the answer stands and says so.
    board : a .kicad_pcb of this design. fab : the makers whose limits it is held against; of none
    those of most. junit : where to write a JUnit report.

    Raises
    ------
    InputError : no design folder, a board that is not of this design, or a fab without a file;
        nothing is written then.
    """
    began, path = time.perf_counter(), Path(folder)
    report = None if junit is None else Path(junit)
    progress = Progress() if progress is None else progress
    if not is_design_folder(path):
        expected = "a design folder, as synthesise and run make it"
        raise InputError(path, "DIR", "no manifest.json", expected)
    if report is not None and (report.is_dir() or not report.parent.is_dir()):
        there = "a folder" if report.is_dir() else "no such folder"
        raise InputError(report, "--junit", there, "a file in a folder that exists")
    catalog = load_catalog()
    if fab and board is None:
        raise InputError(None, "--fab", ", ".join(fab), "a board to hold against it: --board FILE")
    fabs(fab, catalog.folders)
    synthesis = read_design(path, catalog, progress)
    board_file = None if board is None else read_board(Path(board))
    progress.stage("rules")
    checks = checked(synthesis, board_file, fab)
    inputs = {
        "model": synthesis.modelfile.sha256,
        "catalogue": catalog.hash,
        "version": __version__,
        "board": None if board_file is None else sha256(board_file.text.encode("utf-8")),
        "kicad": checks.kicad,
        "fabs": list(fab),
    }
    settings = {"board_sha256": inputs["board"], "kicad": checks.kicad, "fabs": list(fab)}
    origin = provenance(synthesis.modelfile, catalog.hash, settings=settings)
    answer = plain(
        _json(synthesis, board_file, checks.outcomes, origin, time.perf_counter() - began)
    )
    place = Folder(path)
    stages: Stages = {"rules": (inputs, [NAME])}
    place.decide(stages, overwrite=True, resume=False)  # refuses what is not ours
    try:
        with place.working(stages):
            place.write(NAME, dumps(answer))
        renew_report(place, progress.note)
    except NotWritten as why:
        progress.note(f"the answer is not stored: {why}")
        answer["not_stored"] = str(why)
    if report is not None:
        text = rule_reports.junit(synthesis.modelfile.title, checks.outcomes)
        with atomic_write.appearing(report, "--junit") as partial:
            partial.write_text(text, encoding="utf-8")
    return RulesResult(answer, checks.passed)


def checked(
    synthesis: Synthesis, board: BoardFile | None = None, makers: Sequence[str] = ()
) -> RulesAnswer:
    """Every rule on a design, and on its board if there is one. makers : the fabs that shall make
    it; of none the limits of most hold.

    Raises
    ------
    InputError : the board is not of this design, or a part is not in the catalogue.
    """
    limits = synthesis.modelfile.rules
    with naming(synthesis.modelfile):
        subject = RuleSubject.of(synthesis)
        custom = board_rules(subject.circuit, limits)
    listed = subject.components
    if board is not None:
        check_belongs(board, listed)
    on_circuit = run_rules.on_circuit(subject, limits)
    if board is None:
        return RulesAnswer((*on_circuit, *rule_board.without_board(custom, limits)), None)
    fab = fab_limits(makers, synthesis.catalog.folders)
    on_board = rule_board.checked(board, listed, custom, limits, fab)
    return RulesAnswer((*on_circuit, *on_board), kicad_version())


def _json(
    synthesis: Synthesis,
    board: BoardFile | None,
    outcomes: Sequence[RuleOutcome],
    origin: dict[str, Any],
    seconds: float,
) -> dict[str, Any]:
    count = {status: sum(o.status == status for o in outcomes) for status in (PASS, FAIL, NOT_RUN)}
    return {
        "format": 1,
        "title": synthesis.modelfile.title,
        "board": None if board is None else board.path.name,
        "counts": count,
        "complete": not count[NOT_RUN],
        "rules": [o.as_dict() for o in outcomes],
        "provenance": origin,
        "cost": {"seconds": seconds},
    }
