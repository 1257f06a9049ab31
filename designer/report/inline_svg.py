"""SVG documents as parts of a page: no identifiers that clash, colours that follow the page.

A figure of ``base.figure_style`` and a drawing of ``schematic.schematic_drawing`` state their
colours outright, since they also stand alone. Inside a page each of these colours is a CSS
variable, whose values for a light page, a dark page and paper stand in ``templates/page.css.j2``.
"""

from __future__ import annotations

import math
import re
from itertools import count

from markupsafe import Markup

VARIABLES = {
    "#000000": "ink",
    "#1a1a1a": "ink",
    "#5c5c5c": "soft",
    "#8a8a8a": "axis",
    "#e3e3e3": "grid",
    "#f1ece0": "contact",
    "#ffffff": "page",
    "#7cc4ee": "model",
    "#d55e00": "ngspice",
    "#007a5a": "impact",
    "#0072b2": "ok",
    "#e69f00": "lost",
    "#cc79a7": "grazing",
    "#9a9a9a": "failed",
    "#9fcbe6": "pale",
    "#c6dff0": "band",
    "#d9d9d9": "none",
}
"""Name of the CSS variable, without its prefix ``--plot-``, by the colour that it replaces."""

_NAMES = {"black": "#000000", "white": "#ffffff"}
_COLOUR = re.compile(r"\b(fill|stroke|background-color)(:\s*|=\")(#[0-9a-f]{6}|black|white)\b")
_DROPPED = re.compile(
    r"<!--.*?-->|<style\b.*?</style>|\s(?:xmlns|xmlns:xlink|xml:lang|version)=\"[^\"]*\"",
    re.DOTALL,
)
_ID = re.compile(r'\sid="([^"]*)"')
_REFERENCE = re.compile(r'((?:xlink:)?href="#|url\(#)([^")]+)')
_GLYPH = re.compile(r'<path id="(DejaVuSans[\w-]*)"[^>]*/>')
"""A letter, drawn alike in every picture that has it."""
_ROOT = re.compile(r"<svg\b([^>]*)>")
LEAST_LETTERS = 9.5
"""Pixels of a screen that the smallest letters of a drawing are to have."""
_LETTERS = re.compile(r'\sfont-size="([\d.]+)')
_BOX = re.compile(r'\sviewBox="[-\d.]+ [-\d.]+ ([\d.]+)')
_SIZE = re.compile(r'\s(?:width|height|style|role|aria-label)="[^"]*"')


class InlineSvg:
    """Documents of one page; each gets identifiers of its own, in the order of the calls."""

    def __init__(self) -> None:
        self._numbers = count(1)
        self._glyphs: dict[str, str] = {}

    def element(self, svg: str, label: str) -> Markup:
        """The ``<svg>`` element of a page for the document ``svg``.

        svg : trusted markup, as ``figure_style.to_svg`` and ``schematic_drawing.svg`` write it,
        with text escaped. label : what the picture shows, in words, for those who cannot see it;
        escaped here.
        """
        prefix = f"s{next(self._numbers)}-"
        text = _GLYPH.sub(lambda m: self._first(m, prefix), _DROPPED.sub("", svg))
        used = {match[2] for match in _REFERENCE.finditer(text)}
        text = _ID.sub(lambda m: f' id="{prefix}{m[1]}"' if m[1] in used else "", text)
        text = _REFERENCE.sub(
            lambda m: f"{m[1].removeprefix('xlink:')}{self._glyphs.get(m[2], prefix + m[2])}", text
        )
        text = text.replace("xlink:href=", "href=")
        text = _COLOUR.sub(_variable, text)
        root = Markup('<svg role="img" aria-label="{}"').format(label)
        return Markup(_ROOT.sub(lambda m: f"{root}{_SIZE.sub('', m[1])}>", text, count=1).strip())

    def _first(self, glyph: re.Match[str], prefix: str) -> str:
        """A letter where the page has it for the first time; nothing where it has it already."""
        known = glyph[1] in self._glyphs
        self._glyphs.setdefault(glyph[1], prefix + glyph[1])
        return "" if known else glyph[0]


def legible_width(svg: str) -> int:
    """Pixels that a drawing with text has to be wide so that its smallest letters have
    ``LEAST_LETTERS``; 0 where it has no text."""
    letters, box = [float(size) for size in _LETTERS.findall(svg)], _BOX.search(svg)
    if not letters or box is None:
        return 0
    return math.ceil(float(box[1]) * LEAST_LETTERS / min(letters))


def _variable(match: re.Match[str]) -> str:
    """The declaration of a colour by its variable; as an attribute it becomes a style."""
    name, sign, colour = match.groups()
    variable = VARIABLES.get(_NAMES.get(colour, colour))
    if variable is None:
        return match[0]
    value = f"var(--plot-{variable})"
    return f'style="{name}: {value}' if sign.startswith("=") else f"{name}: {value}"
