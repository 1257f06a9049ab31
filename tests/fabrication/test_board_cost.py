"""What a board costs: sums that can be done by hand, and what they follow."""

from __future__ import annotations

from dataclasses import replace

import pytest

from designer.board.bom import Line, bill
from designer.catalog.entries import BuildCost
from designer.catalog.stock_list import StockRow
from designer.fabrication.board_cost import (
    BoardSize,
    board_cost,
    board_size,
    cost_estimate,
    cost_markdown,
)
from tests.board.test_bom_layouts import listed
from tests.shared.paper_cases import synthesised
from tests.shared.stages import CATALOG

BUILD = BuildCost(10, 2.0, 30.0, 4.0, 20.0, 5.0, 0.01, 0.5, "a test")
SIZE = BoardSize(1.5, 40, 6)


def line(price_class: int, quantity: int, *stock: StockRow) -> Line:
    names = tuple(f"R{i}" for i in range(quantity))
    return Line(quantity, names, "1k", "", "M", "P", "F:F", "", price_class, "", stock=stock)


def sold(distributor: str, price: float | None, from_pieces: int) -> StockRow:
    nan = float("nan")
    return StockRow("P", None, nan, "", nan, distributor, "1", price, from_pieces, "2026-01-05", "")


def test_the_sum_by_hand() -> None:
    cost = board_cost([line(3, 4), line(5, 1)], SIZE, BUILD, CATALOG)
    assert cost.parts == pytest.approx(2.0 * (4 * 0.11 + 2.2))
    assert cost.bare_board == pytest.approx(30.0 / 10 + 4.0 * 1.5)
    assert cost.assembly == pytest.approx((20.0 + 5.0 * 2) / 10 + 40 * 0.01 + 6 * 0.5)
    assert cost.total == pytest.approx(cost.parts + cost.bare_board + cost.assembly)
    assert cost.listed == 0


@pytest.mark.parametrize(
    ("stock", "each"),
    [
        ((sold("A", 0.5, 1), sold("A", 0.3, 40), sold("A", 0.2, 41), sold("B", 0.1, 1)), 0.3),
        ((sold("A", 0.5, 41), sold("B", 0.4, 1)), 0.4),
        ((sold("A", None, 1), sold("B", 0.4, 1)), 0.4),
        ((sold("A", 0.5, 41),), 2.0 * 0.11),
    ],
)
def test_a_listed_price_for_so_many_pieces_comes_before_the_class(
    stock: tuple[StockRow, ...], each: float
) -> None:
    """Four pieces on each of ten boards."""
    cost = board_cost([line(3, 4, *stock)], SIZE, BUILD, CATALOG)
    assert cost.parts == pytest.approx(4 * each)
    assert cost.listed == (0 if each == 2.0 * 0.11 else 4)


def test_the_class_of_the_assembly() -> None:
    found = listed("paper")
    size = board_size(20_000.0, found)
    pieces = sum(one.quantity for one in bill(found))
    assert size.area == pytest.approx(2.0)
    assert size.surface_parts + size.through_parts == pieces
    assert size.assembly == "mixed"
    assert replace(size, through_parts=0).assembly == "surface"
    assert replace(size, surface_parts=0).assembly == "through hole"


def test_a_design_is_estimated_for_every_order_that_the_catalogue_knows() -> None:
    estimate = cost_estimate(synthesised())
    assert [cost.boards for cost in estimate.costs] == [1, 10, 100]
    totals = [cost.total for cost in estimate.costs]
    assert totals == sorted(totals, reverse=True), "more boards are no dearer"
    text = cost_markdown(estimate)
    assert "They are no quotation" in text
    assert f"| 100 | {estimate.costs[2].parts:.2f} €" in text
    assert estimate.as_dict()["euro"][0]["total"] == pytest.approx(totals[0])
    assert all(build.assumed and build.source for build in CATALOG.build_costs)
