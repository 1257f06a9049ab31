"""The nominal board of a design: its reduction, its flows and its responses."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.circuit.board_values import nominal_board
from designer.circuit.design import Design
from designer.circuit.netlist import Circuit
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.drive_shape import Shape, wave
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import WITHOUT_PERIOD, Orbit
from designer.dynamics.piecewise_linear import Drive, PiecewiseLinearSystem
from designer.model.driven import model_flow
from designer.model.find_responses import ModelResponse


def on_circuit(system: PiecewiseLinearSystem, design: Design, response: ModelResponse) -> Orbit:
    """The orbit that the exact circuit reaches from the model's own, in volts and seconds."""
    flow = circuit_flow(system, design, response)
    start = response.orbit.start * design.volts(response.b)
    if system is nominal_reduction(design).system():
        return _settled(design.circuit, flow.drive, start.tobytes())
    return settle(flow, start)


@lru_cache(maxsize=32)
def _settled(circuit: Circuit, drive: Drive, start: bytes) -> Orbit:
    """Of the nominal board. The choice, the check, the deck and the design rules all ask for it."""
    return settle(Flow(_reduction(circuit).system(), drive), np.frombuffer(start))


def circuit_flow(system: PiecewiseLinearSystem, design: Design, response: ModelResponse) -> Flow:
    """The flow of a reduced board under the generator's setting for this response."""
    return Flow(system, design.excitation(response.b, response.omega).drive)


TRACE_POINTS = 1024
"""Points of a drawn orbit per drive period."""
KNOTS = 4 * TRACE_POINTS
"""Exact states per drive period that the states between them are interpolated from."""
MOST_LAPS = 100_000
"""Drive periods that a motion without a period is followed for at most."""


SHOWN_PERIODS = 30
"""Drive periods of a trace of a response without a period."""
RECORD_PERIODS, RECORD_POINTS = 2048, 64
"""Drive periods of a record of one, and points in each of them."""


@dataclass(frozen=True)
class Trace:
    """One engine's orbit over its n periods in model units."""

    time: Array
    """(k,) times."""
    states: Array
    """(k, states) states."""


@dataclass(frozen=True)
class UnitFlow:
    """What makes a flow, whose times and states are told in model units."""

    make: Callable[[], Flow]
    """The flow of the model, or of a board."""
    volts: Array
    """(states,) a model's unit in units of the flow."""
    seconds: float
    """The same of time."""
    ground: Shape = ()
    """How the ground moves, in model units; () where it rests."""

    def ground_at(self, times: Array, omega: float) -> Array:
        """(k,) displacement of the ground at times (k,), in model units."""
        return wave(self.ground, times * omega)

    def states_at(self, orbit: Orbit, times: Array) -> Array:
        """(k, states) of an orbit in model units at times (k,) >= 0, drive phase 0 at time 0: exact
        at ``KNOTS`` times a period, and between these by a cubic spline.

        Raises
        ------
        InputError : a time past ``MOST_LAPS`` periods of a motion that has no period, or one that
            the motion does not reach.
        """
        from scipy.interpolate import CubicSpline

        flow = self.make()
        phases = times * (self.seconds / flow.drive.period)
        phases = phases % orbit.n if orbit.n else phases
        if phases.max() > MOST_LAPS:
            latest = MOST_LAPS * flow.drive.period / self.seconds
            raise InputError(None, "times", float(times.max()), f"times up to {latest:g}")
        laps, states = np.floor(phases).astype(int), np.empty((len(times), flow.system.size))
        x, mode, at = orbit.start * self.volts, orbit.mode or None, 0
        knots = np.arange(KNOTS + 1) / KNOTS
        for lap in np.unique(laps):
            for periods, points in ((int(lap) - at, 1), (1, KNOTS)):
                if not periods:
                    continue
                run = flow.run(x, periods, mode=mode, points=points)
                if run.status is not FlowStatus.DONE:
                    expected = f"times before the motion ends, in period {at + 1}"
                    raise InputError(None, "times", float(times.max()), expected)
                x, mode, at = run.strobes[-1], run.mode, at + periods
            here = laps == lap
            states[here] = CubicSpline(knots, run.strobes)(phases[here] - lap)
        return states / self.volts


def nominal_reduction(design: Design) -> Reduction:
    """The nominal board's exact reduction, with the op-amps' finite gain and bias; the last ones
    are kept."""
    return _reduction(design.circuit)


@lru_cache(maxsize=4)
def _reduction(circuit: Circuit) -> Reduction:
    return Reduction(circuit, nominal_board(circuit))


def board_flow(design: Design, response: ModelResponse) -> Flow:
    """The flow of the nominal board at a response."""
    return circuit_flow(nominal_reduction(design).system(), design, response)


def response_flow(design: Design, response: ModelResponse) -> Flow:
    """The flow of the model at a response."""
    return model_flow(design.model.at(response.b), response.omega)


def trace_of(flow: Flow, orbit: Orbit, volts: Array, seconds: float) -> Trace:
    """An orbit over its n periods in model units; from rest where it has no start."""
    return _trace(flow, orbit, volts, seconds, shown_periods(orbit), TRACE_POINTS)


def shown_periods(orbit: Orbit) -> int:
    """Drive periods of an orbit's trace."""
    return orbit.n or SHOWN_PERIODS


def traces_of(
    flow: Flow, orbits: Iterable[Orbit | None], volts: Array, seconds: float
) -> tuple[Trace, ...]:
    """Traces of orbits; none of what has no start."""
    return tuple(
        trace_of(flow, orbit, volts, seconds)
        for orbit in orbits
        if orbit is not None and len(orbit.start)
    )


def record_of(flow: Flow, orbit: Orbit, volts: Array, seconds: float) -> Trace | None:
    """A motion without a period over ``RECORD_PERIODS``, for its section and its spectrum; None of
    any other."""
    if orbit.status not in WITHOUT_PERIOD or not len(orbit.start):
        return None
    return _trace(flow, orbit, volts, seconds, RECORD_PERIODS, RECORD_POINTS)


def _trace(
    flow: Flow, orbit: Orbit, volts: Array, seconds: float, periods: int, points: int
) -> Trace:
    start = orbit.start if len(orbit.start) else np.zeros(flow.system.size)
    run = flow.run(start, periods, mode=orbit.mode or None, points=points)
    time = np.arange(len(run.strobes)) * flow.drive.period / points
    return Trace(time / seconds, run.strobes / volts)
