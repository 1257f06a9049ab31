"""Files as accidents and ill will leave them: bytes that are damaged, values that are swapped.

All is drawn from a ``random.Random``, so that one number stands for one file.
"""

from __future__ import annotations

import copy
import datetime
import json
import math
from collections.abc import Iterator, Mapping
from random import Random
from typing import Any

from designer.board.sexpr import Atom, Expression

LONG = "x" * 5000
TEXTS = (
    "",
    " ",
    "0",
    "nan",
    "-inf",
    "1e308",
    "1e-308",
    "-1",
    "1e999",
    "9" * 400,
    "²",
    "١",
    "5 mm",
    "1 kg",
    "10 Hz",
    "0 %",
    "1_0",
    LONG,
    'a"b',
    "a'b",
    "a\nb",
    "a\r\nb",
    "a\tb",
    "a\x00b",
    "\x1b[31mred\x1b[0m",
    "\x9b2J",
    "\u202egpj",
    "\u2028",
    "\ufeff",
    "é",
    "\U0001f600",
    "\n.include /etc/passwd",
    "\n.control\nshell id\n.endc",
    "$(id)",
    "`id`",
    "{name}",
    "%s%n",
    "<script>alert(1)</script>",
    "</script>",
    "=cmd|' /C calc'!A0",
    "@SUM(1)",
    "../../etc/passwd",
    "/etc/passwd",
    "..",
    "con",
    "ground",
    "base",
    "best",
    "1-2-2",
    "9-9-9;1-1",
    "true",
    "null",
)
"""Words that stand where something else is expected, or are made to harm."""
NUMBERS: tuple[float, ...] = (
    0, -0.0, 1, -1, 2, 3, 1.5, -1.5, 0.5, 1e-3, 1e3, 1e9, -1e9, 1e16, 1e100, 1e154, 1e155, 1e200,
    1e300, 1e308, -1e308, 1e-100, 1e-154, 1e-200, 1e-300, 1e-308, 5e-324, 10**18, 2**63, -(2**63),
    2**64, 10**299, 10**400, math.nan, math.inf, -math.inf,
)  # fmt: skip
MOMENTS = (
    datetime.datetime(2020, 2, 29, 23, 59, 59),
    datetime.date(1, 1, 1),
    datetime.time(0, 0),
)
"""Values of TOML that JSON has not."""
INSERTED = (
    b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", "²".encode(), b"nan", b"1e308", b"-1e999", b"9" * 5000,
    b"0x" + b"f" * 5000, b"[" * 3000, b"(" * 3000, b'"', b"'''", b'"""', b"\r", b"\n", b"\r\n",
    b"=1", b"{", b"}", b"]", b")", b",", b";", b"\t", b"#", b"\\", b"\\u0000", b"[[a]]\n", b"1_0",
    b"\x1b[2J", b"\x80", b"\xed\xa0\x80", b"%", b"-", b".", b"e9",
)  # fmt: skip


def damaged(content: bytes, dice: Random) -> bytes:
    """The bytes after one to four accidents."""
    for _ in range(dice.randint(1, 4)):
        place, other = (dice.randrange(len(content) + 1) for _ in range(2))
        length = dice.choice((1, 2, 8, 40, 400))
        kind = dice.randrange(9)
        if kind == 0 and place < len(content):
            flipped = bytes([content[place] ^ 1 << dice.randrange(8)])
            content = content[:place] + flipped + content[place + 1 :]
        elif kind == 1 and dice.random() < 0.3:
            content = content[:place]
        elif kind == 2:
            content = content[:place] + dice.choice(INSERTED) + content[place:]
        elif kind == 3:
            content = content[:place] + content[place : place + length] * 2 + content[place:]
        elif kind == 4:
            content = content[:place] + content[place + length :]
        elif kind == 5:  # a piece in another place
            content = content[:place] + content[other : other + length] + content[place:]
        elif kind == 6:  # a piece over another
            piece = content[other : other + length]
            content = content[:place] + piece + content[place + len(piece) :]
        elif kind == 7 and place < len(content):
            content = content[:place] + bytes([dice.randrange(256)]) + content[place + 1 :]
        elif kind == 8:
            content = _lines_moved(content, dice)
    return content


def _lines_moved(content: bytes, dice: Random) -> bytes:
    """Two lines exchanged, one doubled or gone, or other line ends."""
    lines = content.split(b"\n")
    first, second = (dice.randrange(len(lines)) for _ in range(2))
    kind = dice.randrange(4)
    if kind == 0:
        lines[first], lines[second] = lines[second], lines[first]
    elif kind == 1:
        lines.insert(first, lines[second])
    elif kind == 2:
        del lines[first]
    return (b"\r\n" if kind == 3 else b"\n").join(lines)


def anything(dice: Random, *, moments: bool = False, deep: int = 2) -> Any:
    """A value of any kind. moments : also dates and times."""
    kind = dice.randrange(10 + moments)
    if kind < 4:
        return dice.choice(NUMBERS)
    if kind < 7:
        return dice.choice(TEXTS)
    if kind == 7:
        return dice.random() < 0.5
    if kind == 10:
        return dice.choice(MOMENTS)
    inner = [anything(dice, moments=moments, deep=deep - 1) for _ in range(dice.randrange(4))]
    inner = inner if deep > 0 else []
    return inner if kind == 8 else {dice.choice(TEXTS): each for each in inner}


def swapped(data: Any, dice: Random, *, moments: bool = False) -> Any:
    """Parsed data with one to three of its values, keys or rows changed."""
    data = copy.deepcopy(data)
    for _ in range(dice.choice((1, 1, 1, 2, 3))):
        places = list(_places(data))
        if places:
            holder, key = dice.choice(places)
            _swap(holder, key, dice, moments=moments, places=places)
    return data


def _places(data: Any) -> Iterator[tuple[Any, Any]]:
    """Each (holder, key) of a value in the data."""
    pairs = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in pairs:
        yield data, key
        if isinstance(value, dict | list):
            yield from _places(value)


def _swap(holder: Any, key: Any, dice: Random, *, moments: bool, places: list[Any]) -> None:
    kind = dice.randrange(10)
    if (isinstance(holder, dict) and key not in holder) or kind < 5:
        holder[key] = anything(dice, moments=moments)
    elif kind == 5:  # a number that is a little off
        value = holder[key]
        real = isinstance(value, int | float) and not isinstance(value, bool)
        holder[key] = value * dice.choice((-1, 0, 10, 1e-6, 1e6)) if real else dice.choice(NUMBERS)
    elif kind == 6:
        del holder[key]
    elif kind == 7:  # the value of another place
        where, which = dice.choice(places)
        found = where.get(which) if isinstance(where, dict) else where[which % max(len(where), 1)]
        holder[key] = copy.deepcopy(found)
    elif kind == 8 and isinstance(holder, dict):
        holder[dice.choice(TEXTS)] = holder.pop(key)
    elif isinstance(holder, list):
        holder.insert(key, copy.deepcopy(holder[key]))
    else:
        holder[dice.choice(TEXTS)] = anything(dice, moments=moments)


def toml_of(data: Mapping[str, Any]) -> str:
    """Any parsed TOML as TOML again, each value on the line of its key."""
    return "".join(f"{_quoted(key)} = {_toml(value)}\n" for key, value in data.items())


def _quoted(text: str) -> str:
    return '"' + "".join(map(_character, text)) + '"'


def _character(sign: str) -> str:
    if sign in '"\\':
        return "\\" + sign
    return sign if " " <= sign < "\x7f" else f"\\U{ord(sign):08X}"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, int):
        return hex(value) if value > 10**300 else str(value)
    if isinstance(value, datetime.date | datetime.time):
        return value.isoformat()
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return "{" + ", ".join(f"{_quoted(k)} = {_toml(v)}" for k, v in value.items()) + "}"


def json_of(data: Any) -> bytes:
    """Any parsed JSON as JSON again; numbers that are none stand as Python writes them."""
    return json.dumps(data, ensure_ascii=True).encode("ascii")


def cells_swapped(text: str, dice: Random, between: str = ",") -> str:
    """A table with one to three of its cells, columns or rows changed."""
    rows = [line.split(between) for line in text.split("\n")]
    for _ in range(dice.choice((1, 1, 2, 3))):
        row = dice.choice(rows)
        at = dice.randrange(len(row) + 1)
        kind = dice.randrange(7)
        if kind < 4:
            word = dice.choice((*TEXTS, *map(_digits, NUMBERS)))
            quote = dice.random() < 0.5 and between == ","
            row[at : at + 1] = ['"' + word.replace('"', '""') + '"' if quote else word]
        elif kind == 4:
            row.insert(at, dice.choice(TEXTS))
        elif kind == 5:
            del row[at:]
        else:
            rows.insert(dice.randrange(len(rows)), list(dice.choice(rows)))
    return "\n".join(between.join(row) for row in rows)


def _digits(value: float) -> str:
    return "9" * 401 if type(value) is int and value > 10**300 else str(value)


WORDS = (
    "", "0", "-1", "1e8", "1e9", "-1e9", "1e-9", "nan", "F.Cu", "B.Cu", "In1.Cu", "*.Cu", "99",
    "Edge.Cuts", "/v1", "GND", "R1", "oval", "circle", "custom", "yes", "dnp", "1.5", "360", "²",
    "\x1b[2J", "=1", "<b>",
)  # fmt: skip
"""Words of boards, and of who means them ill."""


def lists_swapped(tree: Expression, dice: Random) -> str:
    """The text of an S-expression with one to four of its lists changed."""
    lists = list(tree.walk())
    chosen = {id(dice.choice(lists)) for _ in range(dice.choice((1, 1, 2, 4)))}

    def written(each: Expression) -> str:
        items = list(each.items)
        if id(each) in chosen and items:
            at, kind = dice.randrange(len(items)), dice.randrange(7)
            if kind < 4:
                items[at] = Atom(dice.choice(WORDS), dice.random() < 0.5)
            elif kind == 4:
                del items[at]
            elif kind == 5:
                items.insert(at, items[at])
            else:
                del items[at + 1 :]
        return (
            "("
            + " ".join(written(i) if isinstance(i, Expression) else _atom(i) for i in items)
            + ")"
        )

    return written(tree)


def _atom(atom: Atom) -> str:
    escaped = atom.text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"' if atom.quoted or not atom.text else atom.text
