"""The one statement of how far an output reaches, against ngspice's op-amp in its own load."""

from __future__ import annotations

import re

import numpy as np
import pytest

from designer.catalog.output_stage import output_at
from designer.catalog.parts_catalog import load_catalog
from designer.circuit import build
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit, Excitation
from designer.model.model import Dimensionless
from designer.spice import deck
from designer.spice.batch_backend import BatchNgspice
from designer.spice.deck import SolverSettings
from designer.spice.opamp_check import OpAmpBench
from tests.circuit.test_reduction import EXACT

CATALOG = load_catalog()
MODEL = Dimensionless(0.5, 0.5, 0.95, 0.5, 0.1, 0.0, 0.25)


def circuit_of(opamp: str, stated: float | None, feedback: float) -> Circuit:
    """Fig. 5 with this R203, which is most of U3C's load."""
    values = EXACT | {"R202": feedback / 2.0, "R203": feedback}
    return build.circuit_of(MODEL, values, CATALOG.opamp(opamp), supply=15.0, saturation=stated)


def swept(circuit: Circuit, top: float) -> tuple[np.ndarray, np.ndarray]:
    """v1 and v(w2) of the stage alone in ngspice on ``full``, v1 swept up to ``top``."""
    board = nominal_board(circuit)
    text = deck.write(
        circuit, board, Excitation(400.0, 0.0), SolverSettings("trap", 1e-5), title="t",
        stop_time=1e-3, fidelity="full",
    )  # fmt: skip
    stage = re.compile(r"(R20\d|R210|XU3|VCC|VEE) ?")
    model = text[text.index(".subckt opamp") : text.index(".ends opamp") + len(".ends opamp")]
    lines = [line for line in text.splitlines() if stage.match(line)]
    lines = ["* stage", *lines, model, "VX v1 0 0", f".dc VX 0 {top!r} {top / 400!r}",
             ".options reltol=1e-6 vntol=1e-10 abstol=1e-15", ".end"]  # fmt: skip
    plot = BatchNgspice().analyse("\n".join(lines) + "\n")[-1].vectors
    return plot["v1"], plot["w2"]


@pytest.mark.parametrize("feedback", [5e3, 27.4e3, 620e3])
@pytest.mark.parametrize(
    ("opamp", "stated"), [("TL074C", 13.0), ("TL074C", None), ("OPA4192", None)]
)
def test_an_output_reaches_what_the_circuit_says(
    opamp: str, stated: float | None, feedback: float
) -> None:
    """Swept through the threshold, U3C follows v1 to the limit of the exact circuit and stays, each
    within 0.1 %."""
    circuit = circuit_of(opamp, stated, feedback)
    limit, gain = circuit.output_limits()["U3C"], 2.0 * EXACT["R201"] / EXACT["R200"]
    v1, w2 = swept(circuit, 1.1 * limit / gain)
    assert w2.max() == pytest.approx(limit, rel=1e-3)
    free = v1 < 0.999 * limit / gain
    np.testing.assert_allclose(w2[free], gain * v1[free], rtol=1e-3, atol=0.01)
    if stated is not None:
        assert limit == stated
        return
    light, heavy = CATALOG.opamp(opamp).saturation.nominal, circuit.output_loads()["U3C"]
    assert (limit > light) == (heavy > 10e3)


@pytest.mark.parametrize("load", [3e3, 50e3])
@pytest.mark.parametrize("name", [o.name for o in CATALOG.opamps])
def test_the_limit_by_the_load_is_ngspice_s(name: str, load: float) -> None:
    opamp = CATALOG.opamp(name)
    low, high = OpAmpBench.of(opamp, "full").swing(load)
    wanted = output_at(opamp, opamp.rated_supply).limit_into(load)
    short = opamp.output_current.nominal * load
    if wanted < 0.95 * short:  # beyond, the current limit is the bound
        assert (-low, high) == pytest.approx((wanted, wanted), rel=1e-3)
    else:
        assert high <= wanted * (1.0 + 1e-3)
