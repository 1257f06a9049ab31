"""The settings of ngspice for a plan whose op-amps take time.

A design's own gate is passed with ideal op-amps. Above that fidelity the settings are others, and
are found on the nominal board.
"""

from __future__ import annotations

from dataclasses import replace

from designer.base.defaults import Fidelity
from designer.circuit.ensemble import Ensemble
from designer.spice import numerics_gate
from designer.spice.numerics_gate import LEVELS, GateResult, GateSubject
from designer.spice.pool import SpicePool
from designer.verdicts.verdict import StudyPlan


def gated(
    plan: StudyPlan, pool: SpicePool, fidelity: Fidelity, levels: int = LEVELS
) -> tuple[StudyPlan, tuple[GateResult, ...]]:
    """The plan with the settings of this fidelity, None where none passed; and each question's
    gate.

    levels : as of ``numerics_gate.check``.
    """
    reduction = Ensemble(plan.nominal()).reduction(0)
    subjects = [
        GateSubject(reduction, q.excitation, q.start, fidelity=fidelity) for q in plan.questions
    ]
    gates = tuple(numerics_gate.check(pool, subjects, levels))
    questions = tuple(
        replace(q, settings=gate.settings if gate.passed else None)
        for q, gate in zip(plan.questions, gates, strict=True)
    )
    return replace(plan, questions=questions), gates
