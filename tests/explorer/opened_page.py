"""Pages of the explorer in Chromium, and the labels that their plots draw."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

WAIT = 60_000.0
"""Milliseconds that a picture may take on a machine that is busy with all other tests."""
APART = 2.0
"""Pixels that lie between two labels at least."""
WATCH = """
  window.written = new Map();
  const { clearRect, fillText } = CanvasRenderingContext2D.prototype;
  CanvasRenderingContext2D.prototype.clearRect = function (...area) {
    written.set(this.canvas, []);
    clearRect.apply(this, area);
  };
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...more) {
    const m = this.measureText(text), { a, b, c, d, e, f } = this.getTransform();
    const scale = devicePixelRatio;
    const corners = [-m.actualBoundingBoxLeft, m.actualBoundingBoxRight].flatMap((across) =>
      [-m.actualBoundingBoxAscent, m.actualBoundingBoxDescent].map((down) =>
        [a * (x + across) + c * (y + down) + e, b * (x + across) + d * (y + down) + f]));
    const [xs, ys] = [0, 1].map((k) => corners.map((corner) => corner[k] / scale));
    if (!written.has(this.canvas)) written.set(this.canvas, []);
    written.get(this.canvas).push({ text, left: Math.min(...xs), right: Math.max(...xs),
      top: Math.min(...ys), bottom: Math.max(...ys), width: this.canvas.width / scale,
      height: this.canvas.height / scale });
    fillText.call(this, text, x, y, ...more);
  };
"""
"""Keeps for every canvas what is written on it since it was cleared, with the box of the ink."""


@contextmanager
def chromium() -> Iterator[Browser]:
    """The browser."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox"]
        )
        yield browser
        browser.close()


def opened(browser: Browser, address: str, **options: object) -> Page:
    """A page whose first picture is drawn, and which has no error."""
    page = browser.new_page(**options)  # type: ignore[arg-type]
    page.set_default_timeout(WAIT)
    page.add_init_script(WATCH)
    page.on("pageerror", lambda error: pytest.fail(str(error)))
    page.goto(address)
    page.wait_for_selector("html[data-drawn]")
    return page


@dataclass(frozen=True)
class DrawnText:
    """A text on a canvas, and the box of its ink there."""

    text: str
    left: float
    right: float
    top: float
    bottom: float
    width: float
    """Of the canvas."""
    height: float

    def meets(self, other: DrawnText) -> bool:
        """Whether the boxes overlap, or lie so near that they read as one text."""
        return (
            self.left < other.right + APART
            and other.left < self.right + APART
            and self.top < other.bottom + APART
            and other.top < self.bottom + APART
        )

    @property
    def whole(self) -> bool:
        """Whether nothing of it lies outside its canvas."""
        inside = self.left >= 0.0 and self.top >= 0.0
        return inside and self.right <= self.width and self.bottom <= self.height


def drawn_texts(page: Page) -> list[list[DrawnText]]:
    """What each plot has written since it was last cleared: labels of ticks and of axes."""
    each = page.evaluate("() => [...written.values()].filter((texts) => texts.length)")
    return [[DrawnText(**text) for text in texts] for texts in each]


def check_labels(page: Page, plots: int) -> set[str]:
    """All labels of so many plots, none of which meets another or is cut."""
    page.wait_for_timeout(500)  # the diagram comes in pieces
    canvases = drawn_texts(page)
    assert len(canvases) == plots
    for texts in canvases:
        assert len(texts) > 5, "two axes, each with its name and at least two ticks"
        for k, each in enumerate(texts):
            assert each.whole, f"{each} is cut"
            for other in texts[:k]:
                assert not each.meets(other), f"{each} meets {other}"
    return {each.text for texts in canvases for each in texts}
