"""Equations of motion and elements of any system, line by line, as plain text.

Displacements are absolute here, as in the model file: x of a mass, y of the ground. Masses, springs
and dampers are numbered in the file's order; a number of a clearance has the name that a sweep
gives it, such as "A.upper".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, replace

from designer.base.arrays import Array
from designer.base.si_unit import quantity_text
from designer.base.units import ACCELERATIONS
from designer.laws.element_keys import GROUND
from designer.laws.law_elements import CubicSpring, Friction, Law, NonlinearElement
from designer.model.lumped_elements import Elements, Force, Gap, MovingBase, words_of
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
    symbols = law_symbols(model)
    lines += [
        _nonlinear(symbols[name], element, naming) for name, element in model.nonlinear.items()
    ]
    if model.base is not None:
        lines.append(ground_line(model.base, naming))
    return tuple(lines)


def ground_line(base: MovingBase, naming: Naming) -> str:
    """How the ground moves."""
    if base.is_sine and base.acceleration:
        return f"y = {naming('a', base.acceleration)}/ω² {MOTION}"
    symbol = "a" if base.acceleration else "Y"
    unit = ACCELERATIONS.get(base.unit, 1.0)
    harmonics = tuple((n, unit * size, phase) for n, size, phase in base.harmonics)
    sized = replace(base, amplitude=unit * base.amplitude, harmonics=harmonics)
    terms = _wave_terms(sized, symbol, "φ", naming)
    return f"{'−y″' if base.acceleration else 'y'} = {' + '.join(terms)}".replace("+ −", "− ")


def element_rows(model: LumpedSystem, *, si: bool) -> list[tuple[str, str, str]]:
    """(symbol, value, what it is) of every number of the elements.

    si : whether the numbers are SI values, which are then shown with their units.
    """
    return [
        (symbol, _value(value, unit if si else ""), text)
        for symbol, value, unit, text in _elements(model)
    ]


def law_symbols(model: Elements) -> dict[str, str]:
    """What each element whose force is a law is called in equations, by its name: a [[law]] by that
    name, the others F₁, F₂, …"""
    laws = {law.name: law.name for law in model.laws}
    others = [name for name in model.nonlinear if name not in laws]
    return {**laws, **{name: subscripted(f"F{i}") for i, name in enumerate(others, start=1)}}


def approximation_notes(model: LumpedSystem, *, si: bool) -> list[str]:
    """A sentence for each curved law by how much its straight pieces miss it: cubic springs, stops
    after Hertz."""
    notes = []
    for element in model.nonlinear.values():
        if (curve := element.curve) is not None:
            reach = _value(curve.span, "m" if si else "")
            notes.append(
                f"{words_of(element)}: {curve.text} by {curve.count} points, straight between "
                f"them, up to {reach}; the force differs from the law by at most "
                f"{100.0 * curve.largest_error:.2g} % of the largest in that range."
            )
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
    if model.matrices is not None:
        yield from _of_matrices(model)
    for i, mass in enumerate(model.masses if model.matrices is None else (), start=1):
        yield subscripted(f"m{i}"), mass.mass, "kg", f"mass of {mass.name}"
    for i, spring in enumerate(model.springs, start=1):
        text = f"spring, {' to '.join(spring.between)}"
        yield subscripted(f"k{i}"), spring.stiffness, "N/m", text
    for i, damper in enumerate(model.dampers, start=1):
        text = f"damper, {' to '.join(damper.between)}"
        yield subscripted(f"c{i}"), damper.damping, "N s/m", text
    for gap in model.gaps:
        yield from _of_gap(gap, model.stop_damping(gap))
    for name, symbol in law_symbols(model).items():
        yield from _of_law(symbol, model.nonlinear[name])
    for i, force in enumerate(model.forces, start=1):
        if force.amplitude:
            text = f"amplitude of the force on {force.on}"
            yield subscripted(f"P{i}"), force.amplitude, "N", text
        symbols = subscripted(f"P{i}"), subscripted(f"φ{i}")
        yield from _of_waves(force, *symbols, f"the force on {force.on}", "N")
        if force.constant:
            yield subscripted(f"G{i}"), force.constant, "N", f"constant force on {force.on}"
    if model.base is not None:
        stops = "with" if model.base.stops == "base" else "without"
        symbol, motion = ("a", "acceleration") if model.base.acceleration else ("Y", "motion")
        text = f"amplitude of the ground's {motion}, {stops} the stops"
        yield symbol, model.base.amplitude, model.base.unit, text
        yield from _of_waves(model.base, symbol, "φ", f"the ground's {motion}", model.base.unit)


def _of_waves(
    drive: Force | MovingBase, P: str, φ: str, what: str, unit: str
) -> Iterator[tuple[str, float, str, str]]:
    """Phase and shape of a drive, beyond its amplitude."""
    if drive.phase:
        yield φ, drive.phase, "rad", f"phase of {what}"
    if drive.terms is not None:
        shaped = what.replace("the ", f"the {drive.waveform} ", 1)
        yield f"{P}.terms", drive.terms, "", f"harmonics kept of {shaped}"
    for n, amplitude, phase in drive.harmonics:
        yield f"{P}.{n}", amplitude, unit, f"amplitude of harmonic {n} of {what}"
        if phase:
            yield f"{φ}.{n}", phase, "rad", f"phase of harmonic {n} of {what}"


def _matrix_terms(model: LumpedSystem) -> Iterator[tuple[str, Array, str, str]]:
    """Symbol, matrix, unit and prime of the displacements of each matrix of the linear part."""
    assert model.matrices is not None
    yield "m", model.matrices.mass_matrix, "kg", "″"
    yield "c", model.matrices.damping_matrix, "N s/m", "′"
    yield "k", model.matrices.stiffness_matrix, "N/m", ""


def _of_matrices(model: LumpedSystem) -> Iterator[tuple[str, float, str, str]]:
    words = {"m": "mass", "c": "damping", "k": "stiffness"}
    for letter, matrix, unit, _ in _matrix_terms(model):
        for i, name in enumerate(model.names):
            for j, other in enumerate(model.names):
                if matrix[i, j] and (j >= i or matrix[i, j] != matrix[j, i]):
                    text = f"{words[letter]} matrix, {name} and {other}"
                    yield _entry(letter, i, j), float(matrix[i, j]), unit, text


def _entry(letter: str, row: int, column: int) -> str:
    between = "," if max(row, column) > 8 else ""
    return subscripted(f"{letter}{row + 1}") + between + subscripted(f"{column + 1}")


def _of_gap(gap: Gap, damping: float) -> Iterator[tuple[str, float, str, str]]:
    location = f"in {gap.name}, {words_of(gap)}"
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


def _of_law(symbol: str, element: NonlinearElement) -> Iterator[tuple[str, float, str, str]]:
    if isinstance(element, Law):
        unit = "m" if element.quantity == "displacement" else "m/s"
        for i, (x, force) in enumerate(element.corners, start=1):
            yield f"{symbol}.{subscripted(f'x{i}')}", x, unit, f"{element.quantity} at point {i}"
            yield f"{symbol}.{subscripted(f'f{i}')}", force, "N", f"force at point {i}"
        return
    left_out = {field.name: field.default for field in fields(element)}
    for key, number in element.PARAMETERS.items():
        value = getattr(element, key)
        if value != left_out[key]:
            meaning = f"{number.meaning}, {words_of(element)}"
            yield f"{symbol}.{key}", value, number.unit, meaning


def _value(value: float, unit: str) -> str:
    if not unit:
        return f"{value:.6g}"
    return quantity_text(value, unit, 6)


def _line(model: LumpedSystem, mass: int, naming: Naming) -> str:
    """The equation of one mass."""
    name = model.names[mass]
    if model.matrices is not None:
        left = list(_matrix_line(model, mass, naming))
        return _with_forces(model, name, " + ".join(left).replace("+ −", "− "), naming)
    left = [_times(naming(subscripted(f"m{mass + 1}"), model.masses[mass].mass)) + _x(mass, "″")]
    for i, damper in enumerate(model.dampers, start=1):
        if name in damper.between:
            value = naming(subscripted(f"c{i}"), damper.damping)
            left.append(_times(value) + _stretch(model, name, damper.between, "′"))
    for i, spring in enumerate(model.springs, start=1):
        if name in spring.between:
            value = naming(subscripted(f"k{i}"), spring.stiffness)
            left.append(_times(value) + _stretch(model, name, spring.between, ""))
    return _with_forces(model, name, " + ".join(left), naming)


def _matrix_line(model: LumpedSystem, mass: int, naming: Naming) -> Iterator[str]:
    """The linear terms of one mass, by the matrices. Springs and dampers stand on what moves."""
    moves = "" if model.base is None else "y"
    for letter, matrix, _, prime in _matrix_terms(model):
        for other in range(len(model.names)):
            if matrix[mass, other]:
                i, j = sorted((mass, other))
                even = matrix[mass, other] == matrix[other, mass]
                symbol = _entry(letter, i, j) if even else _entry(letter, mass, other)
                place = _x(other, prime)
                if moves and letter != "m":
                    place = f"({place} − {moves}{prime})"
                yield _times(naming(symbol, float(matrix[mass, other]))) + place


def _with_forces(model: LumpedSystem, name: str, text: str, naming: Naming) -> str:
    """The equation of a mass from its linear terms on."""
    for gap in model.gaps:
        factor = gap.factors.get(name, 0.0)
        if factor:
            size = _times(number_of("", abs(factor)))
            sign = "+" if factor > 0.0 else "−"
            text += f" {sign} {size}{gap.name}({_motion(model, gap)})"
    for name_of_law, symbol in law_symbols(model).items():
        element = model.nonlinear[name_of_law]
        factor = element.factors.get(name, 0.0)
        if factor:
            size = _times(number_of("", abs(factor)))
            sign = "+" if factor > 0.0 else "−"
            text += f" {sign} {size}{symbol}({law_variable(model, element)})"
    return f"{text} = {_forces(model, name, naming)}"


def _x(mass: int, prime: str) -> str:
    return subscripted(f"x{mass + 1}") + prime


def _place(model: Elements, name: str, prime: str, *, moves: bool = True) -> str:
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
    if gap.between is None:
        return _sum_of(model, gap.factors, "")
    first, second = (_place(model, name, "", moves=moves) for name in gap.between)
    return f"{first} − {second}" if first and second else first or f"−{second}"


def law_variable(model: Elements, element: NonlinearElement) -> str:
    """What the force of an element depends on."""
    prime = "" if element.quantity == "displacement" else "′"
    return _sum_of(model, element.factors, prime)


def _sum_of(model: Elements, factors: Mapping[str, float], prime: str) -> str:
    """A sum of displacements or velocities."""
    terms = []
    for name, factor in factors.items():
        place = _place(model, name, prime)
        if place:
            size = _times(number_of("", abs(factor)))
            terms.append(f"{'+' if factor > 0.0 else '−'} {size}{place}")
    return " ".join(terms).removeprefix("+ ").replace("− ", "−", not terms[0].startswith("+"))


def _nonlinear(symbol: str, element: NonlinearElement, naming: Naming) -> str:
    """The force of an element over what it depends on, u."""
    if not isinstance(element, CubicSpring | Friction):
        points = (f"({number_of('', x)}, {number_of('', f)})" for x, f in element.corners)
        return f"{symbol}(u) straight from point to point: {', '.join(points)}"

    def value(key: str) -> str:
        return naming(f"{symbol}.{key}", getattr(element, key))

    if isinstance(element, CubicSpring):
        linear = f"{_times(value('k1'))}u + " if element.k1 else ""
        return f"{symbol}(u) = {linear}{_times(value('k3'))}u³".replace("+ −", "− ")
    slip = f"u − {value('speed')}".replace("− −", "+ ") if element.speed else "u"
    slip = f"({slip})" if element.speed else slip
    if element.static is None:
        return f"{symbol}(u) = {_times(value('force'))}min(max({slip}/{value('velocity')}, −1), 1)"
    return (
        f"{symbol}(u) = {_times(value('static'))}{slip}/{value('velocity')} up to that speed, then "
        f"falling to {value('force')} at the speed {value('stribeck')}"
    )


def _forces(model: LumpedSystem, name: str, naming: Naming) -> str:
    terms: list[str] = []
    for i, force in enumerate(model.forces, start=1):
        if force.on == name:
            terms += drive_terms(force, i, naming)
        if force.on == name and force.constant:
            terms.append(naming(subscripted(f"G{i}"), force.constant))
    return " + ".join(terms).replace("+ −", "− ") or "0"


def drive_terms(force: Force, number: int, naming: Naming) -> list[str]:
    """What a force is the sum of, but for its constant part. number : of the force, from 1 on."""
    return _wave_terms(force, subscripted(f"P{number}"), subscripted(f"φ{number}"), naming)


def _wave_terms(drive: Force | MovingBase, P: str, φ: str, naming: Naming) -> list[str]:
    """The terms of a drive whose amplitude and phase have these symbols."""

    def wave(shape: str, order: int, amplitude: float, phase: float, names: tuple[str, str]) -> str:
        turn = f"{order if order > 1 else ''}ωt"
        if phase:
            turn = f"({turn} + {naming(names[1], phase)})".replace("+ −", "− ")
        return f"{_times(naming(names[0], amplitude))}{shape}{'' if phase else ' '}{turn}"

    terms = []
    if drive.amplitude:
        terms.append(wave(drive.waveform or "sin", 1, drive.amplitude, drive.phase or 0.0, (P, φ)))
    for n, amplitude, phase in drive.harmonics:
        terms.append(wave("sin", n, amplitude, phase, (f"{P}.{n}", f"{φ}.{n}")))
    return terms


def _law(model: LumpedSystem, gap: Gap, naming: Naming) -> str:
    """The force of a clearance's stops over the displacement u in it."""
    terms: list[str] = []
    clearance = next(c for c in model.second_order().clearances if c.name == gap.name)
    turned = gap.between is not None and gap.between[0] == GROUND
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
    return {"1": "", "−1": "−"}.get(value, f"{value} ")
