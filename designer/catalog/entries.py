"""What a catalogue holds: part families, op-amps, diodes, references, and what a board needs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from designer.base.units import decode_value, encode_value
from designer.catalog.vendor_model import VendorModel

Kind = Literal["resistor", "capacitor"]
Use = Literal["signal", "supply", "array"]
"""What a family is for: "supply" is for decoupling alone, where the value need not be kept."""
Mounting = Literal["mixed", "smd", "tht"]
"""Which cases a board takes: any, the first that the catalogue names; or one kind alone."""

FORBIDDEN = "!"
"""Stands in front of a family's name that a model file does not let parts be bought from."""

UNITS: dict[Kind, str] = {"resistor": "Ω", "capacitor": "F"}

PRICE_CLASSES = (0.01, 0.05, 0.25, 1.0, 5.0, math.inf)
"""Upper ends, in euro apiece at a hundred pieces, of the price classes 1 to 6."""


ASSUMED_IMPEDANCE = 1.0
"""Dynamic impedance [Ω] of a reference whose data sheet gives none."""


@dataclass(frozen=True)
class Figure:
    """A figure of a data sheet."""

    min: float | None
    """Minimum; None where the sheet gives none."""
    typ: float | None
    """Typical; None where the sheet gives none."""
    max: float | None
    """Maximum; None where the sheet gives none."""
    source: str
    """Where in which data sheet the figure stands."""
    assumed: bool = False
    """Whether no data sheet gives it, or it could not be compared with one."""

    @property
    def nominal(self) -> float:
        """The typical value; where none is given, the bound that is."""
        for value in (self.typ, self.max, self.min):
            if value is not None:
                return value
        raise AssertionError("a figure has at least one value")


def mounting_of(footprint: str) -> Literal["smd", "tht"]:
    """Whether a KiCad footprint is soldered on the surface or through holes, by its library."""
    library = footprint.partition(":")[0]
    through = ("_THT", "Package_DIP", "Package_SIP", "PinHeader", "TerminalBlock")
    return "tht" if any(word in library for word in through) else "smd"


@dataclass(frozen=True)
class Rating:
    """What a part stands."""

    power: float | None
    """Power [W]; None where it does not apply."""
    voltage: float | None
    """Voltage [V]; None where it does not apply."""


@dataclass(frozen=True)
class PartCase:
    """Another case that a part is sold in."""

    part_number: str
    """The maker's part number, which is ordered."""
    footprint: str
    """Footprint in KiCad, as "Library:Name"."""
    manufacturer: str | None = None
    """The maker, where it is another."""
    pins: Mapping[str, str] | None = field(default=None, hash=False)
    """Pin numbers by name as of the part, where they differ."""


@dataclass(frozen=True)
class Price:
    """What a part of a price class counts with where prices are added."""

    name: str
    """Number of the price class, as text."""
    euro: float
    """Euro apiece at a hundred pieces."""
    source: str
    """Where the price comes from."""
    assumed: bool
    """Whether it is an assumption."""

    @property
    def price_class(self) -> int:
        return int(self.name)


@dataclass(frozen=True)
class SectionPins:
    """One amplifier of a package, with its pin numbers."""

    name: str
    """Letter of the section, such as "A"."""
    inverting: str
    """Pin number of the inverting input."""
    noninverting: str
    """Pin number of the non-inverting input."""
    output: str
    """Pin number of the output."""


@dataclass(frozen=True)
class OpAmp:
    """An op-amp package. Voltages and currents are those at a supply of ± ``rated_supply``.

    What only the finer simulation models use may be missing.
    """

    name: str
    """Its name in the catalogue."""
    manufacturer: str
    """Name of the maker."""
    part_number: str
    """The maker's part number, which is ordered."""
    pins: tuple[SectionPins, ...]
    """The sections, with their pin numbers."""
    supply_pins: tuple[str, str]
    """Pin numbers of the positive and the negative supply."""
    rated_supply: float
    """Supply per rail that the figures are given at [V]."""
    supply: Figure
    """Supply voltage per rail [V]."""
    swing: Figure
    """Output swing into 10 kΩ, about ground [V]."""
    saturation: Figure
    """Output limit, about ground [V]."""
    offset: Figure
    """Input offset voltage [V]."""
    bias: Figure
    """Input bias current [A]."""
    gain: Figure
    """Open-loop gain [V/V]."""
    gbw: Figure
    """Gain-bandwidth product [Hz]."""
    slew: Figure
    """Slew rate [V/s]."""
    output_current: Figure
    """Short-circuit output current [A]."""
    output_resistance: Figure
    """Open-loop output resistance [Ω]."""
    common_mode: Figure
    """Input common-mode range [V], its lower and upper end as min and max."""
    supply_current: Figure
    """Supply current per section [A]."""
    noise: Figure
    """Input voltage noise at 1 kHz [V/√Hz]."""
    offset_sigma: float
    """Standard deviation of the normal distribution that a tolerance study draws offsets from
    [V]."""
    offset_limit: float
    """Where that distribution is cut, ± [V]."""
    price: int
    """Price class."""
    footprint: str
    """Footprint in KiCad, as "Library:Name"."""
    sources: tuple[str, ...]
    """Where the figures come from."""
    recovery: Figure | None = None
    """Recovery from saturation after a hard overdrive is reversed [s]."""
    phase_margin: Figure | None = None
    """Phase margin at unity gain [degrees]."""
    swing_2k: Figure | None = None
    """Output swing into 2 kΩ [V]."""
    noise_corner: Figure | None = None
    """Corner frequency of the 1/f noise [Hz]."""
    phase_reversal: bool = False
    """Whether the output goes high when an input falls below the common-mode range."""
    spice: VendorModel | None = None
    """A vendor's model, used instead of ours on the finest rung."""
    # What no simulation knows of stays out of repr, which is part of what a study is known by.
    input_current: Figure | None = field(default=None, repr=False)
    """Absolute maximum of the current into an input [A]; None where no sheet gives it."""
    cases: tuple[PartCase, ...] = field(default=(), repr=False)
    """Other cases that it is sold in, with the same pins."""

    @property
    def sections(self) -> int:
        """Number of amplifiers in the package."""
        return len(self.pins)

    def takes(self, supply: float) -> bool:
        """Whether it works from rails of ± ``supply`` [V]."""
        return (self.supply.min or 0.0) <= supply <= (self.supply.max or math.inf)

    def saturation_at(self, supply: float) -> float:
        """Typical output limit [V] at rails of ± ``supply``: the distance to the rail stays."""
        return supply - (self.rated_supply - self.saturation.nominal)


@dataclass(frozen=True)
class DiodeEntry:
    """A diode."""

    name: str
    """Its name in the catalogue."""
    manufacturer: str
    """Name of the maker."""
    part_number: str
    """The maker's part number, which is ordered."""
    forward_voltage: Figure
    """Forward voltage [V]."""
    reverse_current: Figure
    """Reverse current [A]."""
    capacitance: Figure
    """Capacitance at 0 V [F]."""
    recovery: Figure
    """Reverse recovery time [s]."""
    reverse_voltage: Figure
    """Largest reverse voltage [V]."""
    price: int
    """Price class."""
    footprint: str
    """Footprint in KiCad, as "Library:Name"."""
    sources: tuple[str, ...]
    """Where the figures come from."""
    pins: Mapping[str, str] = field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}, hash=False
    )
    """Number of the footprint's pad by name; KiCad's have the cathode at 1."""
    cases: tuple[PartCase, ...] = ()
    """Other cases that it is sold in."""


@dataclass(frozen=True)
class ReferenceEntry:
    """A shunt voltage reference."""

    name: str
    """Its name in the catalogue."""
    manufacturer: str
    """Name of the maker."""
    part_number: str
    """The maker's part number, which is ordered."""
    voltage: float
    """The voltage that it keeps [V]."""
    grade: float
    """Tolerance of the voltage, ± as a fraction."""
    temperature_coefficient: float
    """Size of the voltage's relative change with temperature [1/K]."""
    current: Figure
    """The currents that it regulates in [A]."""
    price: int
    """Price class."""
    footprint: str
    """Footprint in KiCad, as "Library:Name"."""
    sources: tuple[str, ...]
    """Where the figures come from."""
    impedance: Figure | None = None
    """Dynamic impedance [Ω]; None where it is not known."""
    pins: Mapping[str, str] = field(
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


@dataclass(frozen=True)
class TrimmerEntry:
    """A trimming potentiometer."""

    name: str
    """Its name in the catalogue."""
    manufacturer: str
    """Name of the maker."""
    part_number: str
    """The maker's part number, which is ordered."""
    value: float
    """Resistance of the track [Ω]."""
    grade: float
    """Tolerance, ± as a fraction."""
    rating: Rating
    """Power and voltage that it stands."""
    pins: Mapping[str, str] = field(hash=False)
    """Pin numbers of its ends "low" and "high", and of its wiper."""
    price: int
    """Price class."""
    footprint: str
    """Footprint in KiCad, as "Library:Name"."""
    sources: tuple[str, ...]
    """Where the figures come from."""
    assumed: tuple[str, ...] = ()
    """What could not be compared with a data sheet, in words."""
    cases: tuple[PartCase, ...] = ()
    """Other cases that it is sold in."""
    adjustability: float = 0.0
    """How finely it can be set as a divider, ± as a fraction of the voltage across it."""


@dataclass(frozen=True)
class Header:
    """Pin headers of one to many ways."""

    name: str
    """Its name in the catalogue."""
    manufacturer: str
    """Name of the maker."""
    part_number: str
    """What is ordered; ``{ways}`` and ``{ways:02}`` in it stand for the number of ways."""
    ways: tuple[int, int]
    """Least and largest number of ways."""
    rating: Rating
    """Power and voltage that it stands."""
    price: int
    """Price class."""
    footprint: str
    """KiCad's; ``{ways}`` and ``{ways:02}`` in it stand for the number of ways."""
    sources: tuple[str, ...]
    """Where the figures come from."""
    assumed: tuple[str, ...] = ()
    """What could not be compared with a data sheet, in words."""

    def number(self, ways: int) -> str:
        """The part number of a header of so many ways."""
        return self.part_number.format(ways=ways)

    def place(self, ways: int) -> str:
        """Its footprint."""
        return self.footprint.format(ways=ways)


AGAIN = "{value}"
"""Stands in a part number's suffix for the value once more."""


@dataclass(frozen=True)
class PartNumber:
    """The rule of a family's part numbers: prefix, value, suffix."""

    prefix: str
    """What stands before the value."""
    code: str
    """Name of the code that the value is written in (``units.VALUE_CODES``)."""
    suffix: str
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


@dataclass(frozen=True)
class PartFamily:
    """Parts of one kind, grade and case that differ in their value."""

    name: str
    """Its name in the catalogue."""
    kind: Kind
    """Kind of the parts."""
    manufacturer: str
    """Name of the maker."""
    series: tuple[str, ...]
    """The E series of its values."""
    range: tuple[float, float]
    """Least and largest value [Ω or F]."""
    grade: float
    """Tolerance, ± as a fraction."""
    temperature_coefficient: float
    """Size of the relative change with temperature [1/K]."""
    rating: Rating
    """Power and voltage that it stands."""
    footprint: str
    """Footprint in KiCad, as "Library:Name"."""
    dielectric: str
    """What the parts are made of."""
    price: int
    """Price class."""
    part_number: PartNumber
    """The rule of its part numbers."""
    sources: tuple[str, ...]
    """Where the figures come from."""
    assumed: tuple[str, ...]
    """What could not be compared with a data sheet, in words."""
    values: tuple[float, ...] = field(repr=False)
    """Values that can be bought [Ω or F], ascending."""
    drift: float | None = None
    """Most that a value changes in the data sheet's endurance test, a fraction; None where not
    known."""
    use: Use = "signal"
    """"supply" for families that no signal goes through, "array" for several parts of one value in
    one case; "signal" for all others."""
    elements: int = 1
    """Parts in one case."""
    matching: float | None = None
    """Most that the values of an array's elements differ by, a fraction."""

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
    """The family that it belongs to."""
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
