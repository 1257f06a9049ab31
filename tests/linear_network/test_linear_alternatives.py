"""Other linear blocks of the same error where the dead zone is what limits the circuit."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from designer.catalog.parts_catalog import load_catalog
from designer.circuit.coefficients import EXACT
from designer.linear_network.linear_terms import Shortfall
from designer.model.circuit_table import CircuitSpec
from designer.model.find_responses import Peaks, Reach, find, peaks
from designer.model.model import Dimensionless
from designer.model.model_file import read_model_file
from designer.synthesis import parts_choice
from designer.synthesis.attempt import Attempt, Order, attempt, linear_block
from designer.synthesis.limits import limits
from designer.synthesis.parts_choice import _rest_of, best_alternative

# What each side condition costs is asked where a test is about it: it doubles the time.
synthesise = partial(parts_choice.synthesise, binding=False)

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CATALOG = load_catalog()
PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
PEAKS = Peaks(np.array([0.65, 0.55, 0.65, 0.6]), (Reach(0.4),))
RECTIFIER = CircuitSpec(dead_zone="rectifier")


def test_what_an_interval_leaves_has_no_gap_and_no_overlap() -> None:
    wanted = Order.of(PAPER, RECTIFIER, CATALOG, PEAKS)
    within = limits(RECTIFIER, RECTIFIER.active_conditions, wanted.opamp, 13.0, PEAKS.fastest)
    block = linear_block(wanted, within)
    assert not isinstance(block, Shortfall)
    (above, top), (bottom, below) = _rest_of(block, (1e3, 1e6), "R4")
    others = wanted.resistors[(wanted.resistors >= 1e3) & (wanted.resistors <= 1e6)]
    covered = [(above <= v <= top) + (bottom <= v <= below) for v in others]
    assert covered == [int(v != block.values["R4"]) for v in others]
    for between in ((above, top), (bottom, below)):
        other = linear_block(wanted, within, between=between, level=max(block.least, 1e-9))
        if not isinstance(other, Shortfall):
            assert between[0] <= other.values["R4"] <= between[1]
            assert other.least >= block.bound - EXACT


@pytest.mark.slow
def test_the_best_of_those_tried_is_taken() -> None:
    """Against the first choice, and against every level of R4 tried one by one."""
    spec = replace(RECTIFIER, resistors=("E24",))
    wanted = Order.of(PAPER, spec, CATALOG, PEAKS)
    within = limits(spec, spec.active_conditions, wanted.opamp, 13.0, PEAKS.fastest)
    block = linear_block(wanted, within)
    assert not isinstance(block, Shortfall)
    first = attempt(wanted, within, block)
    best = best_alternative(wanted, within, block, first, partial(attempt, wanted, within))
    assert isinstance(first, Attempt)
    assert isinstance(best, Attempt)
    assert best.errors.max_error <= first.errors.max_error
    errors = [first.errors.max_error]
    for r4 in wanted.resistors:
        other = linear_block(
            wanted, within, between=(r4 - 1e-6, r4 + 1e-6), level=max(block.least, 1e-9)
        )
        if isinstance(other, Shortfall) or other.least > block.least + EXACT:
            continue
        made = attempt(wanted, within, other)
        if isinstance(made, Attempt):
            errors.append(made.errors.max_error)
    assert any(best.errors.max_error == pytest.approx(e, abs=1e-12) for e in errors)
    assert best.errors.max_error <= min(errors) + EXACT or len(errors) > 10


@pytest.mark.slow
def test_the_rectifier_of_the_paper_s_case_is_exact_in_e96() -> None:
    file = read_model_file(EXAMPLES / "paper.toml")
    held = peaks(file.model, find(file.model, file.responses))
    design = synthesise(PAPER, replace(file.circuit, dead_zone="rectifier"), CATALOG, held)
    assert design.errors.max_error <= EXACT
    assert design.certificate.status == "optimal"


@pytest.mark.slow
def test_a_dead_zone_s_own_bound_is_no_bound_of_the_circuit() -> None:
    """19 is no quotient of E24 values: the linear block is exact, the stop's slope is not."""
    file = read_model_file(EXAMPLES / "paper.toml")
    design = synthesise(PAPER, replace(file.circuit, resistors=("E24",)), CATALOG, PEAKS)
    assert design.errors.max_error > EXACT
    assert design.certificate.status == "bound"
    assert design.certificate.lower_bound < EXACT
