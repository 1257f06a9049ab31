"""Whole cures of one response with one kind of upgrade left, each against every option measured by
itself on boards of another seed."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import pytest

from designer.api import Synthesis, synthesise
from designer.cure_branch import KINDS, cured
from designer.cure_search import find_cure
from designer.cure_study import Book, Measured, asked, measure, plan_of
from designer.cure_trial import Cure
from designer.modelfile import parse_model_file
from designer.upgrade import Upgrades, price

BAND = 0.05
OTHER_SEED = 4242


@cache
def design(p: int, omega: float, zone: str) -> Synthesis:
    """For one 1-p-p response of the paper's model, from E24 parts of 1 %."""
    return synthesise(
        parse_model_file(
            "format = 1\n[model]\nm = 0.5\nk = 0.5\nk0 = 0.95\nc = 0.5\nzeta = 0.1\nf20 = 0.0\n"
            f'b = 0.25\n[[response]]\nomega = {omega}\nexpect = "1-{p}-{p}"\n'
            f'[circuit]\nsaturation = 13.0\nresistors = "E24"\ndead_zone = "{zone}"\n'
            f"[tuning]\noffset = {BAND}\n"
        )
    )


def only(kind: str, base: Synthesis, target: float) -> Cure:
    return find_cure(base, target, trim=BAND, without=frozenset(KINDS) - {kind}, seed=3, jobs=1)


def measured(base: Synthesis, upgrades: Upgrades, target: float) -> Measured:
    """The yield of a choice on boards that the cure has not seen."""
    made = cured(base, upgrades)
    (question,) = asked(made, made.found)
    assert question is not None
    plan = plan_of(made, question, OTHER_SEED)
    return measure(plan, target, Book(), trim=upgrades.trim, least=1000, most=1000)


def cheapest(base: Synthesis, options: Iterable[Upgrades], target: float) -> float | None:
    """The least price of the options that reach the target; None where none does."""
    prices = [
        price(cured(base, u)) - price(base) for u in options if measured(base, u, target).reached
    ]
    return min(prices, default=None)


def agrees(found: Cure, options: Iterable[Upgrades]) -> None:
    """The cure is the cheapest of all options, each measured by itself."""
    least = cheapest(found.base, options, found.target)
    assert found.reached == (least is not None), found.why
    if least is not None:
        assert found.best.price == pytest.approx(least, abs=1e-9)
        assert measured(found.base, found.best.upgrades, found.target).reached


@pytest.mark.slow
def test_a_trim_is_taken_where_it_is_enough() -> None:
    base = design(5, 0.337, "saturation")
    found = only("trim", base, 0.97)
    agrees(found, [Upgrades(), Upgrades(trim=BAND)])
    assert found.best.upgrades == Upgrades(trim=BAND)


@pytest.mark.slow
def test_a_trim_that_is_not_enough_is_told() -> None:
    base = design(6, 0.284, "saturation")
    found = only("trim", base, 0.97)
    agrees(found, [Upgrades(), Upgrades(trim=BAND)])
    assert not found.reached
