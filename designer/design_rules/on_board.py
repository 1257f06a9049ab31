"""Rules on a board: by KiCad's own check where that can say them, else read from the board file.

Without a board, without KiCad, or where KiCad does not show that it understood a rule, the rule is
not run: never a pass.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from designer.base.natural_sort import natural_key
from designer.base.views import View
from designer.board.board_facts import BoardFacts, facts_of
from designer.board.component import Component
from designer.board.footprints import footprint
from designer.board.kicad_board import THICKNESS
from designer.board.kicad_names import POWER, circuit_net
from designer.board.kicad_reader import BoardFile
from designer.board.kicad_rules import CustomRule
from designer.board.outline import LAYER
from designer.board.summing_nodes import shortest_tree
from designer.catalog.design_rule import (
    FAIL,
    PASS,
    DesignRule,
    Finding,
    NotRun,
    Override,
    RuleOutcome,
    judged,
    not_run,
    value_text,
)
from designer.catalog.design_rules import RULES
from designer.catalog.fab import FabLimits
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE
from designer.design_rules import on_fab, on_parts
from designer.design_rules.kicad_drc import (
    ERRORS,
    OPEN,
    PARITY,
    SHORT,
    DesignRuleCheck,
    Violation,
    check,
)
from designer.design_rules.kicad_program import KicadFailed

NO_BOARD = "no board was given (--board FILE)"
NOT_UNDERSTOOD = "KiCad does not report a board that breaks this rule"
MOST = 5
"""Names in a message."""
NETS = 12
"""Nets that are not routed in a message."""
_READ = "read from the board file"
SPAN, SPAN_THROUGH_HOLES = 25.0, 45.0
"""Limits of a summing node [mm]: all of its parts on the surface, or one of them in holes."""
COPPER = frozenset({"clearance"})
"""Rules that say nothing of a board without tracks."""


def without_board(
    rules: Sequence[CustomRule], overrides: Mapping[str, Override]
) -> tuple[RuleOutcome, ...]:
    """Every rule on a board, none of them run."""
    return tuple(_idle(rule, rules, overrides, NO_BOARD) for rule in _wanted())


def checked(
    board: BoardFile,
    components: Sequence[Component],
    rules: Sequence[CustomRule],
    overrides: Mapping[str, Override],
    fab: FabLimits,
) -> tuple[RuleOutcome, ...]:
    """Every rule on a board, with KiCad where that is installed and answers. fab : what its maker
    makes."""
    try:
        shapes = {c.footprint: footprint(c.footprint) for c in components if c.footprint}
        answer: DesignRuleCheck | str = check(board, rules, tuple(shapes.values()), fab)
    except KicadFailed as why:
        answer = str(why)
    return on_board(board, components, rules, overrides, answer, fab)


def on_board(
    board: BoardFile,
    components: Sequence[Component],
    rules: Sequence[CustomRule],
    overrides: Mapping[str, Override],
    answer: DesignRuleCheck | str,
    fab: FabLimits,
) -> tuple[RuleOutcome, ...]:
    """Every rule on a board. answer : what KiCad found, or why it was not asked. fab : what its
    maker makes."""
    by_id = {custom.id: custom for custom in rules}
    facts = facts_of(board)
    out = []
    for rule in _wanted():
        override = overrides.get(rule.id)
        try:
            if rule.id in READ:
                out.append(judged(rule, READ[rule.id](board, components), override))
            elif rule.id in MEASURED:
                out.append(judged(rule, MEASURED[rule.id](facts), override))
            elif rule.id in on_fab.READ:
                out.append(judged(rule, on_fab.READ[rule.id](facts, fab), override))
            elif isinstance(answer, str):
                out.append(_idle(rule, rules, overrides, answer))
            elif rule.id in REPORTED:
                out.append(judged(rule, _reported(rule, board, answer), override))
            else:
                out.append(_by_kicad(rule, by_id[rule.id], board, answer, override))
        except NotRun as reason:
            out.append(_idle(rule, rules, overrides, str(reason)))
    return tuple(out)


def decoupling_distance(board: BoardFile, components: Sequence[Component]) -> Iterator[Finding]:
    """Between centres of pads [mm]: each supply pin, and the nearest pad on its net of the
    capacitors that belong to the package."""
    for package in components:
        if package.kind != "op-amp":
            continue
        capacitors = [c.reference for c in components if c.near == package.reference]
        for pad in board.pads(package.reference):
            if pad.net not in (POSITIVE, NEGATIVE):
                continue
            near = [
                (math.dist(pad.at, other.at), reference)
                for reference in capacitors
                for other in board.pads(reference)
                if other.net == pad.net
            ]
            if not near:
                raise NotRun(f"{package.reference} has no decoupling capacitor on {pad.net}")
            distance, reference = min(near)
            place = f"{package.reference}.{pad.number}"
            yield Finding(distance, place, more=f"to {reference}; {_READ}")


def summing_span(board: BoardFile, components: Sequence[Component]) -> Iterator[Finding]:
    """Shortest tree over the pads of each summing node [mm]: about as long as its track has to be.

    A node that an op-amp's output is on has a low impedance, and is none.
    """
    pins = [(c, pin) for c in components for pin in c.pins if pin.net and View.BOARD in c.views]
    driven = {GROUND, *(pin.net for _, pin in pins if pin.electrical == "output")}
    nodes = {pin.net for _, pin in pins if (pin.electrical, pin.name) == ("input", "-")} - driven
    spans = {node: shortest_tree(_places(board, node)) for node in sorted(nodes, key=natural_key)}
    each = ", ".join(f"{node} {span:.1f}" for node, span in spans.items())
    for node, span in spans.items():
        of_node = [c for c, pin in pins if pin.net == node]
        holes = any(footprint(c.footprint).through_hole for c in of_node)
        limit = SPAN_THROUGH_HOLES if holes else SPAN
        yield Finding(span, node, limit, f"in mm: {each}; {_READ}")


def _places(board: BoardFile, net: str) -> list[tuple[float, float]]:
    """Where the pads of a net are [mm]."""
    pads = (pad for footprint in board.footprints for pad in footprint.pads)
    return list(dict.fromkeys(pad.at for pad in pads if pad.net == net))


def board_outline(board: BoardFile, components: Sequence[Component]) -> Iterator[Finding]:
    """From each pad of the design's components to the board's edge [mm]."""
    if not len(board.outline.sides):
        yield Finding(float("nan"), more=f"the board has no edge: nothing on {LAYER}")
        return
    if (at := board.outline.open_at) is not None:
        where = f"({at[0]:.2f} mm, {at[1]:.2f} mm)"
        yield Finding(float("nan"), where, more=f"the edge on {LAYER} is not closed there")
        return
    for component in components:
        for pad in board.pads(component.reference):
            place = f"{component.reference}.{pad.number}"
            if not pad.corners:
                raise NotRun(f"{place} has a shape that is not read")
            room = board.outline.room(np.array(pad.corners))
            yield Finding(room, place, more=_READ)


def unconnected(board: BoardFile, answer: DesignRuleCheck) -> Iterator[Finding]:
    """Open connections, with the nets that they are on.

    Raises
    ------
    NotRun : nothing is routed at all.
    """
    count = sum(answer.unconnected.values())
    if count and not board.copper:
        nets = len(answer.unconnected)
        raise NotRun(f"nothing is routed yet: {count} connections of {nets} nets are open")
    names = [f"{POWER.get(net, net)} ({n})" for net, n in sorted(answer.unconnected.items())]
    more = f" and {len(names) - NETS} more nets" if len(names) > NETS else ""
    yield Finding(count, more=f"not routed: {', '.join(names[:NETS])}{more}" if names else "")


def short_circuits(board: BoardFile, answer: DesignRuleCheck) -> Iterator[Finding]:
    """Places where copper of two nets touches."""
    yield Finding(len(answer.shorts), more="; ".join(answer.shorts[:MOST]))


def kicad_errors(board: BoardFile, answer: DesignRuleCheck) -> Iterator[Finding]:
    """What KiCad's check calls an error and no other rule tells; warnings are named."""
    warned = [f"{name} ({n})" for name, n in sorted(answer.warnings.items())]
    more = [*answer.errors[:MOST], *(["warnings: " + ", ".join(warned)] if warned else [])]
    yield Finding(len(answer.errors), more="; ".join(more))


def schematic_parity(board: BoardFile, answer: DesignRuleCheck) -> Iterator[Finding]:
    """Differences from the schematic.

    Raises
    ------
    NotRun : there is none beside the board.
    """
    if answer.parity is None:
        raise NotRun(f"no {board.path.with_suffix('.kicad_sch').name} beside the board")
    yield Finding(len(answer.parity), more="; ".join(answer.parity[:MOST]))


def mounting_holes(facts: BoardFacts) -> Iterator[Finding]:
    """Holes that a screw goes through."""
    yield Finding(facts.screw_holes, more=_READ)


def thickness(facts: BoardFacts) -> Iterator[Finding]:
    """How far the thickness is from the exported board's [mm]."""
    more = f"{facts.thickness:g} mm; {_READ}"
    yield Finding(abs(facts.thickness - THICKNESS), more=more)


def bare_layers(facts: BoardFacts) -> Iterator[Finding]:
    """Inner layers that nothing lies on, while another has a track.

    Raises
    ------
    NotRun : nothing is routed yet.
    """
    if facts.finest_track is None:
        raise NotRun("the board has no track yet")
    yield Finding(len(facts.bare_layers), more=", ".join([*facts.bare_layers, _READ]))


MEASURED: Mapping[str, Callable[[BoardFacts], Iterator[Finding]]] = {
    "mounting-holes": mounting_holes,
    "board-thickness": thickness,
    "board-layers": bare_layers,
}
"""Rules on figures of the board."""
REPORTED: Mapping[str, Callable[[BoardFile, DesignRuleCheck], Iterator[Finding]]] = {
    OPEN: unconnected,
    SHORT: short_circuits,
    ERRORS: kicad_errors,
    PARITY: schematic_parity,
}
"""Rules that KiCad's check says by itself, without a custom rule."""
READ: Mapping[str, Callable[[BoardFile, Sequence[Component]], Iterator[Finding]]] = {
    **on_parts.READ,
    "decoupling-distance": decoupling_distance,
    "summing-span": summing_span,
    "board-outline": board_outline,
}
"""Rules that KiCad is not asked about: they are read from the file."""


def _reported(rule: DesignRule, board: BoardFile, answer: DesignRuleCheck) -> Iterator[Finding]:
    if rule.id in answer.misunderstood:
        raise NotRun(NOT_UNDERSTOOD)
    return REPORTED[rule.id](board, answer)


def _by_kicad(
    rule: DesignRule,
    custom: CustomRule,
    board: BoardFile,
    answer: DesignRuleCheck,
    override: Override | None,
) -> RuleOutcome:
    if custom.id in answer.misunderstood:
        raise NotRun(NOT_UNDERSTOOD)
    mine = [v for v in answer.violations if v.rule == custom.id]
    if mine:
        return _broken(rule, custom, mine, override)
    concerned = {circuit_net(net) for net in custom.nets}
    if concerned:
        lost = sorted(concerned & answer.unconnected.keys())
        if lost:
            raise NotRun(f"not routed yet: {', '.join(POWER.get(net, net) for net in lost)}")
        if not concerned & board.routed:
            raise NotRun("none of the nets that this speaks of is routed")
    elif rule.id in COPPER and not board.routed:
        raise NotRun("the board has no track and no zone yet")
    if custom.constraint == "courtyard_clearance":
        bare = [f.reference for f in board.footprints if f.wired and not f.courtyard]
        if bare:
            raise NotRun(f"footprints without a courtyard: {', '.join(bare[:MOST])}")
    usual, words = _usual(rule, custom, override), "no violation in KiCad's check"
    return RuleOutcome(rule, PASS, words, limit=custom.limit, override=override, usual=usual)


def _broken(
    rule: DesignRule, custom: CustomRule, broken: Sequence[Violation], override: Override | None
) -> RuleOutcome:
    worst = (min if rule.least else max)(broken, key=lambda v: v.actual)
    text = f"{value_text(worst.actual, rule.unit)} at {worst.where}"
    if len(broken) > 1:
        text += f"; {len(broken)} places in all"
    usual = _usual(rule, custom, override)
    return RuleOutcome(rule, FAIL, text, worst.actual, custom.limit, worst.where, override, usual)


def _usual(rule: DesignRule, custom: CustomRule, override: Override | None) -> float:
    """The limit without the model file's; nan where only the table would say."""
    if override is None:
        return custom.limit
    return float("nan") if rule.limit is None else rule.limit


def _idle(
    rule: DesignRule, rules: Sequence[CustomRule], overrides: Mapping[str, Override], why: str
) -> RuleOutcome:
    outcome = not_run(rule, why, overrides.get(rule.id))
    limits = {custom.id: custom.limit for custom in rules}
    return replace(outcome, limit=limits.get(rule.id, outcome.limit))


def _wanted() -> list[DesignRule]:
    return [rule for rule in RULES if rule.scope == "board"]
