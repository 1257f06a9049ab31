"""Model files: TOML, ``format = 1`` (docs/contract.md).

    format = 1
    [model]                  # or [mechanical], in SI units
    m = 0.5
    …
    [[response]]
    omega = 0.85
    expect = "1-2-2"
    [circuit]
    opamp = "TL074C"

Whatever is wrong with a file ends in one ``InputError`` that names the file, the field, what was
found and what was expected; nothing is read by half.
"""

from __future__ import annotations

import hashlib
import math
import re
import stat
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal, NoReturn

from pydantic import BaseModel, Field

from designer.bands import Bands
from designer.boardspec import BoardSpec, BoardTable
from designer.circuitspec import CircuitSpec, CircuitTable
from designer.errors import InputError
from designer.measured import Measured, read_measured
from designer.model import Dimensionless, Mechanical, Sides
from designer.paths import inside
from designer.rule import Override
from designer.rulespec import overrides
from designer.schema import (
    STRICT,
    Accepts,
    checked,
    choice,
    exactly,
    flag,
    line,
    number,
    parse_toml,
    physical,
    shown,
    span,
)
from designer.searchspec import SearchSpec, SearchTable
from designer.spreadspec import BENCH_1, SpreadSpec, SpreadTable

__all__ = [
    "MAX_BYTES",
    "MAX_PERIODS",
    "CircuitSpec",
    "Expect",
    "ModelFile",
    "Response",
    "SpreadSpec",
    "Twin",
    "parse_model_file",
    "read_model_file",
]

Twin = Literal["either", "exact"]

MAX_BYTES = 1_000_000
"""A model file is a page of text; anything larger is something else."""

MAX_PERIODS = 16
"""Largest n of an n-p-q response (docs/definitions.md)."""

_EXPECT = re.compile(r"([1-9]\d?)-(0|[1-9]\d{0,3})-(0|[1-9]\d{0,3})", re.ASCII)


@dataclass(frozen=True)
class Expect:
    """An n-p-q response: n forcing periods, p impacts at +b and q at -b in that time."""

    n: int
    p: int
    q: int

    def __str__(self) -> str:
        return f"{self.n}-{self.p}-{self.q}"

    @classmethod
    def parse(cls, text: str) -> Expect:
        """Read "1-2-2"; ValueError unless n is 1 to 16 and p and q are integers >= 0."""
        match = _EXPECT.fullmatch(text)
        if not match or int(match[1]) > MAX_PERIODS:
            raise ValueError(f"not n-p-q with n from 1 to {MAX_PERIODS}")
        return cls(int(match[1]), int(match[2]), int(match[3]))

    def accepts(self, n: int, p: int, q: int, twin_exact: bool = False) -> bool:
        """Whether n-p-q is this response, or its mirror twin n-q-p unless ``twin_exact``."""
        if (n, p, q) == (self.n, self.p, self.q):
            return True
        return not twin_exact and (n, p, q) == (self.n, self.q, self.p)


@dataclass(frozen=True)
class Response:
    """A response that the board shall show.

    omega : dimensionless frequency; None for "best": the tool chooses it.
    expect : the wanted n-p-q, or None where any is of interest.
    twin : "either" accepts the mirror twin of ``expect`` as well; "exact" does not.
    symmetric : whether the orbit has to be symmetric (True), asymmetric (False) or either (None).
    b : clearance at which this response is wanted: a value, a range to choose from, or None for
        the model's own.
    """

    omega: float | None
    expect: Expect | None = None
    twin: Twin = "either"
    symmetric: bool | None = None
    b: float | tuple[float, float] | None = None

    def accepts(self, n: int, p: int, q: int) -> bool:
        """Whether n-p-q is what is expected here; without an expectation, anything is."""
        return self.expect is None or self.expect.accepts(n, p, q, self.twin == "exact")


@dataclass(frozen=True)
class ModelFile:
    """A model file that has passed every check.

    ``model`` is always filled, from ``mechanical`` where that is what the file gives; ``text`` is
    the file word for word. measured : the list that ``spread.measured`` names; read with the file.
    rules : other limits of design rules, by their ids.
    """

    title: str
    model: Dimensionless
    mechanical: Mechanical | None
    responses: tuple[Response, ...]
    circuit: CircuitSpec
    text: str = field(repr=False)
    source: Path | None = None
    spread: SpreadSpec = BENCH_1
    measured: Measured | None = None
    tuning: Bands = field(default_factory=Bands)
    board: BoardSpec = field(default_factory=BoardSpec)
    rules: Mapping[str, Override] = field(default_factory=dict, hash=False)
    search: SearchSpec = field(default_factory=SearchSpec)

    @property
    def sha256(self) -> str:
        """Hash of the text: two files with the same hash ask for the same thing."""
        return hashlib.sha256(self.text.encode("utf-8")).hexdigest()


def read_model_file(path: Path, *, measured: Path | None = None) -> ModelFile:
    """Read and check a model file, and the list of measured values that it names, if any.

    measured : where that list lies, if not where the file says.

    Raises
    ------
    InputError : the file cannot be read, or anything in it is wrong.
    """
    path = Path(path)
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise InputError(path, "the file", "a folder", "a model file (TOML)")
        if not stat.S_ISREG(status.st_mode):
            raise InputError(path, "the file", "no regular file", "a model file (TOML)")
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise InputError(path, "the file", "nothing", "a model file (TOML)") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(path, "the file", reason, "a model file that can be read") from None
    if len(content) > MAX_BYTES:
        raise InputError(
            path, "the file", f"more than {MAX_BYTES} bytes", "a model file: a page of TOML"
        )
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = content[: error.start].count(b"\n") + 1
        raise InputError(
            path, f"line {row}", f"byte 0x{content[error.start]:02x}", "text in UTF-8"
        ) from None
    modelfile = parse_model_file(text, path)
    named = modelfile.spread.measured
    if named is None:
        return modelfile
    try:
        place = measured or inside(path.parent, named, "spread.measured")
    except InputError as error:
        raise InputError(path, error.field, error.found, error.expected) from None
    return replace(modelfile, measured=read_measured(place))


def parse_model_file(text: str, source: Path | None = None) -> ModelFile:
    """Check the text of a model file; ``source`` is named in errors and gives the default title.

    Raises
    ------
    InputError : anything in the text is wrong.
    """
    file = None if source is None else str(source)
    tables = checked(_File, parse_toml(text, file), file)
    model, mechanical = _models(tables, file)
    responses = tuple(
        _response(table, index, mechanical, file)
        for index, table in enumerate(tables.response, start=1)
    )
    circuit = CircuitSpec(**dict(tables.circuit))
    if circuit.saturation is not None and circuit.saturation > circuit.supply:
        raise InputError(
            file,
            "circuit.saturation",
            circuit.saturation,
            f"a voltage within the supply of {circuit.supply:g} V",
        )
    spread = tables.spread.spec(circuit.resistor_grade, circuit.capacitor_grade, file)
    title = tables.title or (source.stem if source is not None else "untitled")
    tuning = Bands(**dict(tables.tuning))
    made = ModelFile(
        title,
        model,
        mechanical,
        responses,
        circuit,
        text,
        source,
        spread,
        tuning=tuning,
        board=BoardSpec(**dict(tables.board)),
        search=SearchSpec(**dict(tables.search)),
    )
    return replace(made, rules=overrides(tables.rules, file))


def _models(tables: _File, file: str | None) -> tuple[Dimensionless, Mechanical | None]:
    if tables.model is not None and tables.mechanical is not None:
        raise InputError(file, "mechanical", "[model] and [mechanical]", "one of the two")
    try:
        if tables.model is not None:
            return Dimensionless(**dict(tables.model)), None
        if tables.mechanical is not None:
            mechanical = Mechanical(**dict(tables.mechanical))
            return _dimensionless(mechanical, file), mechanical
    except InputError as error:
        if error.file is not None:
            raise
        raise InputError(file, error.field, error.found, error.expected) from None
    raise InputError(file, "model", "nothing", "a table [model] or a table [mechanical]")


# Which quantity of Eq. (1)-(2) to look at when a dimensionless one leaves its domain.
_CAUSES = {
    "m": ("M2", "M2/(M1 + M2)"),
    "k": ("K2", "K2/(K1 + K2)"),
    "k0": ("K0", "K0/(K0 + K1)"),
    "c": ("C2", "C2/(C1 + C2)"),
    "zeta": ("C1", "C1/(2 sqrt(K1 M1))"),
    "f20": ("P2", "P2/(P1 + P2)"),
    "b": ("B", "B K1/(P1 + P2)"),
}


def _dimensionless(mechanical: Mechanical, file: str | None) -> Dimensionless:
    try:
        return mechanical.dimensionless()
    except (ZeroDivisionError, OverflowError):
        raise InputError(
            file, "mechanical", "values too far apart", "SI values of one mechanism"
        ) from None
    except InputError as error:
        name = error.field.removeprefix("model.")
        if name not in _CAUSES:
            raise
        cause, formula = _CAUSES[name]
        raise InputError(
            file,
            f"mechanical.{cause}",
            getattr(mechanical, cause),
            f"a value that makes {name} = {formula} {error.expected}",
        ) from None


def _response(
    table: _ResponseTable, index: int, mechanical: Mechanical | None, file: str | None
) -> Response:
    place = f"response[{index}]"

    def refuse(key: str, found: object, expected: str) -> NoReturn:
        raise InputError(file, f"{place}.{key}", found, expected)

    if table.omega is not None and table.Omega is not None:
        refuse("Omega", "omega and Omega", "one of the two")
    omega = None if table.omega == "best" else table.omega
    if table.Omega is not None:
        if mechanical is None:
            refuse("Omega", table.Omega, "omega: Omega in rad/s needs a table [mechanical]")
        omega = mechanical.omega(table.Omega)
        if not 0.0 < omega < math.inf:
            refuse("Omega", table.Omega, "a frequency within the range of numbers")
    elif table.omega is None:
        refuse("omega", "nothing", _OMEGA + ("" if mechanical is None else ", or Omega in rad/s"))
    if table.twin == "exact" and table.expect is None:
        refuse("twin", shown(table.twin), "an expect that it can apply to")
    assert not isinstance(omega, str)
    return Response(omega, table.expect, table.twin, table.symmetric, table.b)


# What the fields of a file accept.

_OMEGA = 'a number > 0, or "best"'


def _positive(value: float) -> bool:
    return value > 0.0


def _plain(domain: str) -> Accepts:
    """A number; ``Dimensionless`` holds it to the domain, which is only told here."""
    return number("", f"a number {domain}")


def _omega() -> Accepts:
    frequency = number("", _OMEGA, _positive)

    def check(value: object) -> object:
        return value if value == "best" else frequency.check(value)

    return Accepts(_OMEGA, check)


def _expect() -> Accepts:
    def check(value: object) -> Expect:
        if not isinstance(value, str):
            raise ValueError
        try:
            return Expect.parse(value)
        except ValueError:
            raise ValueError from None

    return Accepts(f'n-p-q such as "1-2-2", with n from 1 to {MAX_PERIODS} and p, q >= 0', check)


def _clearance() -> Accepts:
    expected = "a number > 0, or a range [low, high] of numbers > 0"
    value_of, span_of = number("", expected, _positive), span("", expected, _positive)

    def check(value: object) -> object:
        return (span_of if isinstance(value, list) else value_of).check(value)

    return Accepts(expected, check)


def _band() -> Accepts:
    return number("", "a number in [0, 1)", lambda value: 0.0 <= value < 1.0)


# The tables of a file, key by key.


class _ModelTable(BaseModel):
    model_config = STRICT
    m: Annotated[float, _plain("in (0, 1)")]
    k: Annotated[float, _plain("in (0, 1)")]
    k0: Annotated[float, _plain("in [0, 1)")]
    c: Annotated[float, _plain("in [0, 1)")]
    zeta: Annotated[float, _plain("> 0")]
    f20: Annotated[float, _plain("in [0, 1]")]
    b: Annotated[float, _plain("> 0")]
    sides: Annotated[Sides, choice("both", "upper", "lower")] = "both"


class _MechanicalTable(BaseModel):
    model_config = STRICT
    M1: Annotated[float, physical("kg")]
    M2: Annotated[float, physical("kg")]
    C1: Annotated[float, physical("N s/m")]
    C2: Annotated[float, physical("N s/m", zero=True)]
    K0: Annotated[float, physical("N/m", zero=True)]
    K1: Annotated[float, physical("N/m")]
    K2: Annotated[float, physical("N/m", zero=True)]
    B: Annotated[float, physical("m")]
    P1: Annotated[float, physical("N", zero=True)]
    P2: Annotated[float, physical("N", zero=True)]
    sides: Annotated[Sides, choice("both", "upper", "lower")] = "both"


class _ResponseTable(BaseModel):
    model_config = STRICT
    omega: Annotated[float | Literal["best"] | None, _omega()] = None
    Omega: Annotated[float | None, physical("rad/s")] = None
    expect: Annotated[Expect | None, _expect()] = None
    twin: Annotated[Twin, choice("either", "exact")] = "either"
    symmetric: Annotated[bool | None, flag()] = None
    b: Annotated[float | tuple[float, float] | None, _clearance()] = None


class _TuningTable(BaseModel):
    model_config = STRICT
    frequency: Annotated[float, _band()] = Bands.frequency
    amplitude: Annotated[float, _band()] = Bands.amplitude
    offset: Annotated[float, number("", "a number >= 0", lambda value: value >= 0.0)] = Bands.offset


class _File(BaseModel):
    model_config = STRICT
    format: Annotated[int, exactly(1, "1, the format that this version reads")]
    title: Annotated[str | None, line("text of one line")] = None
    model: _ModelTable | None = Field(None, description="a table [model]")
    mechanical: _MechanicalTable | None = Field(None, description="a table [mechanical]")
    response: tuple[_ResponseTable, ...] = Field(
        (), strict=False, description="one table [[response]] for each response"
    )
    circuit: CircuitTable = Field(CircuitTable(), description="a table [circuit]")
    tuning: _TuningTable = Field(_TuningTable(), description="a table [tuning]")
    board: BoardTable = Field(BoardTable(), description="a table [board]")
    rules: dict[str, object] = Field({}, description="tables [rules.<id>]")
    search: SearchTable = Field(SearchTable(), description="a table [search]")
    spread: SpreadTable = Field(default=SpreadTable(), description="a table [spread]")
