"""Sizing of the saturating dead zone: what is promised of the chosen values is recomputed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from designer.dead_zone import DeadZone, DeadZoneTarget, size
from designer.eseries import series_values
from designer.system import Array
from tests.oracles import dead_zone_curve, dead_zone_gains

E24 = series_values(["E24"], 1e3, 1e6)
E96 = series_values(["E96"], 1e3, 1e6)
BOTH = series_values(["E24", "E96"], 1e3, 1e6)
BASE = 10e3


def target(mu: float = 19.0, threshold: float = 4.0, gain: float = 1.0) -> DeadZoneTarget:
    return DeadZoneTarget(
        mu=mu, slope=(mu * 2e-5, mu * 2e-5), saturation=13.0, threshold=threshold, linear_gain=gain,
        output_gain=2.0 * gain, load=2e3,
    )  # fmt: skip


CASES = [
    pytest.param(E24, target(), id="E24"),
    pytest.param(E96, target(), id="E96"),
    pytest.param(BOTH, target(), id="both"),
    pytest.param(E96, target(mu=1.0, gain=1.5), id="soft stop"),
    pytest.param(E96, target(mu=49.0), id="hard stop"),
    pytest.param(E24, target(threshold=0.5), id="low threshold"),
]


@pytest.mark.parametrize(("resistors", "wanted"), CASES)
def test_sized_stage_is_what_it_says(resistors: Array, wanted: DeadZoneTarget) -> None:
    found = size(wanted, resistors, BASE, frozenset())
    assert isinstance(found, DeadZone), found
    v = found.values
    assert set(v) == {"R50", *(f"R{i}" for i in range(200, 211))}
    assert all(np.isclose(resistors, value, rtol=1e-12).any() for value in v.values())
    steep, slope, through = dead_zone_gains(v)
    # The two errors, recomputed.
    null = wanted.mu * abs(math.log(steep * through / slope))
    assert found.null_error == pytest.approx(null, abs=1e-9)
    off = abs(math.log(slope / v["R50"] / wanted.slope[0]))
    assert found.slope_error == pytest.approx(off, abs=1e-9)
    assert found.slope_error < 0.05
    # The promises about swings and loads.
    assert 13.0 / steep <= wanted.threshold * (1 + 1e-9)
    assert v["R207"] / v["R206"] <= wanted.linear_gain * (1 + 1e-9)
    assert slope <= wanted.output_gain * (1 + 1e-9)
    assert min(v.values()) >= wanted.load
    # U3B is still linear where U3C reaches its limit.
    at = 13.0 / steep
    assert at * v["R201"] / v["R200"] < 13.0


@pytest.mark.parametrize(("resistors", "wanted"), CASES)
def test_the_curve_is_flat_inside_and_steep_outside(
    resistors: Array, wanted: DeadZoneTarget
) -> None:
    found = size(wanted, resistors, BASE, frozenset())
    assert isinstance(found, DeadZone)
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


def test_more_values_are_no_worse() -> None:
    worst = {}
    for name, resistors in (("E24", E24), ("both", BOTH)):
        found = size(target(), resistors, BASE, frozenset())
        assert isinstance(found, DeadZone)
        worst[name] = max(found.slope_error, found.null_error)
    assert worst["both"] <= worst["E24"] + 1e-9


def test_what_leaves_none_is_named() -> None:
    assert size(target(gain=1e-3), E24, BASE, frozenset()) == "stop slope"
    assert size(target(threshold=1e-5), E24, BASE, frozenset()) == "dead-zone null"


def test_tiny_catalogues_are_answered() -> None:
    for count in (1, 2, 4, 8):
        found = size(target(), E24[24 : 24 + count], BASE, frozenset())
        assert isinstance(found, DeadZone | str)
