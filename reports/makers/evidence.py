"""What a report shows of a system: quantities held against closed forms, prose and pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from designer.base.figure_style import GRID
from designer.base.page import Block, Picture, Table, table
from designer.base.plain_json import plain
from designer.model.model_file import ModelFile


@dataclass(frozen=True)
class Comparison:
    """A quantity that the tool computed beside one that is known without it."""

    quantity: str
    """What it is, in words."""
    expected: float
    """By a closed form."""
    computed: float
    """By the tool."""

    @property
    def difference(self) -> float:
        """Of the two, over the expected one."""
        return self.computed / self.expected - 1.0


@dataclass(frozen=True)
class Evidence:
    """A part of a report."""

    title: str
    """Heading of the section."""
    blocks: Sequence[Block]
    """What stands below it."""
    figures: Mapping[str, Figure] = field(default_factory=dict)
    """Figures by name; ``pictures`` among the blocks shows them."""
    comparisons: tuple[Comparison, ...] = ()
    """What was held against closed forms."""
    numbers: Mapping[str, Any] = field(default_factory=dict)
    """Further results, for JSON."""

    def as_dict(self) -> dict[str, object]:
        """Plain, for JSON."""
        rows = [{**c.__dict__, "difference": c.difference} for c in self.comparisons]
        return {"title": self.title, "comparisons": plain(rows), **plain(self.numbers)}


@dataclass(frozen=True)
class Example:
    """What the report on one model file has that others have not."""

    show: Callable[[ModelFile], list[Evidence]]
    """Makes the parts that hold the model against closed forms."""
    see: str
    """What there is to see, in words."""
    board: str
    """What of it the board shows, and what it cannot."""


def figure_block(name: str, caption: str) -> Picture:
    """The place of a figure in the page."""
    return Picture(name, caption, f"{name}.png")


def name_axes(axes: Axes, x: str, y: str) -> None:
    """What is drawn over what, on a grid."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(True, color=GRID, lw=0.5)


def comparison_table(comparisons: Sequence[Comparison], digits: int = 8) -> Table | None:
    """The quantities, a row each. digits : significant ones of the values."""
    rows = [
        (c.quantity, f"{c.expected:.{digits}g}", f"{c.computed:.{digits}g}", f"{c.difference:.1e}")
        for c in comparisons
    ]
    return table(("quantity", "closed form", "computed", "difference"), rows, numeric=(1, 2, 3))
