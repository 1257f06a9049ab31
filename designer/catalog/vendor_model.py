"""A user's SPICE model of an op-amp: untrusted text, reduced to subcircuits that only compute.

A catalogue entry names a file beside it, the subcircuit in it and the order of its pins:

    spice = { file = "part.lib", subckt = "PART", pins = ["inp", "inn", "vcc", "vee", "out"] }

The file may hold ``.subckt .ends .model .param .func`` and element lines of the letters in
``ELEMENTS``, and what `netlist_guard.check_netlist` allows of those; anything else is refused
with the number of its line. Comments are dropped. What stands outside a subcircuit is copied into
each, and every subcircuit gets a prefix, so that nothing in the file can change or replace what
else is in a deck.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Annotated

from designer.base.errors import InputError, problems_in
from designer.base.guarded_reading import inside, read_bytes
from designer.base.schema import Accepts, FieldProblems, FileTable, line, lines, validated
from designer.catalog.netlist_guard import RefusedNetlist, check_netlist

PINS = ("inp", "inn", "out", "vcc", "vee")
ELEMENTS = "BCDEFGHIJKLMQRSVWX"
"""First letters of the elements that a model may have. Code models, digital and compiled devices
are none of them: those read files or run programs."""
CARDS = (".subckt", ".ends", ".model", ".param", ".func")
PREFIX = "vendor_"
MOST_BYTES, MOST_STATEMENTS, LONGEST = 256_000, 5_000, 4_000
"""The most bytes and statements of a file, and characters of a statement with its continuations."""
MOST_EXPANDED, MOST_CHARACTERS = 10_000, 1_000_000
"""The most statements of one op-amp, and their characters, with calls and functions written out:
both can double with every line of a file."""

_FILE = re.compile(r"\bfile\w*\s*[=(\"']|\bpwl\w*\s*+\(?\s*+file|\bd?pwlfile\b", re.IGNORECASE)
_FUNCTION = re.compile(r"\.func\s+([A-Za-z_]\w*)\s*\(([^()]*)\)\s*=?", re.IGNORECASE)
_TOKEN = re.compile(r"[a-z_]\w*|\S")
_NAME = re.compile(r"[A-Za-z0-9_.+-]+")
_PARAMETER = re.compile(r"\S+\s*=\s*(\{[^}]*\}|'[^']*'|\S+)|\bparams:", re.IGNORECASE)


@dataclass(frozen=True)
class VendorModel:
    """A vendor's SPICE model, checked to be safe."""

    file: str
    """Name of the file that it was read from."""
    subckt: str
    """Its name in a deck."""
    pins: tuple[str, ...]
    """Pins of its subcircuit, by the names of ``PINS``, in that subcircuit's order."""
    lines: tuple[str, ...]
    """The subcircuits, safe and one statement a line."""
    content: bytes = field(repr=False)
    """The whole file."""

    def wrapped(self) -> list[str]:
        """The subcircuit ``opamp``: the vendor's, with an offset in series with its input.

        Its bias current and limits are the vendor's; ``ib``, ``low``, ``high``, ``start`` are
        taken and ignored.
        """
        nets = " ".join("inside" if pin == "inp" else pin for pin in self.pins)
        return [
            *self.lines,
            f".subckt opamp {' '.join(PINS)} vos=0 ib=0 low=0 high=0 start=0",
            "Voffset inside inp {vos}",
            f"Xvendor {nets} {self.subckt}",
            ".ends opamp",
        ]


@dataclass(frozen=True)
class _Named(FileTable):
    """A model as a catalogue entry names it."""

    file: Annotated[str, line("the name of a file beside this one")]
    subckt: Annotated[str, line("the name of a subcircuit in it")]
    pins: Annotated[tuple[str, ...], lines("its pins in order, of " + ", ".join(PINS))]


def vendor_model() -> Accepts:
    """A table that names a model in the folder of the file."""

    def check(value: object, folder: Path) -> VendorModel:
        if not isinstance(value, dict):
            raise ValueError
        named, problems = validated(_Named, value, None)
        if named is None:
            raise FieldProblems(problems)
        try:
            return read_vendor_model(named.file, named.subckt, named.pins, folder)
        except InputError as error:
            raise FieldProblems(problems_in(error)) from None

    return Accepts("a table of file, subckt, pins", check, in_folder=True)


def read_vendor_model(name: str, subckt: str, pins: Sequence[str], folder: Path) -> VendorModel:
    """The model in the file ``name`` inside a folder.

    Raises
    ------
    InputError : the file is not inside the folder (symbolic links count as outside), cannot be
        read, is too large, or holds a line that is refused; the subcircuit or its pins are not
        what was said.
    """
    path = inside(folder, name, "file")
    content = read_bytes(path, "an op-amp's SPICE model that can be read", most=MOST_BYTES)
    if sorted(pins) != sorted(PINS):
        raise InputError(path, "pins", ", ".join(pins), "each once: " + ", ".join(PINS))
    # Bytes outside ASCII are common in comments, and refused elsewhere.
    statements = _statements(content.decode("latin-1"), path)
    functions = _functions(statements, path)
    blocks = _blocks(statements, path)
    wanted = blocks.get(subckt.lower())
    if wanted is None:
        raise InputError(path, "subckt", subckt, "one of " + ", ".join(sorted(blocks)))
    if len(wanted.nodes) != len(PINS):
        raise InputError(
            path, f"line {wanted.line}", f"{len(wanted.nodes)} pins", f"{len(PINS)} pins"
        )
    _check_calls(blocks, functions, path)
    lines = [text for block in blocks.values() for text in block.text(blocks)]
    return VendorModel(str(path), _prefixed(subckt), tuple(pins), tuple(lines), content)


@dataclass(frozen=True)
class _Statement:
    line: int
    text: str

    @property
    def word(self) -> str:
        return self.text.split(maxsplit=1)[0].lower()


@dataclass(frozen=True)
class _Block:
    """One subcircuit: line, name, nodes, what follows the nodes, statements inside."""

    line: int
    name: str
    nodes: tuple[str, ...]
    rest: str
    inside: tuple[_Statement, ...]

    def text(self, blocks: Mapping[str, _Block]) -> list[str]:
        head = f".subckt {_prefixed(self.name)} {' '.join(self.nodes)} {self.rest}".rstrip()
        return [head, *(_renamed(s, blocks) for s in self.inside), f".ends {_prefixed(self.name)}"]


def _statements(text: str, path: Path) -> list[_Statement]:
    """Statements without comments, continuations joined, each one found harmless."""
    statements: list[_Statement] = []
    for number, raw in enumerate(text.replace("\r\n", "\n").split("\n"), start=1):
        line = raw.strip(" \t")
        if line.startswith("*"):
            continue
        line = " ".join(line.partition(";")[0].split("\t")).strip()
        if not line:
            continue
        if line.startswith("+"):
            if not statements:
                raise _refused(path, number, line, "a continuation of nothing")
            first = statements.pop()
            statements.append(_Statement(first.line, f"{first.text} {line[1:].strip()}"))
        else:
            statements.append(_Statement(number, line))
    if len(statements) > MOST_STATEMENTS:
        raise InputError(
            path, "the file", f"{len(statements)} statements", f"up to {MOST_STATEMENTS}"
        )
    for statement in statements:
        if len(statement.text) > LONGEST:
            raise InputError(
                path,
                f"line {statement.line}",
                f"{len(statement.text)} characters",
                f"a statement of up to {LONGEST} characters",
            )
    for statement in statements:
        _check(statement, path)
    return statements


def _check(s: _Statement, path: Path) -> None:
    if s.word.startswith("."):
        if s.word not in CARDS:
            raise _refused(path, s.line, s.text, f"the card {s.word}")
    elif s.text[0].upper() not in ELEMENTS:
        raise _refused(path, s.line, s.text, f"an element of kind {s.text[0]}")
    if _FILE.search(s.text):
        raise _refused(path, s.line, s.text, "a file")
    try:
        check_netlist(f"* one statement of a model\n{s.text}\n.end\n")
    except RefusedNetlist as error:
        raise _refused(path, s.line, s.text, error.reason) from None


def _blocks(statements: Sequence[_Statement], path: Path) -> dict[str, _Block]:
    """Subcircuits by lower-case name, each with what stands outside all of them in front."""
    common: list[_Statement] = []
    blocks: dict[str, _Block] = {}
    head: _Statement | None = None
    inside: list[_Statement] = []
    for s in statements:
        if s.word == ".subckt":
            if head is not None:
                raise _refused(path, s.line, s.text, "a subcircuit inside another")
            head, inside = s, []
        elif s.word == ".ends":
            if head is None:
                raise _refused(path, s.line, s.text, "an end without a beginning")
            block = _headed(head, tuple(inside), path)
            if block.name.lower() in blocks:
                raise _refused(path, head.line, head.text, "a name that is taken")
            blocks[block.name.lower()] = block
            head = None
        elif head is not None:
            inside.append(s)
        elif s.word in (".model", ".param", ".func"):
            common.append(s)
        else:
            raise _refused(path, s.line, s.text, "an element outside a subcircuit")
    if head is not None:
        raise _refused(path, head.line, head.text, "a subcircuit without an end")
    return {name: replace(b, inside=(*common, *b.inside)) for name, b in blocks.items()}


def _headed(head: _Statement, inside: tuple[_Statement, ...], path: Path) -> _Block:
    body = head.text.split(maxsplit=1)[1] if " " in head.text else ""
    match = _PARAMETER.search(body)
    words = body[: match.start()].split() if match else body.split()
    if len(words) < 2 or not all(_NAME.fullmatch(word) for word in words):
        raise _refused(path, head.line, head.text, "a subcircuit without a plain name and nodes")
    rest = body[match.start() :] if match else ""
    return _Block(head.line, words[0], tuple(words[1:]), rest, inside)


def _callee(s: _Statement) -> tuple[str, int, int]:
    """Name of the subcircuit that an X line calls, and its first and last position in the text.

    A line without a name gives its own text, which is the name of no subcircuit.
    """
    match = _PARAMETER.search(s.text)
    nodes = s.text[: match.start()] if match else s.text
    last = (nodes.split() or [s.text])[-1]
    nodes = nodes if nodes.split() else s.text
    start = nodes.rindex(last)
    return last, start, start + len(last)


def _renamed(s: _Statement, blocks: Mapping[str, _Block]) -> str:
    if s.word[0] != "x":
        return s.text
    name, start, stop = _callee(s)
    return s.text[:start] + _prefixed(blocks[name.lower()].name) + s.text[stop:]


def _check_calls(
    blocks: Mapping[str, _Block], functions: Mapping[str, tuple[int, int]], path: Path
) -> None:
    """Every call is of a subcircuit of this file, none leads back to itself, and all that a
    subcircuit stands for can be written out."""
    calls: dict[str, list[str]] = {key: [] for key in blocks}
    for key, block in blocks.items():
        for s in block.inside:
            if s.word[0] != "x":
                continue
            name = _callee(s)[0].lower()
            if name not in blocks:
                raise _refused(path, s.line, s.text, "a subcircuit that is not in this file")
            calls[key].append(name)
    order, circle = _ordered(calls)
    if circle is not None:
        block = blocks[circle]
        raise _refused(path, block.line, block.name, "a subcircuit that calls itself")
    sizes: dict[str, tuple[int, int]] = {}
    for key in order:
        block, callees = blocks[key], [sizes[name] for name in calls[key]]
        count = len(block.inside) + sum(n for n, _ in callees)
        length = sum(_length(s.text, functions)[0] for s in block.inside if s.word != ".func")
        length += _length(block.rest, functions)[0] + sum(n for _, n in callees)
        if count > MOST_EXPANDED or length > MOST_CHARACTERS:
            most = f"{MOST_EXPANDED} statements or {MOST_CHARACTERS} characters"
            raise _refused(path, block.line, block.name, f"more than {most}, written out")
        sizes[key] = (count, length)


def _functions(statements: Sequence[_Statement], path: Path) -> dict[str, tuple[int, int]]:
    """The length of each function's call, written out: characters of its body, and how often it
    repeats its arguments. A function that leads back to itself is refused: ngspice would expand it
    for ever."""
    heads: dict[str, _Statement] = {}
    # Two subcircuits may each have one of this name: all that any of them uses counts.
    bodies: dict[str, list[tuple[str, set[str]]]] = {}
    for s in statements:
        if s.word == ".func":
            match = _FUNCTION.match(s.text)
            if match is None:
                raise _refused(path, s.line, s.text, "a function without a name and arguments")
            name = match[1].lower()
            heads.setdefault(name, s)
            arguments = {word.strip() for word in match[2].lower().split(",")}
            bodies.setdefault(name, []).append((s.text[match.end() :], arguments))
    uses = {
        name: [w for text, _ in definitions for w in _TOKEN.findall(text.lower()) if w in heads]
        for name, definitions in bodies.items()
    }
    order, circle = _ordered(uses)
    if circle is not None:
        s = heads[circle]
        raise _refused(path, s.line, s.text, "a function that calls itself")
    sizes: dict[str, tuple[int, int]] = {}
    for name in order:
        lengths, repeats = zip(
            *(_length(text, sizes, names) for text, names in bodies[name]), strict=True
        )
        sizes[name] = (max(lengths), max(1, *repeats))
    return sizes


def _length(
    text: str, functions: Mapping[str, tuple[int, int]], arguments: Collection[str] = ()
) -> tuple[int, int]:
    """An upper bound of the text's length with all functions written out, and the number of times
    that any of the arguments stands in it. Both stop a little above `MOST_CHARACTERS`."""
    most = MOST_CHARACTERS + 1
    open_: list[tuple[tuple[int, int], int, int]] = []
    call, length, repeats, last = (0, 1), 0, 0, ""
    for token in [*_TOKEN.findall(text.lower()), *")" * text.count("(")]:
        if token == "(":
            open_.append((call, length, repeats))
            call, length, repeats = functions.get(last, (0, 1)), 0, 0
        elif token == ")" and open_:
            inner = (call[0] + call[1] * length, call[1] * repeats)
            call, length, repeats = open_.pop()
            length, repeats = min(length + inner[0], most), min(repeats + inner[1], most)
        elif token in arguments:
            repeats += 1
        else:
            length += len(token)
        last = token
    return length, repeats


def _ordered(uses: Mapping[str, Collection[str]]) -> tuple[list[str], str | None]:
    """Names after all that they use, and a name that leads back to itself, or None."""
    try:
        return list(TopologicalSorter(uses).static_order()), None
    except CycleError as error:
        return [], str(error.args[1][0])


def _prefixed(name: str) -> str:
    return PREFIX + name


def _refused(path: Path, line: int, text: str, why: str) -> InputError:
    return InputError(
        path, f"line {line}", text, f"{', '.join(CARDS)} and elements that only compute, not {why}"
    )
