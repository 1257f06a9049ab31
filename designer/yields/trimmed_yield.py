"""The DC trimmer of a board: one setting for all responses, found once, and what the board shows
there.

The fitted trimmer is simulated with its track in two parts and the resistor from its wiper into the
velocity integrator's summing node. It is set by the procedure of docs/bench.md, played as a person
reads a screen. Then every response is judged at that setting, from its nominal orbit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from designer.base.arrays import Array
from designer.base.views import View
from designer.board.board_parts import board_circuit, trimmed_clearance
from designer.circuit.board_arrays import Boards
from designer.circuit.board_modes import at_rest
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit, Resistor, Trimmer
from designer.spread.spread import draw_many
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import Answer, BoardRow, StudyPlan, rounded
from designer.yields.bench_procedure import BITS, READINGS

if TYPE_CHECKING:
    from designer.check.synthesis_result import Synthesis

HIGH, LOW = "RV901H", "RV901L"
"""The track between the wiper and its ends."""
END = 1e-3
"""Share of the travel that stays unused at either end."""
SCREEN = 4.0
"""Volts on the whole screen while the stops are read, over the nominal board's stop."""
FINER = 10.0
"""How much larger the scale is on which the rest point is read: it lies still, near 0 V."""
TURNS = 4
"""Corrections by the rule of proportion; the rest point is all but linear in the setting."""
TAG = 0x7213
"""Sets the readings' noise apart from the other draws of a sample."""


@dataclass(frozen=True)
class DcTrim:
    """A trimmer that sets a board's DC offset."""

    circuit: Circuit
    """The circuit with the trimmer and its resistor among its parts, the wiper in the middle."""
    track: float
    """Resistance of the trimmer's track [Ω]."""
    adjustability: float
    """How finely the wiper is set, ± of the travel."""

    @classmethod
    def of(cls, circuit: Circuit, part: Trimmer, series: Resistor, adjustability: float) -> DcTrim:
        """The trimmer ``part`` with ``series`` from its wiper, in a circuit without fittings."""
        half = 0.5 * part.value
        added = (
            Resistor(HIGH, part.high, part.wiper, half, part.role),
            Resistor(LOW, part.low, part.wiper, half, part.role),
            replace(series, views=View.EVERYWHERE),
        )
        bare = replace(circuit, parts=(*circuit.parts, *added), fittings=())
        return cls(bare, part.value, adjustability)

    def as_dict(self) -> dict[str, Any]:
        """What decides a setting beside the plan, as JSON holds it."""
        parts = {p.name: p.value for p in self.circuit.resistors[-3:]}
        return {"parts": parts, "adjustability": self.adjustability}

    def on(self, circuit: Circuit) -> DcTrim:
        """The same trimmer in a circuit that differs in its references."""
        parts = (*circuit.parts, *self.circuit.parts[-3:])
        return replace(self, circuit=replace(circuit, parts=parts, fittings=()))

    def at(self, boards: Boards, position: Array) -> Boards:
        """These boards of ``circuit`` with the wiper there: (N,) of the travel, 0 at the negative
        rail and 1 at the positive one."""
        track = {HIGH: self.track * (1.0 - position), LOW: self.track * position}
        return replace(boards, values={**boards.values, **track})


@dataclass(frozen=True)
class Trimmed(BoardRow):
    """A board at its one setting of the trimmer."""

    position: float
    """Position of the wiper, 0 at the negative rail and 1 at the positive one."""
    at_end: bool
    """Whether the trimmer reaches no further."""
    radius: float
    """Largest modulus of the orbit's multipliers."""
    penetration: float
    """Smallest penetration of all contacts, in units of the moving state."""
    miss: float
    """Nearest approach to a stop without contact, in units of the moving state."""
    asymmetry: float
    """Distance of the orbit from its mirror image (``Orbit.asymmetry``)."""


def dc_trim(synthesis: Synthesis) -> DcTrim | None:
    """The trimmer of a design; None where the model file does not ask for a fitted one, or no
    summing node is driven.

    Raises
    ------
    Unreachable : no resistor for it can be bought.
    """
    if synthesis.modelfile.board.dc_trim != "fitted":
        return None
    board, _ = board_circuit(synthesis)
    part = next((p for p in board.fittings if isinstance(p, Trimmer)), None)
    if part is None:
        return None
    series = next(p for p in board.fittings if isinstance(p, Resistor) and part.wiper in p.nets)
    adjustability = synthesis.catalog.trimmer(part.value).adjustability
    return DcTrim.of(synthesis.design.circuit, part, series, adjustability)


def trimmed_boards(trim: DcTrim, plan: StudyPlan, indices: range) -> tuple[Boards, Array]:
    """The boards of these samples with their trimmers set, and the settings (N,).

    A trimmer is set once, on the new board at room temperature; the board gets warm and old after.
    """
    built = draw_many(trim.circuit, plan.spread.as_built, plan.seed, indices)
    position = settings(trim, built, plan.seed, indices)
    boards = draw_many(trim.circuit, plan.spread, plan.seed, indices)
    return trim.at(boards, position), position


def trimmed_answers(
    trim: DcTrim,
    plan: StudyPlan,
    indices: range,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> tuple[list[Answer], Array]:
    """An answer for every board and every question, in order, and the settings (N,).

    plan : of the circuit without the trimmer. progress : called once an answer.
    """
    boards, position = trimmed_boards(trim, plan, indices)
    return exact_circuit.of_boards(plan, boards, indices, jobs, progress), position


def trimmed_block(
    trim: DcTrim,
    plan: StudyPlan,
    indices: range,
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> list[Trimmed]:
    """A row for every board and every question, in order; arguments as ``trimmed_answers``."""
    answers, position = trimmed_answers(trim, plan, indices, jobs, progress)
    names = [f.name for f in fields(Trimmed) if f.name not in ("position", "at_end")]
    rows = []
    for answer in answers:
        wiper = float(position[answer.sample - indices.start])
        at_end = min(wiper, 1.0 - wiper) < END * (1.0 + 1e-9)
        columns = {name: getattr(answer, name) for name in names}
        rows.append(Trimmed(**columns, position=rounded(wiper), at_end=at_end))
    return rows


def settings(trim: DcTrim, boards: Boards, seed: int, indices: range) -> Array:
    """(N,) where the procedure leaves the wiper of each board, as a person reads the screen.

    The middle of the travel where a board has no rest point.
    """
    nominal = Boards.of(trim.circuit, [nominal_board(trim.circuit)])
    clearance = trimmed_clearance(trim.circuit)
    wanted, stops = at_rest(nominal, clearance)
    middle = trim.at(boards, np.full(len(boards), 0.5))
    _, read = at_rest(middle, clearance)
    step = SCREEN * max((abs(float(v[0])) for v in stops.values()), default=0.0) / 2**BITS
    people = [np.random.default_rng([seed, i, TAG]) for i in indices]
    target = np.full(len(boards), float(wanted[0]))
    if stops:
        away = [_reading(read[s], step, people) + float(wanted[0] - stops[s][0]) for s in stops]
        target = np.mean(away, axis=0)
    target = _reading(target, step / FINER, people)
    position = _turned(trim, boards, target)
    slip = np.array([p.uniform(-1.0, 1.0) for p in people])
    return np.clip(position + trim.adjustability * slip, END, 1.0 - END)


def _turned(trim: DcTrim, boards: Boards, target: Array) -> Array:
    """(N,) the setting at which the displacement in the trimmed clearance rests at ``target`` [V],
    the nearest end where it does nowhere."""
    clearance = trimmed_clearance(trim.circuit)

    def off(position: Array) -> Array:
        return at_rest(trim.at(boards, position), clearance)[0] - target

    before, setting = np.full(len(boards), END), np.full(len(boards), 1.0 - END)
    error, now = off(before), off(setting)
    for _ in range(TURNS):
        change = now - error
        safe = np.where(change == 0.0, 1.0, change)
        move = np.where(change == 0.0, 0.0, -now * (setting - before) / safe)
        before, error = setting, now
        setting = np.clip(np.nan_to_num(setting + move, nan=0.5), END, 1.0 - END)
        now = off(setting)
    return setting


def _reading(volts: Array, step: float, people: list[np.random.Generator]) -> Array:
    """(N,) the mean of a few readings of a screen, each off by up to one step, in whole steps."""
    if step == 0.0:
        return volts
    noise = np.array([p.uniform(-1.0, 1.0, READINGS) for p in people])
    return np.asarray(np.round(volts[:, None] / step + noise).mean(axis=1) * step)
