"""Whether a setting of ngspice passes the numerics gate.

As in ``spice.numerics_gate``: two step sizes and two methods must agree on n-p-q and on every
strobe within its bound, and with ideal op-amps on the exact circuit's response and wave.

Above ideal op-amps the n-p-q is the rung's own: whether it is the exact circuit's is what a trade
measures, not what it takes for granted. A run that does not converge gets no remedy: it is the
setting that is asked.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from designer.dynamics.orbit import OrbitStatus
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.read_orbit import Read
from designer.spice.simulator import SimulationFailed

Run = Read | SimulationFailed


def companions(settings: SolverSettings) -> tuple[SolverSettings, SolverSettings]:
    """What a setting is held against: half its step, and the other method at that."""
    half = replace(settings, max_step=settings.max_step / 2.0)
    return half, replace(half, method="gear")


def passed(subject: GateSubject, own: Run, beside: tuple[Run, Run]) -> bool:
    """Whether the run of a setting, which has its trace, and those of its ``companions`` agree.

    subject : on its rung.
    """
    read = [run for run in (own, *beside) if isinstance(run, Read)]
    if len(read) < 3 or isinstance(own, SimulationFailed):
        return False
    exact, found = subject.orbit, own.orbit
    if found.status not in (OrbitStatus.PERIODIC, OrbitStatus.APERIODIC):
        return False
    if len({run.orbit.response for run in read}) > 1:
        return False
    ideal = subject.rung == "ideal"
    if ideal and found.response != exact.response:
        return False
    if found.status is not OrbitStatus.PERIODIC:
        return True  # there is no strobe and no wave to compare
    extremes = exact.extremes if exact.status is OrbitStatus.PERIODIC else found.extremes
    peak = np.abs(extremes).max(axis=1)
    last = [run.strobes[-found.n :] for run in read]
    apart = max(
        float((np.abs(a - b) / peak).max()) for i, a in enumerate(last) for b in last[i + 1 :]
    )
    if apart > numerics_gate.BOUND:
        return False
    wave = numerics_gate.wave_error(subject, own) if ideal else 0.0
    return not math.isnan(wave) and wave <= numerics_gate.wave_bound(exact)
