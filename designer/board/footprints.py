"""Footprints by KiCad's names: pads and outline of the case that a name means.

The names are KiCad's, so that a user may take KiCad's own footprints instead; the geometry is our
own, by rule from the dimensions that most names state. Millimetres, y downwards, the origin in the
middle. Chip parts follow IPC-7351B's nominal density: a toe of 0.35 mm (0.2 below 0603), pads that
go 0.05 mm further in than the terminals.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

from designer.base.errors import InputError
from designer.board.kicad_names import footprint_name


@dataclass(frozen=True)
class PadShape:
    """A pad of a footprint."""

    number: str
    x: float
    """Place of its middle to the right [mm]."""
    y: float
    """Place of its middle downwards [mm]."""
    width: float
    """Width [mm]."""
    height: float
    """Height [mm]."""
    drill: float = 0.0
    """Diameter of its hole [mm], 0 on the surface."""
    first: bool = False
    """Whether it is drawn square, as pin 1 of a row of holes is."""
    plated: bool = True
    """Whether it has copper; False for a bare hole."""
    margin: float = 0.0
    """How far the mask's opening, which holds no other copper, reaches beyond it [mm]; 0 for as
    far as the board's own."""
    lead: float = 0.0
    """Largest diameter, or diagonal, of the lead that goes through its hole [mm]; 0 where it is not
    known, and on the surface."""


@dataclass(frozen=True)
class FootprintShape:
    """A footprint, with the part that stands on it."""

    name: str
    pads: tuple[PadShape, ...]
    body: tuple[float, float]
    """Width and height of the part seen from above [mm]."""
    mark: bool = False
    """Whether pin 1 is marked."""
    soldered: bool = True
    """Whether it is soldered; False for a bare pad, which nothing is soldered to."""
    library: str = ""
    """Library of KiCad that has a body of this name; "" where none is known."""
    plug: float = 0.0
    """Width of what is plugged in, beyond the part's own [mm]; 0 where nothing is."""

    @property
    def through_hole(self) -> bool:
        return any(pad.drill for pad in self.pads)

    @property
    def diode(self) -> bool:
        """Whether it is a diode's, whose pin 1 is the cathode."""
        return self.name.startswith("D_")

    @property
    def two_rows(self) -> bool:
        """Whether it is a case with pins on both sides and a notch between them, at pin 1."""
        return len(self.pads) >= 8 and len({pad.x for pad in self.pads}) == 2

    @property
    def across(self) -> bool:
        """Whether its pads are one row from left to right."""
        return len({p.y for p in self.pads}) == 1 < len({p.x for p in self.pads})

    @property
    def origin(self) -> tuple[float, float]:
        """Where KiCad's footprint of this name, and so its body, has its origin [mm]: the first
        hole of a part with holes, the middle of any other."""
        first = next((p for p in self.pads if p.number == "1" and self.through_hole), None)
        return (0.0, 0.0) if first is None else (first.x, first.y)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, top, right, bottom of body and pads together."""
        wide, high = self.body[0] / 2.0, self.body[1] / 2.0
        return (
            min([-wide, *(p.x - p.width / 2.0 for p in self.pads)]),
            min([-high, *(p.y - p.height / 2.0 for p in self.pads)]),
            max([wide, *(p.x + p.width / 2.0 for p in self.pads)]),
            max([high, *(p.y + p.height / 2.0 for p in self.pads)]),
        )

    @property
    def courtyard(self) -> tuple[float, float, float, float]:
        """What nothing else may stand in: 0.25 mm round it and its plug, 0.5 mm round holes and
        marks."""
        room, half = 0.5 if self.through_hole or self.mark else 0.25, self.plug / 2.0
        left, top, right, bottom = self.extent
        return (
            min(left, -half) - room,
            min(top, -half) - room,
            max(right, half) + room,
            max(bottom, half) + room,
        )


TERMINALS = {
    (1.0, 0.5): 0.25,
    (1.6, 0.8): 0.35,
    (2.0, 1.25): 0.45,
    (3.2, 1.6): 0.5,
    (3.2, 2.5): 0.5,
    (5.0, 2.5): 0.6,
    (6.3, 3.2): 0.6,
}
"""Length of a chip's terminals by the length and width of its body, as chip makers state them."""
SMALL_DIODES = {"123": (3.7, 0.45, 0.6, (2.7, 1.6)), "323": (2.5, 0.3, 0.35, (1.7, 1.25))}
"""SOD-123 and SOD-323: span over the leads, length of a foot, width of a lead, body."""
LYING_DIODES = {
    "35_SOD27": ((4.0, 2.0), 1.6, 0.8, 0.56),
    "41_SOD81": ((5.2, 2.7), 2.2, 1.1, 0.86),
}
"""DO-35 and DO-41: length and width of the body, pad, hole, lead. Leads of the DO-35 are up to 0.56
mm thick (JEDEC DO-204AH). Leads of the DO-41 are 0.71 mm to
0.86 mm thick, its body is up to 5.21 mm by 2.72 mm (JEDEC DO-204AL)."""

SQUARE_JACKS = {
    "SMA_Wurth_60312002114503": (2.54, (2.05, 1.5), (2.25, 1.7), 7.0, 9.3),
    "BNC_TEConnectivity_1478204": (3.175, (2.0, 1.27), (2.6, 1.524), 9.7, 14.6),
}
"""Upright jacks: from the middle to the legs on either axis, pad and hole of the inner conductor
and of a leg, width of the body; of the plug, the nut of an SMA over its corners (8 mm across flats)
and the ring of a BNC."""


PIN, ROUND_LEAD = 0.91, 0.63
"""Diagonal of a pin of 0.64 mm square; largest diameter of the leads of axial and radial parts, 0.6
mm and 5 % [mm]."""
DUAL_IN_LINE, TRANSISTOR = 0.67, 0.72
"""Diagonals of leads [mm]: 0.56 mm by 0.36 mm (JEDEC MS-001); 0.533 mm by 0.483 mm (JEDEC
TO-226)."""


def _chip(name: str, code: str) -> FootprintShape | None:
    """A chip of metric code "1608": 1.6 mm by 0.8 mm."""
    sizes = {f"{round(10 * a):02d}{int(10 * b):02d}": (a, b) for a, b in TERMINALS}
    if code not in sizes:
        return None
    length, width = sizes[code]
    toe = 0.35 if length >= 1.6 else 0.2
    outer = length + 2.0 * toe
    inner = length - 2.0 * TERMINALS[length, width] - 0.1
    return FootprintShape(name, _pair(outer, inner, width + 0.1), (length, width))


def _small_diode(name: str, case: str) -> FootprintShape | None:
    if case not in SMALL_DIODES:
        return None
    span, foot, lead, body = SMALL_DIODES[case]
    pads = _pair(span + 0.7, span - 2.0 * foot - 0.5, lead + 0.3)
    return FootprintShape(name, pads, body, mark=True)


def _sot23(name: str) -> FootprintShape:
    """Pads 1.3 mm by 0.6 mm, rows 2.1 mm apart, pitch 0.95 mm (Texas Instruments, DBZ0003A)."""
    at = {"1": (-1.05, -0.95), "2": (-1.05, 0.95), "3": (1.05, 0.0)}
    pads = tuple(PadShape(n, x, y, 1.3, 0.6) for n, (x, y) in at.items())
    return FootprintShape(name, pads, (1.3, 2.92), mark=True)


def _small_outline(name: str, count: str, *sizes: str) -> FootprintShape:
    """Gull wings: a foot reaches 1.05 mm beyond the body (JEDEC MS-012); toe 0.45 mm."""
    width, length, pitch = map(float, sizes)
    outer, inner = width + 2.1 + 0.9, width - 0.9
    across, x = (outer - inner) / 2.0, (outer + inner) / 4.0
    pads = _two_rows(int(count), x, pitch, (across, 0.6))
    return FootprintShape(name, pads, (width, length), mark=True)


def _dual_in_line(name: str, count: str, row: str) -> FootprintShape:
    """Holes at 2.54 mm in two rows."""
    x = float(row) / 2.0
    pads = _two_rows(int(count), x, 2.54, (1.6, 1.6), drill=0.8, lead=DUAL_IN_LINE)
    return FootprintShape(name, pads, (6.35, 2.54 * int(count) / 2.0), mark=True)


def _lying(name: str, length: str, width: str, pitch: str) -> FootprintShape:
    """Two holes; the body, with its length and width or diameter, lies between and beyond them."""
    return _two_holes(name, float(pitch), (float(length), float(width)))


def _lying_diode(name: str, case: str, pitch: str) -> FootprintShape | None:
    if case not in LYING_DIODES:
        return None
    body, pad, drill, lead = LYING_DIODES[case]
    return _two_holes(name, float(pitch), body, mark=True, pad=pad, drill=drill, lead=lead)


def _can(name: str, diameter: str, pitch: str) -> FootprintShape:
    size = float(diameter)
    return _two_holes(name, float(pitch), (size, size), mark=name.startswith("CP"))


def _two_holes(
    name: str,
    pitch: float,
    body: tuple[float, float],
    mark: bool = False,
    pad: float = 1.6,
    drill: float = 0.8,
    lead: float = ROUND_LEAD,
) -> FootprintShape:
    pads = _row(2, (pitch, 0.0), (pad, pad), drill, square=mark, lead=lead)
    return FootprintShape(name, pads, body, mark)


def _transistor_outline(name: str, wide: str) -> FootprintShape:
    """TO-92 with its legs in a row at 1.27 mm, or bent to 2.54 mm; body 5.2 mm by 4.0 mm (JEDEC
    TO-226)."""
    pitch, pad, drill = (2.54, (1.5, 1.5), 0.8) if wide else (1.27, (1.05, 1.5), 0.75)
    pads = _row(3, (pitch, 0.0), pad, drill, lead=TRANSISTOR)
    return FootprintShape(name, pads, (5.2, 4.0), mark=True)


def _header(name: str, count: str, pitch: str) -> FootprintShape:
    """A column of holes for square pins of 0.64 mm."""
    pins, step = int(count), float(pitch)
    pads = _row(pins, (0.0, step), (1.7, 1.7), 1.0, lead=PIN)
    return FootprintShape(name, pads, (step, pins * step), True)


def _locked_header(name: str, count: str, pitch: str) -> FootprintShape:
    """A row of holes for square pins of 0.64 mm, with a lock along it (Molex KK 254, as KiCad has
    it)."""
    pins, step = int(count), float(pitch)
    pads = _row(pins, (step, 0.0), (1.74, 2.19), 1.19, lead=PIN)
    return FootprintShape(name, pads, (step * pins, 5.8), True)


def _square_jack(name: str, case: str) -> FootprintShape | None:
    """The inner conductor in the middle of four legs, which are one pin."""
    if case not in SQUARE_JACKS:
        return None
    leg, inner, outer, body, plug = SQUARE_JACKS[case]
    legs = product((-leg, leg), repeat=2)
    pads = (
        PadShape("1", 0.0, 0.0, inner[0], *inner),
        *(PadShape("2", x, y, outer[0], *outer) for x, y in legs),
    )
    return FootprintShape(name, pads, (body, body), plug=plug)


def _bare_pad(name: str, diameter: str) -> FootprintShape:
    size = float(diameter)
    return FootprintShape(name, (PadShape("1", 0, 0, size, size),), (0.0, 0.0), soldered=False)


def _fiducial(name: str, copper: str, opening: str) -> FootprintShape:
    """A round mark for the assembler's camera: bare copper, free of copper and mask around it."""
    size, free = float(copper), float(opening)
    margin = (free - size) / 2.0
    pad = PadShape("", 0.0, 0.0, size, size, margin=margin)
    return FootprintShape(name, (pad,), (free, free), soldered=False)


def _mounting_hole(name: str, drill: str) -> FootprintShape:
    """A hole without copper, with the room of a screw's head of twice its width."""
    size = float(drill)
    hole = PadShape("", 0.0, 0.0, size, size, size, plated=False)
    return FootprintShape(name, (hole,), (2.0 * size, 2.0 * size), soldered=False)


def _bourns_3296w(name: str) -> FootprintShape:
    """Three pins of 0.51 mm in a row at 2.54 mm below a body of 9.53 mm by 4.83 mm (Bourns
    3296)."""
    pads = _row(3, (-2.54, 0.0), (1.44, 1.44), 0.8, lead=0.51)
    return FootprintShape(name, pads, (9.53, 4.83), mark=True)


def _bourns_3224w(name: str) -> FootprintShape:
    """Two pads of 1.3 mm by 1.6 mm facing one of 2.0 mm by 1.6 mm, body 4.8 mm by 3.5 mm
    (Bourns 3224W; not compared with the sheet)."""
    pads = (
        PadShape("1", 1.25, -1.45, 1.3, 1.6),
        PadShape("2", 0.0, 1.45, 2.0, 1.6),
        PadShape("3", -1.25, -1.45, 1.3, 1.6),
    )
    return FootprintShape(name, pads, (4.8, 3.5), mark=True)


def _pair(outer: float, inner: float, height: float) -> tuple[PadShape, PadShape]:
    """Pads 1 and 2 from ``inner`` to ``outer``, both over all, in steps of 0.01 mm."""
    width, x = round((outer - inner) / 2.0, 2), round((outer + inner) / 4.0, 2)
    size = width, round(height, 2)
    return PadShape("1", -x, 0.0, *size), PadShape("2", x, 0.0, *size)


def _row(
    count: int,
    step: tuple[float, float],
    size: tuple[float, float],
    drill: float,
    square: bool = True,
    lead: float = 0.0,
) -> tuple[PadShape, ...]:
    """Holes in a row about the middle. square : whether pin 1 is drawn so."""
    middle = (count - 1) / 2.0
    return tuple(
        PadShape(
            str(i + 1),
            (i - middle) * step[0],
            (i - middle) * step[1],
            *size,
            drill,
            first=square and i == 0,
            lead=lead,
        )
        for i in range(count)
    )


def _two_rows(
    count: int,
    x: float,
    pitch: float,
    size: tuple[float, float],
    drill: float = 0.0,
    lead: float = 0.0,
) -> tuple[PadShape, ...]:
    """Down on the left, up on the right, as packages are counted."""
    half = count // 2
    top = -(half - 1) * pitch / 2.0
    out = []
    for i in range(count):
        left = i < half
        y = top + (i if left else count - 1 - i) * pitch
        first = drill > 0.0 and i == 0
        at = (-x if left else x, y)
        out.append(PadShape(str(i + 1), *at, *size, drill=drill, first=first, lead=lead))
    return tuple(out)


_N = r"(\d+(?:\.\d+)?)"
_RULES: dict[str, tuple[str, Callable[..., FootprintShape | None]]] = {
    "R_0603_1608Metric": (r"[RC]_\d{4}_(\d{4})Metric(?:_Pad.*HandSolder)?", _chip),
    "SOT-23": ("SOT-23", _sot23),
    "D_SOD-123": (r"D_SOD-(\d+)", _small_diode),
    "SOIC-14_3.9x8.7mm_P1.27mm": (rf"SOIC-(\d+)_{_N}x{_N}mm_P{_N}mm", _small_outline),
    "DIP-14_W7.62mm": (rf"DIP-(\d+)_W{_N}mm", _dual_in_line),
    "R_Axial_DIN0207_L6.3mm_D2.5mm_P10.16mm_Horizontal": (
        rf"[RC]_Axial_(?:DIN\d+_)?L{_N}mm_D{_N}mm_P{_N}mm_Horizontal",
        _lying,
    ),
    "D_DO-35_SOD27_P7.62mm_Horizontal": (rf"D_DO-(35_SOD27)_P{_N}mm_Horizontal", _lying_diode),
    "D_DO-41_SOD81_P10.16mm_Horizontal": (rf"D_DO-(41_SOD81)_P{_N}mm_Horizontal", _lying_diode),
    "C_Rect_L7.2mm_W5.5mm_P5.00mm": (
        rf"C_(?:Rect|Disc)_[LD]{_N}mm_W{_N}mm_P{_N}mm(?:_.*)?",
        _lying,
    ),
    "CP_Radial_D5.0mm_P2.00mm": (rf"CP?_Radial_D{_N}mm_P{_N}mm", _can),
    "TO-92_Inline": ("TO-92_Inline(_Wide|)", _transistor_outline),
    "PinHeader_1x03_P2.54mm_Vertical": (rf"PinHeader_1x(\d+)_P{_N}mm_Vertical", _header),
    "Molex_KK-254_AE-6410-03A_1x03_P2.54mm_Vertical": (
        rf"Molex_KK-254_AE-6410-\d+A_1x(\d+)_P{_N}mm_Vertical",
        _locked_header,
    ),
    "SMA_Wurth_60312002114503_Vertical": (r"((?:SMA|BNC)_\w+)_Vertical", _square_jack),
    "TestPoint_Pad_D1.5mm": (rf"TestPoint_Pad_D{_N}mm", _bare_pad),
    "Fiducial_1mm_Mask2mm": (rf"Fiducial_{_N}mm_Mask{_N}mm", _fiducial),
    "MountingHole_3.2mm_M3": (rf"MountingHole_{_N}mm_M\d+", _mounting_hole),
    "Potentiometer_Bourns_3296W_Vertical": ("Potentiometer_Bourns_3296W_Vertical", _bourns_3296w),
    "Potentiometer_Bourns_3224W_Vertical": ("Potentiometer_Bourns_3224W_Vertical", _bourns_3224w),
}
"""By an example: the names of a kind as a pattern, and what makes the footprint of its groups."""
EXAMPLES = tuple(_RULES)
"""A name of each kind that is understood."""


def footprint(full_name: str) -> FootprintShape:
    """The footprint that a name, ``Library:Name`` or ``Name``, means.

    Raises
    ------
    InputError : no case that is known here.
    """
    name = footprint_name(full_name)
    for pattern, make in _RULES.values():
        match = re.fullmatch(pattern, name)
        shape = make(name, *match.groups()) if match is not None else None
        if shape is not None:
            return replace(shape, library=full_name.rpartition(":")[0] if shape.soldered else "")
    raise InputError(
        None, "footprint", full_name, "a name such as " + ", ".join(EXAMPLES) + " (docs/kicad.md)"
    )
