"""The tables of a catalogue file, key by key: what each accepts (docs/catalogue.md)."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

from designer.base.schema import STRICT, choice, exactly, flag, line, lines, number
from designer.base.units import VALUE_CODES
from designer.catalog import fields
from designer.catalog.entries import UNITS, Figure, Kind, Use
from designer.catalog.vendor_model import PINS

# The tables of a file, key by key.


class PartNumberTable(BaseModel):
    model_config = STRICT
    prefix: Annotated[str, fields.code_text()] = ""
    code: Annotated[str, choice(*VALUE_CODES)]
    suffix: Annotated[str, fields.code_text()] = ""


class ExampleTable(BaseModel):
    model_config = STRICT
    value: Annotated[float | str, fields.quantity()]
    part_number: Annotated[str, fields.code_text()]


class RatingTable(BaseModel):
    model_config = STRICT
    power: Annotated[float | None, fields.positive("W")] = None
    voltage: Annotated[float | None, fields.positive("V")] = None


class FamilyTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    kind: Annotated[Kind, choice(*UNITS)]
    manufacturer: Annotated[str, line("a name of one line")]
    series: Annotated[tuple[str, ...], fields.series_names()] = ()
    range: Annotated[tuple[float | str, ...], fields.quantities("a range [low, high]", 2)] = ()
    values: Annotated[tuple[float | str, ...], fields.quantities("a list of values")] = ()
    grade: Annotated[
        float, number("", "a fraction in (0, 1): 0.01 is 1 %", lambda value: 0.0 < value < 1.0)
    ]
    temperature_coefficient: Annotated[float, fields.per_kelvin()]
    drift: Annotated[
        float | None, number("", "a fraction in [0, 1): 0.005 is 0.5 %", lambda v: 0.0 <= v < 1.0)
    ] = None
    rating: RatingTable = Field(RatingTable(), description="a table of power and voltage")
    footprint: Annotated[str, fields.footprint()]
    dielectric: Annotated[str, line("text of one line: what it is made of")]
    price: Annotated[int, fields.price()]
    part_number: PartNumberTable = Field(description="a table of prefix, code, suffix")
    example: ExampleTable | None = Field(None, description="a table of value, part_number")
    sources: Annotated[tuple[str, ...], lines(fields.SOURCES)]
    assumed: Annotated[tuple[str, ...], lines("a list of what was not checked")] = ()
    use: Annotated[Use, choice("signal", "supply", "array")] = "signal"
    elements: Annotated[int | None, fields.elements()] = None
    matching: Annotated[
        float | None, number("", "a fraction in (0, 1): 0.001 is 0.1 %", lambda v: 0.0 < v < 1.0)
    ] = None


class CaseTable(BaseModel):
    model_config = STRICT
    part_number: Annotated[str, fields.code_text()]
    footprint: Annotated[str, fields.footprint()]
    manufacturer: Annotated[str | None, line("a name of one line")] = None
    pins: Annotated[dict[str, str] | None, fields.pins()] = None


class SectionTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a letter or name")]
    inverting: Annotated[str, line("a pin, in quotes")]
    noninverting: Annotated[str, line("a pin, in quotes")]
    output: Annotated[str, line("a pin, in quotes")]


class SpiceTable(BaseModel):
    model_config = STRICT
    file: Annotated[str, line("the name of a file beside this one")]
    subckt: Annotated[str, line("the name of a subcircuit in it")]
    pins: Annotated[tuple[str, ...], lines("its pins in order, of " + ", ".join(PINS))]


class OpAmpTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[str, fields.code_text()]
    section: tuple[SectionTable, ...] = Field(strict=False, description="a list of sections")
    supply_pins: Annotated[tuple[str, str], fields.pair_of_pins()]
    rated_supply: Annotated[float, fields.positive("V")]
    supply: Annotated[Figure, fields.figure("V")]
    swing: Annotated[Figure, fields.figure("V")]
    saturation: Annotated[Figure, fields.figure("V")]
    offset: Annotated[Figure, fields.figure("V", signed=True)]
    bias: Annotated[Figure, fields.figure("A", signed=True)]
    gain: Annotated[Figure, fields.figure("V/V")]
    gbw: Annotated[Figure, fields.figure("Hz")]
    slew: Annotated[Figure, fields.figure("V/s")]
    output_current: Annotated[Figure, fields.figure("A")]
    output_resistance: Annotated[Figure, fields.figure("Ω")]
    common_mode: Annotated[Figure, fields.figure("V", signed=True)]
    supply_current: Annotated[Figure, fields.figure("A")]
    noise: Annotated[Figure, fields.figure("V/√Hz")]
    offset_sigma: Annotated[float, fields.positive("V")]
    offset_limit: Annotated[float, fields.positive("V")]
    price: Annotated[int, fields.price()]
    footprint: Annotated[str, fields.footprint()]
    sources: Annotated[tuple[str, ...], lines(fields.SOURCES)]
    recovery: Annotated[Figure | None, fields.figure("s")] = None
    phase_margin: Annotated[Figure | None, fields.figure("°")] = None
    swing_2k: Annotated[Figure | None, fields.figure("V")] = None
    noise_corner: Annotated[Figure | None, fields.figure("Hz")] = None
    phase_reversal: Annotated[bool, flag()] = False
    spice: SpiceTable | None = Field(None, description="a table of file, subckt, pins")
    input_current: Annotated[Figure | None, fields.figure("A")] = None
    cases: tuple[CaseTable, ...] = Field(
        (), strict=False, description="a list of tables of part_number, footprint"
    )


class DiodeTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[str, fields.code_text()]
    forward_voltage: Annotated[Figure, fields.figure("V")]
    reverse_current: Annotated[Figure, fields.figure("A")]
    capacitance: Annotated[Figure, fields.figure("F")]
    recovery: Annotated[Figure, fields.figure("s")]
    reverse_voltage: Annotated[Figure, fields.figure("V")]
    price: Annotated[int, fields.price()]
    footprint: Annotated[str, fields.footprint()]
    sources: Annotated[tuple[str, ...], lines(fields.SOURCES)]
    pins: Annotated[dict[str, str], fields.pins("cathode", "anode")] = Field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}
    )
    cases: tuple[CaseTable, ...] = Field(
        (), strict=False, description="a list of tables of part_number, footprint"
    )


class ReferenceTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[str, fields.code_text()]
    voltage: Annotated[float, fields.positive("V")]
    grade: Annotated[
        float, number("", "a fraction in (0, 1): 0.01 is 1 %", lambda value: 0.0 < value < 1.0)
    ]
    temperature_coefficient: Annotated[float, fields.per_kelvin()]
    current: Annotated[Figure, fields.figure("A")]
    price: Annotated[int, fields.price()]
    footprint: Annotated[str, fields.footprint()]
    sources: Annotated[tuple[str, ...], lines(fields.SOURCES)]
    impedance: Annotated[Figure | None, fields.figure("Ω")] = None
    pins: Annotated[dict[str, str], fields.pins("cathode", "anode")] = Field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}
    )
    cases: tuple[CaseTable, ...] = Field(
        (), strict=False, description="a list of tables of part_number, footprint"
    )


class TrimmerTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[str, fields.code_text()]
    value: Annotated[float, fields.positive("Ω")]
    grade: Annotated[
        float, number("", "a fraction in (0, 1): 0.01 is 1 %", lambda value: 0.0 < value < 1.0)
    ]
    rating: RatingTable = Field(RatingTable(), description="a table of power and voltage")
    pins: Annotated[dict[str, str], fields.pins("low", "wiper", "high")]
    adjustability: Annotated[
        float, number("", "a fraction in [0, 0.1): 1e-4 is ± 0.01 %", lambda v: 0.0 <= v < 0.1)
    ] = 0.0
    price: Annotated[int, fields.price()]
    footprint: Annotated[str, fields.footprint()]
    sources: Annotated[tuple[str, ...], lines(fields.SOURCES)]
    assumed: Annotated[tuple[str, ...], lines("a list of what was not checked")] = ()
    cases: tuple[CaseTable, ...] = Field(
        (), strict=False, description="a list of tables of part_number, footprint"
    )


class HeaderTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[
        str, fields.with_ways('a part number with "{ways}" or "{ways:02}" in it')
    ]
    ways: Annotated[tuple[int, int], fields.ways()]
    rating: RatingTable = Field(RatingTable(), description="a table of power and voltage")
    price: Annotated[int, fields.price()]
    footprint: Annotated[
        str, fields.with_ways('a KiCad footprint with "{ways}" or "{ways:02}" in it')
    ]
    sources: Annotated[tuple[str, ...], lines(fields.SOURCES)]
    assumed: Annotated[tuple[str, ...], lines("a list of what was not checked")] = ()


class PriceTable(BaseModel):
    model_config = STRICT
    price_class: Annotated[int, fields.price()]
    euro: Annotated[float, number("", "a number >= 0, euro apiece", lambda value: value >= 0.0)]
    source: Annotated[str, line("where the figure comes from")]
    assumed: Annotated[bool, flag()] = False


class FileTables(BaseModel):
    model_config = STRICT
    format: Annotated[int, exactly(1, "1, the format that this version reads")]
    family: tuple[FamilyTable, ...] = Field((), strict=False, description="tables [[family]]")
    opamp: tuple[OpAmpTable, ...] = Field((), strict=False, description="tables [[opamp]]")
    diode: tuple[DiodeTable, ...] = Field((), strict=False, description="tables [[diode]]")
    reference: tuple[ReferenceTable, ...] = Field(
        (), strict=False, description="tables [[reference]]"
    )
    trimmer: tuple[TrimmerTable, ...] = Field((), strict=False, description="tables [[trimmer]]")
    header: tuple[HeaderTable, ...] = Field((), strict=False, description="tables [[header]]")
    price: tuple[PriceTable, ...] = Field((), strict=False, description="tables [[price]]")
