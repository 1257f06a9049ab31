"""The bifurcation diagram a little way around the present ω, on the branch that is shown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from designer.bifurcations.sweep import next_start
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import SteadyMotion, TransientSettings
from designer.explorer.place import OMEGA, ModelPlace
from designer.explorer.wire import Message, columns
from designer.model.mechanics import frequency_range
from designer.model.swept_model import ModelSubject

WIDTH = 0.15
"""Half the width of the strip over the present ω."""
STEPS = 60
"""Steps on each side."""
TOGETHER = 3
"""Steps of a piece: at most some tens of milliseconds, after which a newer place may come first."""
COURSE = TransientSettings(settle=80, keep=10, patience=0)
"""Drive periods of a step: what is not settled by then is drawn as it is."""
PERIODS = COURSE.settle + COURSE.keep
"""Drive periods within which a step has to settle. To be called aperiodic a motion is followed much
longer: in the strip chaos is a motion that has not settled."""
CHAOS, OPEN = 0, -1
"""In place of a period: a motion without one, and one that is not known."""


def strip(place: ModelPlace, start: np.ndarray) -> Iterator[Message]:
    """Pieces of the diagram, to both sides in turn, each following the attractor outwards.

    start : (states,) a strobe of the orbit at the place. Each piece has ω, the least displacement
    in the first clearance in each drive period, and the period (0: none, -1: not known).
    """
    subject = ModelSubject(place.model, place.omega)
    least, most = frequency_range(place.model)
    ways = [place.omega * (1.0 + side * WIDTH * np.arange(STEPS + 1) / STEPS) for side in (1, -1)]
    starts = [start, start]
    for first in range(0, STEPS + 1, TOGETHER):
        for side, way in enumerate(ways):
            omegas = [float(w) for w in way[first : first + TOGETHER] if least <= w <= most]
            steps = []
            for setting in subject.settings([{OMEGA: w} for w in omegas]):
                steps.append(setting.steady(starts[side], COURSE))
                starts[side] = next_start(steps[-1], subject.weights)
            yield piece(omegas, steps)


def piece(omegas: Sequence[float], steps: Sequence[SteadyMotion]) -> Message:
    """Some steps of the diagram, as ``strip`` yields them."""
    counts = [len(step.minima) for step in steps]
    points = {
        "omega": np.repeat(omegas, counts),
        "x": np.concatenate([np.zeros(0), *(step.minima for step in steps)]),
        "period": np.repeat([_period(step) for step in steps], counts),
    }
    return {"kind": "strip", "data": columns(points)}


def _period(step: SteadyMotion) -> int:
    if step.status is OrbitStatus.PERIODIC:
        return step.n
    return CHAOS if step.status is OrbitStatus.APERIODIC else OPEN
