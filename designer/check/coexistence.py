"""Which attractors coexist, and what share of the starts in a box of initial states each takes.

The states are drawn evenly from the box ± a few static deflections (``find_responses.scale_of``),
all at drive phase 0. That is the box whose planes ``basins`` shows. Start number i of a seed is the
same whatever number of starts is asked for (``samples``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from designer.base.arrays import Array
from designer.base.defaults import DRAWN_STARTS, SEED, check_count
from designer.base.proportion import wilson
from designer.dynamics.attractors import mirrored_strobes, same
from designer.dynamics.coexisting_attractors import outlived, settled
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import ANSWERS, Orbit, OrbitStatus
from designer.model.driven import model_flow
from designer.model.find_responses import ModelResponse, scale_of
from designer.model.mechanics import MechanicalModel, state_names
from designer.spread import random_streams

if TYPE_CHECKING:
    from designer.answers.shared_rows import ShareRow
    from designer.answers.simulate_answer import StartsRow

MOST_STARTS = 100_000
NEAR = 1e-6
"""Strobes of one orbit, from different starts, lie nearer than this, over the peak."""
ALIKE = 1e-3
"""Extremes of two orbits without an exact mirror that differ by less, over the peak, are alike or
mirror images."""


@dataclass(frozen=True)
class Basin:
    """An attractor, and how many starts end on it."""

    orbit: Orbit
    """The attractor; of two mirror twins the one that was met first."""
    count: int
    """Starts that end on it or on its twin."""
    twins: int | None
    """How many of these starts end on the twin; None where it is its own, where the model has no
    mirror, or where none is told apart (aperiodic motions are all one, as are quasi-periodic
    ones)."""


@dataclass(frozen=True)
class Coexistence:
    """Where the starts in a box end."""

    starts: int
    """How many starts were run."""
    wanted_starts: int
    """How many starts were wanted: more than ``starts`` where all of them would have taken
    more than ``step_budget.STARTS`` steps."""
    seed: int
    """Seed that the starts were drawn with."""
    box: Array
    """(states,) half-widths, of every state at drive phase 0, in model units."""
    basins: tuple[Basin, ...]
    """The known attractors first, then the others in the order of their first start."""
    not_settled: int
    """Starts that did not settle on an attractor."""

    def as_dict(self) -> StartsRow:
        """The attractors by the keys of the contract."""
        return {
            "count": self.starts,
            "asked": self.wanted_starts,
            "seed": self.seed,
            "phase": 0.0,
            "box": dict(zip(state_names(len(self.box) // 2), self.box.tolist(), strict=True)),
            "attractors": [
                {
                    "response": b.orbit.response,
                    "symmetric": b.orbit.symmetric,
                    "count": b.count,
                    "on_twin": b.twins,
                    # No extremes of one that has no period.
                    "x1_min": float(b.orbit.extremes[0, 0]) if b.orbit.n else None,
                    "x1_max": float(b.orbit.extremes[0, 1]) if b.orbit.n else None,
                    **self._share(b.count),
                }
                for b in self.basins
            ],
            "not_settled": {"count": self.not_settled, **self._share(self.not_settled)},
        }

    def _share(self, count: int) -> ShareRow:
        low, high = wilson(count, self.starts)
        return {"share": count / self.starts, "low": low, "high": high}


def check(starts: int) -> None:
    """Raises InputError for a number of starts that cannot be."""
    check_count("--starts", starts, 0, MOST_STARTS)


def random_starts(box: Array, count: int, seed: int) -> Array:
    """(count, states) initial states, even in the box ± ``box`` (states,)."""
    names = [f"start {name}" for name in state_names(len(box) // 2)]
    return np.asarray(box * (2.0 * random_streams.cube(seed, names, range(count)) - 1.0))


@lru_cache(maxsize=64)
def of_model(
    model: MechanicalModel,
    omega: float,
    starts: int = DRAWN_STARTS,
    seed: int = SEED,
    lives: tuple[int, ...] = (),
) -> Coexistence:
    """The attractors of the model under a drive of frequency ``omega``, by the exact flow; the
    largest share first. lives : as of ``of_flow``."""
    flow = model_flow(model, omega)
    result = of_flow(flow, scale_of(model, omega), starts, seed, lives=lives)
    return replace(result, basins=tuple(sorted(result.basins, key=lambda b: -b.count)))


def coexisting_with(model: MechanicalModel, response: ModelResponse) -> tuple[Basin, ...]:
    """The attractors that coexist with a response of the model, by ``DRAWN_STARTS`` starts: the
    largest share first, then those that only the search for the response came to.

    model : with the clearance of the response.
    """
    flow = model_flow(model, response.omega)
    lives = tuple(n for o in (response.orbit, *response.others) for n in o.transients)
    basins = of_model(model, response.omega, lives=lives).basins
    rest = [
        Basin(o, 0, None)
        for o in response.others
        if o.status in ANSWERS and not any(same(flow, o, b.orbit) for b in basins)
    ]
    return (*(b for b in basins if not same(flow, b.orbit, response.orbit)), *rest)


def of_flow(
    flow: Flow,
    box: Array,
    starts: int,
    seed: int,
    orbits: Sequence[Orbit] = (),
    unit: Array | None = None,
    *,
    even: bool = True,
    lives: Sequence[int] = (),
) -> Coexistence:
    """Where the starts end under a flow.

    box : (states,) half-widths in model units. orbits : attractors that are listed first, in this
    order. unit : (states,) size of a model unit in the states of a circuit, whose twins are those
    that look like mirror images; None for a model. even : of a circuit, whether its model has
    mirror twins. lives : of the chaos of other starts, which ended (``Orbit.transients``).
    """
    states = random_starts(box, starts, seed) * (1.0 if unit is None else unit)
    tally = _Tally(flow, orbits, alike=unit is not None and even)
    run, unsettled = tally.take(states, lives)
    return Coexistence(run, starts, seed, box, tally.basins(), unsettled)


# ---------------------------------------------------------------------------------------------


class _Tally:
    """Counts starts by the attractor that they end on."""

    def __init__(self, flow: Flow, orbits: Sequence[Orbit], *, alike: bool) -> None:
        self._flow = flow
        self._alike = alike and flow.system.mirror is None
        self._twins = self._alike or flow.system.mirror is not None
        self._orbits: list[Orbit] = []
        self._images: list[tuple[Array, Array]] = []
        self._counts: list[list[int]] = []
        for orbit in orbits:
            self._add(orbit)

    def take(self, states: Array, lives: Sequence[int]) -> tuple[int, int]:
        """Settle these starts while there are steps left; returns how many were run, and how many
        of them lead to no attractor. lives : of the chaos of others."""
        met, unsettled = settled(self._flow, states), 0
        new = all(orbit.status is not OrbitStatus.APERIODIC for orbit in self._orbits)
        for orbit in outlived(self._flow, met, measure=new, known=lives):
            if orbit.status not in ANSWERS:
                unsettled += 1
                continue
            place = self._place(orbit) or (self._add(orbit), 0)
            self._counts[place[0]][place[1]] += 1
        return len(met), unsettled

    def basins(self) -> tuple[Basin, ...]:
        """The basins in the order in which they were met."""
        rows = zip(self._orbits, self._counts, strict=True)
        return tuple(
            Basin(
                orbit,
                sum(counts),
                counts[1] if self._twins and orbit.symmetric is False else None,
            )
            for orbit, counts in rows
        )

    def _add(self, orbit: Orbit) -> int:
        laps = mirrored = np.zeros((0, self._flow.system.size))
        if orbit.n and len(orbit.start):
            mode = orbit.mode or None
            laps = self._flow.run(orbit.start, orbit.n, mode=mode).strobes[:-1]
            if self._flow.system.mirror is not None:
                mirrored = mirrored_strobes(self._flow, orbit)
        self._orbits.append(orbit)
        self._images.append((laps, mirrored))
        self._counts.append([0, 0])
        return len(self._orbits) - 1

    def _place(self, orbit: Orbit) -> tuple[int, int] | None:
        """Number of the attractor that this is, and whether it is the twin (1) or itself (0)."""
        for number, other in enumerate(self._orbits):
            named = other.counts.family == orbit.counts.family
            if orbit.status is not other.status or not named:
                continue
            if orbit.status is not OrbitStatus.PERIODIC:
                return number, 0
            for twin, images in enumerate(self._images[number]):
                if (np.abs(images - orbit.start) < NEAR * other.peaks).all(axis=1).any():
                    return number, twin
            if self._alike and alike(other, orbit, ALIKE, mirrored=True):
                return number, 1
        return None


def alike(a: Orbit, b: Orbit, within: float, *, mirrored: bool = False) -> bool:
    """Whether the extremes of two orbits differ by less than ``within`` of the first one's peaks.

    mirrored : take the mirror image of the second one.
    """
    other = -b.extremes[:, ::-1] if mirrored else b.extremes
    return bool((np.abs(a.extremes - other).max(axis=1) < within * a.peaks).all())
