"""The verb ``rules``."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from designer.base.errors import InputError
from designer.base.frames import frame, table_html
from designer.base.progress import Progress, note, reported, stage, watched
from designer.base.version import __version__
from designer.verbs.console import say, table
from designer.verbs.declared import DesignDir, Verb, option

if TYPE_CHECKING:
    import pandas as pd

    from designer.answers.rules_answer import RulesJson
    from designer.answers.shared_rows import ProvenanceRow
    from designer.base.manifest import Stages
    from designer.board.kicad_reader import BoardFile
    from designer.catalog.design_rule import RuleOutcome
    from designer.check.synthesis_result import Synthesis

NAME = "rules.json"


@dataclass(frozen=True)
class RulesResult:
    """What the verb ``rules`` answers."""

    answer: RulesJson
    """The JSON object (docs/contract.md), which is the folder's ``rules.json``."""
    passed: bool
    """Whether no rule fails; what was not run does not fail."""
    folder: Path
    """The design folder."""

    def table(self) -> pd.DataFrame:
        """A row for each rule."""
        return frame(self.answer["rules"])

    def _repr_html_(self) -> str:
        from designer.catalog.design_rule import PASS

        names = ("id", "status", "found", "limit", "do")
        rows = [{n: r.get(n) for n in names} for r in self.answer["rules"] if r["status"] != PASS]
        counts = ", ".join(f"{number} {status}" for status, number in self.answer["counts"].items())
        return table_html(self.answer["title"], rows, counts)


@reported
def rules(
    folder: DesignDir,
    *,
    board: Annotated[
        Path | str | None,
        option("--board", "FILE", "Its board, a .kicad_pcb of KiCad 7 to 10.", Path),
    ] = None,
    fab: Annotated[
        Sequence[str],
        option(
            "--fab",
            "NAME",
            "With --board: who shall make it, by its limits. May come twice.",
            reads=list[str],
        ),
    ] = (),
    junit: Annotated[
        Path | str | None, option("--junit", "FILE", "Also write a JUnit report.", Path)
    ] = None,
    progress: Progress | None = None,
) -> RulesResult:
    """Test a circuit and its board against the design rules; exit status 1 where one fails.

    An earlier ``rules.json`` is replaced, since a board changes while it is drawn. Where the folder
    cannot be written the answer stands and says so. Without ``fab`` the limits of most makers hold.

    Raises
    ------
    InputError : no design folder, a board that is not of this design, or a fab without a file;
        nothing is written then.
    """
    from designer.base import atomic_write
    from designer.base.atomic_write import NotWritten
    from designer.base.design_folder import Folder, is_design_folder
    from designer.base.plain_json import dumps, plain
    from designer.base.seal import sha256
    from designer.board.kicad_reader import read_board
    from designer.catalog.fab import fabs
    from designer.catalog.parts_catalog import load_catalog
    from designer.design_rules import rule_reports
    from designer.folders.design_source import read_design
    from designer.folders.origin import provenance
    from designer.folders.report_sections import renew_report
    from designer.jobs.rules_job import checked

    began, path = time.perf_counter(), Path(folder)
    report = None if junit is None else Path(junit)
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
    synthesis = read_design(path, catalog, watched())
    board_file = None if board is None else read_board(Path(board))
    stage("rules")
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
    answer: RulesJson = plain(
        _json(synthesis, board_file, checks.outcomes, origin, time.perf_counter() - began)
    )
    place = Folder(path)
    stages: Stages = {"rules": (inputs, [NAME])}
    place.decide(stages, overwrite=True, resume=False)  # refuses what is not ours
    try:
        with place.working(stages):
            place.write(NAME, dumps(answer))
        renew_report(place)
    except NotWritten as why:
        note(f"the answer is not stored: {why}")
        answer["not_stored"] = str(why)
    if report is not None:
        text = rule_reports.junit(synthesis.modelfile.title, checks.outcomes)
        with atomic_write.appearing(report, "--junit") as partial:
            partial.write_text(text, encoding="utf-8")
    return RulesResult(answer, checks.passed, path)


def _json(
    synthesis: Synthesis,
    board: BoardFile | None,
    outcomes: Sequence[RuleOutcome],
    origin: ProvenanceRow,
    seconds: float,
) -> RulesJson:
    from designer.catalog.design_rule import FAIL, NOT_RUN, PASS

    statuses = [o.status for o in outcomes]
    return {
        "format": 1,
        "title": synthesis.modelfile.title,
        "board": None if board is None else board.path.name,
        "counts": {
            "pass": statuses.count(PASS),
            "fail": statuses.count(FAIL),
            "not run": statuses.count(NOT_RUN),
        },
        "complete": not any(o.open for o in outcomes),
        "rules": [o.as_dict() for o in outcomes],
        "provenance": origin,
        "cost": {"seconds": seconds},
    }


def show(result: RulesResult) -> None:
    """The rules, and what may be done next."""
    from designer.verbs import next_steps

    tables(result.answer)
    next_steps.show(next_steps.after_rules(result.folder, result.answer))


def tables(answer: RulesJson) -> None:
    """Every rule with its figure and what was found; then what to do about those that fail."""
    from designer.catalog.design_rule import FAIL, NOT_RUN, PASS

    rows = answer["rules"]
    table(
        "Design rules",
        (
            {
                "rule": r["id"],
                "status": r["status"],
                "figure": r["title"],
                "found": r["found"],
                "limit": r["limit"] + (" (model file)" if r["reason"] else ""),
            }
            for r in rows
            if r["status"] != NOT_RUN
        ),
    )
    for r in rows:
        if r["reason"]:
            say(f"{r['id']}: the model file's limit, because: {r['reason']}")
    for r in rows:
        if r["status"] == FAIL:
            say(f"{r['id']} fails: {r['do']}")
    count = answer["counts"]
    say(f"{count[PASS]} pass, {count[FAIL]} fail, {count[NOT_RUN]} not run")
    idle: dict[str, list[str]] = defaultdict(list)
    for r in rows:
        if r["status"] == NOT_RUN:
            idle[r["found"]].append(r["id"])
    if idle:
        say("Not run is no pass. Rules that were not looked at:")
    for why, ids in idle.items():
        say(f"  {why}: {', '.join(ids)}")


VERB = Verb(
    rules,
    "Make",
    "designer rules out/model --board out/model/kicad/model.kicad_pcb",
    show=show,
    satisfied=lambda result: result.passed,
)
