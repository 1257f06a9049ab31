"""Figures that are composed but not rendered, which takes most of the time of a small study; what
is composed a second time for another format is left out."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

_SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="1pt" height="1pt" viewBox="0 0 1 1"></svg>'


@contextmanager
def blank_figures() -> Iterator[None]:
    """Inside, a figure is saved as one empty point, and so is the schematic's picture beside its
    SVG; a live plot of a page, which shows what its figure shows, is an empty object."""
    from matplotlib.figure import Figure
    from PIL import Image

    from designer.report import interactive_plots
    from designer.schematic import schematic_drawing

    def blank(_: Figure, target: Any, *, format: str = "png", **__: object) -> None:
        if format == "svg":
            target.write(_SVG)
        else:
            Image.new("RGB", (1, 1)).save(target, "png")

    point = io.BytesIO()
    Image.new("RGB", (1, 1)).save(point, "png")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Figure, "savefig", blank)
        patched.setattr(schematic_drawing, "png", lambda *_, **__: point.getvalue())
        patched.setattr(interactive_plots, "document", lambda _: "{}")
        patched.setattr(interactive_plots, "_made", lambda _: "{}")
        yield
