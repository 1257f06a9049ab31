"""The model files that ``designer new`` writes, from the folder ``templates``."""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, Literal, NoReturn

import numpy as np

from designer.base import atomic_write
from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.plain_json import dumps
from designer.base.toml_reader import parse_toml
from designer.model.ascii_sketch import sketch
from designer.model.model import Dimensionless, Mechanical, SiScales
from designer.model.model_file import ModelFile, json_schema, parse_model_file, read_model_file
from designer.model.si_units import MECHANICAL_UNITS

_FOLDER = Path(__file__).parent / "templates"
SCHEMA = "designer.schema.json"
"""The file beside a model file from which an editor knows the keys."""


def _commented(number: int, circuit: str) -> str:
    text = (_FOLDER / f"format_{number}.toml").read_text("utf-8")
    drawn = "".join(f"# {line}\n" for line in sketch().splitlines())
    return f"#:schema ./{SCHEMA}\n" + text.replace("# SKETCH\n", drawn) + circuit


_CIRCUIT = (_FOLDER / "circuit.toml").read_text("utf-8")
TEXT = _commented(1, _CIRCUIT)
"""A file of format 1."""
SECOND = _commented(
    2,
    _CIRCUIT.replace(
        "saturation = 13.0               # V; ", "# saturation = 13.0             # V; "
    ).replace(
        "where omega = 1 may lie", "where the first mass's own frequency may lie on the board"
    ),
)
"""A file of format 2."""


def write_model_file(
    place: Path, from_: Path | str | None = None, *, format: Literal[1, 2] | None = None
) -> Path:
    """Write a model file to start from, and beside a commented one ``SCHEMA``, for editors; its
    path.

    ``from_`` : a model file to begin with: one of format 1 is rewritten in format 2
    (``second_format``), one of format 2 copied. format : of the commented file, 1 unless given.

    Raises
    ------
    InputError : there is a file of this name, which is left alone, or none can be written there;
        both ``from_`` and ``format``; a file that cannot be read or rewritten.
    """
    text = _text(from_, format)
    try:
        with place.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(place, "PATH", "a file", "a name that is free") from None
    except OSError as error:
        expected = "a file that can be written"
        raise InputError(place, "PATH", error.strerror or str(error), expected) from None
    if from_ is None:
        _write_schema(place.with_name(SCHEMA))
    return place


def _write_schema(place: Path) -> None:
    """Write the JSON Schema of model files, or renew one that an older version wrote."""
    schema = json_schema()
    with contextlib.suppress(OSError):  # the model file is good without it
        if not place.exists() or f'"{schema["title"]}"' in place.read_text("utf-8", "replace"):
            atomic_write.write(place, dumps(schema))


def _text(from_: Path | str | None, format: Literal[1, 2] | None) -> str:
    if from_ is None:
        return SECOND if format == 2 else TEXT
    if format is not None:
        raise InputError(
            None, "--format", format, "none beside --from, whose file becomes format 2"
        )
    return second_format(read_model_file(Path(from_)))


NEAR = 1e-12
"""Of the largest entry: coefficients of both files that differ by rounding alone."""
_HEADER = re.compile(r"\s*\[\[?\s*([A-Za-z_.]+)\s*\]\]?\s*(#.*)?")
_LINE = re.compile(r"(\s*([A-Za-z0-9_]+)\s*=\s*)([^#]*)(.*)")


@dataclass(frozen=True)
class _Block:
    """A table's lines in a file, from its header on."""

    table: str
    lines: tuple[str, ...]


def second_format(modelfile: ModelFile) -> str:
    """The text of a file of format 2 that says the same; that of such a file as it is.

    The table ``[model]`` or ``[mechanical]`` becomes elements; frequencies and clearances of the
    responses become those of the new file. Every other table keeps its text, with its comments. The
    result is read again and compared, so a file that is written in another way than a table with a
    header and a key a line is refused, never changed by half.

    Raises
    ------
    InputError : the file is not written with a header for each table and a line for each key.
    """
    model = modelfile.model
    if not isinstance(model, Dimensionless):
        return modelfile.text
    scales = modelfile.si or SiScales()
    blocks = [_rewritten(block, modelfile, scales) for block in _blocks(modelfile.text)]
    text = "\n".join(chain.from_iterable(block.lines for block in blocks)) + "\n"
    _check(modelfile, text, scales)
    return text


def _blocks(text: str) -> Iterator[_Block]:
    """The file by tables; blank lines and comments above a header go with it."""
    table, lines = "", list[str]()
    for line in text.splitlines():
        header = _HEADER.fullmatch(line)
        if header is None:
            lines.append(line)
            continue
        end = len(lines)
        while end and (not lines[end - 1].strip() or lines[end - 1].lstrip().startswith("#")):
            end -= 1
        yield _Block(table, tuple(lines[:end]))
        table, lines = header[1], [*lines[end:], line]
    yield _Block(table, tuple(lines))


def _rewritten(block: _Block, modelfile: ModelFile, scales: SiScales) -> _Block:
    """A block in the new format."""
    model = modelfile.model
    if block.table in ("model", "mechanical"):
        return _Block(block.table, tuple(_elements(modelfile)))
    changes: dict[str, Callable[[Any], Any]] = {}
    if block.table == "":
        changes["format"] = lambda _: 2
    if block.table == "response":
        changes["b"] = lambda b: _each(b, lambda value: value / model.b)
        changes["least_exponent"] = lambda rate: rate / scales.time_scale
    if block.table in ("response", "search"):
        changes["omega"] = lambda omega: _each(omega, lambda value: value / scales.time_scale)
    return _Block(block.table, tuple(_changed(line, changes) for line in block.lines))


def _each(value: Any, change: Callable[[float], float]) -> Any:
    if isinstance(value, list):
        return [change(float(each)) for each in value]
    return value if isinstance(value, str) else change(float(value))


def _changed(line: str, changes: Mapping[str, Callable[[Any], Any]]) -> str:
    """A line ``key = value`` with another value; its comment stays."""
    match = _LINE.fullmatch(line)
    if match is None or match[2] not in changes:
        return line
    before, key, stated, comment = match.groups()
    written = stated.rstrip()
    value = parse_toml(f"value = {written}", None)["value"]
    return f"{before}{json.dumps(changes[key](value))}{stated[len(written) :]}{comment}"


def _elements(modelfile: ModelFile) -> Iterator[str]:
    """The tables of the elements. Plain numbers of [model] are in units of M1, K1 and P1 + P2."""
    model, mechanical = modelfile.model, modelfile.mechanical
    assert isinstance(model, Dimensionless)
    system = mechanical or Mechanical.from_dimensionless(model, M1=1.0, K1=1.0, force=1.0)
    raw = {} if mechanical is None else parse_toml(modelfile.text, None)["mechanical"]

    def value(name: str) -> str:
        number = raw.get(name, getattr(system, name))
        if mechanical is None or isinstance(number, str):
            return json.dumps(number, ensure_ascii=False)
        return json.dumps(f"{number!r} {MECHANICAL_UNITS[name]}")

    for mass in ("M1", "M2"):
        yield from ("[[mass]]", f'name = "{mass}"', f"mass = {value(mass)}", "")
    for kind, key, names in (("spring", "stiffness", "K"), ("damper", "damping", "C")):
        for number, between in (("1", '["M1", "M2"]'), ("2", '["M2", "ground"]')):
            if getattr(system, names + number):
                yield from (f"[[{kind}]]", f"between = {between}")
                yield from (f"{key} = {value(names + number)}", "")
    if system.K0:
        yield from ("[[clearance]]", 'name = "A"', 'between = ["M1", "ground"]')
        gaps = ("upper", "lower") if system.sides == "both" else (system.sides,)
        yield from (f"{side} = {value('B')}" for side in gaps)
        yield from (f"stiffness = {value('K0')}", "")
    for number in ("1", "2"):
        if getattr(system, "P" + number):
            yield from ("[[force]]", f'on = "M{number}"', f"amplitude = {value('P' + number)}", "")


def _check(modelfile: ModelFile, text: str, scales: SiScales) -> None:
    """InputError unless the new text describes the same system as the file."""
    try:
        other = parse_model_file(text, modelfile.source)
    except InputError:
        _refuse(modelfile)
    system = (modelfile.mechanical or modelfile.model).second_order()
    other_system = other.model.second_order()
    keys = ("mass", "damping", "stiffness", "force")
    pairs = [(getattr(system, key), getattr(other_system, key)) for key in keys]
    pairs.append((_frequencies(modelfile, scales), _frequencies(other, SiScales())))
    same = all(np.allclose(a, b, rtol=NEAR, atol=NEAR * np.abs(a).max()) for a, b in pairs)
    wanted = [(r.expect, r.twin, r.symmetric) for r in modelfile.responses]
    other_wanted = [(r.expect, r.twin, r.symmetric) for r in other.responses]
    if not same or wanted != other_wanted or modelfile.circuit != other.circuit:
        _refuse(modelfile)


def _frequencies(modelfile: ModelFile, scales: SiScales) -> Array:
    """Of the responses, in the new file's units, and their least exponents; 0 for one that is to be
    chosen or not stated."""
    rates = [rate or 0.0 for r in modelfile.responses for rate in (r.omega, r.least_exponent)]
    return np.array([0.0, *rates]) / scales.time_scale


def _refuse(modelfile: ModelFile) -> NoReturn:
    expected = "a header line for each table, [model] or [mechanical] among them, and a line a key"
    raise InputError(modelfile.source, "--from", "tables written in another way", expected)
