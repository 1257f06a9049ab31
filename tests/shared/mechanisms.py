"""Mechanisms that are written down for the independent integrator, in the package's own terms."""

from __future__ import annotations

import numpy as np

from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.clearance import Clearance, Side
from designer.model.mechanics import SecondOrderSystem
from tests.shared.event_integrator import GROUND, Array, Gap, Mechanism


def flow_of(system: Mechanism, omega: float | None = None) -> Flow:
    """The flow of a mechanism, at its own drive frequency or another."""
    w = system.omega if omega is None else omega
    n = len(system.masses)
    matrices = []
    for links in (system.dampers, system.springs):
        matrix = np.zeros((n + 1, n + 1))
        for a, b, value in links:
            matrix[[a, b], [a, b]] += value
            matrix[[a, b], [b, a]] -= value
        matrices.append(matrix[:n, :n])
    second = SecondOrderSystem(
        mass=np.array(system.masses),
        damping=matrices[0],
        stiffness=matrices[1],
        force=np.array(system.forces),
        clearances=tuple(_clearance(k, gap) for k, gap in enumerate(system.gaps)),
        constant=np.array(system.constants),
        base=system.base,
        fixed_stops=system.fixed_stops,
    )
    return Flow(second.piecewise_linear(w), Drive(w))


def _clearance(number: int, gap: Gap) -> Clearance:
    def side(springs: tuple[tuple[float, float], ...]) -> Side | None:
        if not springs:
            return None
        (first, stiffness), *further = springs
        deeper = tuple((place - first, k) for place, k in further)
        return Side(first, stiffness, deeper, gap.preload)

    other = None if gap.other == GROUND else gap.other
    return Clearance(
        chr(ord("A") + number), gap.mass, other, side(gap.upper), side(gap.lower), gap.damping
    )


def absolute(system: Mechanism, x: Array) -> Array:
    """(2n,) displacements, then velocities, of a state of the flow at a strobe. States are counted
    from a ground that moves, but not where the stops stay."""
    rate = 0.0 if system.fixed_stops else system.base * system.omega
    return np.concatenate([x[0::2], x[1::2] + rate])


CHAIN = Mechanism(
    masses=[1.0, 0.8, 1.2],
    springs=[(0, GROUND, 1.0), (1, 0, 1.5), (2, 1, 1.0), (2, GROUND, 0.7)],
    dampers=[(0, GROUND, 0.1), (1, 0, 0.1), (2, 1, 0.1), (2, GROUND, 0.1)],
    forces=[1.0, 0.0, -0.4],
    omega=0.7,
    gaps=[
        Gap(0, GROUND, upper=((0.5, 8.0),), lower=((0.7, 6.0),)),
        Gap(2, 1, upper=((0.1, 10.0),), damping=0.4),
    ],
)
"""Three masses, unequal stops on the first, a damped stop between the other two."""
