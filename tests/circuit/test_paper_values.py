"""The paper's circuit: the printed values by hand, and its way for any model."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.catalog.parts_catalog import load_catalog
from designer.circuit import paper_values
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.paper_values import PRINTED
from designer.model.circuit_table import CircuitSpec
from designer.model.model import Dimensionless
from tests.shared.oracles import Plain, coefficient_error, dead_zone_gains

CATALOG = load_catalog()
OPAMP = CATALOG.opamp("TL074C")
PAPER = paper_values.MODEL
PLAIN = Plain(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)


def test_every_part_of_the_two_figures_has_a_value_and_a_source() -> None:
    names = {f"R{i}" for i in (*range(1, 13), 50, *range(100, 108), *range(200, 211))}
    assert set(PRINTED) == names | {"C1", "C2", "C3", "C4"}
    assert set(paper_values.SOURCE) == set(PRINTED)


def test_printed_null_by_hand() -> None:
    """R205 ∥ R208 = 1 k ∥ 100 k = 990.1 Ω, so A+ beta = 210.6 · 990.1/9990.1 = 20.872 < 21.06."""
    circuit = paper_values.circuit(PAPER, PRINTED, OPAMP)
    found = coefficient_errors(circuit, PAPER.second_order())
    loaded = 1e3 * 100e3 / 101e3
    through = 210.6 * loaded / (9e3 + loaded)
    assert found.errors["dead-zone null"] == pytest.approx(19 * math.log(through / 21.06), rel=1e-9)
    # 0.18 K1 inside the clearance.
    assert (21.06 - through) * 20e3 / 20.88e3 == pytest.approx(0.18, abs=0.001)
    spread = found.errors["stop slope"] - found.errors["x1'' x1"]
    assert spread == pytest.approx(math.log(21.06 * 20 / 20.88 / 19), rel=1e-9)
    assert "R12" not in circuit.values


def test_corrected_values_are_exact_to_their_printed_digits() -> None:
    """Eq. (14): 22.37 and 11.19 kΩ stand for √5 · 10 and √5 · 5; nothing else is off.

    e34 + e43 - 2 e44 holds no scale and is 2 ln(11.19/11.1803): half of that, over four terms'
    share of two, is the least largest error.
    """
    values = paper_values.corrected()
    assert values["R50"] == pytest.approx(21.06 * 20e3 / 19.0, rel=1e-12)
    assert values["R204"] == pytest.approx(9.0 * 1e3 * 100e3 / 101e3, rel=1e-12)
    changed = {name for name in PRINTED if values[name] != PRINTED[name]}
    assert changed == {"R50", "R204"}
    found = coefficient_errors(paper_values.circuit(PAPER, values, OPAMP), PAPER.second_order())
    off = math.log(11.19e3 / (5e3 * math.sqrt(5.0)))
    assert off > math.log(22.37e3 / (10e3 * math.sqrt(5.0))) > 0.0
    assert found.max_error == pytest.approx(off / 2.0, rel=1e-6)
    assert found.max_error == pytest.approx(coefficient_error(values, PLAIN), rel=1e-5)
    exact = values | {"R9": 5e3 * math.sqrt(5.0)} | {f"R{i}": 1e4 * math.sqrt(5) for i in (2, 3, 8)}
    found = coefficient_errors(paper_values.circuit(PAPER, exact, OPAMP), PAPER.second_order())
    assert found.max_error < 1e-9


def test_corrected_generator_of_the_errata() -> None:
    """f = 355.88 ω, and V = (13/210.6) 100/(0.25 · 20) = 1.2346 V."""
    frequency, amplitude = paper_values.generator(PAPER, paper_values.corrected())
    assert frequency == pytest.approx(355.88, abs=0.01)
    assert amplitude == pytest.approx(13.0 / 210.6 * 100.0 / (0.25 * 20.0), rel=1e-12)


@settings(max_examples=40)
@given(
    m=st.floats(0.1, 0.9),
    k=st.floats(0.1, 0.9),
    k0=st.floats(0.3, 0.98),
    c=st.floats(0.0, 0.9),
    zeta=st.floats(0.01, 0.5),
    f20=st.sampled_from([0.0, 0.3, 1.0]),
    b=st.floats(0.05, 2.0),
)
def test_the_paper_s_way_is_exact_for_any_model(
    m: float, k: float, k0: float, c: float, zeta: float, f20: float, b: float
) -> None:
    model = Dimensionless(m, k, k0, c, zeta, f20, b)
    values = paper_values.way(model)
    found = coefficient_errors(paper_values.circuit(model, values, OPAMP), model.second_order())
    assert found.max_error < 1e-7
    assert values["R1"] == 100e3
    assert values["R4"] == 20e3
    steep, linear, through = dead_zone_gains(values)
    assert steep * through == pytest.approx(linear, rel=1e-12)
    frequency, volts = paper_values.generator(model, values)
    assert frequency == pytest.approx(found.scales.frequency(1.0), rel=1e-6)
    assert found.drive_gain * volts == pytest.approx([1.0 - f20, f20], rel=1e-6, abs=1e-12)


def test_the_paper_s_way_at_the_paper_s_model_gives_its_values() -> None:
    values = paper_values.way(PAPER)
    for name, value in paper_values.corrected().items():
        assert values[name] == pytest.approx(value, rel=1e-3)


def test_rounded_values_are_the_nearest_that_can_be_bought() -> None:
    spec = CircuitSpec(resistors=("E24",), resistor_grade=0.01)
    near = paper_values.rounded(paper_values.corrected(), spec, CATALOG)
    assert near["R2"] == 22e3
    assert near["R207"] == 22e3  # 21.06 k lies 4.4 % below it and 5.3 % above 20 k
    assert near["R203"] == 11e3
    assert near["C2"] == 100e-9
    sold = CATALOG.values("resistor", ("E24",), 1e3, 1e6, 0.01)
    for name, value in paper_values.corrected().items():
        if name[0] == "R":
            ratios = np.abs(np.log(sold / value))
            assert abs(math.log(near[name] / value)) == pytest.approx(float(ratios.min()))


def test_what_stands_beside_a_design() -> None:
    def names(model: Dimensionless) -> list[str]:
        return [c.name for c in paper_values.candidates(model, CircuitSpec(), CATALOG)]

    assert names(PAPER) == ["paper, as printed", "paper, corrected", "paper, corrected, rounded"]
    nearly = Dimensionless(0.5, 0.5, 0.95 + 1e-14, 0.5, 0.1, 0.0, 0.25)
    assert names(nearly) == names(PAPER)
    other = Dimensionless(0.5, 0.5, 0.9, 0.5, 0.1, 0.0, 0.25)
    assert names(other) == ["paper's way", "paper's way, rounded"]
    assert names(Dimensionless(0.5, 0.5, 0.0, 0.5, 0.1, 0.0, 0.25)) == names(other)
    one_sided = Dimensionless(0.5, 0.5, 0.95, 0.5, 0.1, 0.0, 0.25, "upper")
    assert names(one_sided) == []
