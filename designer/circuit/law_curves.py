"""Force laws of a model, as it asks for them and as the nominal board makes them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.base.si_unit import prefixed
from designer.circuit.board_values import nominal_board
from designer.circuit.dead_zone_reading import DeadZoneReading
from designer.circuit.design import Design
from designer.circuit.reduction import Reduction
from designer.model.clearance import Clearance
from designer.model.force_law import ForceLaw
from designer.model.relative_motion import subscripted

FAR = 1.25
"""Of the furthest corner, or of the furthest motion: how far a curve is drawn."""
POINTS = 401
"""Of a curve."""


@dataclass(frozen=True)
class LawCurve:
    """The force that one law puts on its mass, over what it depends on."""

    name: str
    """Of the law."""
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
    system = design.model.second_order()
    bends = dict(_made_bends(design))
    return tuple(_curve(law, bends, extremes, si=si) for law in system.laws)


def _made_bends(design: Design) -> Iterator[tuple[str, list[tuple[Clearance, int, float, float]]]]:
    """By law: the dead zone, the side, its place and its change of the slope as the board has
    them, in model units."""
    system, scales = design.model.second_order(), design.errors.scales
    reduction = Reduction(design.circuit, nominal_board(design.circuit, ideal=True))
    found: dict[str, list[tuple[Clearance, int, float, float]]] = {}
    for k, zone in enumerate(system.dead_zones):
        if not zone.bend_of:
            continue
        reading, state, row = (
            DeadZoneReading.of(reduction, k, zone),
            zone.watched,
            2 * zone.mass + 1,
        )
        unit = scales.seconds * scales.volts[state] / scales.volts[row] * system.mass[zone.mass]
        for side, volts in reading.thresholds.items():
            slope = reading.slopes.get(side, reading.slopes.get(0))
            assert slope is not None
            place = volts / float(scales.volts[state])
            change = -float(slope[row, state] * unit)
            found.setdefault(zone.bend_of, []).append((zone, side, place, change))
    yield from found.items()


def _curve(
    law: ForceLaw,
    bends: dict[str, list[tuple[Clearance, int, float, float]]],
    extremes: list[Array],
    *,
    si: bool,
) -> LawCurve:
    own = bends.get(law.name, [])
    places = [i for i, factor in enumerate(law.row) if factor]
    # A law of one mass seen from the ground's side is drawn over the mass's own displacement.
    sign = law.row[places[0]] if len(places) == 1 else 1.0
    prime, rate = ("′", 1) if law.quantity == "velocity" else ("", 0)
    ordered = sorted(places, key=lambda i: -law.row[i]) if len(places) > 1 else places
    symbol = " − ".join(subscripted(f"x{i + 1}") + prime for i in ordered)
    reached = None
    if len(places) == 1 and extremes:
        rows = np.array([each[2 * places[0] + rate] for each in extremes if len(each)])
        reached = (float(rows[:, 0].min()), float(rows[:, 1].max())) if len(rows) else None
    far = FAR * max([law.reach, *map(abs, reached or ())])
    corners = tuple(sorted(sign * corner for corner in law.corners))
    x = np.unique([*np.linspace(-far, far, POINTS), *corners])
    made = sign * law.offset + law.slope * x
    for _, side, place, change in own:
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
