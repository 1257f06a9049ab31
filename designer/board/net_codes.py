"""Nets of a board by number, as KiCad 9 writes them, and by name, as KiCad 10 does.

Since version 20251028 of the file a net has no number: tracks, vias and zones state its name, pads
the name alone, and the list of nets is gone. Here such a board gets numbers, so that the rest of
the tool knows one form; what is written goes back to the form that the file had.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from designer.board.sexpr import Atom, Expression, expression

BY_NAME = 20251028
"""Version of the board file since which nets have no numbers: KiCad 10."""
JOINED = ("segment", "arc", "via", "zone")
"""What is on a net beside pads."""


def names_nets(board: Expression) -> bool:
    """Whether a board states nets by name alone."""
    version = board.find("version")
    text = "" if version is None or not version.atoms else version.text()
    return text.isdecimal() and int(text) >= BY_NAME


def with_codes(board: Expression) -> Expression:
    """A board whose nets have numbers, whichever form it is in."""
    if not names_nets(board):
        return board
    names = {
        net.text(0)
        for each in board.walk()
        if each.name in (*JOINED, "pad") and (net := each.find("net")) is not None and net.atoms
    }
    codes = {"": 0} | {name: i for i, name in enumerate(sorted(names - {""}), start=1)}
    nets = [expression("net", code, name) for name, code in codes.items()]
    out: list[Atom | Expression] = []
    for item in board.items:
        if isinstance(item, Expression) and item.name == "footprint" and nets:
            out += nets  # before the first part, as KiCad 9 has them
            nets = []
        out.append(_numbered(item, codes) if isinstance(item, Expression) else item)
    return Expression((*out, *nets), board.source, board.offset)


def without_codes(board: Expression) -> Expression:
    """A board whose nets are named alone, from one with numbers."""
    names = {net.text(0): net.text(1) for net in board.all("net")}
    kept = [i for i in board.items if not (isinstance(i, Expression) and i.name == "net")]
    items = [_named(item, names) if isinstance(item, Expression) else item for item in kept]
    return Expression(tuple(items), board.source, board.offset)


def _numbered(item: Expression, codes: Mapping[str, int]) -> Expression:
    if item.name == "footprint":
        return _changed(item, lambda pad: _with_net(pad, codes) if pad.name == "pad" else pad)
    return _with_net(item, codes) if item.name in JOINED else item


def _changed(item: Expression, change: Callable[[Expression], Expression]) -> Expression:
    items = (change(i) if isinstance(i, Expression) else i for i in item.items)
    return Expression(tuple(items), item.source, item.offset)


def _with_net(item: Expression, codes: Mapping[str, int]) -> Expression:
    """A track, via, zone or pad with the number of its net; a pad has the name too, a zone in a
    list of its own."""
    net = item.find("net")
    name = "" if net is None or not net.atoms else net.text(0)
    if item.name == "pad" and not name:
        return item
    words = (codes[name], name) if item.name == "pad" else (codes[name],)
    more = [expression("net_name", name)] if item.name == "zone" else []
    rest = [i for i in item.items if not (isinstance(i, Expression) and i.name == "net")]
    return Expression((*rest, expression("net", *words), *more), item.source, item.offset)


def _named(item: Expression, names: Mapping[str, str]) -> Expression:
    if item.name == "footprint":
        return _changed(item, lambda pad: _without_code(pad, names) if pad.name == "pad" else pad)
    return _without_code(item, names) if item.name in JOINED else item


def _without_code(item: Expression, names: Mapping[str, str]) -> Expression:
    net = item.find("net")
    if net is None:
        return item
    name = names.get(net.text(0), "")
    gone = ("net", "net_name")
    rest = [i for i in item.items if not (isinstance(i, Expression) and i.name in gone)]
    own = [expression("net", name)] if name else []
    return Expression((*rest, *own), item.source, item.offset)
