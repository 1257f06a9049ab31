"""Force laws of a model, as it asks for them and as the nominal board makes them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.base.si_unit import prefixed
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import DeadZoneReading
from designer.circuit.design import Design
from designer.circuit.reduction import Reduction
from designer.laws.force_law import ForceLaw
from designer.model.relative_motion import subscripted

FAR = 1.25
"""Of the furthest corner, or of the furthest motion: how far a curve is drawn."""
POINTS = 401
"""Of a curve."""
MadeBend = tuple[int, float, float]
"""The side on which it is, 1 upper or -1 lower, its distance from rest, and its change of the
slope."""


@dataclass(frozen=True)
class LawCurve:
    """The force that one law puts on its mass, over what it depends on."""

    name: str
    symbol: str
    """What it depends on, such as "x₁" or "x₁′ − x₂′", with its unit."""
    unit: str
    """Of the force; "" where it has none."""
    x: Array
    """(k,) what it depends on."""
    wanted: Array
    """(k,) the force by the model."""
    made: Array
    """(k,) the force of the nominal board, on the model's slope at rest: by its bends."""
    corners: tuple[float, ...]
    """Where the model's slope changes."""
    reached: tuple[float, float] | None
    """What the wanted responses reach; None where it is not one mass alone that moves."""


def law_curves(design: Design, extremes: list[Array], *, si: bool) -> tuple[LawCurve, ...]:
    """One for each law.

    extremes : (states, 2) of each wanted response, in model units. si : whether the model's numbers
    are SI values.
    """
    bends = _made_bends(design)
    laws = design.model.second_order().laws
    return tuple(_curve(law, bends.get(law.name, []), extremes, si=si) for law in laws)


def _made_bends(design: Design) -> dict[str, list[MadeBend]]:
    """By law, in model units, over what it depends on as ``_turn`` has it."""
    system, scales = design.model.second_order(), design.errors.scales
    laws = {law.name: law for law in system.laws}
    reduction = Reduction(design.circuit, nominal_board(design.circuit, ideal=True))
    found: dict[str, list[MadeBend]] = defaultdict(list)
    for k, zone in enumerate(system.dead_zones):
        law = laws.get(zone.bend_of)
        if law is None:
            continue
        # A dead zone counts displacement and force as its first mass has them.
        factor = _turn(law) * law.row[zone.mass]
        own = abs(float(system.push(law)[zone.mass]))
        reading = DeadZoneReading.of(reduction, k, zone)
        state, row = zone.watched, 2 * zone.mass + 1
        unit = scales.seconds * scales.volts[state] / scales.volts[row] * system.mass[zone.mass]
        for side, volts in reading.thresholds.items():
            slope = reading.slopes[side if side in reading.slopes else 0]
            place = factor * volts / float(scales.volts[state])
            felt = dict(zone.pushed)[zone.mass] * float(slope[row, state] * unit)
            found[zone.bend_of].append((side, place, -felt / (factor * own)))
    return found


def _turn(law: ForceLaw) -> float:
    """The sign with which a law is drawn: one of a mass seen from the ground's side is drawn over
    the mass's own displacement."""
    return 1.0 if max(law.row) > 0.0 else -1.0


def _symbol(law: ForceLaw) -> str:
    """What a law is drawn over: "x₁", "x₁′ − x₂′", "0.5 x₁ + 0.25 x₂"."""
    prime = "′" if law.quantity == "velocity" else ""
    factors = {i: _turn(law) * factor for i, factor in enumerate(law.row) if factor}
    words: list[str] = []
    for i in sorted(factors, key=lambda each: -factors[each]):
        size = "" if abs(factors[i]) == 1.0 else f"{abs(factors[i]):.4g} "
        sign = "" if not words and factors[i] > 0.0 else "− " if factors[i] < 0.0 else "+ "
        words.append(f"{sign}{size}{subscripted(f'x{i + 1}')}{prime}")
    return " ".join(words)


def _curve(
    law: ForceLaw, own: Sequence[MadeBend], extremes: Sequence[Array], *, si: bool
) -> LawCurve:
    places = [i for i, factor in enumerate(law.row) if factor]
    sign, symbol, rate = _turn(law), _symbol(law), int(law.quantity == "velocity")
    reached = None
    if len(places) == 1 and abs(law.row[places[0]]) == 1.0 and extremes:
        rows = np.array([each[2 * places[0] + rate] for each in extremes if len(each)])
        reached = (float(rows[:, 0].min()), float(rows[:, 1].max())) if len(rows) else None
    far = FAR * max([law.reach, *map(abs, reached or ())])
    corners = tuple(sorted(sign * corner for corner in law.corners))
    x = np.unique([*np.linspace(-far, far, POINTS), *corners])
    made = sign * law.offset + law.slope * x
    for side, place, change in own:
        made = made + side * change * np.maximum(side * x - place, 0.0)
    wanted = np.asarray(sign * law.force(sign * x))
    (metre, length), (newton, force) = (1.0, ""), (1.0, "")
    if si:
        metre, length = prefixed(far, "m")
        newton, force = prefixed(float(np.abs(wanted).max()), "N")
        symbol += f" [{length}{'/s' * rate}]"
    return LawCurve(
        law.name,
        symbol,
        force,
        x / metre,
        wanted / newton,
        made / newton,
        tuple(corner / metre for corner in corners),
        None if reached is None else (reached[0] / metre, reached[1] / metre),
    )
