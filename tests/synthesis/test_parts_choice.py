"""Finished designs: errors recomputed from the parts, conditions kept, refusals that are true."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

from designer.base.errors import InputError, Unreachable
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.design import Design
from designer.linear_network.linear_terms import Shortfall
from designer.model.circuit_table import CircuitSpec
from designer.model.find_responses import Peaks, Reach, find, peaks
from designer.model.model import Dimensionless
from designer.model.model_file import read_model_file
from designer.model.response_table import Response
from designer.spread.spread import Spread, draw
from designer.synthesis import parts_choice
from designer.synthesis.limits import LOAD, SIGNAL
from tests.shared.exploring import quick
from tests.shared.model_text import dimensionless
from tests.shared.oracles import Plain, coefficient_error

# What each side condition costs is asked where a test is about it: it doubles the time.
synthesise = partial(parts_choice.synthesise, binding=False)

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CATALOG = load_catalog()
PEAKS = Peaks(np.array([0.65, 0.55, 0.65, 0.6]), (Reach(0.4),))
PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)


def plain(model: Dimensionless) -> Plain:
    return Plain(model.m, model.k, model.k0, model.c, model.zeta, model.f20, model.b)


@cache
def paper_peaks() -> Peaks:
    file = read_model_file(EXAMPLES / "paper.toml")
    return peaks(file.model, find(file.model, file.responses))


@cache
def paper_design(series: tuple[str, ...]) -> Design:
    spec = replace(read_model_file(EXAMPLES / "paper.toml").circuit, resistors=series)
    return synthesise(PAPER, spec, CATALOG, paper_peaks())


def check(design: Design, spec: CircuitSpec, held: Peaks) -> None:
    """Everything that a finished design promises, from its values alone."""
    model, values = dimensionless(design.model), design.circuit.values
    truth = coefficient_error(values, plain(model))
    # Both by HiGHS, whose own tolerance is 1e-7.
    assert design.errors.max_error == pytest.approx(truth, rel=1e-5, abs=2e-7)
    # Members of the catalogue.
    resistors = CATALOG.values(
        "resistor", spec.resistors, *spec.resistor_range, spec.resistor_grade
    )
    capacitors = CATALOG.values(
        "capacitor", spec.capacitors, *spec.capacitor_range, spec.capacitor_grade
    )
    for name, value in values.items():
        assert value in (resistors if name[0] == "R" else capacitors), name
    # Parts that a zero term would have do not exist, those of the others do.
    assert ("R6" in values) is (model.f20 < 1.0)
    assert ("R12" in values) is (model.f20 > 0.0)
    assert ("R50" in values) is (model.k0 > 0.0)
    assert any(n.startswith("R2") and len(n) == 4 for n in values) is (model.k0 > 0.0)
    # Frequency band, swing, generator.
    low, high = spec.frequency
    assert low * (1 - 2e-3) <= design.errors.scales.frequency(1.0) <= high * (1 + 2e-3)
    swing = design.conditions["swing_v"]
    assert (design.errors.scales.volts * held.states).max() <= swing * (1 + 5e-3)
    if spec.side_conditions:
        for name in ("R1", "R2", "R3", "R4", "R5", "R7", "R8", "R9", "R10", "R11"):
            assert SIGNAL[0] <= values[name] <= SIGNAL[1], name
        for name in values:
            if name in {"R50", "R207", "R210", "R201", "R203"}:
                assert values[name] >= LOAD
    # Drive: the amplitude gives the model's force on each driven mass.
    volts = design.amplitude()
    assert volts > 0.0
    force = design.errors.drive_gain * volts
    wanted = np.array([1.0 - model.f20, model.f20])
    assert force == pytest.approx(wanted, rel=0.02, abs=1e-12)
    assert design.amplitude(2.0 * model.b) == pytest.approx(volts / 2.0)
    assert design.volts(2.0 * model.b) == pytest.approx(design.volts() / 2.0)
    if model.k0 > 0.0:
        assert design.volts()[0] * model.b == pytest.approx(design.errors.scales.threshold)
    # The certificate.
    assert design.certificate.status in ("optimal", "bound")
    assert design.certificate.lower_bound <= design.errors.max_error + 1e-9
    kinds = {(n[0], v) for n, v in values.items()}
    assert design.distinct_values == len(kinds)


@pytest.mark.parametrize("series", quick(map(pytest.param, [("E24",), ("E96",), ("E24", "E96")])))
def test_the_paper_s_case(series: tuple[str, ...]) -> None:
    design = paper_design(series)
    check(
        design,
        replace(read_model_file(EXAMPLES / "paper.toml").circuit, resistors=series),
        paper_peaks(),
    )
    assert design.errors.max_error < (2e-5 if series == ("E24",) else 1e-6)
    assert design.amplitude() <= 5.0


def test_the_same_input_gives_the_same_parts() -> None:
    a, b = coarse(), synthesise(PAPER, E12, CATALOG, PEAKS)
    assert a.circuit == b.circuit
    assert a.errors.max_error == b.errors.max_error


def test_the_hammer() -> None:
    file = read_model_file(EXAMPLES / "drill.toml")
    held = peaks(file.model, find(file.model, file.responses))
    check(synthesise(file.model, file.circuit, CATALOG, held), file.circuit, held)


@pytest.mark.parametrize("f20", [0.0, 0.35, 1.0])
@pytest.mark.parametrize("k0", [0.0, 0.9])
def test_terms_that_are_zero_have_no_part(f20: float, k0: float) -> None:
    model = replace(PAPER, f20=f20, k0=k0)
    spec = CircuitSpec(resistors=("E24",))
    check(synthesise(model, spec, CATALOG, PEAKS), spec, PEAKS)


def random_case(seed: int) -> tuple[Dimensionless, CircuitSpec, Peaks]:
    rng = np.random.default_rng(seed)
    model = Dimensionless(
        m=float(rng.uniform(0.2, 0.8)),
        k=float(rng.uniform(0.2, 0.8)),
        k0=float(rng.uniform(0.5, 0.98)),
        c=float(rng.uniform(0.2, 0.8)),
        zeta=float(math.exp(rng.uniform(math.log(0.02), math.log(0.3)))),
        f20=[0.0, 1.0, float(rng.uniform(0.1, 0.9))][seed % 3],
        b=float(math.exp(rng.uniform(math.log(0.05), 0.0))),
    )
    series = [("E24",), ("E96",), ("E24", "E96")][seed // 3 % 3]
    spec = CircuitSpec(resistors=series)
    found = find(model, [Response(omega=float(rng.uniform(0.4, 1.7)))])
    return model, spec, peaks(model, found)


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    "seed", [0, 1, 2, *(pytest.param(k, marks=SLOW) for k in (*range(3, 9), 10, 16, 19))]
)
def test_random_targets(seed: int) -> None:
    """Every pair of series and driven masses, and three that were once refused."""
    model, spec, held = random_case(seed)
    check(synthesise(model, spec, CATALOG, held), spec, held)


# Refusals.


def test_unreachable_names_what_binds() -> None:
    narrow = {
        "frequency": CircuitSpec(resistors=("E24",), frequency=(1e6, 2e6)),
        "signal resistors": CircuitSpec(resistors=("E24",), resistor_range=(1e3, 2e3)),
    }
    for binds, spec in narrow.items():
        with pytest.raises(Unreachable) as caught:
            synthesise(PAPER, spec, CATALOG, PEAKS)
        assert f"binds: {binds}" in str(caught.value)
        assert caught.value.exit_status == 2
    tiny = CircuitSpec(resistors=("E3",), resistor_range=(1e4, 2.3e4))
    with pytest.raises(Unreachable, match="what binds: "):
        synthesise(PAPER, tiny, CATALOG, PEAKS)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"objective": "yield"}, "circuit.objective"),
        ({"diode": "1N9999", "dead_zone": "rectifier"}, "circuit.diode"),
        ({"reference": "LM9999", "dead_zone": "rectifier"}, "circuit.reference"),
        ({"composites": ("R211",)}, "circuit.composites"),
        ({"composites": ("R6",)}, "circuit.composites"),
        ({"composites": ("R100",)}, "circuit.composites"),
        ({"matched": (("R1", "R12"),)}, "circuit.matched"),
        ({"preferred": (1.234e4,)}, "circuit.preferred"),
        ({"opamp": "LM999"}, "circuit.opamp"),
    ],
)
def test_what_cannot_be_built_is_refused_by_name(changes: dict[str, object], field: str) -> None:
    spec = replace(CircuitSpec(), **changes)  # type: ignore[arg-type]
    with pytest.raises(InputError) as caught:
        synthesise(PAPER, spec, CATALOG, PEAKS)
    assert caught.value.field == field


# Wishes.

E12 = CircuitSpec(resistors=("E12",))


@cache
def coarse() -> Design:
    """The paper's case without a wish, for all that compare with it."""
    return synthesise(PAPER, E12, CATALOG, PEAKS)


def test_matched_parts_are_equal() -> None:
    groups = (("R1", "R7", "R100"), ("C1", "C2"), ("R208", "R209"), ("R2", "R207"))
    values = synthesise(PAPER, replace(E12, matched=groups), CATALOG, PEAKS).circuit.values
    for group in groups:
        assert len({values[name] for name in group}) == 1, group
    # The inverter stays one: its two resistors are equal.
    assert values["R100"] == values["R101"]


def test_a_matched_drive() -> None:
    spec = replace(E12, matched=(("R6", "R12"),))
    values = synthesise(replace(PAPER, f20=0.5), spec, CATALOG, PEAKS).circuit.values
    assert values["R6"] == values["R12"]


def kinds(design: Design, preferred: tuple[float, ...] = ()) -> int:
    return len(set(design.circuit.values.values()) - set(preferred))


@pytest.mark.slow
def test_a_limit_on_distinct_values_is_kept_or_refused_by_name() -> None:
    most = kinds(coarse()) - 2
    assert kinds(synthesise(PAPER, replace(E12, most_values=most), CATALOG, PEAKS)) <= most
    with pytest.raises(Unreachable, match="distinct values"):
        synthesise(PAPER, replace(E12, most_values=3), CATALOG, PEAKS)


def test_a_refusal_beside_a_limit_on_values_names_the_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With few values left the stage of a clearance may fail for any reason."""
    missed = parts_choice._Missed(Shortfall("stop slope", False))
    monkeypatch.setattr(parts_choice._Search, "best", lambda *_: missed)
    for most, match in ((9, "raise circuit.most_values"), (None, "finer series$")):
        with pytest.raises(Unreachable, match=match):
            synthesise(PAPER, replace(E12, most_values=most), CATALOG, PEAKS)


def test_preferred_values_are_used_more() -> None:
    preferred = (1e4, 2.2e4, 1e-8)
    plain = coarse()
    wished = synthesise(PAPER, replace(E12, preferred=preferred), CATALOG, PEAKS)
    assert kinds(wished, preferred) <= kinds(plain, preferred)
    assert wished.errors.max_error == pytest.approx(plain.errors.max_error, abs=1e-6)


@pytest.mark.slow
def test_slack_buys_fewer_distinct_values() -> None:
    plain = coarse()
    loose = synthesise(PAPER, replace(E12, slack=2e-2), CATALOG, PEAKS)
    assert kinds(loose) < kinds(plain)
    assert loose.errors.max_error <= plain.errors.max_error + 2e-2 + 1e-6


@pytest.mark.parametrize("sides", quick(["upper", "lower"]))
def test_one_sided_stops(sides: str) -> None:
    model = replace(PAPER, sides=sides)  # type: ignore[arg-type]
    held = Peaks(np.array([3.44, 2.65, 1.82, 1.87]), (Reach(0.61, 3.44),), 25.0)
    design = synthesise(model, CircuitSpec(), CATALOG, held)
    assert design.errors.max_error < 1e-6
    assert {"R211", "R212"} <= set(design.circuit.values)


def test_the_rectifier() -> None:
    design = synthesise(PAPER, CircuitSpec(dead_zone="rectifier"), CATALOG, PAPER_PEAKS)
    assert abs(design.errors.errors["dead-zone null"]) < 1e-9
    assert design.errors.max_error < 1e-4
    assert len(design.circuit.diodes) == 4


# Cases that were once refused although parts exist.

FALSE_10 = Dimensionless(
    m=0.23763075354246097, k=0.6952926880361336, k0=0.6520343199473428, c=0.2987043598844608,
    zeta=0.055237892320365314, f20=1.0, b=0.3966616593668248,
)  # fmt: skip
PEAKS_10 = Peaks(
    np.array([0.57589752, 0.27006041, 0.49431716, 0.22307929]), (Reach(0.17923586117779283),)
)


def test_parts_for_the_case_of_the_next_test_exist() -> None:
    """E96 values within every side condition, linear error 4.1e-3."""
    values = {
        "R1": 340e3, "R2": 130e3, "R3": 127e3, "R4": 9.09e3, "R5": 16.2e3, "R7": 340e3,
        "R8": 200e3, "R9": 137e3, "R10": 14e3, "R11": 7.5e3,
        "C1": 1.8e-9, "C2": 27e-9, "C3": 1e-9, "C4": 5.6e-9,
        **{f"R{i}": 10e3 for i in range(100, 108)},
    }  # fmt: skip
    allowed = CATALOG.values("resistor", ("E96",), 1e3, 1e6, 0.01)
    assert all(v in allowed for n, v in values.items() if n[0] == "R")
    assert all(SIGNAL[0] <= v <= SIGNAL[1] for n, v in values.items() if n[0] == "R")
    assert coefficient_error(values, plain(replace(FALSE_10, k0=0.0))) < 5e-3


@pytest.mark.slow
def test_e96_reaches_what_its_own_values_reach() -> None:
    design = synthesise(FALSE_10, CircuitSpec(resistors=("E96",)), CATALOG, PEAKS_10)
    assert design.errors.max_error < 5e-3


COARSE_SHARE = Dimensionless(
    m=0.5581926383142539, k=0.7506153543025478, k0=0.5370002280802586, c=0.6137780932682486,
    zeta=0.07753446959400091, f20=1.0, b=0.216001665650805,
)  # fmt: skip
PEAKS_16 = Peaks(
    np.array([1.49162242, 1.62113545, 1.00324573, 1.12018193]), (Reach(1.2756207522348961),)
)
CASE_19 = Dimensionless(
    m=0.5751568906490641, k=0.6161737008217492, k0=0.6898670821051658, c=0.5129150732794505,
    zeta=0.0461747756412776, f20=1.0, b=0.8378255618223341,
)  # fmt: skip
PEAKS_19 = Peaks(
    np.array([1.01150755, 1.4017911, 1.40236639, 2.1494458]), (Reach(0.17368199133642082),)
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "held", "series"),
    [
        pytest.param(COARSE_SHARE, PEAKS_16, "E96", id="E96", marks=pytest.mark.slow),
        pytest.param(CASE_19, PEAKS_19, "E24", id="E24"),
    ],
)
def test_fewer_conditions_reach_at_least_as_much(
    model: Dimensionless, held: Peaks, series: str
) -> None:
    with_them = synthesise(model, CircuitSpec(resistors=(series,)), CATALOG, held)
    without = CircuitSpec(resistors=(series,), side_conditions=False)
    bare = synthesise(model, without, CATALOG, held)
    assert bare.errors.max_error <= with_them.errors.max_error + 1e-9


@pytest.mark.parametrize("supply", [100.0, 2.0])
def test_rails_that_the_op_amp_does_not_stand_are_refused(supply: float) -> None:
    with pytest.raises(InputError, match="supply"):
        synthesise(PAPER, CircuitSpec(supply=supply), CATALOG, PAPER_PEAKS)


def test_a_stop_that_no_resistor_makes_is_refused_at_once() -> None:
    stiff = replace(PAPER, k0=0.9999)
    with pytest.raises(Unreachable, match="stop stiffness"):
        synthesise(stiff, CircuitSpec(), CATALOG, PAPER_PEAKS)


@pytest.mark.slow
def test_a_signal_as_small_as_the_offset_is_refused() -> None:
    wide = replace(PAPER, b=1e6)
    with pytest.raises(Unreachable, match="a clearance that is reached"):
        synthesise(wide, E12, CATALOG, PAPER_PEAKS)


@pytest.mark.slow
def test_no_drawn_output_passes_its_rail() -> None:
    """OPA4192 is rail to rail: 5 % above its saturation would be beyond the supply."""
    spec = CircuitSpec(opamp="OPA4192", supply=15.0)
    design = synthesise(PAPER, spec, CATALOG, PAPER_PEAKS)
    spread = Spread.bench_1(CATALOG.opamp("OPA4192"), 0.01, 0.01)
    rails = [draw(design.circuit, spread, 1, i).rails.values() for i in range(20)]
    assert max(high for board in rails for _, high in board) <= 15.0


PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
PAPER_PEAKS = Peaks(np.array([0.452, 0.787, 0.571, 0.877]), (Reach(0.202),))
