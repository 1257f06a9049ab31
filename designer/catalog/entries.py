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
    """A figure of a data sheet: minimum, typical, maximum, where it stands, or that it is assumed.

    ``assumed`` marks what no data sheet gives, or what could not be compared with it.
    """

    min: float | None
    typ: float | None
    max: float | None
    source: str
    assumed: bool = False

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
    """What a part stands: power [W], voltage [V]; None where it does not apply."""

    power: float | None
    voltage: float | None


@dataclass(frozen=True)
class PartCase:
    """Another case that a part is sold in; pins : as of the part, where they differ."""

    part_number: str
    footprint: str
    manufacturer: str | None = None
    pins: Mapping[str, str] | None = field(default=None, hash=False)


@dataclass(frozen=True)
class Price:
    """What a part of a price class counts with where prices are added: euro apiece at a hundred
    pieces."""

    name: str
    euro: float
    source: str
    assumed: bool

    @property
    def price_class(self) -> int:
        return int(self.name)


@dataclass(frozen=True)
class SectionPins:
    """One amplifier of a package, with its pin numbers."""

    name: str
    inverting: str
    noninverting: str
    output: str


@dataclass(frozen=True)
class OpAmp:
    """An op-amp package. Voltages and currents are those at a supply of ± ``rated_supply``.

    supply [V] per rail; swing (into 10 kΩ), saturation [V] about ground; offset [V]; bias [A]; gain
    [V/V]; gbw [Hz]; slew [V/s]; output_current [A], short circuit; output_resistance [Ω], open
    loop; common_mode [V], its lower and upper end as min and max; supply_current [A] per section;
    noise [V/√Hz] at 1 kHz;
    What only the finer simulation models use may be missing: recovery [s] from saturation after a
    hard overdrive is reversed; phase_margin [degrees] at unity gain; swing_2k [V] into 2 kΩ;
    noise_corner [Hz], of the 1/f noise; phase_reversal, whether the output goes high when an input
    falls below the common-mode range. spice : a vendor's model, used instead of ours on the finest
    rung.
    input_current [A] : absolute maximum into an input, None where no sheet gives it. cases : others
    that it is sold in, with the same pins.
    ``offset_sigma`` and ``offset_limit`` [V]: the normal distribution that a tolerance study draws
    offsets from, and where it is cut. ``supply_pins``: positive, negative.
    """

    name: str
    manufacturer: str
    part_number: str
    pins: tuple[SectionPins, ...]
    supply_pins: tuple[str, str]
    rated_supply: float
    supply: Figure
    swing: Figure
    saturation: Figure
    offset: Figure
    bias: Figure
    gain: Figure
    gbw: Figure
    slew: Figure
    output_current: Figure
    output_resistance: Figure
    common_mode: Figure
    supply_current: Figure
    noise: Figure
    offset_sigma: float
    offset_limit: float
    price: int
    footprint: str
    sources: tuple[str, ...]
    recovery: Figure | None = None
    phase_margin: Figure | None = None
    swing_2k: Figure | None = None
    noise_corner: Figure | None = None
    phase_reversal: bool = False
    spice: VendorModel | None = None
    # What no simulation knows of stays out of repr, which is part of what a study is known by.
    input_current: Figure | None = field(default=None, repr=False)
    cases: tuple[PartCase, ...] = field(default=(), repr=False)

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
    """A diode: forward_voltage [V], reverse_current [A], capacitance [F], recovery [s].

    pins : name to number of the footprint's pad; KiCad's have the cathode at 1.
    """

    name: str
    manufacturer: str
    part_number: str
    forward_voltage: Figure
    reverse_current: Figure
    capacitance: Figure
    recovery: Figure
    reverse_voltage: Figure
    price: int
    footprint: str
    sources: tuple[str, ...]
    pins: Mapping[str, str] = field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}, hash=False
    )
    cases: tuple[PartCase, ...] = ()


@dataclass(frozen=True)
class ReferenceEntry:
    """A shunt voltage reference: voltage [V], grade (fraction), current [A] it regulates in,
    dynamic impedance [Ω], which may be missing. pins : name to number; a name that is neither
    cathode nor anode is not connected."""

    name: str
    manufacturer: str
    part_number: str
    voltage: float
    grade: float
    temperature_coefficient: float
    current: Figure
    price: int
    footprint: str
    sources: tuple[str, ...]
    impedance: Figure | None = None
    pins: Mapping[str, str] = field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}, hash=False
    )
    cases: tuple[PartCase, ...] = ()

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
    """A trimming potentiometer of ``value`` [Ω]; pins : of its ends low and high, and the wiper.

    adjustability : how finely it can be set as a divider, ± as a fraction of the voltage across it.
    """

    name: str
    manufacturer: str
    part_number: str
    value: float
    grade: float
    rating: Rating
    pins: Mapping[str, str] = field(hash=False)
    price: int
    footprint: str
    sources: tuple[str, ...]
    assumed: tuple[str, ...] = ()
    cases: tuple[PartCase, ...] = ()
    adjustability: float = 0.0


@dataclass(frozen=True)
class Header:
    """Pin headers of one to many ways; ``{ways}`` and ``{ways:02}`` stand in the part number and
    the footprint for the number of ways."""

    name: str
    manufacturer: str
    part_number: str
    ways: tuple[int, int]
    rating: Rating
    price: int
    footprint: str
    sources: tuple[str, ...]
    assumed: tuple[str, ...] = ()

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
    """A rule: prefix, the value in a named code (``units.VALUE_CODES``), suffix; in the suffix
    ``{value}`` stands for the value once more."""

    prefix: str
    code: str
    suffix: str

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
    """Parts of one kind, grade and case that differ in their value.

    ``values`` [Ω or F] are those that can be bought, ascending; temperature_coefficient [1/K] is a
    magnitude; ``assumed`` says in words what could not be compared with a data sheet. drift : most
    that a value changes in the data sheet's endurance test, a fraction; None where not known.
    use : "supply" for families that no signal goes through, "array" for several parts of one value
    in one case: elements of them, whose values differ by ``matching`` at most, a fraction.
    """

    name: str
    kind: Kind
    manufacturer: str
    series: tuple[str, ...]
    range: tuple[float, float]
    grade: float
    temperature_coefficient: float
    rating: Rating
    footprint: str
    dielectric: str
    price: int
    part_number: PartNumber
    sources: tuple[str, ...]
    assumed: tuple[str, ...]
    values: tuple[float, ...] = field(repr=False)
    drift: float | None = None
    use: Use = "signal"
    elements: int = 1
    matching: float | None = None

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
    part_number: str
    manufacturer: str
    footprint: str
    rating: Rating
    price: int
