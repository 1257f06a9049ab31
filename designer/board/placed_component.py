"""A component at its place on the board, and the room that it takes. Millimetres, y downwards."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from designer.board.component import Component
from designer.board.footprints import FootprintShape

TEXT, STROKE = 1.0, 0.15
"""Height of a reference on the board, and width of its lines [mm]: the least of the shipped
fabs."""
LETTER = 1.06
"""Width of one of its letters [mm]."""
ROOM = 0.4
"""Distance between cells [mm]."""
Label: TypeAlias = Literal["above", "left", "right"]


@dataclass(frozen=True)
class PlacedComponent:
    """A component on the board."""

    component: Component
    footprint: FootprintShape
    x: float = 0.0
    """Place to the right [mm]."""
    y: float = 0.0
    """Place downwards [mm]."""
    angle: int = 0
    """How far it is turned [degrees]."""

    label: Label = "above"
    """Where its reference stands, as it is seen."""
    pin_labels: tuple[str, ...] = ()
    """What stands right of its pads, in their order, or upright below those of a row across;
    nothing of most."""
    caption: str = ""
    """What stands below it; nothing of most."""

    @property
    def courtyard(self) -> PlacedBox:
        """What nothing else may stand in."""
        left, top, right, bottom = self.footprint.courtyard
        if self.angle == 180:
            left, top, right, bottom = -right, -bottom, -left, -top
        return PlacedBox(self.x + left, self.y + top, self.x + right, self.y + bottom)

    @property
    def label_at(self) -> tuple[float, float]:
        """Middle of its reference, seen from its place [mm]."""
        box, half = self.courtyard, LETTER * len(self.component.reference) / 2.0
        if self.label == "above":
            return 0.0, box.top - self.y - 0.25 - TEXT / 2.0
        if self.label == "left":
            return box.left - self.x - 0.1 - half, 0.0
        return box.right - self.x + 0.1 + half, 0.0

    @property
    def box(self) -> PlacedBox:
        """Its courtyard with the room for its reference."""
        box, half = self.courtyard, LETTER * len(self.component.reference) / 2.0
        x, y = self.label_at
        below = LETTER * len(self.caption) / 2.0
        labels = LETTER * max(map(len, self.pin_labels), default=0)
        across = self.footprint.across
        return PlacedBox(
            min(box.left, self.x + x - half, self.x - below),
            min(box.top, self.y + y - TEXT / 2.0 - 0.15),
            max(
                box.right + labels * (not across),
                self.x + x + half,
                self.x + below,
            ),
            max(
                box.bottom + (0.25 + TEXT) * bool(self.caption) + labels * across,
                self.y + y + TEXT / 2.0,
            ),
        )

    def pad(self, number: str) -> tuple[float, float]:
        """Where a pad is."""
        pad = next(p for p in self.footprint.pads if p.number == number)
        sign = -1.0 if self.angle == 180 else 1.0
        return self.x + sign * pad.x, self.y + sign * pad.y

    def moved(self, x: float, y: float) -> PlacedComponent:
        return replace(self, x=self.x + x, y=self.y + y)


@dataclass(frozen=True)
class PlacedBox:
    """An upright rectangle on the board."""

    left: float
    """Its left edge [mm]."""
    top: float
    """Its upper edge [mm]."""
    right: float
    """Its right edge [mm]."""
    bottom: float
    """Its lower edge [mm]."""

    @property
    def width(self) -> float:
        return self.right - self.left

    @property
    def height(self) -> float:
        return self.bottom - self.top


def bounds(spots: Iterable[PlacedComponent]) -> PlacedBox:
    """The rectangle round these components; there has to be one at least."""
    boxes = [s.box for s in spots]
    return PlacedBox(
        min(b.left for b in boxes),
        min(b.top for b in boxes),
        max(b.right for b in boxes),
        max(b.bottom for b in boxes),
    )


def overlap(a: PlacedBox, b: PlacedBox) -> bool:
    """Whether two rectangles have an area in common."""
    return a.left < b.right and b.left < a.right and a.top < b.bottom and b.top < a.bottom
