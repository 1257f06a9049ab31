"""The exponent that ngspice finds by pairs of runs, against that of the exact tangent flow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from designer.check import checked_design
from designer.check.synthesis_result import synthesise
from designer.circuit.nominal import nominal_reduction
from designer.dynamics.attractors import with_exponent
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.model.model_file import read_model_file
from designer.spice import twin_runs
from designer.spice.pool import SpicePool

CHAOS = Path(__file__).parents[2] / "examples" / "two-wells-chaos.toml"


@pytest.mark.slow
def test_ngspice_has_the_exponent_of_the_exact_circuit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two ways that share nothing: a tangent vector of the reduction, whose exponent is known to
    1 %, and runs that part, known to some 10 % with so few of them."""
    monkeypatch.setattr(twin_runs, "PAIRS", 12)
    synthesis = synthesise(read_model_file(CHAOS))
    with SpicePool(2) as pool:
        (checked,) = checked_design.check(synthesis.design, synthesis.model_responses, pool)
    reduction = nominal_reduction(synthesis.design)
    flow = Flow(reduction.system(), checked.excitation.drive)
    exact, ngspice = with_exponent(flow, checked.circuit), checked.ngspice
    assert ngspice is not None
    assert exact.status is ngspice.status is OrbitStatus.APERIODIC
    assert checked.agrees
    error = np.hypot(exact.lyapunov_error, ngspice.lyapunov_error)
    assert ngspice.lyapunov_error < 0.25 * ngspice.lyapunov
    assert abs(exact.lyapunov - ngspice.lyapunov) < 4.0 * error
    assert set(checked.exponents) == {"model", "circuit", "ngspice"}
