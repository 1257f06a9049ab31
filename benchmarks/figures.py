"""What a benchmark returns that measures ratios."""

from __future__ import annotations

from collections.abc import Mapping


class Figures(str):
    """A line of figures, with the ratios of two things in one run; larger is better."""

    ratios: Mapping[str, float]
    """By name."""

    def __new__(cls, line: str, ratios: Mapping[str, float]) -> Figures:
        out = super().__new__(cls, line)
        out.ratios = ratios
        return out
