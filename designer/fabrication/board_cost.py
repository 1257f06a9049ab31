"""What a finished board costs, estimated: its parts, the bare board, the assembly.

Parts count with the price of a distributor's list where one states it for so many pieces, else with
the price of their class (docs/fabrication.md). Nothing here is a quotation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from designer.base.errors import InputError
from designer.base.views import View
from designer.board.board_parts import Designed, board_circuit
from designer.board.bom import Line, bill
from designer.board.component import Component, components, to_buy
from designer.board.footprints import footprint
from designer.board.kicad_placement import place
from designer.catalog.entries import BuildCost
from designer.catalog.parts_catalog import Catalog

if TYPE_CHECKING:
    from designer.answers.design_answer import BoardCostRow, OrderCost

Assembly = Literal["surface", "mixed", "through hole"]
"""How the parts are soldered: all on the surface, some of them through holes, or all of them."""
DM2 = 1e-4
"""Square decimetres in a square millimetre."""
CAVEAT = (
    "Estimates, without tax and transport: parts count with the price of their class, the rest "
    "with assumed rates (catalogs/costs.toml). They are no quotation."
)
"""What is said beside the figures."""


@dataclass(frozen=True)
class BoardSize:
    """What of a board its maker and its assembler charge for."""

    area: float
    """Area of the bare board [dm²]."""
    surface_parts: int
    """Parts that are soldered on the surface."""
    through_parts: int
    """Parts that are soldered through holes."""

    @property
    def assembly(self) -> Assembly:
        """The class of its assembly."""
        if not self.through_parts:
            return "surface"
        return "mixed" if self.surface_parts else "through hole"


@dataclass(frozen=True)
class BoardCost:
    """What one board costs in an order of so many, in euro without tax and transport."""

    boards: int
    """How many boards are ordered at once."""
    parts: float
    """Its parts [€]."""
    bare_board: float
    """The board without parts [€]."""
    assembly: float
    """Soldering by an assembler [€]."""
    listed: int
    """Pieces whose price a distributor's list states; the others count with their class."""

    @property
    def total(self) -> float:
        """All together [€]."""
        return self.parts + self.bare_board + self.assembly

    def as_dict(self) -> OrderCost:
        """Plain data by the keys of docs/contract.md."""
        return {
            "boards": self.boards,
            "parts": self.parts,
            "bare_board": self.bare_board,
            "assembly": self.assembly,
            "listed": self.listed,
            "total": self.total,
        }


@dataclass(frozen=True)
class CostEstimate:
    """What the boards of a design cost."""

    size: BoardSize
    """What is charged for."""
    costs: tuple[BoardCost, ...]
    """One for each size of order that the catalogue knows, ascending."""

    def as_dict(self) -> BoardCostRow:
        """Plain data by the keys of docs/contract.md."""
        return {
            "estimate": True,
            "assembly_class": self.size.assembly,
            "area_dm2": self.size.area,
            "surface_parts": self.size.surface_parts,
            "through_parts": self.size.through_parts,
            "euro": [cost.as_dict() for cost in self.costs],
        }


def cost_estimate(synthesis: Designed) -> CostEstimate:
    """What the boards of a design cost, placed as the tool places them.

    Raises
    ------
    InputError : a footprint that is not known here, or a part that is not in the catalogue.
    Unreachable : a value that cannot be bought.
    """
    circuit, choice = board_circuit(synthesis)
    catalog = synthesis.catalog
    parts = components(circuit, catalog, choice)
    lines = bill(to_buy(parts, choice), catalog.stock)
    outline = place(circuit, [c for c in parts if View.BOARD in c.views]).outline
    size = board_size(outline.width * outline.height, parts)
    return CostEstimate(
        size,
        tuple(
            board_cost(lines, size, build, catalog)
            for build in sorted(catalog.build_costs, key=lambda build: build.boards)
        ),
    )


def cost_or_none(synthesis: Designed) -> CostEstimate | None:
    """As ``cost_estimate``; None where there can be no board, for want of a footprint."""
    try:
        return cost_estimate(synthesis)
    except InputError:
        return None


def board_size(area: float, parts: Sequence[Component]) -> BoardSize:
    """What is charged for of a board of this area [mm²] with these components."""
    soldered = [
        footprint(c.footprint).through_hole
        for c in parts
        if c.bought is not None and View.BOM in c.views
    ]
    return BoardSize(DM2 * area, soldered.count(False), soldered.count(True))


def board_cost(
    lines: Sequence[Line], size: BoardSize, build: BuildCost, catalog: Catalog
) -> BoardCost:
    """One board in an order of ``build.boards``."""
    prices = [(one.quantity, _listed_price(one, build.boards)) for one in lines]
    classes = [build.part_factor * catalog.euro(one.price_class) for one in lines]
    assembly = build.assembly_order + build.assembly_line * len(lines)
    return BoardCost(
        boards=build.boards,
        parts=sum(
            count * (usual if price is None else price)
            for (count, price), usual in zip(prices, classes, strict=True)
        ),
        bare_board=build.board_order / build.boards + build.board_area * size.area,
        assembly=assembly / build.boards
        + build.surface_part * size.surface_parts
        + build.through_part * size.through_parts,
        listed=sum(count for count, price in prices if price is not None),
    )


def _listed_price(one: Line, boards: int) -> float | None:
    """The price of the nearest list that states one for so many pieces [€], or None."""
    pieces = one.quantity * boards
    priced = [row for row in one.stock if row.price is not None and row.from_pieces <= pieces]
    same = [row for row in priced if row.distributor == priced[0].distributor]
    return max(same, key=lambda row: row.from_pieces).price if same else None


def cost_words(estimate: CostEstimate) -> str:
    """What is charged for, and what the figures are worth."""
    size, listed = estimate.size, max((cost.listed for cost in estimate.costs), default=0)
    text = (
        f"One board of {size.area:.2f} dm², {size.surface_parts} parts on the surface, "
        f"{size.through_parts} through holes (class of the assembly: {size.assembly}). {CAVEAT}"
    )
    more = f" Of up to {listed} pieces a distributor's list states the price." if listed else ""
    return text + more


def cost_markdown(estimate: CostEstimate) -> str:
    """A section of ``board.md``."""
    rows = ["| boards | parts | bare board | assembly | one board |", "|---|---|---|---|---|"]
    for cost in estimate.costs:
        figures = (cost.parts, cost.bare_board, cost.assembly, cost.total)
        rows.append(f"| {cost.boards} | {' | '.join(f'{euro:.2f} €' for euro in figures)} |")
    return "\n\n".join(("## Cost, estimated", cost_words(estimate), "\n".join(rows))) + "\n"
