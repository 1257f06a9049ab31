"""Sizing of the dead-zone stages: against every choice, and against what is promised."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.arrays import Array
from designer.base.eseries import series_values
from designer.catalog.output_stage import OutputStage
from designer.linear_network.linear_terms import ANY
from designer.model.circuit_table import CircuitSpec
from designer.synthesis.dead_zone_target import DeadZone, DeadZoneTarget, parts_of
from designer.synthesis.size_dead_zone import size
from tests.shared.dead_zone_enumeration import (
    Ranges,
    choices,
    least_saturating,
    rectifier_errors,
    saturating_errors,
)
from tests.shared.exploring import quick, seeds
from tests.shared.oracles import dead_zone_curve, dead_zone_gains

E24 = series_values(["E24"], 1e3, 1e6)
E96 = series_values(["E96"], 1e3, 1e6)
E192 = series_values(["E192"], 1e3, 1e6)
BOTH = series_values(["E24", "E96"], 1e3, 1e6)
FEW = series_values(["E3"], 1e4, 1e5)
DECADE = series_values(["E6"], 1e4, 1e5)
BASE = 10e3
Sides = Literal["both", "upper", "lower"]
Kind = Literal["saturation", "rectifier"]
SETTERS = ("R200", "R202", "R206", "R208", "R209")


LIMIT = OutputStage(13.0, None, 0.0, "stated")


def target(mu: float = 19.0, threshold: float = 4.0, gain: float = 1.0) -> DeadZoneTarget:
    return DeadZoneTarget(
        mu=mu, slope=(mu * 2e-5, mu * 2e-5), output=LIMIT, threshold=threshold,
        linear_gain=gain, output_gain=2.0 * gain, load=2e3, reference_current=(1.6e-4, 14e-3),
    )  # fmt: skip


def sized(
    wanted: DeadZoneTarget,
    resistors: Array,
    used: frozenset[float] = frozenset(),
    spec: CircuitSpec = ANY,
    fixed: dict[str, float] | None = None,
) -> DeadZone:
    found = size(wanted, resistors, BASE, used, spec, fixed)
    assert isinstance(found, DeadZone), found
    return found


@cache
def stage_of(case: str) -> DeadZone:
    """The stage of one of ``CASES``."""
    resistors, wanted = CASES[case]
    return sized(wanted, resistors)


CASES: dict[str, tuple[Array, DeadZoneTarget]] = {
    "E24": (E24, target()),
    "E96": (E96, target()),
    "both": (BOTH, target()),
    "soft stop": (E96, target(mu=1.0, gain=1.5)),
    "hard stop": (E96, target(mu=49.0, gain=1.2)),
    "low threshold": (E24, target(threshold=0.5)),
}


@pytest.mark.parametrize("case", CASES)
def test_sized_stage_is_what_it_says(case: str) -> None:
    (resistors, wanted), found = CASES[case], stage_of(case)
    v = found.values
    assert set(v) == {"R50", *(f"R{i}" for i in range(200, 211))}
    assert all(value in resistors for value in v.values())
    steep, slope, through = dead_zone_gains(v)
    # The two errors, recomputed.
    null = wanted.mu * abs(math.log(steep * through / slope))
    assert found.null_error == pytest.approx(null, abs=1e-9)
    off = abs(math.log(slope / v["R50"] / wanted.slope[0]))
    assert found.slope_error == pytest.approx(off, abs=1e-9)
    assert found.error == max(found.slope_error, found.null_error)
    assert found.proved
    assert found.error <= found.bound + 1e-6
    # The promises about swings and loads.
    assert wanted.threshold / 1.2 <= 13.0 / steep * (1 + 1e-9)
    assert 13.0 / steep <= wanted.threshold * (1 + 1e-9)
    assert found.threshold == pytest.approx(13.0 / steep)
    assert v["R207"] / v["R206"] <= wanted.linear_gain * (1 + 1e-9)
    assert slope <= wanted.output_gain * math.exp(found.slope_error) * (1 + 1e-9)
    assert min(value for name, value in v.items() if name != "R205") >= wanted.load
    # U3B is still linear where U3C reaches its limit.
    at = 13.0 / steep
    assert at * v["R201"] / v["R200"] < 13.0


@pytest.mark.parametrize("case", CASES)
def test_the_curve_is_flat_inside_and_steep_outside(case: str) -> None:
    (_, wanted), found = CASES[case], stage_of(case)
    rails = dict.fromkeys(("U3A", "U3B", "U3C", "U3D"), (-13.0, 13.0))
    steep, slope, _ = dead_zone_gains(found.values)
    b = 13.0 / steep
    for v1 in (-0.9 * b, 0.3 * b, 0.9 * b):
        leftover = dead_zone_curve(v1, found.values, rails) / v1 / slope
        assert abs(leftover) <= 1.01 * found.null_error / wanted.mu + 1e-12
    for v1 in (1.2 * b, -1.5 * b):
        want = slope * (v1 - math.copysign(b, v1))
        slack = slope * b * found.null_error / wanted.mu
        got = dead_zone_curve(v1, found.values, rails)
        assert got == pytest.approx(want, abs=2 * slack + 1e-9)


def near_choice(values: Array, names: tuple[str, ...], rng: np.random.Generator) -> float:
    """A slope that some choice nearly has."""
    r = dict(zip(names, rng.choice(values, len(names)), strict=True))
    slope = r["R207"] / r["R206"] * r["R210"] / r["R209"] / r["R50"]
    return float(slope * np.exp(rng.uniform(-0.03, 0.03)))


@pytest.mark.parametrize("seed", quick(seeds(3)))
@pytest.mark.parametrize(
    ("values", "tied"),
    [(FEW, (("R206", "R209"), ("R202", "R208"))), (DECADE, (SETTERS, ("R201", "R203")))],
    ids=["four values", "seven values"],
)
def test_never_worse_than_every_choice(
    values: Array, tied: tuple[tuple[str, ...], ...], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    names = parts_of("saturation", "both")
    slope, width = near_choice(values, names, rng), [0.0, 2e-3][seed % 2]
    wanted = replace(
        target(mu=float(rng.choice([1.0, 5.0, 19.0, 49.0]))),
        slope=(slope * math.exp(-width), slope * math.exp(width)),
        load=0.0,
        strict=False,
    )
    truth = least_saturating(names, values, wanted.mu, wanted.slope, Ranges(), tied)
    found = size(wanted, values, float(values[0]), frozenset(), CircuitSpec(matched=tied))
    if isinstance(found, str):
        assert truth > 0.1
        return
    assert found.error <= truth + 1e-6
    assert found.bound <= truth + 1e-9
    assert found.proved
    one = {name: np.array([value]) for name, value in found.values.items()}
    assert saturating_errors(one, wanted.mu, wanted.slope) == pytest.approx(found.error, abs=1e-9)


@pytest.mark.parametrize("seed", quick(seeds(3)))
def test_never_worse_than_every_choice_that_keeps_the_conditions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    names, tied = parts_of("saturation", "both"), (SETTERS, ("R203", "R204"))
    wanted = replace(
        target(mu=5.0, threshold=2.4, gain=1.6),
        slope=(near_choice(DECADE, names, rng),) * 2,
        output_gain=8.0,
        noise_gain=[np.inf, 12.0][seed % 2],
    )
    steep = wanted.farthest / wanted.threshold
    top = wanted.output_gain / wanted.slope[1]
    narrow = Ranges(
        steep=(steep, 1.2 * steep), linear=(1.0, 1.6), stop=(top / 2.5, top), first=1.0,
        noise_gain=wanted.noise_gain, load=2e3,
    )  # fmt: skip
    wide = replace(narrow, steep=(steep, np.inf), linear=(0.0, 1.6), stop=(0.0, top), first=0.0)
    truth = least_saturating(names, DECADE, wanted.mu, wanted.slope, narrow, tied)
    if truth > 0.1:
        truth = least_saturating(names, DECADE, wanted.mu, wanted.slope, wide, tied)
    found = size(wanted, DECADE, BASE, frozenset(), CircuitSpec(matched=tied))
    if isinstance(found, str):
        assert truth > 0.1
        return
    assert found.error <= truth + 1e-6
    assert found.bound <= truth + 1e-9


@pytest.mark.parametrize("seed", quick(seeds(3)))
def test_one_sided_is_never_worse_than_every_choice(seed: int) -> None:
    rng = np.random.default_rng(seed)
    side: Sides = "upper" if seed % 2 else "lower"
    names, tied = (
        parts_of("saturation", side),
        (("R200", "R202", "R206"), ("R208", "R209"), ("R207", "R210")),
    )
    slope = near_choice(FEW, names, rng)
    wanted = replace(
        target(mu=float(rng.choice([1.0, 5.0]))), slope=(slope * 0.99, slope * 1.01), sides=side,
        excursion=1.1, load=0.0, strict=False,
    )  # fmt: skip
    ranges = Ranges(shift=(wanted.shift[0], 0.9))
    truth = least_saturating(names, FEW, wanted.mu, wanted.slope, ranges, tied)
    found = size(wanted, FEW, float(FEW[0]), frozenset(), CircuitSpec(matched=tied))
    if isinstance(found, str):
        assert truth > 0.1
        return
    assert found.error <= truth + 1e-6
    assert found.bound <= truth + 1e-9
    assert found.proved
    one = {name: np.array([value]) for name, value in found.values.items()}
    assert saturating_errors(one, wanted.mu, wanted.slope) == pytest.approx(found.error, abs=1e-9)


@pytest.mark.parametrize("side", ["upper", "lower"])
@pytest.mark.parametrize("resistors", [E24, E96], ids=["E24", "E96"])
def test_one_sided_stage_saturates_at_the_stop_alone(side: Sides, resistors: Array) -> None:
    wanted = replace(target(mu=9.0), sides=side, excursion=2.0)
    found = sized(wanted, resistors)
    v = found.values
    steep, _, _ = dead_zone_gains(v)
    shift = steep * 15.0 * v["R200"] / v["R211"]
    b, reach = (13.0 - shift) / steep, (13.0 + shift) / steep
    assert found.threshold == pytest.approx(b)
    assert b <= wanted.threshold * (1 + 1e-9)
    assert reach >= 2.0 * b
    one = {name: np.array([value]) for name, value in v.items()}
    assert saturating_errors(one, 9.0, wanted.slope) == pytest.approx(found.error, abs=1e-9)
    assert found.error < 2e-4
    assert set(found.errors) == {"stop slope", "dead-zone null", "dead-zone bias"}


@pytest.mark.parametrize("sides", ["both", "upper", "lower"])
@pytest.mark.parametrize("seed", quick(seeds(3)))
def test_rectifier_is_never_worse_than_every_choice(sides: Sides, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = series_values(["E6"], 1e4, 1e5)
    mu = float(rng.choice([1.0, 19.0, 49.0]))
    r = rng.choice(values, 3)
    slope = float(r[0] / r[1] / r[2] * np.exp(rng.uniform(-0.02, 0.02)))
    wanted = replace(
        target(mu), slope=(slope, slope), kind="rectifier", sides=sides, output_gain=3.0,
        noise_gain=[np.inf, 6.0][seed % 2],
    )  # fmt: skip
    found = size(wanted, values, BASE, frozenset())
    names = ("R200", "R201", "R202", "R206", "R50")
    truth = np.inf
    for narrow in (True, False):
        truth = min(
            rectifier_errors(v, wanted, narrow=narrow).min() for v in choices(names, values)
        )
        if truth <= 0.1:
            break
    if isinstance(found, str):
        assert truth > 0.1
        return
    assert found.proved
    assert found.error == pytest.approx(truth, abs=1e-6)
    # Both halves are alike; what is promised holds, from the values alone.
    v = found.values
    assert set(v) == set(parts_of("rectifier", sides))
    shift = {"R200": "R203", "R201": "R204", "R202": "R205", "R206": "R207"}
    if sides == "both":
        assert all(v[a] == v[b] for a, b in shift.items())
    elif sides == "lower":
        v = {a: v[b] for a, b in shift.items()} | {"R50": v["R50"]}
    one = {name: np.array([v[name]]) for name in names}
    reached = min(rectifier_errors(one, wanted, narrow=n)[0] for n in (True, False))
    assert reached == pytest.approx(found.error, abs=1e-9)
    assert found.threshold == pytest.approx(5.0 * v["R200"] / v["R201"])


@settings(max_examples=25, deadline=None)
@given(
    mu=st.floats(1.0, 49.0),
    slope=st.floats(1e-5, 4e-5),
    count=st.integers(1, 9),
    start=st.integers(0, 20),
    kind=st.sampled_from(["saturation", "rectifier"]),
    sides=st.sampled_from(["both", "upper", "lower"]),
    strict=st.booleans(),
)
def test_any_catalogue_is_answered(
    mu: float, slope: float, count: int, start: int, kind: Kind, sides: Sides, strict: bool
) -> None:
    values = series_values(["E6"], 1e3, 1e6)[start : start + count]
    wanted = replace(
        target(mu), slope=(mu * slope, mu * slope), kind=kind, sides=sides, strict=strict
    )
    found = size(wanted, values, float(values[0]), frozenset()) if len(values) else "none"
    if isinstance(found, DeadZone):
        assert set(found.values) == set(parts_of(kind, sides))
        assert all(v in values for v in found.values.values())
        assert found.bound <= found.error <= 0.3 + 1e-9


@pytest.mark.parametrize(
    ("resistors", "mu"),
    [(E24, 1.0), (E24, 49.0), (E96, 7.3), (E192, 1.0), (BOTH, 49.0), (BOTH, 7.3)],
    ids=["E24-1", "E24-49", "E96-7", "E192-1", "both-49", "both-7"],
)
def test_proved_on_whole_catalogues_without_conditions(resistors: Array, mu: float) -> None:
    slope = mu * 2.0123e-5
    found = sized(replace(target(mu), slope=(slope, slope), load=0.0, strict=False), resistors)
    assert found.proved
    assert found.error <= max(found.bound, 0.0) + 1e-6
    assert found.error < 2e-5


def test_exact_null_in_e24() -> None:
    """A known choice from E24 has no null at all; the sizing finds one as good."""
    known = {
        "R200": 10e3, "R202": 10e3, "R206": 10e3, "R201": 36e3, "R203": 620e3, "R204": 16e3,
        "R205": 1.6e3, "R207": 200e3, "R208": 100e3, "R209": 100e3, "R210": 100e3, "R50": 20e3,
    }  # fmt: skip
    steep, slope, through = dead_zone_gains(known)
    assert abs(math.log(steep * through / slope)) < 1e-12
    wanted = replace(
        target(), slope=(slope / 20e3,) * 2, threshold=13.0 / steep, linear_gain=20.0,
        output_gain=20.0, load=1e3,
    )  # fmt: skip
    assert sized(wanted, E24).error < 1e-12


def test_an_interval_leaves_the_slope_free() -> None:
    point = sized(target(), E24)
    wide = replace(target(), slope=(target().slope[0] * 0.9999, target().slope[0] * 1.0001))
    found = sized(wide, E24)
    assert found.slope_error == 0.0
    assert found.error < point.error
    assert found.error <= 1e-6
    _, slope, _ = dead_zone_gains(found.values)
    assert wide.slope[0] <= slope / found.values["R50"] <= wide.slope[1]


@pytest.mark.slow
def test_slack_and_used_values_lessen_the_kinds() -> None:
    exact = sized(target(), E96)
    loose = sized(target(), E96, spec=CircuitSpec(slack=2e-3))
    assert loose.error <= 2e-3 + 1e-6
    assert len(set(loose.values.values())) < len(set(exact.values.values()))
    again = sized(target(), E96, used=frozenset(exact.values.values()))
    assert set(again.values.values()) <= set(exact.values.values())
    preferred = CircuitSpec(preferred=tuple(exact.values.values()))
    assert set(sized(target(), E96, spec=preferred).values.values()) <= set(preferred.preferred)


@pytest.mark.slow
def test_the_number_of_values_is_kept() -> None:
    used = frozenset({BASE, 22e3})
    free = sized(target(), E96, used)
    new = len(set(free.values.values()) - used)
    limited = sized(target(), E96, used, CircuitSpec(most_values=2 + new - 2))
    assert len(set(limited.values.values()) - used) <= new - 2
    assert limited.error > free.error
    assert size(target(), E96, BASE, used, CircuitSpec(most_values=1)) == "distinct values"
    assert size(target(), E96, BASE, used, CircuitSpec(most_values=2)) == "distinct values"


@pytest.mark.parametrize("kind", ["saturation", "rectifier"])
def test_matched_parts_are_equal(kind: Kind) -> None:
    wanted = replace(target(), kind=kind)
    groups: tuple[tuple[str, ...], ...] = (("R200", "R202"), ("R4", "R201"), ("R50", "R206"))
    if kind == "saturation":
        groups = (("R208", "R209"), ("R4", "R201"), ("R50", "R210", "R12"))
    found = sized(wanted, E24, spec=CircuitSpec(matched=groups), fixed={"R4": 12e3, "R1": 1e6})
    v = found.values
    assert v["R201"] == 12e3
    for group in groups:
        assert len({v[name] for name in group if name in v}) == 1
    twice = CircuitSpec(matched=(("R4", "R201"), ("R1", "R201")))
    assert size(wanted, E24, BASE, frozenset(), twice, {"R4": 12e3, "R1": 1e6}) == "matched parts"


def test_cheaper_values_are_taken_where_nothing_else_decides() -> None:
    wanted = replace(target(), kind="rectifier")
    found = sized(wanted, E96)
    price = dict.fromkeys(E96.tolist(), 3.0)
    feeds = (found.values["R206"], found.values["R207"])
    others = [v for v in E96.tolist() if v not in feeds]
    cheap = size(wanted, E96, BASE, frozenset(others), price=price | {others[0]: 1.0})
    assert isinstance(cheap, DeadZone)
    plain = size(wanted, E96, BASE, frozenset(others), price=price)
    assert isinstance(plain, DeadZone)
    assert sum(v == others[0] for v in cheap.values.values()) >= sum(
        v == others[0] for v in plain.values.values()
    )


def test_noise_gain_is_kept() -> None:
    wanted = replace(target(threshold=0.2), noise_gain=12.0)
    v = sized(wanted, E24).values
    behind = v["R208"] + v["R204"] * v["R205"] / (v["R204"] + v["R205"])
    gains = [
        1.0 + v["R201"] / v["R200"],
        1.0 + v["R203"] / v["R202"],
        1.0 + v["R207"] / v["R206"],
        1.0 + v["R210"] / v["R209"] + v["R210"] / behind,
    ]
    assert max(gains) <= 12.0 * (1 + 1e-9)
    free = sized(replace(wanted, noise_gain=np.inf), E24)
    assert free.error <= sized(wanted, E24).error + 1e-6


@pytest.mark.slow
def test_what_leaves_none_is_named() -> None:
    assert size(target(gain=1e-3), E24, BASE, frozenset()) == "stop slope"
    assert size(target(threshold=1e-5), E24, BASE, frozenset()) == "dead-zone null"
    one = replace(target(), sides="upper", excursion=1e4)
    assert size(one, E24, BASE, frozenset()) == "dead-zone bias"
    rectifier = replace(target(), kind="rectifier")
    assert size(replace(rectifier, threshold=1e-4), E24, BASE, frozenset()) == "threshold"
    starved = replace(rectifier, reference_current=(1.0, 2.0))
    assert size(starved, E24, BASE, frozenset()) == "reference current"
    loud = replace(rectifier, noise_gain=1.1)
    assert size(loud, E24, BASE, frozenset()) == "noise gain"
    assert size(replace(rectifier, output_gain=1e-6), E24, BASE, frozenset()) == "stop slope"


def test_the_same_question_has_the_same_answer() -> None:
    first, second = (sized(target(mu=7.0), E96) for _ in range(2))
    assert first == second
