"""The table ``[spread]`` of a model file: how the boards differ (docs/spread.md).

Names of parts are only read here; which parts a design has is known once it is made
(``spread.part_rules``).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from designer.base.errors import MISSING, InputError
from designer.base.json_schema import either
from designer.base.schema import Accepts, FileTable, fraction, line, number, one_of, several, span
from designer.base.units import parse_quantity
from designer.model.distributions import Binned, Distribution, Normal, Uniform

DataSheet = Literal["typical", "data sheet"]
LawName = Literal["uniform", "normal", "binned"]
LAWS: tuple[LawName, ...] = ("uniform", "normal", "binned")
ABSOLUTE_ZERO, HOTTEST = -273.15, 300.0
"""°C: a board's temperature lies above the one and not beyond the other, where solder is molten."""


@dataclass(frozen=True)
class SpreadShape:
    """How parts lie within their grade."""

    law: LawName = "uniform"
    """"uniform", "normal" (cut at the grade) or "binned" (uniform without the middle)."""
    sigmas: float = 3.0
    """Standard deviations that the grade is of the normal law."""
    inner: float = 0.0
    """No part lies within ± this, a fraction as a grade is: these were picked out ("binned")."""

    def of(self, grade: float) -> Distribution:
        """The relative deviation of parts of this grade."""
        if self.law == "normal":
            return Normal(grade / self.sigmas, grade)
        return Binned(self.inner, grade) if self.law == "binned" else Uniform(-grade, grade)

    def over(self, grade: float) -> Distribution:
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
        parameters = {"uniform": (), "normal": ("sigmas",), "binned": ("inner",)}[table["law"]]
        for key in table:
            if key not in ("law", *parameters):
                raise ValueError(f"{table['law']} has no {key}")
        if table["law"] == "binned" and "inner" not in table:
            raise ValueError("binned needs inner, the grade that was picked out")
        return SpreadShape(
            table["law"], **{key: positive(table, key) for key in parameters if key in table}
        )

    return Accepts(expected, check, json=either({"enum": list(LAWS)}, {"type": "object"}))


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

    expected = '0, or { sigma = "3 mV", limit = "10 mV" }'
    return Accepts(expected, check, json=either({"const": 0}, {"type": "object"}))


def _drift(expected: str, fine: Callable[[float], bool]) -> Accepts:
    """A half-width, or lowest and highest."""
    one, two = number("", expected, fine), span("", expected, fine)

    def check(value: object) -> tuple[float, float]:
        if isinstance(value, list):
            return two.check(value)  # type: ignore[no-any-return]
        width = one.check(value)
        if width < 0.0:
            raise ValueError("± a number >= 0")
        return -width, width

    return Accepts(expected, check, json=either(one.json, two.json))


def _tempco() -> Accepts:
    expected = "1/K: a number >= 0 such as 100e-6 for ±, or [low, high]"
    return _drift(expected, lambda value: abs(value) < 0.01)


def _ageing(catalogue: bool = False) -> Accepts:
    expected = "a fraction >= 0 such as 0.005 for ±, or [low, high]"
    expected += ', or "catalogue"' if catalogue else ""
    drift = _drift(expected, lambda value: abs(value) < 1.0)

    def check(value: object) -> object:
        return value if catalogue and value == "catalogue" else drift.check(value)

    json = either(drift.json, {"const": "catalogue"}) if catalogue else drift.json
    return Accepts(expected, check, json=json)


def _figure(unit: str, example: str) -> Accepts:
    expected = f'"typical", "data sheet" or a range [low, high] such as {example}'
    between = span(unit, expected, math.isfinite)

    def check(value: object) -> object:
        return value if value in ("typical", "data sheet") else between.check(value)

    words = {"enum": ["typical", "data sheet"]}
    return Accepts(expected, check, json=either(words, between.json))


_SHARE = number("", "a share from 0 to 1", lambda value: 0.0 <= value <= 1.0)


def _names() -> Accepts:
    expected = 'a part such as "R203", or a list of parts'
    listed = several(expected, line("a name"), least=1, single=True, again=True)

    def check(value: object) -> tuple[str, ...]:
        names: tuple[str, ...] = listed.check(value)
        if len(set(names)) < len(names):
            raise ValueError("each of them once")
        return names

    return Accepts(expected, check, json=listed.json)


@dataclass(frozen=True)
class PartRule(FileTable):
    """What some parts have of their own; None: as the others."""

    names: Annotated[tuple[str, ...], _names()]
    """Names of the parts, or of a kind: "resistors"."""
    grade: Annotated[float | None, fraction("0.001 is 0.1 %", zero=True)] = None
    """Their grade, a fraction."""
    law: Annotated[SpreadShape | None, _shape()] = None
    """How they lie within their grade."""
    tempco: Annotated[tuple[float, float] | None, _tempco()] = None
    """Lowest and highest temperature coefficient [1/K]."""
    ageing: Annotated[tuple[float, float] | None, _ageing()] = None
    """Lowest and highest relative change by ageing."""


@dataclass(frozen=True)
class NetworkRule(FileTable):
    """Parts of one network."""

    parts: Annotated[tuple[str, ...], _names()]
    """Names of the parts."""
    share: Annotated[float | None, _SHARE] = None
    """Share of a part's deviation that is common to all of them."""
    family: Annotated[str | None, line("a family of arrays of the catalogue")] = None
    """Family of the catalogue's arrays that they are bought as, which then says their share and
    their grade."""


@dataclass(frozen=True)
class SpreadSpec(FileTable):
    """How the boards of a study differ; the defaults are ``bench-1``."""

    resistors: Annotated[SpreadShape, _shape()] = SpreadShape()
    """How resistors lie within their grade."""
    capacitors: Annotated[SpreadShape, _shape()] = SpreadShape()
    """How capacitors lie within their grade."""
    offset: Annotated[Offset | None, _offset()] = None
    """Distribution of the op-amps' offsets; None: the catalogue's."""
    saturation: Annotated[float, fraction("0.05 is ± 5 %", zero=True)] = 0.05
    """Half-width of the output limits, a fraction."""
    bias: Annotated[DataSheet | tuple[float, float], _figure("A", '["0 A", "200 pA"]')] = "typical"
    """Input bias current [A]: the typical figure, what the data sheet gives, or lowest and
    highest."""
    gain_bandwidth: Annotated[
        DataSheet | tuple[float, float], _figure("Hz", '["2.5 MHz", "4 MHz"]')
    ] = "typical"
    """Gain-bandwidth product [Hz]: the typical figure, what the data sheet gives, or lowest and
    highest."""
    supply: Annotated[float, fraction("0.02 is ± 2 %", zero=True)] = 0.0
    """Half-width of the rails, a fraction."""
    reference_grade: Annotated[float | None, fraction("0.001 is ± 0.1 %", zero=True)] = None
    """Tolerance of the references, a fraction; None: the catalogue's."""
    temperature: Annotated[
        tuple[float, float] | None,
        span(
            "",
            f"a range [low, high] in °C, from {ABSOLUTE_ZERO:g} to {HOTTEST:g}, such as [0, 50]",
            lambda t: ABSOLUTE_ZERO < t <= HOTTEST,
        ),
    ] = None
    """Lowest and highest temperature of the board [°C]."""
    ageing: Annotated[
        Literal["catalogue"] | tuple[float, float] | None, _ageing(catalogue=True)
    ] = None
    """Lowest and highest relative change of resistors and capacitors; "catalogue": each ± its
    family's drift."""
    reels: Annotated[float, _SHARE] = 0.0
    """Share of a deviation that parts of one value, from one reel, have in common."""
    network: tuple[NetworkRule, ...] = ()
    """Parts that stand in one network."""
    part: tuple[PartRule, ...] = ()
    """What some parts have of their own."""
    measured: Annotated[str | None, line("the name of a CSV file beside the model file")] = None
    """Name of the file with a bench's list of measured values; None for none."""

    def check(self, resistor_grade: float, capacitor_grade: float, file: str | None) -> None:
        """Refuse combinations of keys that contradict each other.

        Raises
        ------
        InputError : what was picked out is not better than what was bought; a network that says
            both its share and its family, or neither.
        """
        for index, rule in enumerate(self.network, start=1):
            if (rule.share is None) is (rule.family is None):
                value = MISSING if rule.share is None else "share and family"
                expected = "a share, or the family of arrays that it is bought from"
                raise InputError(file, f"spread.network[{index}].share", value, expected)
        check_binned(self.resistors, resistor_grade, "spread.resistors", file)
        check_binned(self.capacitors, capacitor_grade, "spread.capacitors", file)


BENCH_1 = SpreadSpec()
"""What a file without the table says."""


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
