"""The net classes of a KiCad project: how wide a net is drawn, and how far others stay from it.

KiCad 9 reads net settings of version 4 only where every class has a priority: it drops classes
without one, and every net then has KiCad's own 0.2 mm. A rule of the ``.kicad_dru`` that fits a net
goes before its class, so what a class asks for beyond the general rule stands there as well
(``board_rules``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

DEFAULT, SUMMING, SUPPLY = "Default", "summing", "supply"
"""KiCad's name of the default; an op-amp's inverting input; ground and the rails."""
CLASSES: Mapping[str, Mapping[str, float]] = {
    DEFAULT: {"clearance": 0.2, "track_width": 0.25},
    SUMMING: {"clearance": 0.3, "track_width": 0.2},
    SUPPLY: {"clearance": 0.2, "track_width": 0.5},
}
"""Millimetres. The classes after the default come in the order of their priority."""
VIA: Mapping[str, float] = {"via_diameter": 0.6, "via_drill": 0.3}
"""Millimetres, of every class."""
SHEET: Mapping[str, int] = {"wire_width": 6, "bus_width": 12}
"""Thousandths of an inch, of every class: without them wires are plotted with no width."""
LAST = 2147483647
"""KiCad's priority of the default class; the others count from 0, the first one the strongest."""


def net_settings(summing: Iterable[str], supply: Iterable[str]) -> dict[str, Any]:
    """The object ``net_settings`` of a ``.kicad_pro``. summing, supply : KiCad's names of nets."""
    nets = [(SUMMING, net) for net in summing] + [(SUPPLY, net) for net in supply]
    others = [name for name in CLASSES if name != DEFAULT]
    priority = {DEFAULT: LAST} | {name: number for number, name in enumerate(others)}
    return {
        "classes": [
            {"name": name, "priority": priority[name], **sizes, **VIA, **SHEET}
            for name, sizes in CLASSES.items()
        ],
        "meta": {"version": 4},
        "netclass_patterns": [{"netclass": name, "pattern": net} for name, net in nets],
    }
