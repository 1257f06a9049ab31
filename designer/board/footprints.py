"""Footprints by KiCad's names: which case a name means.

The geometry is our own (``board.footprint_shapes``); the names are KiCad's, so that a user may
take KiCad's own instead.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from designer.base.errors import InputError
from designer.board import footprint_shapes as shapes
from designer.board.footprint_shapes import FootprintShape
from designer.board.kicad_names import footprint_name

_Rule = Callable[[str, re.Match[str]], FootprintShape | None]
_NUMBER = r"(\d+(?:\.\d+)?)"


def _two_holes(name: str, found: re.Match[str]) -> FootprintShape:
    """Length and height of the body and the pitch; a disc or a can may have one diameter."""
    length, height, pitch = (float(x) for x in found.groups())
    return shapes.two_holes(name, pitch, (length, height))


def _can(name: str, found: re.Match[str]) -> FootprintShape:
    diameter, pitch = (float(x) for x in found.groups())
    mark = name.startswith("CP")
    return shapes.two_holes(name, pitch, (diameter, diameter), mark=mark)


_RULES: tuple[tuple[str, str, _Rule], ...] = (
    (
        "R_0603_1608Metric",
        r"[RC]_\d{4}_(\d{4})Metric(?:_Pad.*HandSolder)?",
        lambda name, m: shapes.chip(name, m[1]),
    ),
    ("SOT-23", r"SOT-23", lambda name, m: shapes.sot23(name)),
    ("D_SOD-123", r"D_SOD-(123|323)", lambda name, m: shapes.small_diode(name, m[1])),
    (
        "SOIC-14_3.9x8.7mm_P1.27mm",
        rf"SOIC-(\d+)_{_NUMBER}x{_NUMBER}mm_P{_NUMBER}mm",
        lambda name, m: shapes.small_outline(
            name, int(m[1]), float(m[2]), float(m[3]), float(m[4])
        ),
    ),
    (
        "DIP-14_W7.62mm",
        rf"DIP-(\d+)_W{_NUMBER}mm",
        lambda name, m: shapes.dual_in_line(name, int(m[1]), float(m[2])),
    ),
    (
        "R_Axial_DIN0207_L6.3mm_D2.5mm_P10.16mm_Horizontal",
        rf"[RC]_Axial_(?:DIN\d+_)?L{_NUMBER}mm_D{_NUMBER}mm_P{_NUMBER}mm_Horizontal",
        _two_holes,
    ),
    (
        "D_DO-35_SOD27_P7.62mm_Horizontal",
        rf"D_DO-35_SOD27_P{_NUMBER}mm_Horizontal",
        lambda name, m: shapes.two_holes(name, float(m[1]), (4.0, 2.0), mark=True),
    ),
    (
        "C_Rect_L7.2mm_W5.5mm_P5.00mm",
        rf"C_(?:Rect|Disc)_[LD]{_NUMBER}mm_W{_NUMBER}mm_P{_NUMBER}mm(?:_.*)?",
        _two_holes,
    ),
    ("CP_Radial_D5.0mm_P2.00mm", rf"CP?_Radial_D{_NUMBER}mm_P{_NUMBER}mm", _can),
    (
        "TO-92_Inline",
        r"TO-92_Inline",
        lambda name, m: shapes.transistor_outline(name),
    ),
    (
        "PinHeader_1x03_P2.54mm_Vertical",
        rf"PinHeader_1x(\d+)_P{_NUMBER}mm_Vertical",
        lambda name, m: shapes.header(name, int(m[1]), float(m[2])),
    ),
    (
        "TestPoint_Pad_D1.5mm",
        rf"TestPoint_Pad_D{_NUMBER}mm",
        lambda name, m: shapes.bare_pad(name, float(m[1])),
    ),
    (
        "Potentiometer_Bourns_3296W_Vertical",
        r"Potentiometer_Bourns_3296W_Vertical",
        lambda name, m: shapes.bourns_3296w(name),
    ),
    (
        "Potentiometer_Bourns_3224W_Vertical",
        r"Potentiometer_Bourns_3224W_Vertical",
        lambda name, m: shapes.bourns_3224w(name),
    ),
)
EXAMPLES = tuple(example for example, _, _ in _RULES)
"""A name of each kind that is understood."""


def footprint(full_name: str) -> FootprintShape:
    """The footprint that a name, ``Library:Name`` or ``Name``, means.

    Raises
    ------
    InputError : no case that is known here.
    """
    name = footprint_name(full_name)
    for _, pattern, make in _RULES:
        found = re.fullmatch(pattern, name)
        made = make(name, found) if found is not None else None
        if made is not None:
            return made
    raise InputError(
        None, "footprint", full_name, "a name such as " + ", ".join(EXAMPLES) + " (docs/kicad.md)"
    )
