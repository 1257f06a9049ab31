"""What accuracy costs on a design: every fidelity against the most faithful one, and the cheapest
that answers each question.

Two truths are asked of a response (``fidelity.fidelity_errors``), and of boards a third, ngspice
with ideal op-amps. A bound counts as kept only if the error and the truth's own uncertainty, what
its two finest steps differ by, keep it together. The board's truth is the answer where that
uncertainty keeps the bound and nothing less does. A setting of ngspice that did not pass the
numerics gate, the truth's own too, is measured and is never named.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from designer.fidelity.fidelity_answers import CIRCUIT, MODEL, RK4
from designer.fidelity.fidelity_errors import BOARD, EQUATIONS, FidelityError, ResponseLabel, Truth
from designer.fidelity.yields import BoardTrade, LeftOut

IDEAL = "ideal"
"""What yields are measured against: ngspice with ideal op-amps, on the same boards."""
VELOCITY, WAVEFORM, YIELD = 0.01, 0.001, 0.01
"""Bounds of the questions."""
RESPONSE, IMPACT, WAVE, SHARE = (
    "n-p-q",
    "impact velocity within 1 %",
    "waveform within 0.1 %",
    "yield within 1 %",
)
QUESTIONS = (RESPONSE, IMPACT, WAVE)
"""The questions about a response; ``SHARE`` is the one about boards."""
NO_IMPACTS = "no impacts"
NO_PERIOD = "no period"
"""Why questions do not arise."""
ITSELF = "the board itself, which nothing measures here; its two finest steps differ by this"
"""What is said where nothing less than the truth will do."""
UNSURE = "the two finest steps of the board show different n-p-q, or none"
"""Why a question has no answer."""


@dataclass(frozen=True)
class Cheapest:
    """The cheapest fidelity that answers a question.

    A question that does not arise has no fidelity, no setting and no answer (None), and the note
    says why.
    """

    question: str
    """What is asked of a fidelity."""
    of: str
    """What the fidelity is measured against: the board, its equations, or ideal op-amps in
    ngspice."""
    label: ResponseLabel | None
    """Which response; None for all responses together."""
    rung: str | None
    """Name of the fidelity; None where there is none."""
    level: str | None
    """Name of the setting; None where there is none."""
    bound: float
    """Largest error that answers the question."""
    measured: float
    """The largest error with the truth's uncertainty, of this fidelity; for n-p-q the number of
    responses it has wrong; nan where there is none to measure, and of a fidelity that stands for
    what it would be measured against."""
    shown: bool | None
    """Whether that keeps the bound; where not, the fidelity is the one that comes nearest, or none
    where the truth is not sure."""
    seconds: float
    """CPU time of a drive period, summed over the responses [s]."""
    note: str = ""
    """What else there is to say."""
    convergence: float = math.nan
    """What the steps of a fidelity differ by; it takes the place of ``measured`` where a fidelity
    is compared with itself."""


@dataclass(frozen=True)
class TradedResponse:
    """What was found of one response."""

    rows: tuple[FidelityError, ...]
    truth: Truth
    """What the board does."""
    boards: BoardTrade | LeftOut | None = None
    """Its yields on boards, or why none were asked; None where none were wanted."""


@dataclass(frozen=True)
class Trade:
    """Time against accuracy, for every wanted response."""

    responses: tuple[TradedResponse, ...]
    """What was found, in the order of the model file."""
    cheapest: tuple[Cheapest, ...]
    """The cheapest fidelity for each question."""


def trade(responses: Sequence[TradedResponse]) -> Trade:
    """Judge what was found, response by response and for all together."""
    choices = []
    for of in (BOARD, EQUATIONS):
        for question in QUESTIONS:
            choices += [cheapest(question, of, [one]) for one in responses]
            if len(responses) > 1:
                choices.append(cheapest(question, of, responses))
    return Trade(tuple(responses), (*(c for c in choices if c is not None), *_of_boards(responses)))


def cheapest(question: str, of: str, responses: Sequence[TradedResponse]) -> Cheapest | None:
    """The cheapest fidelity and setting that keeps the bound on all of these responses; the nearest
    where none does. None where nothing was asked."""
    bound = {RESPONSE: 0.0, IMPACT: VELOCITY, WAVE: WAVEFORM}[question]
    label = responses[0].truth.label if len(responses) == 1 else None
    why = {r.truth.label.number: _no_question(question, of, r.truth) for r in responses}
    asked = [r for r in responses if not why[r.truth.label.number]]
    nothing = Cheapest(question, of, label, None, None, bound, math.nan, None, math.nan)
    if not asked:
        return replace(nothing, note=", ".join(dict.fromkeys(why.values())))
    left_out = [f"without response {n}: {reason}" for n, reason in why.items() if reason]
    open_ = [str(r.truth.label.number) for r in asked if of == BOARD and not r.truth.sure]
    if open_:
        unsure = UNSURE if label else f"{UNSURE} (response {', '.join(open_)})"
        return replace(nothing, shown=False, note="; ".join([unsure, *left_out]))
    truth = asked[0].truth
    finest = [(row.rung, row.level) for row in asked[0].rows if row.rung == truth.rung][-1:]
    kinds = dict.fromkeys((row.rung, row.level) for r in asked for row in r.rows)
    best: Cheapest | None = None
    for fidelity, level in kinds:
        picked = [
            row for r in asked for row in r.rows if (row.rung, row.level) == (fidelity, level)
        ]
        if len(picked) < len(asked) or not _competes(fidelity, of, picked):
            continue
        errors = [_error(question, of, row, r.truth) for row, r in zip(picked, asked, strict=True)]
        measured = sum(errors) if question == RESPONSE else max(errors)
        seconds = sum(row.seconds for row in picked)
        shown = measured <= bound
        itself = of == BOARD and [(fidelity, level)] == finest
        if itself and not shown:
            continue  # nothing is nearer than what is measured against
        note = "; ".join([ITSELF, *left_out] if itself else left_out)
        one = Cheapest(question, of, label, fidelity, level, bound, measured, shown, seconds, note)
        if best is None or _rank(one) < _rank(best):
            best = one
    if best is None or best.rung is None or not truth.is_itself(best.rung, of):
        return best
    return replace(best, measured=math.nan, convergence=best.measured)


def _no_question(question: str, of: str, truth: Truth) -> str:
    """Why a question does not arise; "" where it does."""
    if question == RESPONSE or (of == BOARD and not truth.sure):
        return ""
    if not truth.periodic[of]:
        return NO_PERIOD
    return NO_IMPACTS if question == IMPACT and not truth.impacts[of] else ""


def _rank(one: Cheapest) -> tuple[bool, float]:
    """The order of two candidates: those that keep the bound go by their cost, the others by how
    far they are off."""
    measure = one.seconds if one.shown else one.measured
    return (not one.shown, math.inf if math.isnan(measure) else measure)


def _competes(fidelity: str, of: str, picked: Sequence[FidelityError]) -> bool:
    """Whether a fidelity may be named: it passed the gate, and against the model's equations it
    computes the model."""
    if of == EQUATIONS:
        return fidelity in (RK4, MODEL)
    return all(row.gate is not False for row in picked)


def _error(question: str, of: str, row: FidelityError, truth: Truth) -> float:
    """The error of an answer plus the uncertainty of a truth that is sure; infinite where the truth
    is not."""
    if question == RESPONSE:
        return 0.0 if row.right[of] else 1.0
    own = row.velocity if question == IMPACT else row.error
    uncertainty = (truth.velocity if question == IMPACT else truth.error) if of == BOARD else 0.0
    total = own[of] + uncertainty
    return total if row.right[of] and total == total else math.inf


def _of_boards(responses: Sequence[TradedResponse]) -> list[Cheapest]:
    """The exact circuit where its yield is near ngspice's; ngspice on every board where it is
    shown not to be."""
    asked = [r.boards for r in responses if isinstance(r.boards, BoardTrade)]
    missing = [str(r.boards.label.number) for r in responses if isinstance(r.boards, LeftOut)]
    out = [_of_some([b]) for b in asked]
    if len(asked) > 1 or (asked and missing):
        note = f"without response {', '.join(missing)}" if missing else ""
        out.append(_of_some(asked, note, combined=True))
    return out


def _of_some(some: Sequence[BoardTrade], note: str = "", *, combined: bool = False) -> Cheapest:
    measured = max(b.bound for b in some)
    off = any(b.off(YIELD) for b in some)
    fidelity = "ideal" if off else CIRCUIT
    # ngspice is what is measured against: the circuit's difference is what there is to say.
    notes = [f"the exact circuit is off by more than {100.0 * YIELD:g} %"] if off else []
    notes += [note] if note else []
    if undecided := sum(b.undecided for b in some):
        asked = sum(b.asked for b in some)
        notes.append(f"{undecided} of {asked} boards undecided, counted as differing")
    return Cheapest(
        SHARE,
        IDEAL,
        None if combined else some[0].label,
        fidelity,
        "gate" if off else "exact",
        YIELD,
        math.nan if off else measured,
        off or measured <= YIELD,
        sum(b.seconds[fidelity] for b in some),
        "; ".join(notes),
    )
