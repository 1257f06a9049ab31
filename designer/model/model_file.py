"""Model files: TOML (docs/contract.md).

    format = 1
    [model]                  # or [mechanical], in SI units
    m = 0.5
    …
    [[response]]
    omega = 0.85
    expect = "1-2-2"
    [circuit]
    opamp = "TL074C"

``format = 1`` is two masses in a chain, of ``format = 2`` any system: [[mass]], [[spring]],
[[damper]], [[clearance]], [[force]] and [base] in place of [model] (``model.lumped_elements``).

Whatever is wrong with a file ends in one ``InputError`` that names the file, the field, what was
found and what was expected; nothing is read by half.

A wanted response that no motion of the model can be is refused, where that is certain; one that is
merely not found is no matter of the file (``model.find_responses``).
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from designer.base.errors import MISSING, InputError
from designer.base.guarded_reading import inside, read_text
from designer.base.json_schema import DIALECT, either, of_tables
from designer.base.schema import FileTable, checked, line, such, whole_number
from designer.base.si_unit import drive_text
from designer.base.toml_reader import parse_toml
from designer.base.toml_writer import toml_text
from designer.catalog.entries import Kind
from designer.catalog.parts_catalog import Catalog
from designer.dynamics.counts import Counts
from designer.dynamics.orbit import OrbitStatus
from designer.laws.law_elements import KINDS, CubicSpring, Friction, Law
from designer.model import model_limits
from designer.model.board_table import BoardSpec
from designer.model.circuit_table import CircuitSpec
from designer.model.file_numbers import FileNumbers, put_at
from designer.model.lumped_elements import BaseTable, Damper, Force, Gap, Mass, Spring
from designer.model.lumped_system import LumpedSystem
from designer.model.matrices import Matrices, written_out
from designer.model.mechanics import MechanicalModel, SecondOrderSystem
from designer.model.model import Dimensionless, Mechanical, SiScales
from designer.model.response_table import EXPECTED, Response, ResponseTable
from designer.model.search_table import SearchSpec
from designer.model.si_units import in_si
from designer.model.spread_table import BENCH_1, SpreadSpec
from designer.model.tuning_bands import Bands

if TYPE_CHECKING:
    from designer.catalog.design_rule import Override
    from designer.model.measured_values import MeasuredBoards

MAX_BYTES = 1_000_000
"""A model file is a page of text; anything larger is something else."""
LONGEST_TITLE = 200
"""Characters."""
SIDES = {1: "upper", -1: "lower"}


@dataclass(frozen=True)
class ModelFile:
    """A model file that has passed every check."""

    title: str
    """The title that it gives."""
    model: MechanicalModel
    """What is computed with: dimensionless, made from ``mechanical`` where that is what the file
    gives, or the system of a file of format 2 in the file's own units."""
    mechanical: Mechanical | None
    """Parameters in SI units, where a file of format 1 gives these."""
    si: SiScales | None
    """SI values of the model's units; None where they are not known."""
    responses: tuple[Response, ...]
    """The wanted responses."""
    circuit: CircuitSpec
    """What the circuit is to be made of."""
    text: str = field(repr=False)
    """The file word for word, but for NumPy files that it names, which are written out."""
    source: Path | None = None
    """The file that it was read from; None where it was none."""
    spread: SpreadSpec = BENCH_1
    """How the boards of a study differ."""
    measured: MeasuredBoards | None = None
    """The list that ``spread.measured`` names; read with the file."""
    tuning: Bands = field(default_factory=Bands)
    """The bands that the generator may be tuned in."""
    board: BoardSpec = field(default_factory=BoardSpec)
    """What the board has."""
    rules: Mapping[str, Override] = field(default_factory=dict, hash=False)
    """Other limits of design rules, by their ids."""
    search: SearchSpec = field(default_factory=SearchSpec)
    """What a search may change."""

    @property
    def sha256(self) -> str:
        """Hash of the text: two files with the same hash ask for the same thing."""
        return hashlib.sha256(self.text.encode("utf-8")).hexdigest()

    @property
    def motions_sha256(self) -> str:
        """Hash of its tables without what is expected of responses: files with the same one have
        the same motions, whatever is wanted of them."""
        data = self.data
        data["response"] = [
            {key: value for key, value in response.items() if key not in EXPECTED}
            for response in data.get("response", ())
        ]
        text = json.dumps(data, sort_keys=True, default=str)
        return hashlib.sha256(text.encode("ascii")).hexdigest()

    @property
    def angular(self) -> bool:
        """Whether ω is in rad/s, so that people are shown hertz."""
        return in_si(self.si, self.model)

    def drive_text(self, omega: float) -> str:
        """A drive frequency for people: "36 Hz" where ω is in rad/s, else "ω = 0.85"."""
        return drive_text(omega, None if self.si is None else self.si.hertz(omega))

    def with_(self, changes: Mapping[str, Any]) -> ModelFile:
        """This file with other values, checked as a file is; nothing is written.

        changes : by a key ("title", "circuit.opamp", "response"), what a file would have there, and
        None to leave it out; or by the name of a parameter ("zeta", "A.upper"; of format 2 not b, a
        factor on all gaps), a number or a text with its unit. Keys are changed first.

        Raises
        ------
        InputError : a name that is neither, or a value that the file may not have.
        """
        keys = {each.name for each in fields(FORMATS[self.format - 1])}
        of_keys, of_numbers = dict[str, Any](), dict[str, Any]()
        for name, value in changes.items():
            is_key = name.split(".")[0] in keys and name not in self.model.parameters
            (of_keys if is_key else of_numbers)[name] = value
        with errors_in(self):
            file, data = self, {**self.data, "title": self.title}
            if of_keys:
                for name, value in of_keys.items():
                    put_at(data, name, value)
                file = self.rewritten(data)
            if not of_numbers:
                return file
            file.numbers.change(data, of_numbers, sorted(keys))
            return file.rewritten(data)

    @property
    def data(self) -> dict[str, Any]:
        """A copy of its tables, as plain data."""
        return parse_toml(self.text.lstrip("\ufeff"), None)

    @property
    def numbers(self) -> FileNumbers:
        """Its numbers, which may be changed in its data."""
        return FileNumbers(self.model, self.mechanical, self.si)

    @property
    def format(self) -> int:
        """1 for the paper's two masses, 2 for any system."""
        return 1 if isinstance(self.model, Dimensionless) else 2

    def rewritten(self, data: Mapping[str, Any], source: Path | None = None) -> ModelFile:
        """A file of other tables with the list of measured values that this one has beside its own,
        and the place that it was read from, unless ``source`` says another.

        Raises
        ------
        InputError : the tables are no model file.
        """
        read = parse_model_file(toml_text(data), source or self.source)
        measured = self.measured
        if read.spread.measured != self.spread.measured:
            measured = _named_list(read)
        return replace(read, measured=measured)

    def choices(self, catalog: Catalog) -> Catalog:
        """The catalogue restricted to the cases and families that this file allows, for boards of
        the temperatures that it states.

        Raises
        ------
        InputError : a family that the catalogue does not have; names this file and the known ones.
        """
        families: dict[Kind, tuple[str, ...]] = {
            "resistor": self.circuit.resistor_family,
            "capacitor": self.circuit.capacitor_family,
        }
        try:
            bought = catalog.mounted(self.board.mounting).bought_from(families)
            return bought.at(self.spread.temperature)
        except InputError as error:
            raise InputError(self.source, error.field, error.found, error.expected) from None


def read_model_file(path: Path, *, measured: Path | None = None) -> ModelFile:
    """Read and check a model file, and the list of measured values that it names, if any.

    measured : where that list lies, if not where the file says.

    Raises
    ------
    InputError : the file cannot be read, or anything in it is wrong.
    """
    path = Path(path)
    text = read_text(path, "a model file (TOML)", most=MAX_BYTES)
    try:
        text = written_out(text, path.parent)
    except InputError as error:
        raise InputError(path, error.field, error.found, error.expected) from None
    modelfile = parse_model_file(text, path)
    return replace(modelfile, measured=_named_list(modelfile, measured))


def _named_list(modelfile: ModelFile, place: Path | None = None) -> MeasuredBoards | None:
    """The list that a file names, if any. place : where it lies, if not beside the file."""
    named = modelfile.spread.measured
    if named is None:
        return None
    from designer.model.measured_values import read_measured

    folder = Path() if modelfile.source is None else modelfile.source.parent
    with errors_in(modelfile):
        place = place or inside(folder, named, "spread.measured")
    return read_measured(place)


def parse_model_file(text: str, source: Path | None = None) -> ModelFile:
    """Check the text of a model file; ``source`` is named in errors and gives the default title.

    Raises
    ------
    InputError : anything in the text is wrong.
    """
    file = None if source is None else str(source)
    data = parse_toml(text, file)
    model_limits.check(data, FORMATS, file)
    table: type[_ModelFile | _SystemFile] = FORMATS[int(data["format"]) - 1]
    try:
        tables = checked(table, data, file)
        model = tables.system
        tables.search.band(model)
    except InputError as error:  # a model outside its domain does not know the file
        raise InputError(file, error.field, error.found, error.expected) from None
    si = tables.scales(data)
    responses = tuple(
        each.response(keys, index, si, file)
        for index, (each, keys) in enumerate(
            zip(tables.response, data.get("response", ()), strict=True), start=1
        )
    )
    for index, response in enumerate(responses, start=1):
        check_possible(response, index, model, file)
    circuit = tables.circuit
    if circuit.saturation is not None and circuit.saturation > circuit.supply:
        raise InputError(
            file,
            "circuit.saturation",
            circuit.saturation,
            f"a voltage within the supply of {circuit.supply:g} V",
        )
    tables.spread.check(circuit.resistor_grade, circuit.capacitor_grade, file)
    return ModelFile(
        title=tables.title or _named_after(source),
        model=model,
        mechanical=tables.mechanical,
        si=si,
        responses=responses,
        circuit=circuit,
        text=text,
        source=source,
        spread=tables.spread,
        tuning=tables.tuning,
        board=tables.board,
        rules=_rules(tables.rules, file),
        search=tables.search,
    )


def _named_after(source: Path | None) -> str:
    """A title for a file that states none. A file's name may be anything that is no slash."""
    stem = "" if source is None else source.stem[:LONGEST_TITLE]
    return "".join(ch if ch.isprintable() else "?" for ch in stem).strip() or "untitled"


_FORMAT = whole_number(
    "1 or 2, the formats that this version reads; a newer version of designer may know more", 1, 2
)
_RULES = such(
    "tables [rules.<id>]",
    lambda value: isinstance(value, dict),
    {"type": "object", "additionalProperties": {"type": "object"}},
)


def _rules(tables: Mapping[str, Any], file: str | None) -> dict[str, Override]:
    """``rules_table.overrides``; of no tables nothing, and the rules are not imported for it."""
    if not tables:
        return {}
    from designer.model.rules_table import overrides

    return overrides(tables, file)


@dataclass(frozen=True, kw_only=True)
class _Tables(FileTable):
    """What files of both formats have."""

    format: Annotated[int, _FORMAT]
    """1 for the paper's two masses, 2 for any system."""
    title: Annotated[str | None, line("text of one line", LONGEST_TITLE)] = None
    """Title of the reports; without it the file's name."""
    response: tuple[ResponseTable, ...] = ()
    """The responses that the board shall show."""
    circuit: CircuitSpec = field(default_factory=CircuitSpec)
    """What the circuit is to be made of."""
    tuning: Bands = field(default_factory=Bands)
    """The bands that the generator may be tuned in."""
    board: BoardSpec = field(default_factory=BoardSpec)
    """What the board has."""
    rules: Annotated[dict[str, Any], _RULES] = field(default_factory=dict)
    """Other limits of design rules, each with a reason."""
    search: SearchSpec = field(default_factory=SearchSpec)
    """What a search may change."""
    spread: SpreadSpec = BENCH_1
    """How the boards of a study differ."""


@dataclass(frozen=True, kw_only=True)
class _ModelFile(_Tables):
    """Format 1: the paper's two masses in a chain with stops."""

    model: Dimensionless | None = None
    """The parameters, dimensionless; or [mechanical]."""
    mechanical: Mechanical | None = None
    """The parameters in SI units."""

    @property
    def system(self) -> Dimensionless:
        """What is computed with."""
        if self.model is not None and self.mechanical is not None:
            raise InputError(None, "mechanical", "[model] and [mechanical]", "one of the two")
        if self.mechanical is not None:
            return _dimensionless(self.mechanical)
        if self.model is None:
            raise InputError(None, "model", MISSING, "a table [model] or a table [mechanical]")
        return self.model

    def scales(self, _data: Mapping[str, Any]) -> SiScales | None:
        """Those of Eq. (3)."""
        return None if self.mechanical is None else self.mechanical.scales


@dataclass(frozen=True, kw_only=True)
class _SystemFile(_Tables):
    """Format 2: any masses, springs, dampers, clearances and forces."""

    mass: tuple[Mass, ...] = ()
    """The masses."""
    spring: tuple[Spring, ...] = ()
    """Springs between masses, or between a mass and ground."""
    damper: tuple[Damper, ...] = ()
    """Dampers between masses, or between a mass and ground."""
    clearance: tuple[Gap, ...] = ()
    """Gaps to stops, in the order in which n-p-q names them."""
    force: tuple[Force, ...] = ()
    """Forces on masses."""
    base: BaseTable | None = None
    """How the ground moves; without it the ground rests."""
    law: tuple[Law, ...] = ()
    """Forces that are straight between given points."""
    cubic_spring: tuple[CubicSpring, ...] = ()
    """Springs with a cubic force."""
    friction: tuple[Friction, ...] = ()
    """Dry friction."""
    matrices: Matrices | None = None
    """The linear part by its matrices, in the place of masses, springs and dampers."""
    mechanical: ClassVar[None] = None

    @property
    def system(self) -> LumpedSystem:
        """What is computed with."""
        base = None if self.base is None else self.base.motion
        masses = self.mass
        if self.matrices is not None:
            if masses:
                expected = "none beside [matrices], whose names are the masses'"
                raise InputError(None, "mass", f"{len(masses)} tables [[mass]]", expected)
            named = zip(self.matrices.names, self.matrices.mass, strict=False)
            masses = tuple(Mass(name, row[i]) for i, (name, row) in enumerate(named))
        linear = masses, self.spring, self.damper, self.clearance, self.force
        laws = {kind.LIST: getattr(self, kind.TABLE) for kind in KINDS}
        return LumpedSystem(*linear, base, **laws, matrices=self.matrices)

    def scales(self, data: Mapping[str, Any]) -> SiScales | None:
        """The file is in SI where a value of its elements is a text with a unit."""
        keys = (key for key in model_limits.ELEMENTS if key not in ("base", "matrices"))
        elements = [element for key in keys for element in data.get(key, ())]
        elements += [data["base"]] if "base" in data else []
        words = ("name", "between", "of", "on", "law", "stops", "quantity", "waveform", "phase")
        values = [v for each in elements for key, v in each.items() if key not in words]
        values += [v for law in data.get("law", ()) for point in law["points"] for v in point]
        drives = [*data.get("force", ()), data.get("base", {})]
        values += [v for each in drives for _, v, _ in each.get("harmonics", ())]
        return SiScales() if any(isinstance(value, str) for value in values) else None


FORMATS: tuple[type[_ModelFile], type[_SystemFile]] = (_ModelFile, _SystemFile)
"""The top level of each format, from 1 on."""


def json_schema() -> dict[str, Any]:
    """JSON Schema of a model file, for editors: the keys of each table and what they accept."""
    formats, shared = list[dict[str, Any]](), dict[str, Any]()
    for number, table in enumerate(FORMATS, start=1):
        schema = of_tables(table)
        shared |= schema.pop("$defs")
        schema["properties"]["format"] |= {"const": number}
        formats.append(schema)
    title = "Model file of designer"
    return {"$schema": DIALECT, "title": title, **either(*formats), "$defs": shared}


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


def _dimensionless(mechanical: Mechanical) -> Dimensionless:
    try:
        return mechanical.dimensionless()
    except (ZeroDivisionError, OverflowError):
        raise InputError(
            None, "mechanical", "values too far apart", "SI values of one mechanism"
        ) from None
    except InputError as error:
        name = error.field.removeprefix("model.")
        if name not in _CAUSES:
            raise
        cause, formula = _CAUSES[name]
        raise InputError(
            None,
            f"mechanical.{cause}",
            getattr(mechanical, cause),
            f"a value that makes {name} = {formula} {error.expected}",
        ) from None


def need_responses(modelfile: ModelFile, more: str = "") -> None:
    """InputError unless the file wants a response."""
    if not modelfile.responses:
        raise InputError(
            str(modelfile.source) if modelfile.source else None,
            "response",
            MISSING,
            f"at least one table [[response]]{more}",
        )


@contextlib.contextmanager
def errors_in(modelfile: ModelFile) -> Iterator[None]:
    """Names the model file in an InputError that names none."""
    try:
        yield
    except InputError as error:
        if error.file is not None or modelfile.source is None:
            raise
        raise type(error)(modelfile.source, error.field, error.found, error.expected) from None


def check_possible(
    response: Response, index: int, model: MechanicalModel, file: str | None
) -> None:
    """Refuse a response that the model cannot have, whatever its numbers.

    index : number of its table in the file, from 1.

    Raises
    ------
    InputError : n-p-q without a p-q for each clearance; impacts on a stop that is not there,
        whatever its mirror twin has; a period or a symmetry that such a motion cannot have.
    """
    expect, system = response.expect, model.second_order()
    if not isinstance(expect, Counts):
        _check_without_period(expect, index, system, file)
        return
    stops, field = system.clearances, f"response[{index}].expect"
    count = max(len(stops), 1)
    if len(expect.impacts) != count:
        shape = "1-" + ";".join(["p-q"] * count)
        listed = f", for the clearances {', '.join(s.name for s in stops)}" if count > 1 else ""
        raise InputError(file, field, str(expect), f"p-q for each clearance, as in {shape}{listed}")
    missing = list(_missing_stops(expect, system))
    if missing:
        none = f"there is no {' and no '.join(missing)}" if stops else "the model has no stops"
        expected = f"0 for a stop that is not there, as in {_near(expect, system)}: {none}"
        raise InputError(file, field, str(expect), expected)
    if expect.n > 1 and not expect.total and _is_linear_between(system):
        expected = "n = 1: a motion without impacts is linear, and has the period of its drive"
        raise InputError(file, field, str(expect), expected)
    if response.symmetric and expect.n % 2 == 0:
        field = f"response[{index}].symmetric"
        expected = f"none beside {expect}: of a symmetric motion n is odd"
        raise InputError(file, field, "true", expected)


def _check_without_period(
    wanted: OrbitStatus | None, index: int, system: SecondOrderSystem, file: str | None
) -> None:
    """Refuse a motion without a period of a system without anything that bends or jumps."""
    if wanted is not None and not system.clearances and not system.laws:
        expected = "1-0-0: a linear system has the period of its drive"
        raise InputError(file, f"response[{index}].expect", str(wanted), expected)


def _missing_stops(counts: Counts, system: SecondOrderSystem) -> Iterator[str]:
    """Stops that are to be hit and are not there, in words."""
    for index, pair in enumerate(counts.impacts):
        stop = system.clearances[index] if system.clearances else None
        for side, hits in zip((1, -1), pair, strict=True):
            if hits and (stop is None or side not in stop.positions):
                yield "stop" if stop is None else f"{SIDES[side]} stop of {stop.name}"


def _near(counts: Counts, system: SecondOrderSystem) -> Counts:
    """What may have been meant: the mirror twin, or 0 for each stop that is not there."""
    if not list(_missing_stops(counts.mirrored, system)):
        return counts.mirrored
    impacts = list[tuple[int, int]]()
    for index, (p, q) in enumerate(counts.impacts):
        there = system.clearances[index].positions if system.clearances else ()
        impacts.append((p if 1 in there else 0, q if -1 in there else 0))
    return Counts(counts.n if any(map(any, impacts)) else 1, tuple(impacts))


def _is_linear_between(system: SecondOrderSystem) -> bool:
    """Whether nothing but the entry into contact, or its end, changes the equations."""
    flow = system.piecewise_linear(1.0)
    first = flow.mode(flow.start).guards
    entered = [guard for each in first for guard in flow.mode(each.target).guards]
    return all(guard.clearance >= 0 for guard in (*first, *entered))
