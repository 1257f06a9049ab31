"""The diode's curve against its data-sheet figures, alone and in ngspice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.base.errors import InputError
from designer.catalog.diode_curve import card, diode_model
from designer.catalog.fields import Figure
from designer.catalog.netlist_guard import check_netlist
from designer.catalog.parts_catalog import load_catalog
from designer.spice.batch_backend import BatchNgspice
from designer.spice.worker import open_simulator

DIODE = load_catalog().diode("1N4148")


def figure(**values: float) -> Figure:
    return Figure(values.get("min"), values.get("typ"), values.get("max"), "a test")


def test_the_1n4148_keeps_inside_its_sheet() -> None:
    model = diode_model(DIODE)
    assert model.assumed, "the sheet has a maximum alone"
    assert 0.6 < model.forward(10e-3) < 1.0
    assert model.saturation_current < 25e-9
    assert 0.5 < model.drop < 0.7
    assert model.drop == model.forward(1e-3)
    assert (model.capacitance, model.reverse_voltage) == (4e-12, 100.0)


@pytest.mark.parametrize("volts", [0.25, 0.35, 0.72, 0.9])
def test_a_typical_forward_voltage_is_met(volts: float) -> None:
    model = diode_model(replace(DIODE, forward_voltage=figure(typ=volts, max=1.0)))
    assert not model.assumed
    assert model.forward(10e-3) == pytest.approx(volts, rel=1e-9)
    assert model.saturation_current <= 12.5e-9


def test_a_leaky_diode_may_have_little_drop() -> None:
    schottky = replace(DIODE, forward_voltage=figure(typ=0.3), reverse_current=figure(max=2e-6))
    model = diode_model(schottky)
    assert model.forward(10e-3) == pytest.approx(0.3, rel=1e-9)
    assert model.saturation_current <= 1e-6


def test_figures_of_no_diode_are_refused() -> None:
    with pytest.raises(InputError, match="1N4148"):
        diode_model(replace(DIODE, forward_voltage=figure(typ=0.005)))


@pytest.mark.parametrize("charge", [False, True])
def test_ngspice_draws_the_same_curve(charge: bool) -> None:
    """A slow ramp into the diode through 100 ohm, and a reverse voltage."""
    model = diode_model(DIODE)
    text = "\n".join(
        [
            "* title: a diode", "V1 a 0 PWL(0 -20 1 -20 2 2)", "R1 a b 100.0", "D1 b 0 diode0",
            card(model, "diode0", charge=charge), ".options noopiter", ".save v(a) v(b)",
            ".tran 1e-3 2.0 0 1e-3", ".end", "",
        ]
    )  # fmt: skip
    check_netlist(text)
    waves = open_simulator("shared").run(text, ("a", "b"), 2.0)
    current = (waves.signals["a"] - waves.signals["b"]) / 100.0
    high = current > 1e-4
    assert high.sum() > 20
    want = np.array([model.forward(float(i)) for i in current[high]])
    # ngspice runs at 27 °C and takes its own value of Vt there.
    assert waves.signals["b"][high] == pytest.approx(want, rel=2e-3)
    assert abs(current[waves.axis < 1.0]).max() < 25e-9


def test_ngspice_recovers_in_the_time_of_the_sheet() -> None:
    """10 mA to -10 mA in 100 ohm, until a tenth of that is left: 4 ns within a tenth."""
    text = "\n".join(
        [
            "* title: recovery", "V1 a 0 PULSE(1.72 -0.28 100n 10p 10p 1 2)", "R1 a b 100.0",
            "D1 b 0 diode0", card(diode_model(DIODE), "diode0", charge=True),
            ".tran 2p 130n 0 2p", ".end", "",
        ]
    )  # fmt: skip
    waves = open_simulator("shared").run(text, ("a", "b"), 130e-9)
    current = (waves.signals["a"] - waves.signals["b"]) / 100.0
    reversed_ = (waves.axis > 99e-9) & (current < 0.0)
    began = waves.axis[reversed_][0]
    assert current[reversed_].min() == pytest.approx(-10e-3, rel=0.05)
    ended = waves.axis[(waves.axis > began + 0.1e-9) & (current > -1e-3)][0]
    assert ended - began == pytest.approx(DIODE.recovery.nominal, rel=0.1)


def test_ngspice_has_the_capacitance_of_the_sheet() -> None:
    text = "\n".join(
        [
            "* title: capacitance", "V1 b 0 DC 0 AC 1", "D1 b 0 diode0",
            card(diode_model(DIODE), "diode0", charge=True), ".ac lin 2 1e6 2e6", ".end", "",
        ]
    )  # fmt: skip
    current = BatchNgspice().analyse(text)[-1].vectors["v1#branch"][0]
    assert abs(current.imag) / (2e6 * np.pi) == pytest.approx(4e-12, rel=0.01)
