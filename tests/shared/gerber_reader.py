"""A small reader of what a fab is sent: flashes of Gerber X2 files, and holes of Excellon files.

Read are flashes with their aperture, net and pad; drawn copper is left out. An aperture is known by
the rectangle around it, so a pad that is turned by any angle is compared by its own rectangle.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Flash:
    """Copper, or an opening of the mask, that is flashed once."""

    at: tuple[float, float]
    """Its place [mm], y upwards."""
    box: Box
    """Left, bottom, right and top of the aperture about that place [mm]."""
    pad: tuple[str, str]
    """Designator and number of the pad; ("", "") of a via."""
    net: str
    """Name of its net, "" where none is stated."""


def flashes(text: str) -> Iterator[Flash]:
    """Every flash of a Gerber file in mm with six decimals."""
    assert "%FSLAX46Y46*%" in text
    assert "%MOMM*%" in text
    boxes: dict[str, Box] = {}
    attributes: dict[str, str] = {}
    aperture = ""
    for line in text.splitlines():
        if match := re.fullmatch(r"%ADD(\d+)(\w+),([^*]*)\*%", line):
            boxes[match[1]] = _box(match[2], [float(v) for v in match[3].split("X")])
        elif match := re.fullmatch(r"%TO\.([PN]),?(.*)\*%", line):
            attributes[match[1]] = match[2]
        elif line == "%TD*%":
            attributes = {}
        elif match := re.fullmatch(r"D(\d+)\*", line):
            aperture = match[1]
        elif match := re.fullmatch(r"X(-?\d+)Y(-?\d+)D03\*", line):
            reference, number, *_ = (*attributes.get("P", "").split(","), "")
            at = int(match[1]) / 1e6, int(match[2]) / 1e6
            yield Flash(at, boxes[aperture], (reference, number), attributes.get("N", ""))


def _box(kind: str, values: list[float]) -> Box:
    if kind == "C":
        half = values[0] / 2.0
        return -half, -half, half, half
    if kind in ("R", "O"):
        return -values[0] / 2.0, -values[1] / 2.0, values[0] / 2.0, values[1] / 2.0
    assert kind == "RoundRect", kind
    radius, xs, ys = values[0], values[1:9:2], values[2:9:2]
    return min(xs) - radius, min(ys) - radius, max(xs) + radius, max(ys) + radius


def holes(text: str) -> list[tuple[float, float, float]]:
    """x, y (upwards) and diameter of every hole of an Excellon file in mm."""
    assert "METRIC" in text
    sizes = {tool: float(size) for tool, size in re.findall(r"^T(\d+)C([\d.]+)$", text, re.M)}
    out, size = [], 0.0
    for line in text.split("\nM30")[0].splitlines():
        if match := re.fullmatch(r"T(\d+)", line):
            size = sizes[match[1]]
        elif match := re.fullmatch(r"X(-?[\d.]+)Y(-?[\d.]+)", line):
            out.append((float(match[1]), float(match[2]), size))
    return out
