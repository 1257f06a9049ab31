"""What a user may do next: command lines to copy, below what a verb has to say."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.si_unit import is_angular, value_text
from designer.dynamics.orbit import WITHOUT_PERIOD
from designer.verbs.console import say

if TYPE_CHECKING:
    from designer.answers.cure_answer import CureAnswer
    from designer.answers.design_answer import DesignAnswer
    from designer.answers.rules_answer import RulesJson
    from designer.answers.study_answer import RunAnswer, StudyAnswer

Step = tuple[str, str]
"""A command line, and what it is for."""
GOOD = 0.95
"""A response of a lower yield is one to mend."""
AROUND = 0.3
"""Half-width of the sweep about a frequency whose response was not found, as a share of it."""
WIDE = 72
"""Characters of a command line that the purposes of others are kept in line with."""


def show(steps: Iterable[Step]) -> None:
    """Print them, one a line."""
    rows = list(steps)
    if not rows:
        return
    width = max((len(command) for command, _ in rows if len(command) <= WIDE), default=0)
    say("\n".join(["", "Next", *(f"  {command:{width}}  {purpose}" for command, purpose in rows)]))


def after_model(model: Path) -> Iterator[Step]:
    """With a model file."""
    yield _step("what the model does", "simulate", model)
    yield _step("the whole job", "run", model, "--out", Path("out") / model.stem)


def after_design(folder: Path, answer: DesignAnswer) -> Iterator[Step]:
    """With a design that nothing was counted of. answer : of ``synthesise``."""
    yield from after_response(folder, answer["knobs"])
    failing = list(after_failed_rules(folder, answer))
    yield from failing
    yield _step("how many boards will work", "tolerance", folder)
    if not failing:
        yield _step("circuit against design rules", "rules", folder)


def after_study(
    folder: Path, answer: StudyAnswer | RunAnswer, *, repaired: bool = False
) -> Iterator[Step]:
    """With a study. answer : of ``tolerance`` or ``run``. repaired : whether a repair was sought
    already."""
    responses = answer["responses"]
    yield f"open {shlex.quote(str(folder / 'report.html'))}", "the report"
    yield from after_failed_rules(folder, answer)
    yield from after_response(folder, responses)
    low = any(
        # Where no board has an answer there is no rate.
        r["found"] and r["yield"] is not None and (r["rate"] or 0.0) < GOOD
        for r in responses
    )
    # A search follows orbits.
    if (
        low
        and not repaired
        and not any((r["expected"] or r["circuit"]) in WITHOUT_PERIOD for r in responses)
    ):
        yield _step("the cheapest cure", "search", folder, "--yield", GOOD)
    if _board(folder) is None:
        yield _step("the KiCad project, its board routed", "export", folder, "--routed")
    yield from after_board(folder)


def after_repair(folder: Path, cure: CureAnswer) -> Iterator[Step]:
    """With a repaired design in a folder of its own. cure : the JSON object of ``cure.json``."""
    rare = any(r["after"].get("rare") for r in cure["responses"])
    more = [*(["--rare"] if rare else []), *(["--tuned"] if cure["upgrades"]["trim"] else [])]
    yield _step("how many of its boards will work", "tolerance", folder, *more)
    yield _step("its KiCad project, its board routed", "export", folder, "--routed")


def after_failed_rules(folder: Path, answer: Mapping[str, Any]) -> Iterator[Step]:
    """With design rules that fail on the circuit. answer : with ``failed_rules``; older ones have
    none."""
    if names := ", ".join(rule["id"] for rule in answer.get("failed_rules", ())):
        yield _step(f"design rules that fail: {names}", "rules", folder)


def after_board(folder: Path) -> Iterator[Step]:
    """With a board in the folder's KiCad project, if there is one."""
    board = _board(folder)
    if board is not None:
        yield _step("circuit and board against design rules", "rules", folder, "--board", board)
        yield _step("files to order the board", "export", folder, "--fab", "jlcpcb")


def after_rules(folder: Path, answer: RulesJson) -> Iterator[Step]:
    """With rules that no board was given for. answer : of ``rules``."""
    board = _board(folder)
    if answer["board"] is None and board is not None:
        yield _step("the rules of the board too", "rules", folder, "--board", board)


def after_response(place: Path, responses: Iterable[Mapping[str, Any]]) -> Iterator[Step]:
    """With a wanted response that was not found. place : model file or design folder."""
    for row in responses:
        if not row["found"]:
            low, high = (_frequency(row, 1.0 + side * AROUND) for side in (-1.0, 1.0))
            sweep = ("--from", low, "--to", high, "--steps", 61, "--up", "--down")
            wanted = row["expected"]
            why = "what there is about it" if wanted is None else f"where {wanted} lives"
            yield _step(why, "bifurcation", place, *sweep)
            return


def _frequency(row: Mapping[str, Any], share: float) -> str:
    """A share of a response's frequency, as the options of ``bifurcation`` read it."""
    hertz = row.get("mechanism_hz", row.get("frequency_hz"))
    if is_angular(row["omega"], hertz):
        return value_text(share * hertz, "Hz")
    return f"{share * row['omega']:.4g}"


def _board(folder: Path) -> Path | None:
    return next(iter(sorted((folder / "kicad").glob("*.kicad_pcb"))), None)


def _step(purpose: str, *words: object) -> Step:
    return shlex.join(["designer", *(str(word) for word in words)]), purpose
