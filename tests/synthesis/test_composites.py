"""Composites: against enumeration on a tiny list, and the paper's case in E24."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache, partial
from itertools import combinations_with_replacement, product
from pathlib import Path

import numpy as np
import pytest

from designer.board.bom import bill
from designer.board.component import components, designator
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.coefficients import EXACT
from designer.circuit.design import Design
from designer.circuit.resistors import effective
from designer.folders.design_source import read_design
from designer.jobs.options import Options
from designer.jobs.synthesise_job import synthesise_into
from designer.model.board_table import BoardChoice
from designer.model.circuit_table import CircuitSpec
from designer.model.find_responses import Peaks, Reach
from designer.model.model import Dimensionless
from designer.model.model_file import parse_model_file
from designer.synthesis import composites, parts_choice
from designer.synthesis.composites import Pair, PairProgram, best, pairs_near
from tests.shared.model_text import dimensionless
from tests.shared.oracles import Plain, coefficient_error, elementary_vectors
from tests.shared.quick_folders import without_starts

pytestmark = pytest.mark.usefixtures("figures_are_blank")

# What each side condition costs is asked where a test is about it: it doubles the time.
synthesise = partial(parts_choice.synthesise, binding=False)

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CATALOG = load_catalog()
PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
PEAKS = Peaks(np.array([0.452, 0.787, 0.571, 0.877]), (Reach(0.202, 0.0),), 36.0)
E12, E24 = CircuitSpec(resistors=("E12",)), CircuitSpec(resistors=("E24",))


def test_a_pair_is_what_its_parts_make() -> None:
    assert Pair("series", 20e3, 10e3).value == 30e3
    assert Pair("parallel", 20e3, 20e3).value == 10e3


def test_tables_hold_every_near_pair_and_nothing_that_is_one_part() -> None:
    values = np.array([1e3, 2e3, 3e3, 6e3])
    found = {(p.kind, p.a, p.b) for p in pairs_near(values, 3e3, 0.5)}
    every = set()
    for a, b in combinations_with_replacement(sorted(values.tolist(), reverse=True), 2):
        every |= {("series", a, b), ("parallel", a, b)}
    # 2k + 1k and 6k || 6k are 3k exactly: one part does it.
    assert found == every - {("series", 2e3, 1e3), ("parallel", 6e3, 6e3)}


def test_of_too_many_pairs_the_window_is_covered_evenly() -> None:
    values = CATALOG.values("resistor", ("E96",), 1e3, 1e6, 0.01)
    found = pairs_near(values, 1.23456e4, 0.05)
    logs = np.log([p.value / 1.23456e4 for p in found])
    assert len(found) == composites.MOST_PAIRS
    assert (np.diff(logs) >= 0.0).all()
    assert logs[0] < -0.045
    assert logs[-1] > 0.045
    assert np.diff(logs).max() < 0.01


@pytest.mark.parametrize("seed", range(6))
def test_never_worse_than_enumeration(seed: int) -> None:
    """Four errors, one scale, three resistors with every pair of two values, all choices."""
    rng = np.random.default_rng(seed)
    values = np.sort(rng.uniform(1e3, 1e4, 2))
    D = np.array([[1.0], [1.0], [-1.0], [0.5]])
    slopes = rng.integers(-1, 2, (3, 4)).astype(float)
    tables, changes = {}, {}
    for i, slope in enumerate(slopes):
        table = pairs_near(values, float(values[i % 2]), 10.0)
        tables[f"R{i}"] = table
        changes[f"R{i}"] = np.outer(slope, np.log([p.value / values[i % 2] for p in table]))
    program = PairProgram(0.01 * rng.standard_normal(4), D, tables, changes, frozenset())
    chosen = best(program, frozenset())
    options = [np.column_stack([np.zeros(4), change]).T for change in changes.values()]
    numbers = list(product(*(range(len(option)) for option in options)))
    vectors = elementary_vectors(D)
    # The least error over the scale is the largest of the elementary combinations (duality).
    errors = [
        np.abs(vectors @ sum((o[k] for o, k in zip(options, ks, strict=True)), program.h)).max()
        for ks in numbers
    ]
    pairs = [np.count_nonzero(ks) for ks in numbers]
    least = max(min(errors), EXACT)
    own = tuple(1 + tables[n].index(chosen[n]) if n in chosen else 0 for n in tables)
    assert errors[numbers.index(own)] <= least + 2.0 * EXACT
    assert len(chosen) == min(n for e, n in zip(errors, pairs, strict=True) if e <= least + EXACT)


def test_of_curved_effects_at_most_one_is_used() -> None:
    """Two resistors whose effects do not add: each alone halves the error, together it is gone."""
    table = (Pair("series", 2e3, 1e3),)
    half = np.array([[-0.01], [0.0]])
    changes = {"R1": half, "R2": half}
    D = np.zeros((2, 1))
    h = np.array([0.02, 0.0])
    free = best(PairProgram(h, D, dict.fromkeys(changes, table), changes, frozenset()), frozenset())
    held = best(
        PairProgram(h, D, dict.fromkeys(changes, table), changes, frozenset(changes)), frozenset()
    )
    assert (len(free), len(held)) == (2, 1)


@cache
def design(names: tuple[str, ...] | bool) -> Design:
    return synthesise(PAPER, replace(E24, composites=names), CATALOG, PEAKS)


def truth(made: Design) -> float:
    values = effective(made.circuit.values, made.composites)
    m = dimensionless(made.model)
    return coefficient_error(values, Plain(m.m, m.k, m.k0, m.c, m.zeta, m.f20, m.b))


@pytest.mark.slow
@pytest.mark.parametrize("names", [True, ("R50", "R210")])
def test_the_paper_s_case_in_e24_is_exact_with_composites(names: bool | tuple[str, ...]) -> None:
    """Of the first linear block no pairs are enough; those of one beside it are."""
    alone, made = design(False), design(names)
    assert alone.errors.max_error > EXACT >= made.errors.max_error
    assert truth(made) == pytest.approx(made.errors.max_error, abs=2e-7)
    assert made.certificate.status == "optimal"
    assert made.composites
    assert isinstance(names, bool) or set(made.composites) <= set(names)
    series = CATALOG.values("resistor", ("E24",), 1e3, 1e6, 0.01)
    values = made.circuit.values
    for name, kind in made.composites.items():
        assert name not in values
        assert {values[f"{name}A"], values[f"{name}B"]} <= set(series)
        net = f"{name.lower()}m"
        assert (net in made.circuit.nets) is (kind == "series")
    bought = {
        d
        for row in bill(components(made.circuit, CATALOG, BoardChoice.of(E24)))
        for d in row.designators
    }
    assert {designator(f"{n}{part}") for n in made.composites for part in "AB"} <= bought


def test_without_any_that_may_be_one_nothing_changes() -> None:
    none, never = (
        synthesise(PAPER, replace(E12, composites=names), CATALOG, PEAKS) for names in ((), False)
    )
    assert none.circuit == never.circuit


@pytest.mark.slow
@pytest.mark.parametrize(
    "matched",
    [
        (("R208", "R209"),),
        pytest.param((("R208", "R209"), ("R50", "R7")), marks=pytest.mark.slow),
    ],
)
def test_matched_parts_stay_single(matched: tuple[tuple[str, str], ...]) -> None:
    names = ("R208", "R209", "R50", "R7", "R210", "R1")
    spec = replace(E24, composites=names, matched=matched)
    made = synthesise(PAPER, spec, CATALOG, PEAKS)
    values = made.circuit.values
    for one, other in matched:
        assert values[one] == values[other]
    if len(matched) == 1:
        assert made.composites, "others may still be two parts"


@pytest.mark.slow
def test_a_design_folder_with_composites_is_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_starts(monkeypatch)
    text = (EXAMPLES / "paper.toml").read_text(encoding="utf-8")
    one = '[[response]]\nomega = 1.55\nexpect = "1-1-1"\n\n'
    text = text[: text.index("[[response]]")] + one + text[text.index("[circuit]") :]
    text = text.replace('resistors = "E96"', 'resistors = "E24"')
    modelfile = parse_model_file(text.replace("composites = false", 'composites = ["R50", "R210"]'))
    out = tmp_path / "out"
    answer = synthesise_into(modelfile, out, Options()).answer
    again = read_design(out)
    assert again.design.circuit.values == answer["parts"]
    assert again.design.composites
    assert len(again.design.checks) == len(answer["conditions"]["checked"]) > 0
    said = json.loads((out / "design.json").read_text())
    assert said["composites"] == again.design.composites
    assert {"R50A", "R50B"} <= set(said["parts"])
    assert set(said["conditions"]) >= {"swing_v", "checked", "at_limit", "binding"}
