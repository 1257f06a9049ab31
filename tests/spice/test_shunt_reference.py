"""The shunt reference in ngspice: voltage, impedance, and what it does when fed too little."""

from __future__ import annotations

import numpy as np
import pytest

from designer.base.defaults import Fidelity
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Excitation, Reference
from designer.spice import deck
from designer.spice.batch_backend import BatchNgspice
from designer.spice.deck import SHUNT_REFERENCE, SolverSettings, shunt_reference
from tests.shared.stages import rectifier, stage

ENTRY = load_catalog().reference("LM4040C50")


def voltages(currents: list[float], volts: float = ENTRY.voltage) -> list[float]:
    """Voltage [V] at each current [A]."""
    reference = Reference(
        "VR1", "k", "0", volts, 0.001, ENTRY.name, "",
        ENTRY.least_current, ENTRY.dynamic_impedance,
    )  # fmt: skip
    found = []
    for current in currents:
        text = [
            "* title: a reference", f"I1 0 k {current!r}",
            shunt_reference(reference, volts),
            *SHUNT_REFERENCE, ".options reltol=1e-9 vntol=1e-9", ".op", ".end", "",
        ]  # fmt: skip
        found.append(float(BatchNgspice().analyse("\n".join(text))[-1].vectors["k"][0]))
    return found


def test_the_voltage_and_the_dynamic_impedance() -> None:
    """Within its range of current: 5 V, rising by the impedance of the catalogue."""
    low, one, more, most = voltages([100e-6, 1e-3, 2e-3, 15e-3])
    assert low == pytest.approx(5.0, abs=1e-4)
    assert more - one == pytest.approx(1e-3 * ENTRY.impedance.nominal, rel=0.01)  # type: ignore[union-attr]
    assert 5.0 < one < more < most < 5.0 * 1.005


def test_fed_too_little_it_does_not_reach_its_voltage() -> None:
    least = ENTRY.current.min
    assert least is not None
    assert voltages([least / 2])[0] == pytest.approx(2.5, rel=1e-3)
    assert voltages([least * 1.1])[0] == pytest.approx(5.0, rel=1e-3)


def test_another_sample_another_voltage() -> None:
    assert voltages([1e-3], 4.98)[0] == pytest.approx(4.9805, abs=1e-4)


@pytest.mark.parametrize("fidelity", ["dynamic", "full"])
def test_a_feed_that_is_too_large_shows_on_the_board(fidelity: Fidelity) -> None:
    """Of a rectifier whose feeds cannot carry the load, the references sag; a source would not."""
    for feed, wanted in ((2.2e3, 5.0), (100e3, None)):
        circuit = stage("rectifier", "both", {**rectifier(), "R206": feed, "R207": feed})
        text = deck.write(
            circuit, nominal_board(circuit), Excitation(400.0, 0.0), SolverSettings("trap", 1e-6),
            title="feeds", stop_time=1e-4, fidelity=fidelity,
        ).replace(".save ", ".save v(vrp) v(vrn) ")  # fmt: skip
        waves = BatchNgspice().run(text, ("vrp", "vrn"), 1e-4)
        for net, sign in (("vrp", 1.0), ("vrn", -1.0)):
            volts = sign * waves.signals[net][-1]
            if wanted is None:
                assert volts < 3.0
            else:
                assert volts == pytest.approx(wanted, abs=5e-3)
    assert np.isfinite(waves.axis).all()
