"""Where the text of a figure stands, as matplotlib draws it."""

from __future__ import annotations

from itertools import combinations
from typing import Any
from unittest import mock

from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

SLACK = 1.0
"""Pixels that a box may reach beyond another's edge: boxes include the room of ascenders."""


def _drawn(figure: Figure) -> list[tuple[str, Bbox]]:
    """Every text that is drawn and not tilted, with its box in pixels."""
    met: list[Text] = []
    draw = Text.draw

    def record(text: Text, renderer: Any, *args: Any, **kwargs: Any) -> None:
        draw(text, renderer, *args, **kwargs)
        if text.get_visible() and text.get_text().strip() and not text.get_rotation() % 90.0:
            met.append(text)

    with mock.patch.object(Text, "draw", record):
        figure.canvas.draw()
    unique = {id(text): text for text in met}.values()
    return [(text.get_text(), Text.get_window_extent(text)) for text in unique]


def clipped(figure: Figure) -> list[str]:
    """Texts that reach beyond the figure's edges."""
    edge = figure.bbox
    return [
        text
        for text, box in _drawn(figure)
        if min(box.x0 - edge.x0, box.y0 - edge.y0, edge.x1 - box.x1, edge.y1 - box.y1) < -SLACK
    ]


def overlapping(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of texts whose boxes cover each other."""
    return [
        (a, b)
        for (a, first), (b, second) in combinations(_drawn(figure), 2)
        for both in [Bbox.intersection(first, second)]
        if both is not None and both.width > SLACK and both.height > SLACK
    ]
