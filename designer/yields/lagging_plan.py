"""A study of boards whose op-amps lag by their gain-bandwidth (``--rung bandwidth``)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from designer.base.errors import InputError
from designer.circuit.ensemble import Ensemble
from designer.dynamics.orbit import OrbitStatus
from designer.spice.pool import SpicePool
from designer.verdicts.rung_gate import gated
from designer.verdicts.verdict import StudyPlan


def lagging_plan(
    plan: StudyPlan, pool: SpicePool | None
) -> tuple[StudyPlan, tuple[int, ...], dict[int, str]]:
    """The plan of the same boards with bandwidth, which of its questions are left in order, and
    why the others are not.

    Each question starts on the nominal orbit of the circuit with bandwidth. pool : of ngspice,
    which must pass the gate with op-amps that lag too; without one it is not asked.

    Raises
    ------
    InputError : the circuit's op-amp has no gain-bandwidth.
    """
    if plan.circuit.figures is None:
        expected = "a circuit whose op-amp has figures in the catalogue"
        raise InputError(None, "--rung", "bandwidth", expected)
    plan = replace(plan, bandwidth=True)
    if not plan.questions:
        return plan, (), {}
    orbits = Ensemble(plan.nominal()).settle(
        [0] * len(plan.questions),
        [q.excitation.drive for q in plan.questions],
        np.array([q.start.start for q in plan.questions]),
    )
    left = tuple(k for k, o in enumerate(orbits) if o.status is OrbitStatus.PERIODIC)
    why = {
        k: f"the nominal circuit with bandwidth is {orbit.response}"
        for k, orbit in enumerate(orbits)
        if k not in left
    }
    questions = tuple(replace(plan.questions[k], start=orbits[k], settings=None) for k in left)
    plan = replace(plan, questions=questions)
    if pool is not None and questions:
        plan, _ = gated(plan, pool, plan.rung)
    return plan, left, why
