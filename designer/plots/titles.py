"""Names and titles of sweeps, maps and basins, so that a picture can be read alone."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping

from designer.base.arrays import Array
from designer.base.si_unit import quantity_text, span_text
from designer.bifurcations.basins import BasinPlan
from designer.bifurcations.border_curves import CurvePlan
from designer.bifurcations.parameter_map import MapPlan
from designer.bifurcations.subject import Subject
from designer.bifurcations.sweep import DOWN, UP, SweepPlan

NAMES = {
    "omega": "ω",
    "zeta": "ζ",
    "k0": "k₀",
    "f20": "f₂₀",
    "frequency": "generator frequency",
    "amplitude": "generator amplitude (peak)",
    "offset": "generator offset",
    "x1": "x₁",
    "x1'": "x₁′",
    "x2": "x₂",
    "x2'": "x₂′",
    "v1": "v₁",
    "v2": "v₂",
    "v3": "v₃",
    "v4": "v₄",
}


def title(name: str, plan: SweepPlan | MapPlan | BasinPlan, width: int = 100) -> str:
    """What a picture shows: whose motion, over what, from which starts, and the fixed parameters.

    name : the model's title, or "". width : characters of a line.
    """
    owner = plan.subject.name
    if isinstance(plan, SweepPlan):
        over = parameter_name(plan.subject, plan.parameter)
        heading = f"bifurcation diagram of the {owner} over {over}, {_way(plan)}"
        changed: Mapping[str, float | None] = {plan.parameter: None}
    elif isinstance(plan, MapPlan):
        over = _both(plan.subject, plan.x, plan.y)
        heading = f"responses n-p-q of the {owner} over {over}, from rest"
        changed = {plan.x: None, plan.y: None}
    else:
        heading = f"basins of attraction of the {owner}, by the initial "
        heading += f"{_both(plan.subject, plan.x, plan.y)}, other states 0"
        changed = plan.changes
    lines = [name, heading, "held: " + ", ".join(_fixed(plan.subject, changed))]
    return "\n".join(
        part for line in lines for part in textwrap.wrap(line, width, break_on_hyphens=False)
    )


def curves_title(name: str, plan: CurvePlan, width: int = 100) -> str:
    """The title of bifurcation curves over two parameters."""
    over = _both(plan.subject, plan.first, plan.second)
    heading = f"bifurcation curves of the {plan.subject.name} over {over}"
    held = _fixed(plan.subject, {plan.first: None, plan.second: None})
    lines = [name, heading, "held: " + ", ".join(held)]
    return "\n".join(
        part for line in lines for part in textwrap.wrap(line, width, break_on_hyphens=False)
    )


def _both(subject: Subject, first: str, second: str) -> str:
    return f"{parameter_name(subject, first)} and {parameter_name(subject, second)}"


def _way(plan: SweepPlan) -> str:
    """The order in which, or the starts from which, the values are computed."""
    if plan.followed:
        directions = {DOWN: "followed down", UP: "followed up"}
        return " and ".join(directions[t] for t in plan.tracks)
    count = len(plan.tracks)
    return "from rest at each value" if count == 1 else f"from {count} starts at each value"


def _fixed(subject: Subject, changed: Mapping[str, float | None]) -> Iterable[str]:
    """The fixed parameters with their values. changed : None where one is swept."""
    yield from subject.remarks()
    for name, value in {**subject.fixed(changed), **changed}.items():
        if value is not None:
            yield f"{parameter_name(subject, name)} = {parameter_text(subject, name, value)}"


def taken(subject: Subject, name: str, values: Array) -> str:
    """A swept parameter and its range, with the unit that its numbers were taken in."""
    low, high = float(values.min()), float(values.max())
    unit, si = subject.units.get(name, ""), subject.si.get(name)
    return f"{NAMES.get(name, name)} {span_text(low, high, unit, si)}"


def in_si_values(subject: Subject) -> bool:
    """Whether the plain numbers of a subject are SI values of a mechanism, ω in rad/s."""
    return subject.units.get("omega") == "rad/s"


def parameter_name(subject: Subject, name: str) -> str:
    """What people read: ω by its symbol, where it is shown in hertz in words."""
    if name == "omega" and in_si_values(subject):
        return "drive frequency"
    return NAMES.get(name, name)


def parameter_text(subject: Subject, name: str, value: float) -> str:
    """A value of it with its unit."""
    unit, si = subject.units.get(name, ""), subject.si.get(name)
    if si is not None and si.own_si:
        return si.text(value, 6)
    if unit and in_si_values(subject):
        return quantity_text(value, unit, 6)
    plain = f"{value:.6g}" + (f" {unit}" if unit else "")
    return plain + (f" ({si.text(value)})" if si is not None else "")
