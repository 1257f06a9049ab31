"""Any system of masses, springs, dampers, clearances, forces and a moving ground: ``format = 2``.

All numbers are in the file's own consistent units. The matrices of ``second_order`` are sums over
the elements, each by what it joins, so the paper's two masses are one case of the rule.

Elements that make no mechanical system with a steady response to its drive are refused. Each
refusal says which element, and what to do.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import chain, pairwise
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import MISSING, InputError
from designer.base.schema import GREATEST, SMALLEST, one_of
from designer.dynamics.drive_shape import SINE
from designer.laws.element_keys import GROUND, check_joined, check_size, refuse
from designer.laws.force_law import ForceLaw
from designer.laws.law_elements import KINDS, NonlinearElement
from designer.model.clearance import Clearance, combined
from designer.model.lumped_elements import Elements, Force, Gap, MovingBase, joined_by, turned
from designer.model.matrices import Matrices
from designer.model.mechanics import HarmonicForce, SecondOrderSystem, reaches_ground

RESERVED = (GROUND, "base")
"""Names that mean something else."""
MOST_MASSES = 12
"""Beyond it nothing was tried."""
DRIFTS = (
    ": nothing holds the place of a mass inside its gap, in a circuit no more than in the model; "
    "a soft spring, of a hundredth of the stops' stiffness, changes little"
)
UNDAMPED = 1e-12
"""Least damping ratio of a mode: below it no steady response is reached."""
ROUNDED = 1e-12
"""Of the steepest slope: an eigenvalue of a matrix of slopes that small may be 0."""


def check(system: Elements) -> None:
    """Refuse elements that do not make such a system.

    Raises
    ------
    InputError : the first thing that is wrong; its field is that of the model file.
    """
    if not system.masses:
        refuse("mass", MISSING, "at least one table [[mass]]")
    if len(system.masses) > MOST_MASSES:
        refuse("mass", len(system.masses), f"at most {MOST_MASSES} masses")
    _check_names(system)
    if system.matrices is not None:
        _check_matrices(system, system.matrices)
    for gap in system.gaps:
        _check_gap(gap)
    for law in system.nonlinear.values():
        law.check()
    for force in system.forces:
        _check_waves(force, f"force on {force.on}")
    if system.base is not None:
        _check_waves(system.base, "base")
    _check_grounded(system)
    _check_driven(system)


def _check_matrices(system: Elements, matrices: Matrices) -> None:
    """Matrices stand in the place of springs and dampers, and hold every mass as these do."""
    for key, elements in (("spring", system.springs), ("damper", system.dampers)):
        if elements:
            expected = "none beside [matrices], which has them; or no [matrices]"
            refuse(key, f"{len(elements)} tables [[{key}]]", expected)
    for key in ("mass", "stiffness", "damping"):
        for value in chain.from_iterable(getattr(matrices, key)):
            check_size(f"matrices.{key}", value, "numbers")
    matrices.check()
    if not system.nonlinear:  # what laws hold is known where they are
        values = np.linalg.eigvalsh(matrices.stiffness_matrix)
        if not values[0] > ROUNDED * np.abs(values).max():
            expected = "a positive definite matrix: it holds every mass"
            refuse("matrices.stiffness", "a motion that nothing holds", expected)


def _check_names(system: Elements) -> None:
    """Each name once, and only names that there are."""
    laws = [law.name for law in system.laws]
    names = [*system.names, *(gap.name for gap in system.gaps), *laws]
    for name, count in Counter(names).items():
        field = "law" if name in laws else "mass" if name in system.names else "clearance"
        if count > 1:
            refuse(f"{field}.name", name, "a name that no other mass, clearance or law has")
        if name in RESERVED:
            refuse(f"{field}.name", name, f"a name other than {', '.join(RESERVED)}")
    nets = Counter(gap.name.casefold().removesuffix("_out") for gap in system.gaps)
    for gap in system.gaps:  # nets of the circuit bear them, and SPICE knows no capitals
        if nets[gap.name.casefold().removesuffix("_out")] > 1:
            expected = "a name that differs from the others in more than capitals or an _out"
            refuse("clearance.name", gap.name, expected)
    for key, bodies in _joints(system):
        for name in bodies:
            if name not in (*system.names, GROUND):
                refuse(key, name, one_of(name, (*system.names, GROUND)))
    for force in system.forces:
        if force.on not in system.names:
            refuse("force.on", force.on, one_of(force.on, system.names))


def _joints(system: Elements) -> Iterable[tuple[str, tuple[str, ...]]]:
    """(key of the model file, bodies) of everything that joins bodies."""
    yield from (("spring.between", spring.between) for spring in system.springs)
    yield from (("damper.between", damper.between) for damper in system.dampers)
    for gap in system.gaps:
        yield ("clearance.of" if gap.between is None else "clearance.between"), joined_by(gap)
    for law in system.nonlinear.values():
        yield f"{law.TABLE}.{'of' if law.between is None else 'between'}", joined_by(law)
    if system.matrices is not None:
        yield from (("matrices", pair) for pair in system.matrices.coupled)


def _check_gap(gap: Gap) -> None:
    field = f"clearance {gap.name}"
    check_joined(field, gap.between, gap.of)
    if gap.upper is None and gap.lower is None:
        refuse(f"{field}.upper", MISSING, "a gap to an upper or a lower stop, or both")
    if gap.upper is not None and gap.lower is not None and gap.upper + gap.lower <= 0.0:
        text = f"{gap.upper:g}, with lower = {gap.lower:g}"
        more = "two stops that are both in contact at rest are two clearances, one for each"
        refuse(f"{field}.upper", text, f"upper + lower > 0; {more}")
    if gap.preload_over is not None and not gap.preload:
        refuse(f"{field}.preload_over", gap.preload_over, "none without a preload, which rises")
    _check_stiffness(gap, field)
    if gap.restitution is not None:
        _check_restitution(gap, f"{field}.restitution")


def _check_stiffness(gap: Gap, field: str) -> None:
    """What its stops are made of: stiffnesses, or a constant and a depth."""
    if gap.law == "hertz":
        for key in ("constant", "depth"):
            if getattr(gap, key) is None:
                refuse(f"{field}.{key}", MISSING, f'a {key} of the law "hertz"')
        for key in ("stiffness", "upper_stiffness", "lower_stiffness"):
            if getattr(gap, key) is not None:
                refuse(f"{field}.{key}", getattr(gap, key), 'none: the law "hertz" has a constant')
        return
    for key in ("constant", "depth"):
        if getattr(gap, key) is not None:
            refuse(f"{field}.{key}", getattr(gap, key), 'none without law = "hertz"')
    for side in ("upper", "lower"):
        stiffness = getattr(gap, f"{side}_stiffness")
        if getattr(gap, side) is None and stiffness is not None:
            refuse(f"{field}.{side}_stiffness", stiffness, f"none: there is no {side} stop")
        if getattr(gap, side) is not None and stiffness is None and gap.stiffness is None:
            refuse(f"{field}.stiffness", MISSING, f"a stiffness, or {side}_stiffness")


def _check_restitution(gap: Gap, field: str) -> None:
    """It decides the damper of the stops, so that there is one damper and one stiffness for it."""
    if gap.damping:
        refuse(field, gap.restitution, "none beside damping, which it decides")
    if gap.law == "hertz":
        refuse(field, gap.restitution, 'damping instead: with law = "hertz" no stiffness decides')
    upper, lower = gap.sides
    if upper and lower and upper.stiffness != lower.stiffness:
        expected = "stops of one stiffness, or a [[clearance]] for each: they have one damper"
        refuse(field, gap.restitution, expected)


def _check_waves(drive: Force | MovingBase, field: str) -> None:
    if (drive.waveform is None) != (drive.terms is None):
        key = "waveform" if drive.waveform is None else "terms"
        refuse(f"{field}.{key}", MISSING, "both waveform and terms, or neither")


def _check_grounded(system: Elements) -> None:
    """Springs hold every mass to ground, directly or through others."""
    sprung = {name for bodies in system.holding for name in bodies}
    for name in system.names:
        if name not in sprung:
            expected = f"a [[spring]] between {name} and another"
            if any(name in gap.factors for gap in system.gaps):
                expected += DRIFTS
            refuse("spring.between", f"no spring on {name}", expected)
    grounded = _reached({GROUND}, system.holding)
    floating = [name for name in system.names if name not in grounded]
    if floating:
        refuse(
            "spring.between",
            f"{', '.join(floating)} without a spring to ground",
            "a [[spring]] that holds this part: it floats",
        )


def _check_driven(system: Elements) -> None:
    """A drive that reaches every clearance."""
    driven = {force.on for force in system.forces if force.drives}
    if system.base is not None:
        driven |= set(system.names)  # the ground's inertia force is on every mass
    if not driven:
        refuse("force", MISSING, "a [[force]] with an amplitude, or a [base]: nothing moves")
    moving = [name for name, law in system.nonlinear.items() if _moves_with_ground(law)]
    if moving and system.base is not None and system.base.stops == "fixed":
        beside = f'beside [base] stops = "fixed" and {moving[0]}, which moves with the ground'
        if not system.base.is_sine:
            expected = f'"base", or a sine in phase {beside}'
            refuse("base.stops", '"fixed", with another phase or shape', expected)
        for gap in system.gaps:
            for key in ("damping", "restitution"):
                if getattr(gap, key) and GROUND in joined_by(gap):
                    refuse(f"clearance {gap.name}.{key}", getattr(gap, key), f"no {key} {beside}")
    joints = [between for _, between in _joints(system) if GROUND not in between]
    moved = _reached(driven, joints)
    for gap in system.gaps:
        if moved.isdisjoint(gap.factors):
            expected = "a force, a base motion or a spring that moves it: it can never be reached"
            key = "of" if gap.between is None else "between"
            refuse(f"clearance {gap.name}.{key}", f"{' and '.join(gap.factors)}, at rest", expected)


def _moves_with_ground(law: NonlinearElement) -> bool:
    return reaches_ground(factor for name, factor in law.factors.items() if name != GROUND)


def _reached(start: set[str], joints: Sequence[tuple[str, ...]]) -> set[str]:
    """What hangs together with ``start``."""
    reached = set(start)
    while True:
        more = {name for pair in joints if not reached.isdisjoint(pair) for name in pair} - reached
        if not more:
            return reached
        reached |= more


def check_bounded(stiffness: Array, damping: Array, laws: Sequence[ForceLaw]) -> None:
    """Refuse a system that far out nothing holds, or something drives.

    stiffness, damping : (n, n) of the springs and of the dampers. A matrix that a slope makes
    positive definite is so with every larger slope: the lower end of each law decides.

    Raises
    ------
    InputError : names the law with the lowest end.
    """
    for quantity, matrix in (("displacement", stiffness), ("velocity", damping)):
        own = [law for law in laws if law.quantity == quantity]
        if not own:
            continue
        outer = matrix + sum(min(law.ends) * np.outer(law.row, law.row) for law in own)
        values = np.linalg.eigvalsh(outer)
        steepest = max(abs(values).max(), *(abs(s) for law in own for s in law.slopes))
        holds = quantity == "displacement"
        if values[0] > ROUNDED * steepest or (not holds and values[0] >= -ROUNDED * steepest):
            continue
        lowest = min(own, key=lambda law: min(law.ends))
        text = f"slope {min(lowest.ends):.6g} beyond its points"
        if holds:
            expected = (
                "a slope there with which springs and laws hold every mass, stops left out: it "
                "would leave"
            )
        else:
            expected = "a slope there with which dampers and laws do not drive a motion for ever"
        refuse(f"law {lowest.name}", text, expected)


def check_damped(state_matrix: Array) -> None:
    """Refuse a system of which some free motion does not die out with all clearances open.

    state_matrix : (2n, 2n) of the open system.

    Raises
    ------
    InputError : a mode has no damping.
    """
    rates = np.linalg.eigvals(state_matrix)
    sizes = np.abs(rates)  # one that is lost in the rounding of a far larger one is 0
    slowest = rates[np.argmax(np.divide(rates.real, sizes, out=0.0 * sizes, where=sizes > 0.0))]
    if not -slowest.real > UNDAMPED * abs(slowest):
        text = f"none that slows the motion at {abs(slowest.imag):.4g} rad per unit of time"
        expected = "a [[damper]] for it: without one no steady response is reached"
        refuse("damper.between", text, expected)


LEAST: dict[str, dict[str, float]] = {
    "masses": {"mass": SMALLEST},
    "springs": {"stiffness": SMALLEST},
    "dampers": {"damping": SMALLEST},
    "gaps": {
        "upper": -GREATEST,
        "lower": -GREATEST,
        "stiffness": SMALLEST,
        "upper_stiffness": SMALLEST,
        "lower_stiffness": SMALLEST,
        "damping": 0.0,
        "preload": 0.0,
        "preload_over": SMALLEST,
        "restitution": SMALLEST,
    },
    "forces": {"amplitude": -GREATEST, "constant": -GREATEST, "phase": -GREATEST},
    "base": {"amplitude": SMALLEST, "phase": -GREATEST},
    **{kind.LIST: {key: n.least for key, n in kind.PARAMETERS.items()} for kind in KINDS},
}
"""The numbers of each list of elements that can be changed, and the least that each may be."""
MOST = {"restitution": 1.0}
"""The most that a number may be, where that is not ``GREATEST``."""
TABLES = {
    "masses": "mass",
    "springs": "spring",
    "dampers": "damper",
    "gaps": "clearance",
    "forces": "force",
    "base": "base",
    "matrices": "matrices",
    **{kind.LIST: kind.TABLE for kind in KINDS},
}
"""The table of a model file that has each list of elements."""
UNITS = {
    "mass": "kg",
    "stiffness": "N/m",
    "upper_stiffness": "N/m",
    "lower_stiffness": "N/m",
    "damping": "N s/m",
    "points": "N",
    "upper": "m",
    "lower": "m",
    "preload": "N",
    "preload_over": "m",
    "constant": "N",
    "phase": "rad",
}
"""SI unit of each of these numbers; of an amplitude see ``LumpedSystem.units``, of a law's numbers
``LawNumber``."""
_LAWS = {kind.LIST: kind.PARAMETERS for kind in KINDS}
_SOLE = ("base", "matrices")
"""Fields of one element."""
NEAREST = 1e-6
"""Of the distance of two points of a law: how near a sweep takes one to the other."""
Way = tuple[str | int, ...]
"""Fields and indices from an element on to one of its numbers."""

_MAY_BE_ZERO = ("damping", "preload", "amplitude", "constant", "phase")


def _in_file(way: Way) -> Way:
    """The same in the tables of a model file, where the points of a law are a list."""
    return tuple(step for step in way if step != "values")


def _step(found: Any, step: str | int) -> Any:
    return getattr(found, step) if isinstance(step, str) else found[step]


def _changed(found: Any, way: Way, value: float) -> Any:
    """An element, or a part of one, with another number at the end of the way."""
    if not way:
        return value
    step, *rest = way
    inner = _changed(_step(found, step), tuple(rest), value)
    if isinstance(step, str):
        return replace(found, **{step: inner})
    return (*found[:step], inner, *found[step + 1 :])


@dataclass(frozen=True)
class LumpedSystem(Elements):
    """A mechanical system of any elements.

    Raises
    ------
    InputError : the elements do not make a system that can be computed.
    """

    b: float = 1.0
    """Factor on every gap and constant force; a generator's amplitude by 1/b as large has the same
    effect."""

    def __post_init__(self) -> None:
        check(self)
        self._check_sizes()
        system = self.second_order()
        check_bounded(self.stiffness_matrix, self.damping_matrix, system.laws)
        check_damped(system.spanning_state_matrix())

    def _check_sizes(self) -> None:
        for name, way in self.places.items():
            texts = (f".{step}" if isinstance(step, str) else f"[{step + 1}]" for step in way)
            check_size("".join(texts).removeprefix("."), self.parameter(name))

    def second_order(self) -> SecondOrderSystem:
        """The equations of motion."""
        return self._second_order

    @cached_property
    def _second_order(self) -> SecondOrderSystem:
        n = len(self.masses)
        constant, waves = np.zeros(n), dict[int, Array]()
        for each in self.forces:
            place = self.names.index(each.on)
            constant[place] += self.b * each.constant
            for order, size, phase in each.waves:
                wave = waves.setdefault(order, np.zeros((2, n)))
                wave[:, place] += size * turned(phase)
        force, quadrature = waves.pop(1, np.zeros((2, n)))
        damping, stiffness = self.damping_matrix, self.stiffness_matrix
        laws = self._force_laws()
        for law in laws:
            matrix = stiffness if law.quantity == "displacement" else damping
            matrix += law.slope * np.outer(law.row, law.row)
            constant -= law.offset * np.array(law.row)
        system = SecondOrderSystem(
            mass=np.array([mass.mass for mass in self.masses]),
            damping=damping,
            stiffness=stiffness,
            force=force,
            clearances=tuple(self._clearance(gap) for gap in self.gaps),
            constant=constant,
            base=0.0 if self.base is None else self.base.displacement,
            base_acceleration=0.0 if self.base is None else self.base.acceleration,
            base_shape=SINE if self.base is None else self.base.shape,
            fixed_stops=self.base is not None and self.base.stops == "fixed",
            names=self.names,
            quadrature=quadrature,
            harmonics=tuple(HarmonicForce(k, *waves[k]) for k in sorted(waves)),
            laws=laws,
        )
        if np.count_nonzero(self.mass_matrix) == n:
            return system
        return system.with_couplings(self.mass_matrix)

    def _force_laws(self) -> tuple[ForceLaw, ...]:
        """Of the elements whose force is not linear."""
        laws = [
            ForceLaw(
                name,
                tuple(float(each) for each in self.row_of(element.factors)),
                element.quantity,
                element.corners,
                curved=element.curve is not None,
            )
            for name, element in self.nonlinear.items()
        ]
        return tuple(law.scaled(self.b) for law in laws)

    def _clearance(self, gap: Gap) -> Clearance:
        """With ground first it is the same gap seen from the mass, its sides changed."""
        upper, lower = gap.sides
        damping = self.stop_damping(gap)
        if gap.between is None:
            row = self.row_of(gap.factors)
            mass, place, combination = combined(row)
        else:
            first, other = gap.between
            if first == GROUND:
                first, other, upper, lower = other, first, lower, upper
            place = None if other == GROUND else self.names.index(other)
            mass, combination = self.names.index(first), ()
        clearance = Clearance(gap.name, mass, place, upper, lower, damping, combination=combination)
        return clearance.scaled(self.b)

    def stop_damping(self, gap: Gap) -> float:
        """Of the stops of a clearance: as stated, or what makes its restitution.

        A contact of the bodies with such a stop alone lasts half a period of their motion on its
        spring, which leaves exp(-π ζ/√(1 - ζ²)) of the speed. The mass that moves on that spring
        is 1/(r M⁻¹ rᵀ), r the factors of the displacements in the clearance and M the mass matrix.
        """
        if gap.restitution is None:
            return gap.damping
        loss = -math.log(gap.restitution)
        ratio = loss / math.hypot(math.pi, loss)
        row = self.row_of(gap.factors)
        inverse = float(row @ np.linalg.solve(self.mass_matrix, row))
        stiffness = next(stop.stiffness for stop in gap.sides if stop is not None)
        return 2.0 * ratio * math.sqrt(stiffness / inverse)

    @cached_property
    def parameters(self) -> Mapping[str, tuple[float, float]]:
        """``b``, and each number of an element as NAME.key: hammer.mass, hammer-casing.stiffness,
        A.upper, hammer.amplitude, base.amplitude. Of a law's points x1, f1, x2, …; of matrices
        entries, stiffness.tip.middle."""
        ends = {name: self._domain(name) for name in ("b", *self._places)}
        for law in self.laws:
            for i, ((x0, _), (x1, _)) in enumerate(pairwise(law.corners), start=1):
                lower, upper, near = f"{law.name}.x{i}", f"{law.name}.x{i + 1}", NEAREST * (x1 - x0)
                ends[lower] = ends[lower][0], x1 - near
                ends[upper] = x0 + near, GREATEST
        return ends

    def _domain(self, name: str) -> tuple[float, float]:
        """What a parameter may be, whatever the others are."""
        if name == "b":
            return SMALLEST, GREATEST
        group, _, (key, *indices) = self._places[name]
        if group == "matrices" and indices[0] == indices[1]:
            # Laws may hold what the stiffness matrix does not.
            positive = key == "mass" or (key == "stiffness" and not self.nonlinear)
            return SMALLEST if positive else -GREATEST, GREATEST
        return LEAST.get(group, {}).get(str(key), -GREATEST), MOST.get(str(key), GREATEST)

    @cached_property
    def units(self) -> Mapping[str, str]:
        """SI unit of each of ``parameters`` that has one; an acceleration of the ground may be in
        g."""
        amplitudes = {"forces": "N", "base": "m" if self.base is None else self.base.unit}

        def unit(group: str, index: int, way: Way) -> str:
            key = str(way[0])
            if group == "laws" and way[-1] == 0:
                return {"displacement": "m", "velocity": "m/s"}[self.laws[index].quantity]
            if key in _LAWS.get(group, {}):
                return _LAWS[group][key].unit
            return amplitudes[group] if key == "amplitude" else UNITS.get(key, "")

        found = {name: unit(*place) for name, place in self._places.items()}
        return {name: text for name, text in found.items() if text}

    @property
    def listed(self) -> frozenset[str]:
        """Points of laws and entries of matrices."""
        return frozenset(name for name, (_, _, way) in self._places.items() if len(way) > 1)

    @property
    def idle(self) -> frozenset[str]:
        """A factor of 1; dampers and forces of 0; what is ``listed``."""

        def is_idle(name: str, group: str, way: Way) -> bool:
            key = str(way[0])
            own = _LAWS.get(group, {}).get(key)
            may_be = key in _MAY_BE_ZERO if own is None else own.idle_at_zero
            return may_be and self.parameter(name) == 0.0

        places = self._places.items()
        idle = {name for name, (group, _, way) in places if is_idle(name, group, way)}
        return self.listed | idle | ({"b"} if self.b == 1.0 else set())

    @cached_property
    def _places(self) -> dict[str, tuple[str, int, Way]]:
        """The list, the index in it and the way on to each parameter but ``b``."""
        named: dict[str, list[str]] = {
            "masses": list(self.names) if self.matrices is None else [],
            "springs": ["-".join(spring.between) for spring in self.springs],
            "dampers": ["-".join(damper.between) for damper in self.dampers],
            "gaps": [gap.name for gap in self.gaps],
            "forces": [force.on for force in self.forces],
            "base": ["base"] if self.base is not None else [],
            **{k.LIST: [e.bodies for e in self._elements(k.LIST)] for k in KINDS},
        }
        places: dict[str, tuple[str, int, Way]] = {
            f"{name}.{key}": (group, index, (key,))
            for group, names in named.items()
            for index, name in enumerate(names)
            for key in LEAST[group]
            if getattr(self._elements(group)[index], key) is not None
        }
        for gap in (gap for gap in self.gaps if gap.restitution is not None):  # decides the damping
            places.pop(f"{gap.name}.damping", None)
        for index, law in enumerate(self.laws):
            for i in range(len(law.corners)):
                for k, letter in enumerate("xf"):
                    way = "points", "values", i, k
                    places[f"{law.name}.{letter}{i + 1}"] = "laws", index, way
        if self.matrices is not None:
            for key, name, other, indices in self.matrices.entries:
                places[f"{key}.{name}.{other}"] = "matrices", 0, (key, *indices)
        return places

    @property
    def places(self) -> Mapping[str, Way]:
        """Where in a model file each parameter but ``b`` stands: table, index in a list of tables,
        key, indices."""
        return {
            name: (TABLES[group], *(() if group in _SOLE else (index,)), *_in_file(way))
            for name, (group, index, way) in self._places.items()
        }

    def _elements(self, group: str) -> Sequence[Any]:
        return (getattr(self, group),) if group in _SOLE else tuple(getattr(self, group))

    def parameter(self, name: str) -> float:
        """The value of one of ``parameters``."""
        if name == "b":
            return self.b
        group, index, way = self._places[name]
        found = self._elements(group)[index]
        for step in way:
            found = _step(found, step)
        return float(found)

    def changed(self, changes: Mapping[str, float]) -> LumpedSystem:
        """The model with other values of some ``parameters``.

        Raises
        ------
        InputError : a value outside its domain, or a system that cannot be.
        """
        new: dict[str, Any] = {}
        for name, value in changes.items():
            low, high = self._domain(name)
            if not low <= value <= high:
                expected = "a number" + ("" if low < 0.0 else " >= 0" if low == 0.0 else " > 0")
                expected += f", at most {high:g}" if high < GREATEST else ""
                raise InputError(None, name, value, expected)
            if name == "b":
                new["b"] = value
                continue
            group, index, way = self._places[name]
            elements = list(new.get(group, self._elements(group)))
            elements[index] = _changed(elements[index], way, value)
            if group == "matrices" and way[0] != "damping":
                elements[index] = _changed(elements[index], (way[0], *way[:0:-1]), value)
            new[group] = tuple(elements)
        for sole in new.keys() & set(_SOLE):
            (new[sole],) = new[sole]
        if "matrices" in new:
            rows = new["matrices"].mass
            new["masses"] = tuple(replace(m, mass=rows[i][i]) for i, m in enumerate(self.masses))
        return replace(self, **new) if new else self

    def as_dict(self) -> dict[str, object]:
        """The elements by their lists; the ground's unit where it is not that of a displacement.

        Lists and keys of later versions are there where a file has them, so that earlier files keep
        their hashes.
        """
        out = asdict(self)
        for gap in out["gaps"]:
            for key in ("preload_over", "restitution", "of"):
                if gap[key] is None:
                    del gap[key]
        bases = [] if self.base is None else [out["base"]]
        for drive in (*out["forces"], *bases):
            for key in ("phase", "waveform", "terms", "harmonics"):
                if not drive[key]:
                    del drive[key]
        if self.base is not None and self.base.unit == "m":
            del out["base"]["unit"]
        for later in (*(kind.LIST for kind in KINDS), "matrices"):
            if not out[later]:
                del out[later]
        return out

    def at(self, b: float) -> LumpedSystem:
        """The model with every gap and constant force b times as large as in the file."""
        return replace(self, b=b)
