"""The rules of a board as KiCad's custom rules: the text of a ``.kicad_dru`` file.

Conditions name nets, not net classes: these vanish with the project file. Of two rules that fit,
KiCad takes the later one, so the general rule stands first. A rule goes before a net class as well,
so what a class asks for beyond the general rule is a rule of its own here. Past a syntax error
KiCad drops every rule of the file without a word, and a condition that it does not know never
holds; so ``design_rules.kicad_drc`` makes a board that breaks each rule and sees whether they work.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from designer.base.errors import InputError
from designer.board.kicad_names import kicad_net
from designer.board.net_classes import CLASSES, SUMMING, SUPPLY
from designer.board.sexpr import Expression, expression, number_text, word, write_all
from designer.catalog.design_rule import Override
from designer.catalog.design_rules import BY_ID
from designer.catalog.fab import FabLimits, Measure
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit

SPACING: tuple[tuple[float, float, float], ...] = (
    (15.0, 0.1, 0.13),
    (30.0, 0.1, 0.25),
    (50.0, 0.6, 0.4),
    (100.0, 0.6, 0.5),
    (150.0, 0.6, 0.8),
    (170.0, 1.25, 0.8),
    (300.0, 1.25, 0.8),
    (500.0, 2.5, 1.5),
)
"""IPC-2221, table 6-1: up to [V], columns B2 and A6 [mm]."""
MADE = 0.2
"""Gap [mm] that board makers etch without extra cost, and KiCad's own default."""
CANARY = "canary"
CANARY_WIDTH, CANARY_LIMIT = 0.0371, 7.3371
"""A track of a width [mm] that no board has, and the least that its rule asks for."""
NONE: Mapping[str, Override] = MappingProxyType({})


@dataclass(frozen=True)
class CustomRule:
    """A rule in KiCad's words."""

    id: str
    """Id of the rule that it says."""
    constraint: str
    limit: float
    """The limit [mm], or a count."""
    least: bool
    """Whether the limit is from below."""
    condition: str = ""
    """What it holds for; "" for everything."""
    nets: tuple[str, ...] = ()
    """KiCad's names of the nets that it speaks of, none for every net."""
    usual: float | None = None
    """Width that KiCad's router takes under this rule [mm]; None where the rule says nothing of
    it."""

    @property
    def expression(self) -> Expression:
        """The rule for a ``.kicad_dru`` file."""
        counted = self.constraint == "via_count"
        text = number_text(self.limit) if counted else _millimetres(self.limit)
        bound = expression("min" if self.least else "max", word(text))
        usual = [] if self.usual is None else [expression("opt", word(_millimetres(self.usual)))]
        parts = [expression("constraint", word(self.constraint), bound, *usual)]
        if self.condition:
            parts.append(expression("condition", self.condition))
        return expression("rule", self.id, *parts)


def spacing(volts: float) -> tuple[float, float]:
    """Gap [mm] between conductors and between component leads at this voltage.

    Raises
    ------
    InputError : more than the table's 500 V.
    """
    for upto, conductors, leads in SPACING:
        if volts <= upto:
            return conductors, leads
    raise InputError(None, "circuit.supply", f"{volts:g} V between the rails", "at most 500 V")


def board_rules(
    circuit: Circuit, overrides: Mapping[str, Override] = NONE
) -> tuple[CustomRule, ...]:
    """The rules that KiCad can check, with the limits of a model file where it has some."""

    def limit(id_: str, usual: float | None = None) -> float:
        if id_ in overrides:
            return overrides[id_].limit
        value = BY_ID[id_].limit if usual is None else usual
        assert value is not None
        return value

    def rule(
        id_: str, constraint: str, value: float, nets: tuple[str, ...] = (), condition: str = ""
    ) -> CustomRule:
        selector = condition or " || ".join(f"A.NetName == '{net}'" for net in nets)
        return CustomRule(id_, constraint, value, BY_ID[id_].least, selector, nets)

    conductors, leads = spacing(2.0 * circuit.supply)
    clearance = limit("clearance", max(conductors, MADE))
    summing_clearance = limit("summing-clearance", max(clearance, CLASSES[SUMMING]["clearance"]))
    pads, width = limit("pad-clearance", max(leads, MADE)), limit("supply-width")
    summing = tuple(dict.fromkeys(kicad_net(s.inverting) for s in circuit.sections))
    rails = (POSITIVE, NEGATIVE, GROUND, *circuit.supply_inputs)
    supply = tuple(kicad_net(net) for net in rails)
    return (
        rule("clearance", "clearance", clearance),
        rule("summing-clearance", "clearance", summing_clearance, summing),
        rule("pad-clearance", "clearance", pads, (), "A.Type == 'Pad' && B.Type == 'Pad'"),
        rule("component-spacing", "courtyard_clearance", limit("component-spacing")),
        rule("summing-length", "length", limit("summing-length"), summing),
        rule("summing-vias", "via_count", limit("summing-vias"), summing),
        replace(
            rule("supply-width", "track_width", width, supply),
            usual=max(width, CLASSES[SUPPLY]["track_width"]),
        ),
    )


def project_rules(fab: FabLimits) -> dict[str, float]:
    """The object ``rules`` of the board's settings in a ``.kicad_pro`` [mm]: what KiCad's own check
    asks for, beside the custom rules. A measure that no fab limits keeps KiCad's own."""
    of: dict[str, Measure] = {
        "min_track_width": "track",
        "min_clearance": "gap",
        "min_through_hole_diameter": "hole",
        "min_via_annular_width": "via-ring",
        "min_hole_to_hole": "hole-gap",
        "min_copper_edge_clearance": "edge",
        "min_text_height": "silk-height",
        "min_text_thickness": "silk-stroke",
    }
    rules = {key: fab.least[measure] for key, measure in of.items() if measure in fab.least}
    if {"hole", "via-ring"} <= fab.least.keys():
        rules["min_via_diameter"] = round(fab.least["hole"] + 2.0 * fab.least["via-ring"], 6)
    return rules


def rules_text(rules: Sequence[CustomRule]) -> str:
    """The text of a ``.kicad_dru`` file."""
    return write_all([expression("version", 1), *(rule.expression for rule in rules)])


def canary() -> CustomRule:
    """A rule that a track of ``CANARY_WIDTH`` breaks: unless KiCad says so, it has read no rule."""
    return CustomRule(
        CANARY, "track_width", CANARY_LIMIT, True, f"A.Width == {number_text(CANARY_WIDTH)}mm"
    )


def _millimetres(value: float) -> str:
    return f"{number_text(value)}mm"
