"""KiCad's design rule check of a board under our rules, and whether it understood them.

Everything happens on copies in a scratch folder, without the board's project: its severities and
exclusions hide nothing, and its net classes are not needed. Two checks are made. One of a board
that breaks every rule (``drc_specimen``): what KiCad does not report there, it does not
understand, be it a rule of ours or one of its own. One of the board itself with a track besides
that breaks a rule of its own: unless that is reported, KiCad has dropped the rules, and nothing it
says of them counts.
"""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from designer.base.errors import InputError
from designer.base.guarded_reading import parse_json
from designer.base.sexpr import Expression, expression_text, read
from designer.board.kicad_names import circuit_net
from designer.board.kicad_reader import BoardFile
from designer.board.kicad_rules import CANARY, CustomRule, canary, rules_text
from designer.design_rules.drc_specimen import canary_track, specimen
from designer.design_rules.kicad_program import KicadFailed, call, last_words, needed_version

ASIDE = (-100.0, -100.0)
"""Where the canary's track lies [mm], from the board's uppermost, leftmost pad."""

OPEN, SHORT = "unconnected", "short-circuit"
"""Rules that KiCad's check says by itself."""
SHORTS = frozenset({"shorting_items", "tracks_crossing", "zones_intersect"})
"""KiCad's types of violations in which copper of two nets touches."""

_RULE = re.compile(r"\(rule '([^']*)' ")
_ACTUAL = re.compile(r"actual ([0-9.]+)")
_MINIMUM = re.compile(r"min width ([0-9.]+) mm")
_NET = re.compile(r"\[([^\]]*)\]")


@dataclass(frozen=True)
class Violation:
    """A place on the board where a rule is broken."""

    rule: str
    """Id of the custom rule."""
    actual: float
    """What KiCad measured, in mm or a count."""
    where: str
    """Place on the board, in KiCad's words."""


@dataclass(frozen=True)
class DesignRuleCheck:
    """What KiCad says of a board."""

    version: str
    """Version of KiCad."""
    violations: tuple[Violation, ...]
    """The places where rules are broken."""
    misunderstood: frozenset[str]
    """Rules that KiCad does not report when they are broken."""
    unconnected: Mapping[str, int]
    """Nets of the circuit that are not all routed, and how many connections are open on each."""
    shorts: tuple[str, ...] = ()
    """Places where copper of two nets touches, in KiCad's words."""


def check(board: BoardFile, rules: Sequence[CustomRule]) -> DesignRuleCheck:
    """Check a board against the rules.

    Raises
    ------
    KicadFailed : no KiCad, one that is too old, no report, or rules that KiCad has dropped.
    """
    version = needed_version()
    with tempfile.TemporaryDirectory(prefix="designer-drc-") as scratch:
        place = Path(scratch)
        text = rules_text([*rules, canary()])
        broken = report(specimen(rules, breaking=True), text, place / "specimen")
        reported = {v.rule for v in violations(broken, rules)}
        reported |= {OPEN} if _unconnected(broken) else set()
        reported |= {SHORT} if _shorts(broken) else set()
        answer = report(_with_canary(board), text, place / "board")
    if not any(_is_canary(v) for v in answer["violations"]):
        raise KicadFailed("KiCad has dropped the custom rules: a planted violation went unreported")
    return DesignRuleCheck(
        version,
        violations(answer, rules),
        frozenset([OPEN, SHORT, *(rule.id for rule in rules)]) - reported,
        _unconnected(answer),
        _shorts(answer),
    )


def report(board: str, rules: str, place: Path) -> dict[str, Any]:
    """KiCad's report on the text of a board under the text of a ``.kicad_dru``.

    Raises
    ------
    KicadFailed : there is none.
    """
    place.mkdir()
    (place / "board.kicad_pcb").write_text(board, encoding="utf-8")
    (place / "board.kicad_dru").write_text(rules, encoding="utf-8")
    out = place / "report.json"
    options = ["--format", "json", "--units", "mm", "--severity-all", "--output", str(out)]
    process = call("pcb", "drc", *options, str(place / "board.kicad_pcb"), place=place)
    if not out.is_file():
        raise KicadFailed(f"kicad-cli wrote no report: {last_words(process)}")
    try:
        answer = parse_json(out.read_bytes(), out)
    except InputError:
        raise KicadFailed("kicad-cli wrote a report that is no JSON") from None
    lists = ("violations", "unconnected_items")
    if not isinstance(answer, dict) or not all(isinstance(answer.get(n), list) for n in lists):
        raise KicadFailed("kicad-cli wrote a report of another kind")
    return answer


def violations(answer: Mapping[str, Any], rules: Sequence[CustomRule]) -> tuple[Violation, ...]:
    """What a report says of our rules. A width names the board's setup in the place of the rule; it
    is known by its limit and its net."""
    by_id = {rule.id: rule for rule in rules}
    out = []
    for each in answer["violations"]:
        text = str(each.get("description", ""))
        named, actual = _RULE.search(text), _ACTUAL.search(text)
        id_ = named[1] if named else _width_rule(each, rules)
        if id_ in by_id:
            value = float(actual[1]) if actual else float("nan")
            out.append(Violation(id_, value, _place(each)))
    return tuple(out)


def _width_rule(each: Mapping[str, Any], rules: Sequence[CustomRule]) -> str:
    limit = _MINIMUM.search(str(each.get("description", "")))
    if each.get("type") != "track_width" or limit is None:
        return ""
    for rule in rules:
        if rule.constraint != "track_width" or abs(rule.limit - float(limit[1])) > 1e-4:
            continue
        if set(rule.nets) & set(_nets(each)):
            return rule.id
    return ""


def _is_canary(each: Mapping[str, Any]) -> bool:
    limit = _MINIMUM.search(str(each.get("description", "")))
    named = _RULE.search(str(each.get("description", "")))
    if named is not None and named[1] == CANARY:
        return True
    limit_text = f"{canary().limit:.4f}"
    return each.get("type") == "track_width" and limit is not None and limit[1] == limit_text


def _unconnected(answer: Mapping[str, Any]) -> Mapping[str, int]:
    """Open connections by net; both ends of one are on the same net."""
    return Counter(
        circuit_net(net)
        for each in answer["unconnected_items"]
        for net in dict.fromkeys(_nets(each))
    )


def _shorts(answer: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(_place(each) for each in answer["violations"] if each.get("type") in SHORTS)


def _nets(each: Mapping[str, Any]) -> list[str]:
    """KiCad's names of the nets that a violation's items are on."""
    words = [str(item.get("description", "")) for item in each.get("items", [])]
    return [net for text in words for net in _NET.findall(text)]


def _place(each: Mapping[str, Any]) -> str:
    items = each.get("items", [])
    words = " and ".join(str(item.get("description", "")) for item in items[:2])
    at = items[0].get("pos", {}) if items else {}
    if isinstance(at, dict) and {"x", "y"} <= at.keys():
        words += f" ({at['x']} mm, {at['y']} mm)"
    return "".join(ch if ch.isprintable() else "?" for ch in words)


def _with_canary(board: BoardFile) -> str:
    corners = [pad.at for footprint in board.footprints for pad in footprint.pads] or [(0.0, 0.0)]
    x = min(at[0] for at in corners) + ASIDE[0]
    y = min(at[1] for at in corners) + ASIDE[1]
    tree = read(board.text, board.path)
    return expression_text(Expression((*tree.items, canary_track(x, y))))
