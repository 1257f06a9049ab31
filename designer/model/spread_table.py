"""The table ``[spread]`` of a model file: how the boards differ (docs/spread.md).

Names of parts are only read here; which parts a design has is known once it is made
(``spread.part_rules``).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from designer.base.errors import MISSING, InputError
from designer.base.schema import STRICT, Accepts, line, number, one_of, span
from designer.base.units import parse_quantity
from designer.model.distributions import Binned, Law, Normal, Uniform

DataSheet = Literal["typical", "data sheet"]
LawName = Literal["uniform", "normal", "binned"]
LAWS: tuple[LawName, ...] = ("uniform", "normal", "binned")
ABSOLUTE_ZERO = -273.15


@dataclass(frozen=True)
class SpreadShape:
    """How parts lie within their grade."""

    law: LawName = "uniform"
    """"uniform", "normal" (cut at the grade) or "binned" (uniform without the middle)."""
    sigmas: float = 3.0
    """Standard deviations that the grade is of the normal law."""
    inner: float = 0.0
    """No part lies within ± this, a fraction as a grade is: these were picked out ("binned")."""

    def of(self, grade: float) -> Law:
        """The relative deviation of parts of this grade."""
        if self.law == "normal":
            return Normal(grade / self.sigmas, grade)
        return Binned(self.inner, grade) if self.law == "binned" else Uniform(-grade, grade)

    def over(self, grade: float) -> Law:
        """The same, over the grade."""
        if self.law == "normal":
            return Normal(1.0 / self.sigmas)
        return Binned(self.inner / grade) if self.law == "binned" else Uniform(-1.0, 1.0)


@dataclass(frozen=True)
class Offset:
    """Offsets that are normal about 0 and cut."""

    sigma: float
    """Standard deviation before the cut [V]."""
    limit: float
    """The cut lies at ± this [V]."""


@dataclass(frozen=True)
class PartRule:
    """What some parts have of their own; None: as the others."""

    names: tuple[str, ...]
    """Names of the parts, or of a kind: "resistors"."""
    grade: float | None = None
    """Their grade, a fraction."""
    law: SpreadShape | None = None
    """How they lie within their grade."""
    tempco: tuple[float, float] | None = None
    """Lowest and highest temperature coefficient [1/K]."""
    ageing: tuple[float, float] | None = None
    """Lowest and highest relative change by ageing."""


@dataclass(frozen=True)
class NetworkRule:
    """Parts of one network."""

    parts: tuple[str, ...]
    """Names of the parts."""
    share: float | None = None
    """Share of a part's deviation that is common to all of them."""
    family: str | None = None
    """Family of the catalogue's arrays that they are bought as, which then says their share and
    their grade."""


@dataclass(frozen=True)
class SpreadSpec:
    """How the boards of a study differ; the defaults are ``bench-1``."""

    resistors: SpreadShape = SpreadShape()
    """How resistors lie within their grade."""
    capacitors: SpreadShape = SpreadShape()
    """How capacitors lie within their grade."""
    offset: Offset | None = None
    """Distribution of the op-amps' offsets; None: the catalogue's."""
    saturation: float = 0.05
    """Half-width of the output limits, a fraction."""
    bias: DataSheet | tuple[float, float] = "typical"
    """Input bias current [A]: the typical figure, what the data sheet gives, or lowest and
    highest."""
    gain_bandwidth: DataSheet | tuple[float, float] = "typical"
    """Gain-bandwidth product [Hz]: the typical figure, what the data sheet gives, or lowest and
    highest."""
    supply: float = 0.0
    """Half-width of the rails, a fraction."""
    reference_grade: float | None = None
    """Tolerance of the references, a fraction; None: the catalogue's."""
    temperature: tuple[float, float] | None = None
    """Lowest and highest temperature of the board [°C]."""
    ageing: Literal["catalogue"] | tuple[float, float] | None = None
    """Lowest and highest relative change of resistors and capacitors; "catalogue": each ± its
    family's drift."""
    reels: float = 0.0
    """Share of a deviation that parts of one value, from one reel, have in common."""
    network: tuple[NetworkRule, ...] = ()
    """Parts that stand in one network."""
    part: tuple[PartRule, ...] = ()
    """What some parts have of their own."""
    measured: str | None = None
    """Name of the file with a bench's list of measured values; None for none."""


BENCH_1 = SpreadSpec()
"""What a file without the table says."""


# What the fields accept.


def _shape() -> Accepts:
    expected = (
        '"uniform", "normal", { law = "normal", sigmas = 3 } or { law = "binned", inner = 0.01 }'
    )

    def positive(table: dict[str, Any], key: str) -> float:
        value = table[key]
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"{key} is a number")
        if not 0.0 < value < math.inf:
            raise ValueError(f"{key} is > 0")
        return float(value)

    def check(value: object) -> SpreadShape:
        table = {"law": value} if isinstance(value, str) else value
        if not isinstance(table, dict) or not isinstance(table.get("law"), str):
            raise ValueError
        if table["law"] not in LAWS:
            raise ValueError(f"a law is {one_of(table['law'], LAWS)}")
        own = {"uniform": (), "normal": ("sigmas",), "binned": ("inner",)}[table["law"]]
        for key in table:
            if key not in ("law", *own):
                raise ValueError(f"{table['law']} has no {key}")
        if table["law"] == "binned" and "inner" not in table:
            raise ValueError("binned needs inner, the grade that was picked out")
        return SpreadShape(
            table["law"], **{key: positive(table, key) for key in own if key in table}
        )

    return Accepts(expected, check)


def _offset() -> Accepts:
    def volts(table: dict[str, Any], key: str) -> float:
        return parse_quantity(table[key], "V")

    def check(value: object) -> Offset:
        if value == 0 and not isinstance(value, bool):
            return Offset(0.0, 0.0)
        if not isinstance(value, dict) or set(value) != {"sigma", "limit"}:
            raise ValueError
        sigma, limit = volts(value, "sigma"), volts(value, "limit")
        if sigma <= 0.0 or limit <= 0.0:
            raise ValueError("both are > 0")
        return Offset(sigma, limit)

    return Accepts('0, or { sigma = "3 mV", limit = "10 mV" }', check)


def _fraction(expected: str) -> Accepts:
    return number("", expected, lambda value: 0.0 <= value < 1.0)


def _share() -> Accepts:
    return number("", "a share from 0 to 1", lambda value: 0.0 <= value <= 1.0)


def _drift(expected: str, fine: Callable[[float], bool]) -> Accepts:
    """A half-width, or lowest and highest."""
    one, two = number("", expected, fine), span("", expected, fine)

    def check(value: object) -> tuple[float, float]:
        if isinstance(value, list):
            low, high = two.check(value)
            return low, high
        width = one.check(value)
        if width < 0.0:
            raise ValueError("± a number >= 0")
        return -width, width

    return Accepts(expected, check)


def _tempco() -> Accepts:
    said = "1/K: a number >= 0 such as 100e-6 for ±, or [low, high]"
    return _drift(said, lambda value: abs(value) < 0.01)


def _ageing(catalogue: bool = False) -> Accepts:
    said = "a fraction >= 0 such as 0.005 for ±, or [low, high]"
    said += ', or "catalogue"' if catalogue else ""
    given = _drift(said, lambda value: abs(value) < 1.0)

    def check(value: object) -> object:
        return value if catalogue and value == "catalogue" else given.check(value)

    return Accepts(said, check)


def _figure(unit: str, example: str) -> Accepts:
    expected = f'"typical", "data sheet" or a range [low, high] such as {example}'
    between = span(unit, expected, math.isfinite)

    def check(value: object) -> object:
        return value if value in ("typical", "data sheet") else between.check(value)

    return Accepts(expected, check)


def _temperature() -> Accepts:
    return span("", "a range [low, high] in °C, such as [0, 50]", lambda t: t > ABSOLUTE_ZERO)


def _names() -> Accepts:
    one = line("a name").check

    def check(value: object) -> tuple[str, ...]:
        names = [value] if isinstance(value, str) else value
        if not isinstance(names, list) or not names:
            raise ValueError
        read = tuple(str(one(name)) for name in names)
        if len(set(read)) < len(read):
            raise ValueError("each of them once")
        return read

    return Accepts('a part such as "R203", or a list of parts', check)


class _PartTable(BaseModel):
    model_config = STRICT
    names: Annotated[tuple[str, ...], _names()]
    grade: Annotated[float | None, _fraction("a fraction in [0, 1): 0.001 is 0.1 %")] = None
    law: Annotated[SpreadShape | None, _shape()] = None
    tempco: Annotated[tuple[float, float] | None, _tempco()] = None
    ageing: Annotated[tuple[float, float] | None, _ageing()] = None


class _NetworkTable(BaseModel):
    model_config = STRICT
    parts: Annotated[tuple[str, ...], _names()]
    share: Annotated[float | None, _share()] = None
    family: Annotated[str | None, line("a family of arrays of the catalogue")] = None


class SpreadTable(BaseModel):
    """The keys of ``[spread]``, each with what it accepts."""

    model_config = STRICT
    resistors: Annotated[SpreadShape, _shape()] = SpreadSpec.resistors
    capacitors: Annotated[SpreadShape, _shape()] = SpreadSpec.capacitors
    offset: Annotated[Offset | None, _offset()] = None
    saturation: Annotated[float, _fraction("a fraction in [0, 1): 0.05 is ± 5 %")] = (
        SpreadSpec.saturation
    )
    bias: Annotated[DataSheet | tuple[float, float], _figure("A", '["0 A", "200 pA"]')] = "typical"
    gain_bandwidth: Annotated[
        DataSheet | tuple[float, float], _figure("Hz", '["2.5 MHz", "4 MHz"]')
    ] = "typical"
    supply: Annotated[float, _fraction("a fraction in [0, 1): 0.02 is ± 2 %")] = SpreadSpec.supply
    reference_grade: Annotated[
        float | None, _fraction("a fraction in [0, 1): 0.001 is ± 0.1 %")
    ] = None
    temperature: Annotated[tuple[float, float] | None, _temperature()] = None
    ageing: Annotated[Literal["catalogue"] | tuple[float, float] | None, _ageing(True)] = None
    reels: Annotated[float, _share()] = SpreadSpec.reels
    network: tuple[_NetworkTable, ...] = Field(
        default=(), strict=False, description="tables [[spread.network]]"
    )
    part: tuple[_PartTable, ...] = Field(
        default=(), strict=False, description="tables [[spread.part]]"
    )
    measured: Annotated[str | None, line("the name of a CSV file beside the model file")] = None

    def spec(self, resistor_grade: float, capacitor_grade: float, file: str | None) -> SpreadSpec:
        """The checked table.

        Raises
        ------
        InputError : what was picked out is not better than what was bought; a network that says
            both its share and its family, or neither.
        """
        for number_, rule in enumerate(self.network, start=1):
            if (rule.share is None) is (rule.family is None):
                found = MISSING if rule.share is None else "share and family"
                expected = "a share, or the family of arrays that it is bought from"
                raise InputError(file, f"spread.network[{number_}].share", found, expected)
        for key, shape, grade in (
            ("resistors", self.resistors, resistor_grade),
            ("capacitors", self.capacitors, capacitor_grade),
        ):
            check_binned(shape, grade, f"spread.{key}", file)
        read = {key: value for key, value in self if key not in ("network", "part")}
        network = tuple(NetworkRule(**dict(table)) for table in self.network)
        return SpreadSpec(
            **read, network=network, part=tuple(PartRule(**dict(table)) for table in self.part)
        )


def check_binned(shape: SpreadShape, grade: float, field: str, file: str | None) -> None:
    """Refuse parts of which all were picked out.

    Raises
    ------
    InputError : ``inner`` is not below the grade.
    """
    if shape.law == "binned" and shape.inner >= grade:
        raise InputError(
            file, f"{field}.inner", shape.inner, f"a fraction below the grade of {grade:g}"
        )
