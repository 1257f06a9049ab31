"""The elements of a mechanical system, each a table of a model file of ``format = 2``.

All numbers are in the file's own consistent units; texts with units become SI.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count, islice
from typing import Annotated, Literal

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.schema import Accepts, FileTable, choice, number, physical, whole_number
from designer.base.units import ACCELERATIONS, has_unit, parse_angle, parse_quantity
from designer.dynamics.drive_shape import SINE, Shape
from designer.laws.element_keys import GROUND, NAME, combination, signed, two_bodies
from designer.laws.hertz_law import HertzPieces, hertz_pieces
from designer.laws.law_elements import KINDS, CubicSpring, Friction, Law, NonlinearElement
from designer.model.clearance import Side
from designer.model.matrices import Matrices

Waveform = Literal["square", "triangle", "sawtooth"]


def series(waveform: Waveform, terms: int) -> Iterator[tuple[int, float]]:
    """(n, amplitude of sin nθ) of the first ``terms`` harmonics that the waveform has."""
    return islice(_terms(waveform), terms)


def _terms(waveform: Waveform) -> Iterator[tuple[int, float]]:
    if waveform == "sawtooth":
        yield from ((n, (-1.0) ** (n + 1) * 2.0 / (math.pi * n)) for n in count(1))
    for n in count(1, 2):
        if waveform == "square":
            yield n, 4.0 / (math.pi * n)
        else:
            yield n, (-1.0) ** (n // 2) * 8.0 / (math.pi * n) ** 2


@dataclass(frozen=True)
class Mass(FileTable):
    """A mass; it moves along one line."""

    name: Annotated[str, NAME]
    """Its name."""
    mass: Annotated[float, physical("kg")]
    """Its mass."""


@dataclass(frozen=True)
class Spring(FileTable):
    """A linear spring."""

    between: Annotated[tuple[str, str], two_bodies()]
    """What it joins."""
    stiffness: Annotated[float, physical("N/m")]
    """Its stiffness."""


@dataclass(frozen=True)
class Damper(FileTable):
    """A linear damper."""

    between: Annotated[tuple[str, str], two_bodies()]
    """What it joins."""
    damping: Annotated[float, physical("N s/m")]
    """Its damping."""


@dataclass(frozen=True)
class Gap(FileTable):
    """A clearance: the gap that a mass has to a stop on one side or both."""

    name: Annotated[str, NAME]
    """Its name."""
    between: Annotated[tuple[str, str] | None, two_bodies()] = None
    """What moves in it, and what carries the stops."""
    upper: Annotated[float | None, signed("m", "a length, negative for a preloaded stop,")] = None
    """Gap to the upper stop; None where there is none."""
    lower: Annotated[float | None, signed("m", "a length, negative for a preloaded stop,")] = None
    """Gap to the lower stop; None where there is none."""
    stiffness: Annotated[float | None, physical("N/m")] = None
    """Stiffness of the stops; None where each side has its own, or a law."""
    upper_stiffness: Annotated[float | None, physical("N/m")] = None
    """Stiffness of the upper stop, where it has its own."""
    lower_stiffness: Annotated[float | None, physical("N/m")] = None
    """Stiffness of the lower stop, where it has its own."""
    damping: Annotated[float, physical("N s/m", zero=True)] = 0.0
    """Of the stops, in contact only."""
    preload: Annotated[float, physical("N", zero=True)] = 0.0
    """Force with which the stops push as soon as they are touched: that of a spring that is held
    short."""
    preload_over: Annotated[float | None, physical("m")] = None
    """Depth over which that force rises from 0; None: it is there at once."""
    restitution: Annotated[
        float | None, number("", "a number > 0, at most 1", lambda e: 0.0 < e <= 1.0)
    ] = None
    """Speed after a contact over that before it, in the place of ``damping``."""
    law: Annotated[Literal["linear", "hertz"], choice("linear", "hertz")] = "linear"
    """Force of a stop over its depth: straight, or constant · depth^1.5."""
    constant: Annotated[float | None, number("", "a number > 0", lambda k: k > 0.0)] = None
    """Of the Hertzian law: force over depth^1.5, in the file's units."""
    depth: Annotated[float | None, physical("m")] = None
    """Down to which the Hertzian law holds."""
    pieces: Annotated[int, whole_number("a whole number from 1 to 12", 1, 12)] = 4
    """Straight pieces that stand for the Hertzian law."""
    of: Annotated[tuple[tuple[str, float], ...] | None, combination()] = None
    """In the place of ``between``: what moves in it is the sum of the masses' displacements times
    these factors, such as a rocking corner or a point between two nodes."""

    @property
    def factors(self) -> Mapping[str, float]:
        """What moves in it is the sum of, ground left out of it or not."""
        if self.between is not None:
            first, second = self.between
            return {first: 1.0, second: -1.0}
        return dict(self.of or ())

    @property
    def hertz(self) -> HertzPieces | None:
        """The pieces of a Hertzian stop; None of a straight one."""
        if self.constant is None or self.depth is None:
            return None
        return hertz_pieces(self.constant, self.depth, self.pieces)

    @property
    def sides(self) -> tuple[Side | None, Side | None]:
        """The upper and the lower stop; None where there is none."""
        hertz = self.hertz

        def side(gap: float | None, side_stiffness: float | None) -> Side | None:
            stiffness = self.stiffness if side_stiffness is None else side_stiffness
            if gap is None:
                return None
            more = self.preload, self.preload_over or 0.0
            if hertz is not None:
                return Side(gap, hertz.stiffness, hertz.further, *more)
            assert stiffness is not None
            return Side(gap, stiffness, (), *more)

        return side(self.upper, self.upper_stiffness), side(self.lower, self.lower_stiffness)


Harmonics = tuple[tuple[int, float, float], ...]
"""(n, amplitude, phase [rad]) of each."""
MOST_HARMONICS = 32
"""Of one force."""
HIGHEST = 64
"""Harmonic."""


def _angle() -> Accepts:
    expected = 'an angle in rad, or text such as "90 deg" or "1.57 rad"'

    def check(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError
        return parse_angle(value)

    return Accepts(expected, check, json={"type": ["number", "string"]})


def _harmonics() -> Accepts:
    expected = (
        f"a list of [n, amplitude, phase], n different whole numbers from 2 to {HIGHEST}, at most "
        f'{MOST_HARMONICS} of them, such as [[2, 1.5, 0.0], [3, "2 N", "90 deg"]]'
    )
    angle, force = _angle(), signed("N", "a force")

    def check(value: object) -> Harmonics:
        if not isinstance(value, list) or not 1 <= len(value) <= MOST_HARMONICS:
            raise ValueError
        if not all(isinstance(each, list) and len(each) == 3 for each in value):
            raise ValueError
        orders = [n for n, _, _ in value]
        if not all(type(n) is int and 2 <= n <= HIGHEST for n in orders):
            raise ValueError
        if len(set(orders)) < len(orders):
            raise ValueError("one n twice")
        return tuple((n, force.check(size), angle.check(phase)) for n, size, phase in value)

    each = {"type": "array", "items": {"type": ["number", "string"]}, "minItems": 3, "maxItems": 3}
    json = {"type": "array", "items": each, "minItems": 1, "maxItems": MOST_HARMONICS}
    return Accepts(expected, check, json=json)


OfPhase = Annotated[float | None, _angle()]
OfWaveform = Annotated[Waveform | None, choice("square", "triangle", "sawtooth")]
OfTerms = Annotated[
    int | None, whole_number(f"a whole number from 1 to {MOST_HARMONICS}", 1, MOST_HARMONICS)
]
"""Keys that a force and the ground's motion have alike."""


@dataclass(frozen=True)
class Force(FileTable):
    """A force on a mass: amplitude · sin(ωt + phase) + constant, and harmonics of it."""

    on: Annotated[str, NAME]
    """The mass."""
    amplitude: Annotated[float, signed("N", "a force")] = 0.0
    """Amplitude; negative: in antiphase."""
    constant: Annotated[float, signed("N", "a force")] = 0.0
    """Constant part, such as a weight or a preload."""
    phase: OfPhase = None
    """Of the force, before the drive's sine; None: in phase."""
    waveform: OfWaveform = None
    """Shape with the peak ``amplitude``, in the place of the sine."""
    terms: OfTerms = None
    """How many harmonics that the waveform has are kept, the first among them."""
    harmonics: Annotated[Harmonics, _harmonics()] = ()
    """Forces amplitude · sin(nωt + phase) beside it."""

    @property
    def waves(self) -> Iterator[tuple[int, float, float]]:
        """(n, amplitude, phase) of all that it is the sum of: amplitude · sin(nωt + phase)."""
        return waves_of(self)

    @property
    def drives(self) -> bool:
        """Whether it changes with time."""
        return any(True for _ in self.waves)


def waves_of(element: Force | MovingBase) -> Iterator[tuple[int, float, float]]:
    """(n, amplitude, phase) of what a force or a motion of the ground is the sum of:
    amplitude · sin(nωt + phase)."""
    phase = element.phase or 0.0
    shape = [(1, 1.0)] if element.waveform is None else series(element.waveform, element.terms or 1)
    sizes = [(n, element.amplitude * size, n * phase) for n, size in shape]
    yield from (wave for wave in (*sizes, *element.harmonics) if wave[1])


STRAIGHT = 1e-12
"""A sine or a cosine that small is 0."""


def turned(phase: float) -> Array:
    """(2,) cosine and sine of an angle; 0 where that is what was meant, as of the sine of π."""
    parts = np.array([math.cos(phase), math.sin(phase)])
    parts[np.abs(parts) < STRAIGHT] = 0.0
    return parts


BaseStops = Literal["base", "fixed"]


def _base_unit(value: object) -> str:
    """Unit of a length or an acceleration; a number has that of a length."""
    if not isinstance(value, str):
        return "m"
    return next((u for u in ACCELERATIONS if has_unit(value, u)), "m")


def _base_amplitude() -> Accepts:
    """(amplitude, unit) of ``MovingBase``; a number is a displacement."""
    expected = 'a displacement > 0 in m, or an acceleration such as "0.5 g" or "5 m/s²"'

    def check(value: object) -> tuple[float, str]:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError
        unit = _base_unit(value)
        amplitude = parse_quantity(value, unit)
        if not amplitude > 0.0:
            raise ValueError
        return amplitude, unit

    return Accepts(expected, check, json={"type": ["number", "string"]})


BaseHarmonics = tuple[tuple[int, float, str, float], ...]
"""(n, amplitude, its unit or "" for that of the first, phase [rad]) of each."""


def _base_harmonics() -> Accepts:
    harmonics = _harmonics()
    expected = harmonics.expected.replace("2 N", "0.1 mm")

    def check(value: object) -> BaseHarmonics:
        if not isinstance(value, list):
            raise ValueError
        units = [""] * len(value)
        plain: list[object] = []
        for place, each in enumerate(value):
            if isinstance(each, list) and len(each) == 3 and isinstance(each[1], str):
                units[place] = _base_unit(each[1])
                each = [each[0], parse_quantity(each[1], units[place]), each[2]]
            plain.append(each)
        checked: Harmonics = harmonics.check(plain)
        return tuple(
            (n, size, unit, phase) for (n, size, phase), unit in zip(checked, units, strict=True)
        )

    return Accepts(expected, check, json=harmonics.json)


@dataclass(frozen=True)
class MovingBase:
    """The ground moves as y = Y sin ωt, or as a sum of such waves."""

    amplitude: float
    """Y, or the amplitude of the acceleration, Y ω²."""
    stops: BaseStops = "base"
    """Whether the stops between a mass and ground move with it or stay."""
    unit: str = "m"
    """Unit of ``amplitude``: one of ``ACCELERATIONS``, or that of a displacement."""
    phase: float | None = None
    """Of the motion, before the drive's sine; None: in phase."""
    waveform: Waveform | None = None
    """Shape with the peak ``amplitude``, in the place of the sine."""
    terms: int | None = None
    """How many harmonics that the waveform has are kept."""
    harmonics: Harmonics = ()
    """Waves amplitude · sin(nωt + phase) beside it, in the unit of ``amplitude``."""

    @property
    def shape(self) -> Shape:
        """What it is the sum of, over ``amplitude``."""
        waves = defaultdict[int, Array](lambda: np.zeros(2))
        for n, size, phase in waves_of(self):
            waves[n] += size / self.amplitude * turned(phase)
        return tuple((n, *waves[n].tolist()) for n in sorted(waves))

    @property
    def is_sine(self) -> bool:
        """Whether it is the drive's sine."""
        return self.shape == SINE

    @property
    def displacement(self) -> float:
        """Y where that is given, else 0."""
        return 0.0 if self.unit in ACCELERATIONS else self.amplitude

    @property
    def acceleration(self) -> float:
        """Y ω² in m/s² where that is given, else 0."""
        return ACCELERATIONS.get(self.unit, 0.0) * self.amplitude


@dataclass(frozen=True)
class BaseTable(FileTable):
    """The ground moves as amplitude · sin ωt."""

    amplitude: Annotated[tuple[float, str], _base_amplitude()]
    """Amplitude of the displacement, or of the acceleration in g or m/s²; it is the same at every
    drive frequency."""
    stops: Annotated[BaseStops, choice("base", "fixed")] = "base"
    """Whether the stops between a mass and ground move with it or stay."""
    phase: OfPhase = None
    """Of the motion, before the drive's sine; None: in phase."""
    waveform: OfWaveform = None
    """Shape with the peak ``amplitude``, in the place of the sine."""
    terms: OfTerms = None
    """How many harmonics that the waveform has are kept, the first among them."""
    harmonics: Annotated[BaseHarmonics, _base_harmonics()] = ()
    """Waves amplitude · sin(nωt + phase) beside it: displacements where ``amplitude`` is one,
    accelerations where that is one; a number has the unit of ``amplitude``."""

    @property
    def motion(self) -> MovingBase:
        """The motion that it stands for.

        Raises
        ------
        InputError : a displacement beside an acceleration.
        """
        amplitude, unit = self.amplitude
        harmonics = []
        for n, size, own, phase in self.harmonics:
            if own and (own in ACCELERATIONS) != (unit in ACCELERATIONS):
                kind = "an acceleration" if unit in ACCELERATIONS else "a displacement"
                found = f"harmonic {n} in {own}"
                raise InputError(None, "base.harmonics", found, f"{kind}, as amplitude is")
            ratio = ACCELERATIONS.get(own, 1.0) / ACCELERATIONS.get(unit, 1.0) if own else 1.0
            harmonics.append((n, ratio * size, phase))
        more = self.phase, self.waveform, self.terms, tuple(harmonics)
        return MovingBase(amplitude, self.stops, unit, *more)


@dataclass(frozen=True)
class Elements:
    """What a system is made of."""

    masses: tuple[Mass, ...]
    springs: tuple[Spring, ...] = ()
    dampers: tuple[Damper, ...] = ()
    gaps: tuple[Gap, ...] = ()
    """The clearances, in the order in which n-p-q names them."""
    forces: tuple[Force, ...] = ()
    base: MovingBase | None = None
    """How the ground moves; None where it rests."""
    laws: tuple[Law, ...] = ()
    """The laws that are given point by point."""
    cubic_springs: tuple[CubicSpring, ...] = ()
    frictions: tuple[Friction, ...] = ()
    """Dry friction."""
    matrices: Matrices | None = None
    """The linear part, where it is given by matrices; ``masses`` then have the diagonal of the
    first, and there are no springs and no dampers."""

    @property
    def nonlinear(self) -> dict[str, NonlinearElement]:
        """All elements whose force is a law, by their names; a second one between the same bodies
        has a number."""
        found, met = dict[str, NonlinearElement](), Counter[str]()
        for kind in KINDS:
            for element in getattr(self, kind.LIST):
                name = element.law_name
                met[name] += 1
                found[name if met[name] == 1 else f"{name}{met[name]}"] = element
        return found

    @property
    def holding(self) -> tuple[tuple[str, ...], ...]:
        """What each element joins whose force depends on a displacement, clearances left out."""
        laws = [each for each in self.nonlinear.values() if each.quantity == "displacement"]
        return (*(spring.between for spring in self.shown_springs), *map(joined_by, laws))

    @property
    def shown_springs(self) -> tuple[Spring, ...]:
        """The springs, or those that make the stiffness matrix."""
        if self.matrices is None:
            return self.springs
        joints = self.matrices.joints(self.matrices.stiffness_matrix, GROUND)
        return tuple(Spring(between, stiffness) for between, stiffness in joints)

    @property
    def shown_dampers(self) -> tuple[Damper, ...]:
        """The dampers, or those that make the even part of the damping matrix."""
        if self.matrices is None:
            return self.dampers
        joints = self.matrices.joints(self.matrices.damping_matrix, GROUND)
        return tuple(Damper(between, damping) for between, damping in joints)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the masses."""
        return tuple(mass.name for mass in self.masses)

    @property
    def row(self) -> tuple[str, ...]:
        """Names of the masses from the ground on, by how many springs away from it they are."""
        reached, row = {GROUND}, list[str]()
        ends = [set(bodies) for bodies in self.holding]
        while len(row) < len(self.masses):
            near = {n for pair in ends if not reached.isdisjoint(pair) for n in pair} - reached
            row += [name for name in reversed(self.names) if name in near]
            reached |= near
        return tuple(row)

    def row_of(self, factors: Mapping[str, float]) -> Array:
        """(n,) coefficients of the masses' displacements in a sum of those of bodies."""
        row = np.zeros(len(self.masses))
        for name, factor in factors.items():
            if name != GROUND:
                row[self.names.index(name)] += factor
        return row

    @property
    def mass_matrix(self) -> Array:
        """(n, n) mass matrix."""
        if self.matrices is not None:
            return self.matrices.mass_matrix
        return np.diag([mass.mass for mass in self.masses])

    @property
    def stiffness_matrix(self) -> Array:
        """(n, n) of the springs."""
        if self.matrices is not None:
            return self.matrices.stiffness_matrix
        return self._matrix([(spring.between, spring.stiffness) for spring in self.springs])

    @property
    def damping_matrix(self) -> Array:
        """(n, n) of the dampers."""
        if self.matrices is not None:
            return self.matrices.damping_matrix
        return self._matrix([(damper.between, damper.damping) for damper in self.dampers])

    def _matrix(self, joints: Sequence[tuple[tuple[str, str], float]]) -> Array:
        """Each joint pulls on the difference of the two displacements between which it stands."""
        out = np.zeros((len(self.masses), len(self.masses)))
        for (first, second), value in joints:
            row = self.row_of({first: 1.0, second: -1.0})
            out += value * np.outer(row, row)
        return out


def joined_by(element: NonlinearElement | Gap) -> tuple[str, ...]:
    """The bodies that the force of an element joins; a combination of masses stands on ground."""
    names = tuple(element.factors)
    return names if element.between is not None else (*names, GROUND)


def words_of(element: NonlinearElement | Gap) -> str:
    """What an element is between, or of what combination."""
    if element.between is not None:
        return " to ".join(element.between)
    return " ".join(f"{factor:+g} {name}" for name, factor in element.factors.items())
