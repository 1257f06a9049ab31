"""What the page shows of one place: the attractor, drawn, and its figures in words."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.si_unit import prefixed
from designer.check.curved_laws import law_misfits
from designer.dynamics.attractors import ENGINE_ERROR, settle
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.step_budget import Budget
from designer.explorer.place import SHOWN, ModelPlace, start_text, words_of
from designer.explorer.wire import Message, columns
from designer.model.driven import model_flow
from designer.model.mechanics import SecondOrderSystem
from designer.model.relative_motion import (
    RelativeMotion,
    mass_motion,
    relative_motions,
    state_labels,
)

STEPS = 4_000_000
"""Steps that one picture may take, a fifth of ``step_budget.SETTLING``: under a second."""
LISTED = 4
"""Impacts on a stop whose velocities are written one by one; of more the least and the greatest."""


RADIUS, EXPONENT = "largest |μ|", "λ max"
IN_SIGHT = (RADIUS, EXPONENT)
"""Figures that stay in sight beside the response on a page too narrow for all of them."""


@dataclass(frozen=True)
class Detail:
    """How finely a motion is drawn."""

    points: int = 2048
    """Points of a whole trace."""
    fewest: int = 96
    """The fewest of them in a drive period."""
    most: int = 768
    """The most of them in a drive period."""
    long: int = 24
    """Drive periods that are drawn of a motion without a period."""
    strobes: int = 160
    """Strobes that are drawn of such a motion."""


DETAIL = Detail()
"""The detail of a page whose pictures come one by one."""
Pack = Callable[[Mapping[str, ArrayLike]], Message]
"""Makes columns of numbers ready for a page."""


@dataclass(frozen=True)
class ShownMotion:
    """A displacement that can be drawn: that in a clearance, or that of a mass."""

    motion: RelativeMotion
    """Its row and its stops."""
    clearance: int | None
    """Index of the clearance; None of a mass."""

    @property
    def label(self) -> str:
        """What the list of displacements calls it."""
        return self.motion.label


def shown_motions(system: SecondOrderSystem) -> tuple[ShownMotion, ...]:
    """The motions in the clearances in their order, then the absolute ones of all masses."""
    gaps = [
        ShownMotion(motion, k if system.clearances else None)
        for k, motion in enumerate(relative_motions(system))
    ]
    rows = [each.motion.row.tolist() for each in gaps if not system.ground_moves]
    masses = [
        ShownMotion(mass_motion(system, mass), None)
        for mass in range(system.size)
        if np.eye(system.size)[mass].tolist() not in rows
    ]
    return (*gaps, *masses)


@dataclass(frozen=True)
class ResponseView:
    """The attractor at a place, with what is drawn of it."""

    place: ModelPlace
    orbit: Orbit
    """The attractor that its start leads to."""
    motion: ShownMotion
    """What is drawn."""
    time: Array
    """(k,) drive periods since the start of what is drawn."""
    displacement: Array
    """(k,) displacement that is drawn."""
    velocity: Array
    """(k,) its velocity."""
    strobes: Array
    """(j, 2) displacement and velocity at drive phase 0."""
    impacts: Array
    """(i, 3) of the impacts in the clearance that is drawn: drive periods, displacement,
    velocity."""

    def message(self) -> Message:
        """What the page draws and writes."""
        return {
            "kind": "view",
            "words": words_of(self.place),
            "start": start_text(tuple(self.orbit.start.tolist())),
            "response": self.orbit.response,
            "period": self.orbit.n,
            "summary": summary(self.orbit),
            "facts": facts(self.orbit, self.place),
            **self.picture(columns),
        }

    def picture(self, pack: Pack) -> Message:
        """What of it depends on the displacement that is drawn."""
        t, x, v = self.impacts.T
        return {
            "axes": {"x": self.motion.motion.symbol, "v": self.motion.motion.rate},
            "stops": list(self.motion.motion.gaps),
            "data": {
                "trace": pack({"t": self.time, "x": self.displacement, "v": self.velocity}),
                "strobes": pack({"x": self.strobes[:, 0], "v": self.strobes[:, 1]}),
                "impacts": pack({"t": t, "x": x, "v": v}),
            },
        }


def respond(place: ModelPlace) -> ResponseView:
    """The attractor that the start of a place leads to.

    Raises
    ------
    InputError : there is no such displacement to be shown.
    """
    system = place.model.second_order()
    motions = shown_motions(system)
    if place.shown >= len(motions):
        raise InputError(None, SHOWN, place.shown, f"a whole number from 0 to {len(motions) - 1}")
    return view_of(place, *reached(place), motions[place.shown])


def reached(place: ModelPlace) -> tuple[Flow, Orbit]:
    """The flow of a place, and the attractor that its start leads to."""
    flow = model_flow(place.model, place.omega)
    return flow, settle(flow, place.state, budget=Budget(STEPS))


def view_of(
    place: ModelPlace, flow: Flow, orbit: Orbit, shown: ShownMotion, detail: Detail = DETAIL
) -> ResponseView:
    """What is drawn of an orbit that is known."""
    periods = max(orbit.n, 2) if orbit.n else detail.long
    points = int(np.clip(detail.points // periods, detail.fewest, detail.most))
    time, states = _trace(flow, orbit, periods, points)
    drawn = shown.motion.of(time * flow.drive.period, states, place.omega)
    laps = orbit.n or detail.strobes
    at, where = _trace(flow, orbit, laps, 1)
    strobes = shown.motion.of(at * flow.drive.period, where, place.omega)[: max(laps, 1)]
    impacts = _impacts(flow, orbit, shown)
    return ResponseView(place, orbit, shown, time, drawn[:, 0], drawn[:, 1], strobes, impacts)


def _trace(flow: Flow, orbit: Orbit, periods: int, points: int) -> tuple[Array, Array]:
    """Drive periods (k,) and states (k, states) from the orbit's start; empty where it has none."""
    if not len(orbit.start):
        return np.zeros(0), np.zeros((0, flow.system.size))
    with flow.within(Budget(STEPS)):
        run = flow.run(orbit.start, periods, mode=orbit.mode or None, points=points)
    if run.status is not FlowStatus.DONE:
        return np.zeros(0), np.zeros((0, flow.system.size))
    return np.arange(len(run.strobes)) / points, run.strobes


def _impacts(flow: Flow, orbit: Orbit, shown: ShownMotion) -> Array:
    """The impacts of one clearance over n periods; none of a motion without a period."""
    here = orbit.impact_clearances == shown.clearance
    places = dict(shown.motion.stops)
    sides = [places.get(int(side), np.nan) for side in orbit.impact_sides[here]]
    times = orbit.impact_times[here] / flow.drive.period
    return np.stack([times, np.array(sides), orbit.impact_velocities[here]], axis=1)


def summary(orbit: Orbit) -> str:
    """The response in words, for the head of the page and for who listens to it."""
    if orbit.status is not OrbitStatus.PERIODIC:
        return f"{orbit.response}: {orbit.reason}" if orbit.reason else orbit.response
    words = {True: "symmetric", False: "asymmetric", None: "symmetry not known"}
    return f"{orbit.response}, {words[orbit.symmetric]}"


def facts(orbit: Orbit, place: ModelPlace) -> list[tuple[str, str]]:
    """Figures of an orbit, each with its name."""
    rows = [("response", orbit.response)]
    if orbit.n:
        symmetric = {True: "yes", False: "no", None: "not known"}[orbit.symmetric]
        rows += [("period", f"{orbit.n} of the drive"), ("symmetric", symmetric)]
        rows.append(("multipliers", multipliers_text(orbit.multipliers)))
        rows.append((RADIUS, f"{orbit.radius:.4g}"))
    per_second = " 1/s" if place.in_si and np.isfinite(orbit.lyapunov) else ""
    rows.append((EXPONENT, f"{exponent_text(orbit)}{per_second}"))
    if len(orbit.extremes):
        names = state_labels(place.model.second_order())[0::2]
        for name, (low, high) in zip(names, orbit.extremes[0::2], strict=True):
            rows.append((name, _in_one_unit([low, high], "m", place, 4, " to ")))
    if orbit.n:
        rows += _impact_rows(orbit, place)
    if np.isfinite(orbit.penetration):
        rows.append(("shallowest contact", _in_one_unit([orbit.penetration], "m", place, 3)))
    if np.isfinite(orbit.miss):
        rows.append(("nearest miss", _in_one_unit([orbit.miss], "m", place, 3)))
    flow = model_flow(place.model, place.omega)
    for misfit in law_misfits(place.model, flow, orbit, np.ones(flow.system.size)):
        rows.append(("curved law", misfit.text(orbit.response, in_si=place.in_si)))
    return rows


def _impact_rows(orbit: Orbit, place: ModelPlace) -> Iterator[tuple[str, str]]:
    """How many impacts each stop has in the orbit's period, and with what velocities."""
    system = place.model.second_order()
    for k, motion in enumerate(relative_motions(system)):
        of = f" of {system.clearances[k].name}" if len(system.clearances) > 1 else ""
        for side, _, velocities in motion.impacts(orbit):
            name = f"{'upper' if side > 0 else 'lower'} stop{of}"
            yield name, _impacts_text(motion.rate, np.sort(velocities), place)


def _impacts_text(rate: str, velocities: Array, place: ModelPlace) -> str:
    count = len(velocities)
    if not count:
        return "no impact"
    few = count <= LISTED
    listed, between = (velocities, ", ") if few else (velocities[[0, -1]], " to ")
    words = "1 impact" if count == 1 else f"{count} impacts"
    return f"{words}, {rate}\u00a0=\u00a0{_in_one_unit(listed, 'm/s', place, 3, between)}"


def _in_one_unit(
    values: Sequence[float] | Array, unit: str, place: ModelPlace, digits: int, between: str = ""
) -> str:
    """Values in one unit, which suits the largest of them."""
    factor, name = 1.0, ""
    if place.in_si:
        factor, name = prefixed(max(abs(float(value)) for value in values), unit)
    return f"{between.join(f'{value / factor:.{digits}g}' for value in values)} {name}".rstrip()


def multipliers_text(multipliers: Sequence[complex] | np.ndarray) -> str:
    """Floquet multipliers, the largest first; a conjugate pair once, with ±."""
    upper = [
        mu for mu in sorted(multipliers, key=lambda mu: (-abs(mu), -mu.imag)) if mu.imag >= 0.0
    ]
    return ", ".join(_multiplier(complex(mu)) for mu in upper) or "none"


def _multiplier(mu: complex) -> str:
    if abs(mu.imag) <= ENGINE_ERROR * abs(mu):
        return f"{mu.real:.3g}"
    return f"{mu.real:.3g} ± {mu.imag:.3g}i"


def exponent_text(orbit: Orbit) -> str:
    """The largest Lyapunov exponent, with its error where it was measured."""
    if not np.isfinite(orbit.lyapunov):
        return "not known"
    error = orbit.lyapunov_error
    return f"{orbit.lyapunov:.3g}" + (f" ± {error:.1g}" if np.isfinite(error) else "")
