"""What a catalogue holds: part families, op-amps, diodes, references, and what a board needs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

from pydantic import Field

from designer.base.errors import MISSING, InputError
from designer.base.schema import (
    FieldProblems,
    FileTable,
    choice,
    flag,
    fraction,
    line,
    number,
    whole_number,
)
from designer.base.units import decode_value, encode_value
from designer.catalog import fields
from designer.catalog.fields import Figure
from designer.catalog.vendor_model import VendorModel, vendor_model

Kind = Literal["resistor", "capacitor"]
Use = Literal["signal", "supply", "array"]
"""What a family is for: "supply" is for decoupling alone, where the value need not be kept."""
Mounting = Literal["mixed", "smd", "tht"]
"""Which cases a board takes: any, the first that the catalogue names; or one kind alone."""

FORBIDDEN = "!"
"""Stands in front of a family's name that a model file does not let parts be bought from."""

UNITS: dict[Kind, str] = {"resistor": "Ω", "capacitor": "F"}

ROOM = 25.0
"""°C at which figures hold, and parts have the values that they are sold for."""

LEAST_LEFT, MOST_DOUBLINGS = 0.01, 30.0
"""What is left of a figure at any temperature, and how often a bias current doubles at most,
however far a slope is drawn out."""

ASSUMED_IMPEDANCE = 1.0
"""Dynamic impedance [Ω] of a reference whose data sheet gives none."""


def mounting_of(footprint: str) -> Literal["smd", "tht"]:
    """Whether a KiCad footprint is soldered on the surface or through holes, by its library."""
    library = footprint.partition(":")[0]
    through = ("_THT", "Package_DIP", "Package_SIP", "PinHeader", "TerminalBlock")
    return "tht" if any(word in library for word in through) else "smd"


@dataclass(frozen=True)
class Rating(FileTable):
    """What a part stands."""

    power: Annotated[float | None, fields.positive("W")] = None
    """Power [W]; None where it does not apply."""
    voltage: Annotated[float | None, fields.positive("V")] = None
    """Voltage [V]; None where it does not apply."""


@dataclass(frozen=True)
class PartCase(FileTable):
    """Another case that a part is sold in."""

    part_number: Annotated[str, fields.CODE_TEXT]
    """The maker's part number, which is ordered."""
    footprint: Annotated[str, fields.FOOTPRINT]
    """Footprint in KiCad, as "Library:Name"."""
    manufacturer: Annotated[str | None, fields.NAME] = None
    """The maker, where it is another."""
    pins: Annotated[Mapping[str, str] | None, fields.pins()] = field(default=None, hash=False)
    """Pin numbers by name as of the part, where they differ."""


@dataclass(frozen=True)
class Price(FileTable):
    """What a part of a price class counts with where prices are added."""

    price_class: Annotated[int, fields.PRICE]
    """Number of the price class."""
    euro: Annotated[float, number("", "a number >= 0, euro apiece", lambda value: value >= 0.0)]
    """Euro apiece at a hundred pieces."""
    source: Annotated[str, line("where the figure comes from")]
    """Where the price comes from."""
    assumed: Annotated[bool, flag()] = False
    """Whether it is an assumption."""

    @property
    def name(self) -> str:
        return str(self.price_class)


@dataclass(frozen=True)
class SectionPins(FileTable):
    """One amplifier of a package, with its pin numbers."""

    name: Annotated[str, line("a letter or name")]
    """Letter of the section, such as "A"."""
    inverting: Annotated[str, fields.PIN]
    """Pin number of the inverting input."""
    noninverting: Annotated[str, fields.PIN]
    """Pin number of the non-inverting input."""
    output: Annotated[str, fields.PIN]
    """Pin number of the output."""


@dataclass(frozen=True)
class CatalogEntry(FileTable):
    """What is known of everything that is bought by one part number."""

    name: Annotated[str, fields.NAME]
    """Its name in the catalogue."""
    manufacturer: Annotated[str, fields.NAME]
    """Name of the maker."""
    part_number: Annotated[str, fields.CODE_TEXT]
    """The maker's part number, which is ordered."""


@dataclass(frozen=True)
class BoardEntry(CatalogEntry):
    """What a board needs beside its op-amps, resistors and capacitors."""

    price: Annotated[int, fields.PRICE]
    """Price class."""
    footprint: Annotated[str, fields.FOOTPRINT]
    """Footprint in KiCad, as "Library:Name"."""
    sources: Annotated[tuple[str, ...], fields.SOURCES]
    """Where the figures come from."""


@dataclass(frozen=True)
class OpAmp(CatalogEntry):
    """An op-amp package. Voltages and currents are those at a supply of ± ``rated_supply``.

    What only the finer simulation models use may be missing.
    """

    pins: Annotated[tuple[SectionPins, ...], Field(alias="section")]
    """The sections, with their pin numbers."""
    supply_pins: Annotated[tuple[str, str], fields.pair_of_pins()]
    """Pin numbers of the positive and the negative supply."""
    rated_supply: Annotated[float, fields.positive("V")]
    """Supply per rail that the figures are given at [V]."""
    supply: Annotated[Figure, fields.figure("V")]
    """Supply voltage per rail [V]."""
    swing: Annotated[Figure, fields.figure("V")]
    """Output swing into 10 kΩ, about ground [V]."""
    saturation: Annotated[Figure, fields.figure("V")]
    """Output limit, about ground [V]."""
    offset: Annotated[Figure, fields.figure("V", signed=True)]
    """Input offset voltage [V]."""
    bias: Annotated[Figure, fields.figure("A", signed=True)]
    """Input bias current [A]."""
    gain: Annotated[Figure, fields.figure("V/V")]
    """Open-loop gain [V/V]."""
    gbw: Annotated[Figure, fields.figure("Hz")]
    """Gain-bandwidth product [Hz]."""
    slew: Annotated[Figure, fields.figure("V/s")]
    """Slew rate [V/s]."""
    output_current: Annotated[Figure, fields.figure("A")]
    """Short-circuit output current [A]."""
    output_resistance: Annotated[Figure, fields.figure("Ω")]
    """Open-loop output resistance [Ω]."""
    common_mode: Annotated[Figure, fields.figure("V", signed=True)]
    """Input common-mode range [V], its lower and upper end as min and max."""
    supply_current: Annotated[Figure, fields.figure("A")]
    """Supply current per section [A]."""
    noise: Annotated[Figure, fields.figure("V/√Hz")]
    """Input voltage noise at 1 kHz [V/√Hz]."""
    offset_sigma: Annotated[float, fields.positive("V")]
    """Standard deviation of the normal distribution that a tolerance study draws offsets from
    [V]."""
    offset_limit: Annotated[float, fields.positive("V")]
    """Where that distribution is cut, ± [V]."""
    price: Annotated[int, fields.PRICE]
    """Price class."""
    footprint: Annotated[str, fields.FOOTPRINT]
    """Footprint in KiCad, as "Library:Name"."""
    sources: Annotated[tuple[str, ...], fields.SOURCES]
    """Where the figures come from."""
    recovery: Annotated[Figure | None, fields.figure("s")] = None
    """Recovery from saturation after a hard overdrive is reversed [s]."""
    phase_margin: Annotated[Figure | None, fields.figure("°")] = None
    """Phase margin at unity gain [degrees]."""
    swing_2k: Annotated[Figure | None, fields.figure("V")] = None
    """Output swing into 2 kΩ [V]."""
    noise_corner: Annotated[Figure | None, fields.figure("Hz")] = None
    """Corner frequency of the 1/f noise [Hz]."""
    phase_reversal: Annotated[bool, flag()] = False
    """Whether the output goes high when an input falls below the common-mode range."""
    spice: Annotated[VendorModel | None, vendor_model()] = None
    """A vendor's model, used instead of ours at the finest fidelity."""
    # What no simulation knows of stays out of repr, which is part of what a study is known by.
    input_current: Annotated[Figure | None, fields.figure("A")] = field(default=None, repr=False)
    """Absolute maximum of the current into an input [A]; None where no sheet gives it."""
    temperature: Annotated[Figure | None, fields.figure("°C", signed=True)] = field(
        default=None, repr=False
    )
    """Temperatures that it is specified for [°C], the lowest and the highest as min and max."""
    # What changes with temperature and age moves boards by the spread, which a study is known by.
    offset_drift: Annotated[Figure | None, fields.figure("V/K")] = field(default=None, repr=False)
    """Size of the offset's change with temperature [V/K]: typ as a standard deviation, none beyond
    max."""
    bias_doubling: Annotated[Figure | None, fields.figure("K")] = field(default=None, repr=False)
    """Warming that doubles the bias current [K]; None where it does not grow so."""
    gbw_drift: Annotated[Figure | None, fields.figure("1/K", signed=True)] = field(
        default=None, repr=False
    )
    """Relative change of the gain-bandwidth with temperature [1/K]."""
    slew_drift: Annotated[Figure | None, fields.figure("1/K", signed=True)] = field(
        default=None, repr=False
    )
    """Relative change of the slew rate with temperature [1/K]."""
    saturation_drift: Annotated[Figure | None, fields.figure("V/K", signed=True)] = field(
        default=None, repr=False
    )
    """Change of the output limits' size with temperature [V/K]."""
    offset_ageing: Annotated[Figure | None, fields.figure("V")] = field(default=None, repr=False)
    """Size of the offset's change over the years [V]: typ as a standard deviation, none beyond
    max."""
    cases: tuple[PartCase, ...] = field(default=(), repr=False)
    """Other cases that it is sold in, with the same pins."""

    def __post_init__(self) -> None:
        pins = [*self.supply_pins]
        for section in self.pins:
            pins += [section.inverting, section.noninverting, section.output]
        names = [section.name for section in self.pins]
        problems = [
            InputError(None, key, name, "a name or pin that is used once")
            for key, used in (("section.name", names), ("section", pins))
            for name in dict.fromkeys(used)
            if used.count(name) > 1
        ]
        if not self.pins:
            problems.append(InputError(None, "section", MISSING, "at least one section"))
        if problems:
            raise FieldProblems(problems)

    @property
    def sections(self) -> int:
        """Number of amplifiers in the package."""
        return len(self.pins)

    def takes(self, supply: float) -> bool:
        """Whether it works from rails of ± ``supply`` [V]."""
        return (self.supply.min or 0.0) <= supply <= (self.supply.max or math.inf)

    def over(self, temperatures: tuple[float, float] | None) -> OpAmp:
        """The same op-amp with bounds that hold from one temperature [°C] to another.

        What is typical stays: it is that of ``ROOM``, which the range always holds. None: at
        ``ROOM`` alone. Of a change with temperature the worst that is given counts. A figure of
        which the catalogue has no change stays as it is.
        """
        if temperatures is None:
            return self
        warmer = tuple(t - ROOM for t in (*temperatures, ROOM))
        drift = 0.0 if self.offset_drift is None else self.offset_drift.about_zero[1]
        offset = drift * max(map(abs, warmer))
        doubling = self.bias_doubling
        doublings = 0.0 if doubling is None else max(warmer) / doubling.given[0]
        bias = 2.0 ** min(doublings, MOST_DOUBLINGS)

        def lowest(figure: Figure, drift: Figure | None, *, relative: bool) -> Figure:
            slopes = (0.0,) if drift is None else drift.given
            low = figure.nominal if figure.min is None else figure.min
            moved = min((low if relative else 1.0) * s * dt for s in slopes for dt in warmer)
            return replace(figure, min=max(low + moved, LEAST_LEFT * low)) if moved else figure

        def reach(figure: Figure) -> Figure:
            return lowest(figure, self.saturation_drift, relative=False)

        return replace(
            self,
            offset=_up_to(self.offset, lambda most: most + offset),
            offset_limit=self.offset_limit + offset,
            bias=_up_to(self.bias, lambda most: most * bias),
            gbw=lowest(self.gbw, self.gbw_drift, relative=True),
            slew=lowest(self.slew, self.slew_drift, relative=True),
            swing=reach(self.swing),
            swing_2k=None if self.swing_2k is None else reach(self.swing_2k),
        )

    def offset_spread(self, temperatures: tuple[float, float] | None) -> float:
        """Standard deviation of the offset [V] where it is largest between two temperatures [°C];
        None: at ``ROOM``."""
        drift = 0.0 if self.offset_drift is None else self.offset_drift.about_zero[0]
        return math.hypot(
            self.offset_sigma, drift * max((abs(t - ROOM) for t in temperatures or ()), default=0.0)
        )

    def saturation_at(self, supply: float) -> float:
        """Typical output limit [V] at rails of ± ``supply``: the distance to the rail stays."""
        return supply - (self.rated_supply - self.saturation.nominal)


def _up_to(figure: Figure, moved: Callable[[float], float]) -> Figure:
    """A figure with its upper bound moved, where it has one or a typical value alone."""
    most = figure.nominal if figure.max is None else figure.max
    return replace(figure, max=moved(most)) if moved(most) != most else figure


@dataclass(frozen=True, kw_only=True)
class DiodeEntry(BoardEntry):
    """A diode."""

    forward_voltage: Annotated[Figure, fields.figure("V")]
    """Forward voltage [V]."""
    reverse_current: Annotated[Figure, fields.figure("A")]
    """Reverse current [A]."""
    capacitance: Annotated[Figure, fields.figure("F")]
    """Capacitance at 0 V [F]."""
    recovery: Annotated[Figure, fields.figure("s")]
    """Reverse recovery time [s]."""
    reverse_voltage: Annotated[Figure, fields.figure("V")]
    """Largest reverse voltage [V]."""
    pins: Annotated[Mapping[str, str], fields.pins("cathode", "anode")] = field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}, hash=False
    )
    """Number of the footprint's pad by name; KiCad's have the cathode at 1."""
    cases: tuple[PartCase, ...] = ()
    """Other cases that it is sold in."""


@dataclass(frozen=True, kw_only=True)
class ReferenceEntry(BoardEntry):
    """A shunt voltage reference."""

    voltage: Annotated[float, fields.positive("V")]
    """The voltage that it keeps [V]."""
    grade: Annotated[float, fields.GRADE]
    """Tolerance of the voltage, ± as a fraction."""
    temperature_coefficient: Annotated[float, fields.per_kelvin()]
    """Size of the voltage's relative change with temperature [1/K]."""
    current: Annotated[Figure, fields.figure("A")]
    """The currents that it regulates in [A]."""
    impedance: Annotated[Figure | None, fields.figure("Ω")] = None
    """Dynamic impedance [Ω]; None where it is not known."""
    drift: Annotated[float | None, fraction("120e-6 is 120 ppm", zero=True)] = None
    """Size of the voltage's change over 1000 h, as a fraction, typical: taken as a standard
    deviation, none beyond three of it. None where not known."""
    pins: Annotated[Mapping[str, str], fields.pins("cathode", "anode")] = field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}, hash=False
    )
    """Number of the footprint's pad by name; a name that is neither cathode nor anode is not
    connected."""
    cases: tuple[PartCase, ...] = ()
    """Other cases that it is sold in."""

    @property
    def least_current(self) -> float:
        """Current [A] below which it does not regulate; 0 where the data sheet gives none."""
        return self.current.min or 0.0

    @property
    def dynamic_impedance(self) -> float:
        """Typical dynamic impedance [Ω]; assumed where the catalogue has none."""
        return self.impedance.nominal if self.impedance else ASSUMED_IMPEDANCE


@dataclass(frozen=True, kw_only=True)
class TrimmerEntry(BoardEntry):
    """A trimming potentiometer."""

    value: Annotated[float, fields.positive("Ω")]
    """Resistance of the track [Ω]."""
    grade: Annotated[float, fields.GRADE]
    """Tolerance, ± as a fraction."""
    rating: Rating = Rating()
    """Power and voltage that it stands."""
    pins: Annotated[Mapping[str, str], fields.pins("low", "wiper", "high")] = field(hash=False)
    """Pin numbers of its ends "low" and "high", and of its wiper."""
    assumed: Annotated[tuple[str, ...], fields.ASSUMED] = ()
    """What could not be compared with a data sheet, in words."""
    cases: tuple[PartCase, ...] = ()
    """Other cases that it is sold in."""
    adjustability: Annotated[
        float,
        number("", "a fraction in [0, 0.1): 1e-4 is ± 0.01 %", lambda v: 0.0 <= v < 0.1),
    ] = 0.0
    """How finely it can be set as a divider, ± as a fraction of the voltage across it."""


@dataclass(frozen=True, kw_only=True)
class Header(BoardEntry):
    """Pin headers of one to many ways."""

    part_number: Annotated[
        str, fields.with_ways('a part number with "{ways}" or "{ways:02}" in it')
    ]
    """What is ordered; ``{ways}`` and ``{ways:02}`` in it stand for the number of ways."""
    ways: Annotated[tuple[int, int], fields.ways()]
    """Least and largest number of ways."""
    rating: Rating = Rating()
    """Power and voltage that it stands."""
    footprint: Annotated[
        str, fields.with_ways('a KiCad footprint with "{ways}" or "{ways:02}" in it')
    ]
    """KiCad's; ``{ways}`` and ``{ways:02}`` in it stand for the number of ways."""
    keyed: Annotated[bool, flag()] = False
    """Whether its plug goes in one way alone: the supply's is such a one."""
    assumed: Annotated[tuple[str, ...], fields.ASSUMED] = ()
    """What could not be compared with a data sheet, in words."""

    def number(self, ways: int) -> str:
        """The part number of a header of so many ways."""
        return self.part_number.format(ways=ways)

    def place(self, ways: int) -> str:
        """Its footprint."""
        return self.footprint.format(ways=ways)


AGAIN = "{value}"
"""Stands in a part number's suffix for the value once more."""


@dataclass(frozen=True, kw_only=True)
class PartNumber(FileTable):
    """The rule of a family's part numbers: prefix, value, suffix."""

    prefix: Annotated[str, fields.CODE_TEXT] = ""
    """What stands before the value."""
    code: Annotated[str, fields.VALUE_CODE]
    """Name of the code that the value is written in (``units.VALUE_CODES``)."""
    suffix: Annotated[str, fields.CODE_TEXT] = ""
    """What stands after the value; ``{value}`` in it stands for the value once more."""

    def of(self, value: float) -> str:
        """The part number of a value; ValueError for a value that the code cannot spell."""
        spelled = encode_value(self.code, value)
        return f"{self.prefix}{spelled}{self.suffix.replace(AGAIN, spelled)}"

    def value(self, number: str) -> float:
        """The value [Ω or F] of a part number; ValueError for one that is not of this rule."""
        first = len(self.prefix)
        fixed = first + len(self.suffix.replace(AGAIN, ""))
        length = (len(number) - fixed) // (1 + self.suffix.count(AGAIN))
        spelled = number[first : first + max(length, 0)]
        if number != f"{self.prefix}{spelled}{self.suffix.replace(AGAIN, spelled)}":
            raise ValueError(f"not a part number {self.prefix}…{self.suffix}")
        return decode_value(self.code, spelled)


@dataclass(frozen=True, kw_only=True)
class FamilyBase(FileTable):
    """What a file says of parts of one kind, grade and case that differ in their value."""

    name: Annotated[str, fields.NAME]
    """Its name in the catalogue."""
    kind: Annotated[Kind, choice(*UNITS)]
    """Kind of the parts."""
    manufacturer: Annotated[str, fields.NAME]
    """Name of the maker."""
    series: Annotated[tuple[str, ...], fields.SERIES_NAMES] = ()
    """The E series of its values."""
    grade: Annotated[float, fields.GRADE]
    """Tolerance, ± as a fraction."""
    temperature_coefficient: Annotated[float, fields.per_kelvin()]
    """Size of the relative change with temperature [1/K]."""
    rating: Rating = Rating()
    """Power and voltage that it stands."""
    footprint: Annotated[str, fields.FOOTPRINT]
    """Footprint in KiCad, as "Library:Name"."""
    dielectric: Annotated[str, line("text of one line: what it is made of")]
    """What the parts are made of."""
    price: Annotated[int, fields.PRICE]
    """Price class."""
    part_number: PartNumber
    """The rule of its part numbers."""
    sources: Annotated[tuple[str, ...], fields.SOURCES]
    """Where the figures come from."""
    assumed: Annotated[tuple[str, ...], fields.ASSUMED] = ()
    """What could not be compared with a data sheet, in words."""
    drift: Annotated[float | None, fraction("0.005 is 0.5 %", zero=True)] = None
    """Most that a value changes in the data sheet's endurance test, a fraction; None where not
    known."""
    dc_bias: Annotated[float | None, fraction("0.8 is 80 %", zero=True)] = None
    """Share of a capacitance that is lost at the rated voltage, in proportion below; None where not
    known."""
    use: Annotated[Use, choice("signal", "supply", "array")] = "signal"
    """"supply" for families that no signal goes through, "array" for several parts of one value in
    one case; "signal" for all others."""
    matching: Annotated[float | None, fraction("0.001 is 0.1 %")] = None
    """Most that the values of an array's elements differ by, a fraction."""


@dataclass(frozen=True, kw_only=True)
class PartFamily(FamilyBase):
    """Parts of one kind, grade and case that differ in their value."""

    range: tuple[float, float]
    """Least and largest value [Ω or F]."""
    values: tuple[float, ...] = field(repr=False)
    """Values that can be bought [Ω or F], ascending."""
    elements: int = 1
    """Parts in one case."""

    @property
    def share(self) -> float:
        """Of a deviation within the grade, what an array's parts have in common: two of them then
        differ by ``matching`` at most (``spread.Group``)."""
        assert self.matching is not None
        return 1.0 - min(0.5 * self.matching / self.grade, 1.0)

    @property
    def mounting(self) -> Literal["smd", "tht"]:
        return mounting_of(self.footprint)


@dataclass(frozen=True)
class PartChoice:
    """A part that can be bought: a value of a family."""

    family: PartFamily
    value: float
    """Its value [Ω or F]."""
    part_number: str
    """The maker's part number, which is ordered."""
    manufacturer: str
    """Name of the maker."""
    footprint: str
    """Footprint in KiCad, as "Library:Name"."""
    rating: Rating
    """Power and voltage that it stands."""
    price: int
    """Price class."""


Series = Literal["sma", "bnc"]


@dataclass(frozen=True, kw_only=True)
class CoaxialJack(BoardEntry):
    """A coaxial jack that is soldered to the board."""

    series: Annotated[Series, choice("sma", "bnc")]
    """The cables that fit."""
    rating: Rating = field(default_factory=Rating)
    """Power and voltage that it stands."""
    pins: Annotated[Mapping[str, str], fields.pins("signal", "shell")] = field(
        default_factory=lambda: {"signal": "1", "shell": "2"}, hash=False
    )
    """Number of the footprint's pads by name; KiCad's have the inner conductor at 1."""
    assumed: Annotated[tuple[str, ...], fields.ASSUMED] = ()
    """What could not be compared with a data sheet, in words."""


_EURO = number("", "a number >= 0, in euro", lambda value: value >= 0.0)


@dataclass(frozen=True)
class BuildCost(FileTable):
    """What an order of so many boards is charged with, in euro without tax and transport."""

    boards: Annotated[int, whole_number("a whole number of boards, at least 1", 1)]
    """How many boards are ordered at once."""
    part_factor: Annotated[float, number("", "a factor > 0", lambda value: value > 0.0)]
    """A part's price at this size of order, against the one at a hundred pieces."""
    board_order: Annotated[float, _EURO]
    """For each order of bare boards."""
    board_area: Annotated[float, _EURO]
    """For each dm² of a bare board with two layers."""
    assembly_order: Annotated[float, _EURO]
    """For each order that is assembled: set-up and stencil."""
    assembly_line: Annotated[float, _EURO]
    """For each line of the bill that the assembler loads, an order."""
    surface_part: Annotated[float, _EURO]
    """For each part that is soldered on the surface."""
    through_part: Annotated[float, _EURO]
    """For each part that is soldered through holes."""
    source: Annotated[str, line("where the figures come from")]
    """Where the figures come from."""
    assumed: Annotated[bool, flag()] = False
    """Whether they are assumptions."""

    @property
    def name(self) -> str:
        return str(self.boards)


@dataclass(frozen=True)
class ForwardDrop(FileTable):
    """The most that a diode drops at a current."""

    current: Annotated[float, fields.positive("A")]
    """The current [A]."""
    voltage: Annotated[float, fields.positive("V")]
    """Largest forward voltage there [V]."""
    source: Annotated[str, line("where the figure comes from")]
    """Where the figure comes from."""


@dataclass(frozen=True, kw_only=True)
class SupplyDiodeEntry(BoardEntry):
    """A diode that carries the current of a rail."""

    drops: tuple[ForwardDrop, ...]
    """Largest forward voltages, in any order of the currents."""
    reverse_voltage: Annotated[Figure, fields.figure("V")]
    """Largest reverse voltage [V]."""
    pins: Annotated[Mapping[str, str], fields.pins("cathode", "anode")] = field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}, hash=False
    )
    """Number of the footprint's pad by name; KiCad's have the cathode at 1."""
    assumed: Annotated[tuple[str, ...], fields.ASSUMED] = ()
    """What could not be compared with a data sheet, in words."""
    cases: tuple[PartCase, ...] = ()
    """Other cases that it is sold in."""

    def drop(self, current: float) -> float | None:
        """Most that it drops [V] at this current [A] and below: that of the next larger current
        that the sheet gives, for the drop grows with the current; None past the largest."""
        return min((d.voltage for d in self.drops if d.current >= current), default=None)
