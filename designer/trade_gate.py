"""Whether a setting of ngspice passes the numerics gate: by the runs beside it on the ladder.

As in ``designer.gate``, two step sizes and two methods must agree on n-p-q and on every strobe
within its bound, and with ideal op-amps on the exact circuit's response and wave. Here the second
step is that of the next finer setting, whose tolerance is tighter too (of the finest: the next
coarser), and the other method runs at the finer of the two.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from designer import gate
from designer.gate import Subject
from designer.ngspice import SimulationFailed
from designer.orbit import OrbitStatus
from designer.waveform_orbit import Read

Run = Read | SimulationFailed


def passed(subject: Subject, runs: Sequence[Run], gear: Sequence[Run]) -> tuple[bool, ...]:
    """For each setting, coarsest first; of a single setting nothing can be said.

    runs : trapezoidal, by setting. gear : by the other method, by setting from the second on.
    subject : on its rung.
    """
    last = len(runs) - 1
    if last < 1:
        return (False,) * len(runs)
    return tuple(
        _agree(subject, run, [run, runs[k + 1 if k < last else k - 1], gear[min(k, last - 1)]])
        for k, run in enumerate(runs)
    )


def _agree(subject: Subject, own: Run, runs: Sequence[Run]) -> bool:
    read = [run for run in runs if isinstance(run, Read)]
    if len(read) < len(runs) or isinstance(own, SimulationFailed):
        return False
    exact, ideal = subject.orbit, subject.rung == "ideal"
    first = own.orbit
    if len({r.orbit.response for r in read}) > 1 or first.status not in (
        OrbitStatus.PERIODIC,
        OrbitStatus.APERIODIC,
    ):
        return False
    if ideal and first.response != exact.response:
        return False
    if first.status is not OrbitStatus.PERIODIC:
        return True  # there is no strobe to compare
    peak = np.abs(first.extremes).max(axis=1)
    last = [r.strobes[-first.n :] for r in read]
    apart = max(
        float((np.abs(a - b) / peak).max()) for i, a in enumerate(last) for b in last[i + 1 :]
    )
    wave = gate.wave_error(subject, own) if ideal else 0.0
    return apart <= gate.BOUND and not math.isnan(wave) and wave <= gate.wave_bound(exact)
