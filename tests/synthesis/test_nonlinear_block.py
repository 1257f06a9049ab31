"""What the linear block leaves to the dead zone: the slope's interval, and what binds."""

from __future__ import annotations

import inspect
import re
from dataclasses import replace
from types import ModuleType
from typing import Literal

import numpy as np
import pytest

from designer.base.eseries import series_values
from designer.catalog.output_stage import OutputStage
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.dead_zone_parts import dead_zone_stage
from designer.linear_network import linear_search
from designer.linear_network.linear_terms import Targets
from designer.model.circuit_table import CircuitSpec
from designer.model.find_responses import Peaks, Reach
from designer.model.model import Dimensionless
from designer.synthesis import rectifier_stage, saturating_search, size_dead_zone
from designer.synthesis.dead_zone_target import DeadZoneTarget, slope_interval, target_of
from designer.synthesis.limits import limits
from designer.synthesis.parts_choice import FREES
from designer.synthesis.size_dead_zone import size
from tests.shared.oracles import Plain, coefficient_error

MODEL = Dimensionless(m=0.45, k=0.55, k0=0.95, c=0.4, zeta=0.1, f20=0.0, b=0.25)
TARGETS = Targets.from_state_matrix(MODEL.second_order().state_matrix())
PLAIN = Plain(MODEL.m, MODEL.k, MODEL.k0, MODEL.c, MODEL.zeta, MODEL.f20, MODEL.b)
PEAKS = Peaks(np.array([0.65, 0.55, 0.65, 0.6]), (Reach(0.4),))
CATALOG = load_catalog()


def target(values: dict[str, float], kind: Literal["saturation", "rectifier"]) -> DeadZoneTarget:
    """Of the stage beside this linear block, with 11 V of swing."""
    spec = CircuitSpec(dead_zone=kind)
    within = limits(spec, frozenset({"swing", "load"}), CATALOG.opamp(spec.opamp), 13.0, 1.0)
    stage = dead_zone_stage(MODEL, spec, CATALOG)
    within = replace(within, swing=11.0)
    output = OutputStage(13.0, None, 0.0, "stated")
    return target_of(MODEL, values, stage, within, PEAKS, output=output, supply=15.0)


def linear_block(spread: float, seed: int) -> dict[str, float]:
    """Values of the linear block, each off by a random factor."""
    rng = np.random.default_rng(seed)
    A = np.abs(MODEL.second_order().state_matrix())
    exact = dict.fromkeys(("R1", "R7"), 45000.0) | {
        "R2": 45e3 / A[1, 1], "R3": 45e3 / A[1, 3], "R4": 45e3, "R5": 45e3 / A[1, 2],
        "R8": 45e3 / A[3, 1], "R9": 45e3 / A[3, 3], "R10": 45e3 / A[3, 0],
        "R11": 45e3 / A[3, 2],
    } | dict.fromkeys(("C1", "C2", "C3", "C4"), 10e-9)  # fmt: skip
    off = {k: float(v * np.exp(rng.uniform(-spread, spread))) for k, v in exact.items()}
    return off | {f"R{i}": 10e3 for i in range(100, 108)}


def with_slope(values: dict[str, float], slope: float) -> dict[str, float]:
    """A dead zone without a null error and with this (fv slope)/R50."""
    ones = dict.fromkeys((f"R{i}" for i in range(200, 211)), 10e3)
    # Rt = R204 + R208 + R204 R208/R205 has to be A+ R206 R209/R207 = 30 k.
    return values | ones | {"R203": 30e3, "R50": 1.0 / slope}


@pytest.mark.parametrize("seed", range(6))
def test_inside_the_interval_the_stop_costs_nothing(seed: int) -> None:
    values = linear_block(0.02, seed)
    linear = coefficient_error(values, replace(PLAIN, k0=0.0))
    low, high = slope_interval(values, TARGETS, MODEL.mu)
    assert low <= high
    for slope in (low, high, (low * high) ** 0.5):
        error = coefficient_error(with_slope(values, slope), PLAIN)
        assert error == pytest.approx(linear, abs=1e-7)
    # The ends are the extremes: past them the stop's own error exceeds the linear block's.
    off = float(np.exp(linear + 1e-5))
    for slope in (low / off, high * off):
        assert coefficient_error(with_slope(values, slope), PLAIN) > linear + 1e-6


@pytest.mark.parametrize("kind", ["saturation", "rectifier"])
def test_the_stage_fits_its_linear_block(kind: Literal["saturation", "rectifier"]) -> None:
    values = linear_block(1e-4, 1)
    resistors = series_values(["E24", "E96"], 1e3, 1e6)
    used = frozenset(values.values())
    found = size(target(values, kind), resistors, 10e3, used)
    assert not isinstance(found, str)
    assert found.error <= 1e-5
    if kind == "saturation":
        error = coefficient_error(values | found.values, PLAIN)
        assert error <= coefficient_error(values, replace(PLAIN, k0=0.0)) + found.error + 1e-7
    # x1 fills the swing where its peak is the largest.
    assert found.threshold <= 0.25 * 11.0 / 0.65 * (1 + 1e-3)


def test_what_binds_is_named_and_has_a_cure() -> None:
    values = linear_block(1e-4, 1)
    sold, used = series_values(["E24"], 1e5, 1e6), frozenset(values.values())
    found = size(target(values, "saturation"), sold, 1e5, used)
    assert found == "stop slope"
    assert "resistor_range" in FREES[found]


@pytest.mark.parametrize(
    "module", [linear_search, size_dead_zone, rectifier_stage, saturating_search]
)
def test_whatever_a_search_names_has_a_cure(module: ModuleType) -> None:
    said = re.compile(r'(?:Shortfall\(|return |yield |binding = |rule = )"([a-z][a-z -]+)"')
    named = set(said.findall(inspect.getsource(module)))
    assert named <= set(FREES), named - set(FREES)
    assert named or module is size_dead_zone
