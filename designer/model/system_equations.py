"""Equations of motion and elements of any system, line by line, as plain text.

Displacements are absolute here, as in the model file: x of a mass, y of the ground. Masses, springs
and dampers are numbered in the file's order; a number of a clearance has the name that a sweep
gives it, such as "A.upper".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from designer.base.si_unit import quantity_text
from designer.model.lumped_elements import GROUND, Gap
from designer.model.lumped_system import LumpedSystem
from designer.model.relative_motion import subscripted

MOTION = "sin ωt"
Naming = Callable[[str, float], str]
"""What stands for a number: its symbol, or the number itself."""


def symbol_of(symbol: str, _value: float) -> str:
    """A number by its symbol."""
    return symbol


def number_of(_symbol: str, value: float) -> str:
    """A number by its value, six digits."""
    return f"{value:.6g}".replace("-", "−")


def equations_of(model: LumpedSystem, naming: Naming = symbol_of) -> tuple[str, ...]:
    """One line for each mass, one for each clearance, and the ground's motion."""
    lines = [_line(model, i, naming) for i in range(len(model.masses))]
    lines += [_law(model, gap, naming) for gap in model.gaps]
    if model.base is not None:
        if model.base.acceleration:
            lines.append(f"y = {naming('a', model.base.acceleration)}/ω² {MOTION}")
        else:
            lines.append(f"y = {naming('Y', model.base.amplitude)} {MOTION}")
    return tuple(lines)


def element_rows(model: LumpedSystem, *, si: bool) -> list[tuple[str, str, str]]:
    """(symbol, value, what it is) of every number of the elements.

    si : whether the numbers are SI values, which are then shown with their units.
    """
    return [
        (symbol, _value(value, unit if si else ""), text)
        for symbol, value, unit, text in _elements(model)
    ]


def hertz_notes(model: LumpedSystem, *, si: bool) -> list[str]:
    """A sentence for each clearance whose stops follow Hertz's law: by how much the pieces miss."""
    notes = []
    for gap in model.gaps:
        if gap.hertz is not None and gap.depth is not None:
            depth = _value(gap.depth, "m" if si else "")
            notes.append(
                f"{gap.name}: {gap.constant:.4g} depth^1.5 by {gap.pieces} straight pieces down to "
                f"a depth of {depth}; the force differs from the law by at most "
                f"{100.0 * gap.hertz.largest_error:.2g} % of the force at that depth."
            )
    return notes


def _elements(model: LumpedSystem) -> Iterator[tuple[str, float, str, str]]:
    for i, mass in enumerate(model.masses, start=1):
        yield subscripted(f"m{i}"), mass.mass, "kg", f"mass of {mass.name}"
    for i, spring in enumerate(model.springs, start=1):
        text = f"spring, {' to '.join(spring.between)}"
        yield subscripted(f"k{i}"), spring.stiffness, "N/m", text
    for i, damper in enumerate(model.dampers, start=1):
        text = f"damper, {' to '.join(damper.between)}"
        yield subscripted(f"c{i}"), damper.damping, "N s/m", text
    for gap in model.gaps:
        yield from _of_gap(gap, model.stop_damping(gap))
    for i, force in enumerate(model.forces, start=1):
        if force.amplitude:
            text = f"amplitude of the force on {force.on}"
            yield subscripted(f"P{i}"), force.amplitude, "N", text
        if force.constant:
            yield subscripted(f"G{i}"), force.constant, "N", f"constant force on {force.on}"
    if model.base is not None:
        stops = "with" if model.base.stops == "base" else "without"
        symbol, motion = ("a", "acceleration") if model.base.acceleration else ("Y", "motion")
        text = f"amplitude of the ground's {motion}, {stops} the stops"
        yield symbol, model.base.amplitude, model.base.unit, text


def _of_gap(gap: Gap, damping: float) -> Iterator[tuple[str, float, str, str]]:
    location = f"in {gap.name}, {' to '.join(gap.between)}"
    for side in ("upper", "lower"):
        place = getattr(gap, side)
        if place is not None:
            more = ", preloaded" if place < 0.0 else ""
            yield f"{gap.name}.{side}", place, "m", f"gap to the {side} stop {location}{more}"
    for side in ("", "upper_", "lower_"):
        stiffness = getattr(gap, f"{side}stiffness")
        if stiffness is not None:
            of = f"the {side[:-1]} stop" if side else "the stops"
            yield f"{gap.name}.{side}stiffness", stiffness, "N/m", f"stiffness of {of} {location}"
    if gap.constant is not None and gap.depth is not None:
        yield f"{gap.name}.constant", gap.constant, "", f"of the Hertzian law {location}"
        yield f"{gap.name}.depth", gap.depth, "m", f"down to which the law holds {location}"
    if gap.preload:
        text = f"push of the stops where they are touched {location}"
        yield f"{gap.name}.preload", gap.preload, "N", text
    if gap.preload_over is not None:
        text = f"depth over which that push rises {location}"
        yield f"{gap.name}.preload_over", gap.preload_over, "m", text
    if gap.restitution is not None:
        text = f"restitution: speed after a contact over that before {location}"
        yield f"{gap.name}.restitution", gap.restitution, "", text
    if damping:
        more = "" if gap.restitution is None else ", which makes that restitution"
        yield f"{gap.name}.damping", damping, "N s/m", f"damping of the stops {location}{more}"


def _value(value: float, unit: str) -> str:
    if not unit:
        return f"{value:.6g}"
    return quantity_text(value, unit, 6)


def _line(model: LumpedSystem, mass: int, naming: Naming) -> str:
    """The equation of one mass."""
    name = model.names[mass]
    left = [_times(naming(subscripted(f"m{mass + 1}"), model.masses[mass].mass)) + _x(mass, "″")]
    for i, damper in enumerate(model.dampers, start=1):
        if name in damper.between:
            value = naming(subscripted(f"c{i}"), damper.damping)
            left.append(_times(value) + _stretch(model, name, damper.between, "′"))
    for i, spring in enumerate(model.springs, start=1):
        if name in spring.between:
            value = naming(subscripted(f"k{i}"), spring.stiffness)
            left.append(_times(value) + _stretch(model, name, spring.between, ""))
    text = " + ".join(left)
    for gap in model.gaps:
        if name in gap.between:
            sign = "+" if name == gap.between[0] else "−"
            text += f" {sign} {gap.name}({_motion(model, gap)})"
    return f"{text} = {_forces(model, name, naming)}"


def _x(mass: int, prime: str) -> str:
    return subscripted(f"x{mass + 1}") + prime


def _place(model: LumpedSystem, name: str, prime: str, *, moves: bool = True) -> str:
    """The displacement of a mass or of the ground; "" of a ground that rests."""
    if name != GROUND:
        return _x(model.names.index(name), prime)
    return f"y{prime}" if model.base is not None and moves else ""


def _stretch(model: LumpedSystem, name: str, between: tuple[str, str], prime: str) -> str:
    (other,) = (end for end in between if end != name)
    ends = [end for end in (_place(model, n, prime) for n in (name, other)) if end]
    return f"({' − '.join(ends)})" if len(ends) > 1 else ends[0]


def _motion(model: LumpedSystem, gap: Gap) -> str:
    """The displacement that a clearance sees."""
    moves = model.base is not None and model.base.stops == "base"
    first, second = (_place(model, name, "", moves=moves) for name in gap.between)
    return f"{first} − {second}" if first and second else first or f"−{second}"


def _forces(model: LumpedSystem, name: str, naming: Naming) -> str:
    terms: list[str] = []
    for i, force in enumerate(model.forces, start=1):
        if force.on == name and force.amplitude:
            terms.append(f"{_times(naming(subscripted(f'P{i}'), force.amplitude))}{MOTION}")
        if force.on == name and force.constant:
            terms.append(naming(subscripted(f"G{i}"), force.constant))
    return " + ".join(terms).replace("+ −", "− ") or "0"


def _law(model: LumpedSystem, gap: Gap, naming: Naming) -> str:
    """The force of a clearance's stops over the displacement u in it."""
    terms: list[str] = []
    clearance = next(c for c in model.second_order().clearances if c.name == gap.name)
    turned = gap.between[0] == GROUND
    for side, stop in clearance.sides:
        end = "upper" if (side > 0) != turned else "lower"
        sign = "−" if end == "upper" else "+"
        bound = "max" if end == "upper" else "min"
        if gap.hertz is not None and naming is symbol_of:
            depth = f"max({'u' if end == 'upper' else '−u'} − {gap.name}.{end}, 0)"
            terms.append(f"{'' if end == 'upper' else '−'}{gap.name}.constant {depth}^1.5")
            continue
        side_name = f"{gap.name}.{end}_stiffness"
        is_stated = getattr(gap, f"{end}_stiffness") is not None
        name = side_name if is_stated else f"{gap.name}.stiffness"
        for place, stiffness in stop.own_springs:
            shift = naming(f"{gap.name}.{end}", place)
            terms.append(f"{_times(naming(name, stiffness))}{bound}(u {sign} {shift}, 0)")
        if stop.rise:
            push = _times(naming(f"{gap.name}.preload", stop.preload))
            over = naming(f"{gap.name}.preload_over", stop.rise)
            way = "u" if end == "upper" else "−u"
            depth = f"{way} − {naming(f'{gap.name}.{end}', stop.gap)}".replace("− −", "+ ")
            risen = f"min(max({depth}, 0)/{over}, 1)"
            terms.append(f"{'' if end == 'upper' else '−'}{push}{risen}")
        elif stop.preload:
            holds = f"(u {'>' if end == 'upper' else '<'} {_at(model, gap, end, naming)})"
            push = _times(naming(f"{gap.name}.preload", stop.preload))
            terms.append(f"{'' if end == 'upper' else '−'}{push or '1 '}{holds}")
    text = " + ".join(terms).replace("− −", "+ ").replace("+ −", "− ")
    if clearance.damping:
        text += f", and {_times(naming(f'{gap.name}.damping', clearance.damping))}u′ in contact"
    return f"{gap.name}(u) = {text}"


def _at(model: LumpedSystem, gap: Gap, end: str, naming: Naming) -> str:
    """The displacement at which a stop is touched."""
    place = model.b * getattr(gap, end)
    if end == "upper":
        return naming(f"{gap.name}.{end}", place)
    return f"−{naming(f'{gap.name}.{end}', place)}".replace("−−", "")


def _times(value: str) -> str:
    return "" if value == "1" else f"{value} "
