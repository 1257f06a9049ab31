"""KiCad's design rule check of a board under our rules, and whether it understood them.

Everything happens on copies in a scratch folder, without the board's project: its severities and
exclusions hide nothing, and its net classes are not needed. The library of footprints is ours, so
that a footprint that was changed on the board is seen. Two checks are made. One of a board
that breaks every rule (``specimen``): what KiCad does not report there, it does not
understand, be it a rule of ours or one of its own. One of the board itself with a track besides
that breaks a rule of its own: unless that is reported, KiCad has dropped the rules, and nothing it
says of them counts.
"""

from __future__ import annotations

import contextlib
import json
import math
import re
import shutil
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from designer.base.errors import InputError
from designer.base.guarded_reading import UNREADABLE, parse_json, read_text, reason
from designer.base.progress import doing
from designer.board.footprints import FootprintShape
from designer.board.kicad_board import layers
from designer.board.kicad_footprint import module
from designer.board.kicad_names import BOARD_VERSION, HEAD, LIBRARY, circuit_net, identifier
from designer.board.kicad_reader import BoardFile
from designer.board.kicad_rules import (
    CANARY,
    CANARY_WIDTH,
    CustomRule,
    canary,
    project_rules,
    rules_text,
)
from designer.board.sexpr import Expression, expression, expression_text, lists, read, word
from designer.catalog.fab import FabLimits
from designer.design_rules.kicad_program import (
    PROGRAM,
    KicadFailed,
    call,
    last_words,
    needed_version,
)

APART = 40.0
"""Between the examples of two rules [mm]."""
MARGIN = 0.1
"""Of a limit: how far an example is from it."""
TRACK, PAD, VIA, DRILL = 0.5, 1.0, 0.8, 0.4
"""Widths [mm] of what an example is made of where its rule does not speak of it."""
LAYERS = (
    (0, "F.Cu", "signal"),
    (2, "B.Cu", "signal"),
    (1, "F.Mask", "user"),
    (3, "B.Mask", "user"),
    (25, "Edge.Cuts", "user"),
    (31, "F.CrtYd", "user"),
)
_A, _B = "/specimen_a", "/specimen_b"
Point = tuple[float, float]


def specimen(rules: Sequence[CustomRule], *, breaking: bool) -> str:
    """The text of a board with one example for each rule, a tenth past its limit or a tenth inside;
    a count is one past it, or at it. One that breaks them has a short circuit as well, and like
    every one of them connections that are open."""
    nets = ["", _A, _B]
    nets += [net for rule in rules for net in rule.nets[:3] if net not in nets]
    items: list[Expression] = []
    for place, rule in enumerate(rules):
        at = (20.0, 20.0 + APART * place)
        items += _example(rule, _size(rule, breaking), at, nets)
    if breaking:
        items += _short((20.0 + APART, 20.0), nets)
    return expression_text(
        expression(
            "kicad_pcb",
            *lists(
                version=BOARD_VERSION,
                **HEAD,
                general={"thickness": 1.6},
                paper="A4",
                layers=layers(LAYERS),
            ),
            *(expression("net", number, name) for number, name in enumerate(nets)),
            *items,
        )
    )


def canary_track(x: float, y: float) -> Expression:
    """A short thin track on no net, for a place where nothing else is."""
    return _segment((x, y), (x + 1.0, y), CANARY_WIDTH, None)


def _size(rule: CustomRule, breaking: bool) -> float:
    if rule.constraint == "via_count":
        return rule.limit + breaking
    return rule.limit * (1.0 - MARGIN if breaking is rule.least else 1.0 + MARGIN)


def _example(rule: CustomRule, size: float, at: Point, nets: list[str]) -> Iterator[Expression]:
    x, y = at
    net = nets.index(rule.nets[0]) if rule.nets else 0
    if rule.constraint == "clearance" and (rule.nets or not rule.condition):
        down = y + TRACK + size
        # Not the nets whose length and whose vias count.
        ruled_net = nets.index(rule.nets[:3][-1]) if rule.nets else nets.index(_A)
        yield _segment((x, y), (x + 5.0, y), TRACK, ruled_net)
        yield _segment((x, down), (x + 5.0, down), TRACK, nets.index(_B))
    elif rule.constraint == "clearance":
        for number, (name, left) in enumerate(((_A, x), (_B, x + PAD + size))):
            yield _footprint(f"{rule.id}-{number}", (left, y), nets.index(name), name, PAD / 2.0)
    elif rule.constraint == "courtyard_clearance":
        for number, (name, left) in enumerate(((_A, x), (_B, x + 4.0 * PAD + size))):
            net = nets.index(name)
            yield _footprint(f"{rule.id}-{number}", (left, y), net, name, 2.0 * PAD)
    elif rule.constraint == "length":
        yield _segment((x, y), (x + size, y), TRACK, net)
    elif rule.constraint == "via_count":
        net = nets.index(rule.nets[1 % len(rule.nets)])  # not the net whose length counts
        count = math.floor(size)
        end = x + 2.0 * (count + 1)
        yield _segment((x, y), (end, y), TRACK, net)
        for number in range(count):
            yield _via((x + 2.0 * (number + 1), y), net)
    else:
        assert rule.constraint == "track_width"
        yield _segment((x, y), (x + 5.0, y), size, net)


def _short(at: Point, nets: list[str]) -> Iterator[Expression]:
    """Two pads of two nets, and a track of the second that ends on the first."""
    x, y = at
    for name, left in ((_A, x), (_B, x + 5.0 * PAD)):
        yield _footprint(f"short{name}", (left, y), nets.index(name), name, PAD)
    yield _segment((x, y), (x + 5.0 * PAD, y), TRACK, nets.index(_B))


def _segment(start: Point, end: Point, width: float, net: int | None) -> Expression:
    return expression(
        "segment",
        start=start,
        end=end,
        width=width,
        layer="F.Cu",
        net=net,
        uuid=identifier("segment", str(start), str(end)),
    )


def _via(at: Point, net: int) -> Expression:
    return expression(
        "via",
        at=at,
        size=VIA,
        drill=DRILL,
        layers=("F.Cu", "B.Cu"),
        net=net,
        uuid=identifier("via", str(at)),
    )


def _footprint(name: str, at: Point, net: int, net_name: str, yard: float) -> Expression:
    """One square pad; yard : half the width of its courtyard."""
    courtyard = expression(
        "fp_rect",
        start=(-yard, -yard),
        end=(yard, yard),
        stroke={"width": 0.05, "type": word("solid")},
        fill=False,
        layer="F.CrtYd",
        uuid=identifier("yard", name),
    )
    pad = expression(
        "pad",
        "1",
        word("smd"),
        word("rect"),
        at=(0.0, 0.0),
        size=(PAD, PAD),
        layers=("F.Cu", "F.Mask"),
        net=(net, net_name),
        uuid=identifier("pad", name),
    )
    head = lists(layer="F.Cu", uuid=identifier("footprint", name), at=at)
    return expression("footprint", f"specimen:{name}", *head, courtyard, pad)


ASIDE = (-100.0, -100.0)
"""Where the canary's track lies [mm], from the board's uppermost, leftmost pad."""

NEAR_CANARY = 10.0
"""From there [mm]: what KiCad says of this is of the canary's track."""

OPEN, SHORT = "unconnected", "short-circuit"
"""Rules that KiCad's check says by itself."""
ERRORS, PARITY = "kicad-errors", "schematic-parity"
"""Rules that stand for KiCad's own errors."""
SEVERITIES = {"lib_footprint_mismatch": "error", "lib_footprint_issues": "ignore"}
"""Other than KiCad's own: a mask or paste opening that is missing is no matter of taste, and a
footprint of another library is a rule of ours (``part-footprint``)."""
MOST_SCHEMATIC = 20_000_000
"""Bytes of a schematic, at most."""
SHORTS = frozenset({"shorting_items", "tracks_crossing", "zones_intersect"})
"""KiCad's types of violations in which copper of two nets touches."""

_PARITY, _SHEET = "schematic_parity", "board.kicad_sch"
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
    errors: tuple[str, ...] = ()
    """Errors of no other rule, each with its type and place in KiCad's words."""
    warnings: Mapping[str, int] = field(default_factory=dict)
    """How many warnings there are, by type."""
    parity: tuple[str, ...] | None = None
    """Differences from the schematic, each with its type and place; None where there is none beside
    the board."""


def check(
    board: BoardFile,
    rules: Sequence[CustomRule],
    footprints: Sequence[FootprintShape] = (),
    fab: FabLimits | None = None,
) -> DesignRuleCheck:
    """Check a board against the rules, and against the schematic beside it, where there is one.

    footprints : as the design has them, by which those on the board are judged. fab : what its
    maker makes, which KiCad's own check asks for; None for KiCad's own limits.

    Raises
    ------
    KicadFailed : no KiCad, one that is too old, no report, or rules that KiCad has dropped.
    """
    version = needed_version()
    doing("KiCad's check of the board")
    reported = _understood(tuple(rules), version, shutil.which(PROGRAM))
    files = _project_files(board, footprints, fab)
    with tempfile.TemporaryDirectory(prefix="designer-drc-") as scratch:
        text = rules_text([*rules, canary()])
        answer = report(_with_canary(board), text, Path(scratch) / "board", files)
    return understood(answer, version, reported, board, rules, sheet=_SHEET in files)


def understood(
    answer: Mapping[str, Any],
    version: str,
    reported: frozenset[str],
    board: BoardFile,
    rules: Sequence[CustomRule],
    *,
    sheet: bool,
) -> DesignRuleCheck:
    """What a report on a board says.

    version : of KiCad. reported : rules that it reports on a board that breaks them. sheet :
    whether the report is on parity too.

    Raises
    ------
    KicadFailed : the report is none, or KiCad has dropped the rules.
    """
    with _understandable():
        return _read(answer, version, reported, board, rules, sheet)


@contextlib.contextmanager
def _understandable() -> Iterator[None]:
    """KicadFailed for a report in which other things stand where KiCad writes what is met."""
    try:
        yield
    except UNREADABLE as error:
        raise KicadFailed(f"kicad-cli wrote a report of another kind: {reason(error)}") from None


def _read(
    answer: Mapping[str, Any],
    version: str,
    reported: frozenset[str],
    board: BoardFile,
    rules: Sequence[CustomRule],
    sheet: bool,
) -> DesignRuleCheck:
    if not any(_is_canary(v) for v in answer["violations"]):
        raise KicadFailed("KiCad has dropped the custom rules: a planted violation went unreported")
    return DesignRuleCheck(
        version,
        violations(answer, rules),
        frozenset([OPEN, SHORT, *(rule.id for rule in rules)]) - reported,
        _unconnected(answer),
        _shorts(answer),
        tuple(map(_typed, _others(answer, rules, "error", _aside(board)))),
        Counter(str(each.get("type")) for each in _others(answer, rules, "warning", _aside(board))),
        tuple(map(_typed, answer[_PARITY])) if sheet else None,
    )


@lru_cache(maxsize=8)  # one KiCad understands the same rules each time
def _understood(rules: tuple[CustomRule, ...], version: str, program: str | None) -> frozenset[str]:
    """Rules that KiCad reports on a board that breaks them all. version, program : of the KiCad
    that is asked."""
    with tempfile.TemporaryDirectory(prefix="designer-drc-") as scratch:
        text = rules_text([*rules, canary()])
        broken = report(specimen(rules, breaking=True), text, Path(scratch) / "specimen")
    with _understandable():
        reported = {v.rule for v in violations(broken, rules)}
        reported |= {OPEN} if _unconnected(broken) else set()
        reported |= {SHORT} if _shorts(broken) else set()
    return frozenset(reported)


def _project_files(
    board: BoardFile, footprints: Sequence[FootprintShape], fab: FabLimits | None
) -> dict[str, str]:
    """Files that stand beside a board when it is checked, by name."""
    files = {
        f"{LIBRARY}.pretty/{shape.name}.kicad_mod": expression_text(module(shape))
        for shape in footprints
    }
    table = {"name": LIBRARY, "type": "KiCad", "uri": f"${{KIPRJMOD}}/{LIBRARY}.pretty"}
    files["fp-lib-table"] = expression_text(
        expression("fp_lib_table", version=7, lib={**table, "options": "", "descr": ""})
    )
    limits = {} if fab is None else project_rules(fab)
    design = {"rule_severities": SEVERITIES, "rules": limits}
    files["board.kicad_pro"] = json.dumps({"board": {"design_settings": design}})
    sheet = board.path.with_suffix(".kicad_sch")
    if sheet.is_file():
        files[_SHEET] = read_text(sheet, "a schematic of KiCad", most=MOST_SCHEMATIC)
    return files


def report(
    board: str, rules: str, place: Path, files: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """KiCad's report on the text of a board under the text of a ``.kicad_dru``.

    files : that stand beside it, by name; with a schematic, parity is looked at too.

    Raises
    ------
    KicadFailed : there is none.
    """
    place.mkdir()
    files = {} if files is None else files
    every = {**files, "board.kicad_pcb": board, "board.kicad_dru": rules}
    for name, text in every.items():
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_text(text, encoding="utf-8")
    out = place / "report.json"
    options = ["--format", "json", "--units", "mm", "--severity-all", "--output", str(out)]
    options += ["--schematic-parity"] if _SHEET in files else []
    process = call("pcb", "drc", *options, str(place / "board.kicad_pcb"), place=place)
    if not out.is_file():
        raise KicadFailed(f"kicad-cli wrote no report: {last_words(process)}")
    try:
        answer = parse_json(out.read_bytes(), out)
    except InputError:
        raise KicadFailed("kicad-cli wrote a report that is no JSON") from None
    lists = ("violations", "unconnected_items", *([_PARITY] if _SHEET in files else []))
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


def _others(
    answer: Mapping[str, Any],
    rules: Sequence[CustomRule],
    severity: str,
    aside: tuple[float, float],
) -> list[Mapping[str, Any]]:
    """Violations of this severity that no rule of ours tells. aside : where the canary's track
    lies, of which KiCad says more than one thing."""
    ids = {rule.id for rule in rules}

    def ours(each: Mapping[str, Any]) -> bool:
        named = _RULE.search(str(each.get("description", "")))
        id_ = named[1] if named else _width_rule(each, rules)
        at = [item.get("pos", {}) for item in each.get("items", [])]
        near = [math.dist((p.get("x", 0.0), p.get("y", 0.0)), aside) < NEAR_CANARY for p in at]
        return id_ in ids or each.get("type") in SHORTS or (bool(near) and all(near))

    return [v for v in answer["violations"] if v.get("severity") == severity and not ours(v)]


def _typed(each: Mapping[str, Any]) -> str:
    place = _place(each)
    return f"{each.get('type')}: {place}" if place else str(each.get("type"))


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


def _aside(board: BoardFile) -> tuple[float, float]:
    """Where the canary's track lies [mm]."""
    corners = [pad.at for footprint in board.footprints for pad in footprint.pads] or [(0.0, 0.0)]
    return min(at[0] for at in corners) + ASIDE[0], min(at[1] for at in corners) + ASIDE[1]


def _with_canary(board: BoardFile) -> str:
    tree = read(board.text, board.path)
    return expression_text(Expression((*tree.items, canary_track(*_aside(board)))))
