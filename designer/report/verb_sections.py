"""Sections of a report about what other verbs answered of the same design: repair, rules, trade,
bench.

Each is made from the JSON object that the verb wrote beside the report, and from nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pydantic import TypeAdapter, ValidationError

from designer.answers.bench_answer import BenchShown, RecordShown
from designer.answers.cure_answer import CuredShown, CureShown, MeasuredShown, TrialShown
from designer.answers.design_answer import RuleShown
from designer.answers.rules_answer import RuleCounts, RulesShown
from designer.answers.trade_answer import BoardTradeShown, TradeShown
from designer.base.page import (
    Block,
    FileLinks,
    Items,
    PageSection,
    SmallPrint,
    bullets,
    table,
    table_of,
    titled,
)
from designer.base.si_unit import drive_text
from designer.catalog.design_rule import FAIL, NOT_RUN, PASS
from designer.fidelity import trade_files
from designer.report import record_page, words


def repair_section(answer: CureShown, files: Sequence[str]) -> PageSection:
    """The cheapest repair. answer : ``cure.json`` (docs/contract.md). files : of it, for links."""
    blocks: list[Block] = [
        _upgrades(answer),
        SmallPrint(
            "Yields of the exact circuit on fresh boards, with their 95 % intervals. Prices are "
            "over the design as it is, in euro by the catalogue's price classes."
        ),
        _repaired_responses(answer),
        PageSection("Yield against price", [_front(answer)]),
        PageSection("Not built", [_refused(answer)]) if answer["refused"] else None,
        FileLinks(tuple(files)),
    ]
    return PageSection("The cheapest cure", blocks, "cure", "", _repair_lead(answer))


def _repair_lead(answer: CureShown) -> str:
    wanted, price = f"{100.0 * answer['target']:g} %", f"{answer['price']:.2f} €"
    if answer["reached"]:
        return f"Every response at {wanted} or better for {price}."
    return f"{wanted} is not reached: {answer['why']}. The best that was measured costs {price}."


def _upgrades(answer: CureShown) -> Items | str:
    return bullets(answer["said"]) if answer["said"] else "Nothing is changed."


def _repaired_responses(answer: CureShown) -> Block:
    columns: dict[str, Callable[[CuredShown], str]] = {
        "response": _response,
        "as it is": lambda r: _share(r["before"]),
        "with the cure": lambda r: _share(r["after"]),
        "limit": lambda r: r["limit"],
    }
    return table_of(answer["responses"], columns)


def _front(answer: CureShown) -> Block:
    columns: dict[str, Callable[[TrialShown], str]] = {
        "price": lambda t: f"{t['price']:.2f} €",
        "worst response": lambda t: _share(min(t["measured"], key=_worst)),
        "upgrades": lambda t: "; ".join(t["said"]) or "as it is",
    }
    return table_of(answer["front"], columns, ("price",))


def _refused(answer: CureShown) -> Items:
    return bullets(f"{'; '.join(r['upgrades'])}: {r['why']}" for r in answer["refused"])


def _response(row: CuredShown) -> str:
    place = drive_text(row["omega"], row.get("frequency_hz"))
    return place + (f" ({row['expected']})" * bool(row["expected"]))


def _worst(measured: MeasuredShown) -> tuple[float, float]:
    return (measured["rate"] or 0.0, measured["low"])


def _share(measured: MeasuredShown) -> str:
    """A measured yield with its interval."""
    if measured["rate"] is None:
        return "not shown"
    shares = measured["rate"], measured["low"], measured["high"]
    rate, low, high = (f"{100.0 * share:.4g}" for share in shares)
    failed = f", {measured['failed']} failed" if measured["failed"] else ""
    return f"{rate} % ({low} to {high} %){failed}"


def rules_section(answer: RulesShown, files: Sequence[str]) -> PageSection:
    """The design rules. answer : ``rules.json`` (docs/contract.md). files : of it, for links."""
    by: dict[str, list[RuleShown]] = {status: [] for status in (FAIL, PASS, NOT_RUN)}
    for rule in answer["rules"]:
        by[rule["status"]].append(rule)
    board = answer["board"]
    failing = [(r["id"], r["title"], r["found"], r["limit"], r["do"]) for r in by[FAIL]]
    holding = [(r["id"], r["title"], r["found"], r["limit"]) for r in by[PASS]]
    waiting = [(r["id"], r["found"]) for r in by[NOT_RUN]]
    heads = ("rule", "figure", "found", "limit")
    blocks: list[Block] = [
        "No board was looked at." if board is None else f"The board that was looked at: {board}.",
        titled("What fails", table((*heads, "what to do"), failing)),
        titled("What was not run", table(("rule", "why"), waiting, names=1)),
        titled("What holds", table(heads, holding)),
        FileLinks(tuple(files)),
    ]
    return PageSection("Design rules", blocks, "rules", "", _rules_lead(answer["counts"]))


def _rules_lead(counts: RuleCounts) -> str:
    fail = f"{words.plural(counts[FAIL], 'rule')} failed" if counts[FAIL] else "No rule failed"
    rest = f", {counts[NOT_RUN]} not run" if counts[NOT_RUN] else ""
    return f"{fail}; {counts[PASS]} passed{rest}."


def trade_section(answer: TradeShown, files: Sequence[str]) -> PageSection:
    """Time against error. answer : ``trade.json`` (docs/contract.md). files : of it, for links."""
    blocks: list[Block] = [
        "The cheapest rung and setting that answers each question, for all responses together. "
        "What the error is measured against: board is the nominal circuit with "
        f"{trade_files.truth_words(answer['truths'])} in ngspice at the finest step, equations the "
        "exact flow of the model, ideal ngspice with ideal op-amps on the same boards.",
        trade_files.cheapest_table(answer["cheapest"], responses=len(answer["truths"])),
        SmallPrint(trade_files.UNITS),
        _boards(answer["boards"]),
        FileLinks(tuple(files)),
    ]
    line = "The cheapest way to ask each question of all responses."
    return PageSection("Time and error of the engines", blocks, "trade", "", line)


def _boards(boards: Sequence[BoardTradeShown]) -> PageSection | None:
    if not boards:
        return None
    return PageSection("Yields of both engines", trade_files.board_blocks(boards))


def bench_section(answers: Mapping[str, BenchShown]) -> PageSection:
    """Boards on the bench. answers : ``bench.json`` of each, by the folder that holds it."""
    rows = [(place, r) for place, answer in answers.items() for r in answer["records"]]
    asked = [r["as_wanted"] for _, r in rows if r["as_wanted"] is not None]
    columns: dict[str, Callable[[tuple[str, RecordShown]], str]] = {
        "board": lambda row: row[0],
        "record": lambda row: row[1]["file"],
        "drive": lambda row: record_page.at(row[1]),
        "shows": lambda row: record_page.shown_words(row[1]),
        "wanted there": lambda row: row[1]["wanted"] or "",
        "advice": lambda row: "" if (a := row[1]["advice"]) is None else a.get("words", ""),
    }
    blocks: list[Block] = [
        table_of(rows, columns),
        FileLinks(tuple(f"{place}/bench.html" for place in answers)),
    ]
    line = f"Records that surely show what is wanted there: {sum(asked)} of {len(asked)}."
    return PageSection("On the bench", blocks, "bench", "", line)


SHOWN: Mapping[str, type] = {
    "cure": CureShown,
    "rules": RulesShown,
    "trade": TradeShown,
    "bench": BenchShown,
}
"""What the section of a verb's answer shows."""


def is_whole(verb: str, answer: object) -> bool:
    """Whether an answer has all that its section shows: earlier versions wrote fewer keys."""
    try:
        TypeAdapter(SHOWN[verb]).validate_python(answer)
    except ValidationError:
        return False
    return True


COMMANDS: Mapping[str, str] = {
    "cure": "search DIR --yield Y --overwrite",
    "rules": "rules DIR",
    "trade": "trade DIR --overwrite",
}


def older_section(verb: str, files: Sequence[str]) -> PageSection:
    """The section of an answer of an earlier version, which has fewer figures than are shown
    now."""
    text = f"An earlier version made {files[0]}. `designer {COMMANDS[verb]}` makes it anew."
    blocks: list[Block] = [text, FileLinks(tuple(files))]
    return PageSection(verb.capitalize(), blocks, verb, "", "Of an earlier version.")


SECTIONS: Mapping[str, Callable[[Any, Sequence[str]], PageSection]] = {
    "cure": repair_section,
    "rules": rules_section,
    "trade": trade_section,
}
"""How the answer of a verb is shown, by the stage of the folder that holds it."""
