"""A small board for KiCad on which each custom rule's measure is a chosen part of its limit.

Whoever runs the rules sees on it that KiCad reads and understands every one of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from designer.board.kicad_board import layers
from designer.board.kicad_names import BOARD_VERSION, HEAD, identifier
from designer.board.kicad_rules import CANARY_WIDTH, CustomRule
from designer.board.sexpr import Expression, expression, expression_text, lists, word

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
