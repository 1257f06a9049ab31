"""Masses, dampers, springs and stops as a piecewise-linear system.

    M z'' + C z' + K z + Σ stops + Σ laws = force(ω) · sin ωt + constant

with any number of masses, clearances and force laws; Eq. (1)-(2) of the paper is the case of two
masses and one two-sided clearance. Where the ground moves, by y = Y sin ωt, z = x - y is the
displacement relative to it: the force is then that of the file and M Y ω² (every spring, damper and
law to ground stands on what moves). Y or the acceleration Y ω² is given. Where the stops stay, z is
the absolute displacement, and the force is that of the file and (K y + C y') of springs and dampers
to ground; a law to ground keeps displacements relative, and such stops watch z + y.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import accumulate
from typing import Protocol, Self

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.dynamics.drive_shape import SINE, Channel, Shape, channels
from designer.dynamics.piecewise_linear import (
    ForceCorner,
    Guard,
    Mode,
    ModeKey,
    PiecewiseLinearSystem,
)
from designer.laws.force_law import ForceLaw, Quantity
from designer.model.clearance import Clearance
from designer.model.dead_zones import dead_zones


@dataclass(frozen=True)
class HarmonicForce:
    """Forces at a multiple of the drive's frequency: sine · sin nωt + cosine · cos nωt."""

    order: int
    """n, from 2 on."""
    sine: Array
    """(masses,) amplitudes."""
    cosine: Array
    """(masses,) amplitudes."""


MOST_CHANNELS = 2
"""Of a generator."""
ROUNDING = 1e-12
"""Of the size of its terms: a sum below it is none."""


@dataclass(frozen=True)
class SecondOrderSystem:
    """Masses, dampers and springs with stops, driven by forces and by the ground."""

    mass: Array
    """(n,) masses."""
    damping: Array
    """(n, n) damping matrix, with every law on its piece at rest."""
    stiffness: Array
    """(n, n) stiffness matrix, with every law on its piece at rest."""
    force: Array
    """(n,) amplitude of the force on each mass."""
    clearances: tuple[Clearance, ...]
    """The clearances, in the order in which n-p-q names them."""
    constant: Array = field(default_factory=lambda: np.zeros(0))
    """(n,) constant force on each mass; zero where it is not given."""
    base: float = 0.0
    """Amplitude of the ground's displacement, where that is the same at every frequency."""
    base_acceleration: float = 0.0
    """Amplitude of the ground's acceleration, where that is the same at every frequency."""
    base_shape: Shape = SINE
    """What the ground's motion is the sum of, over that amplitude."""
    fixed_stops: bool = False
    """Whether the stops between a mass and ground stay where they are while the ground moves."""
    names: tuple[str, ...] = ()
    """Names of the masses; () where they have none."""
    quadrature: Array = field(default_factory=lambda: np.zeros(0))
    """(n,) amplitude of cos ωt in the force on each mass; zero where it is not given."""
    harmonics: tuple[HarmonicForce, ...] = ()
    """Forces at multiples of the drive's frequency, one for each."""
    laws: tuple[ForceLaw, ...] = ()
    """Further forces. What they are at rest is in the matrices and in ``constant``."""
    stated_frequency: float | None = None
    """``own_frequency`` where the matrices do not say it (``with_couplings``)."""

    def __post_init__(self) -> None:
        if not len(self.constant):
            object.__setattr__(self, "constant", np.zeros(self.size))
        if not len(self.quadrature):
            object.__setattr__(self, "quadrature", np.zeros(self.size))

    @property
    def size(self) -> int:
        """Number of masses."""
        return len(self.mass)

    def with_couplings(self, mass_matrix: Array) -> SecondOrderSystem:
        """The same motion as with this mass matrix (n, n), whose diagonal is ``mass``: every force
        acts on each mass as much as it does through the couplings. The matrices are no longer
        symmetric."""
        inverse = self.mass[:, None] * np.linalg.inv(mass_matrix)

        def through(forces: Array) -> Array:
            out, terms = inverse @ forces, np.abs(inverse) @ np.abs(forces)
            return np.where(np.abs(out) > ROUNDING * terms, out, 0.0)

        def push(element: Clearance | ForceLaw) -> tuple[float, ...]:
            return tuple(through(self.push(element)).tolist())

        return replace(
            self,
            damping=through(self.damping),
            stiffness=through(self.stiffness),
            force=through(self.force),
            quadrature=through(self.quadrature),
            constant=through(self.constant),
            harmonics=tuple(
                replace(wave, sine=through(wave.sine), cosine=through(wave.cosine))
                for wave in self.harmonics
            ),
            clearances=tuple(replace(stop, push=push(stop)) for stop in self.clearances),
            laws=tuple(replace(law, push=push(law)) for law in self.laws),
            stated_frequency=self.own_frequency,
        )

    def over_mass(self, forces: Array) -> Array:
        """(n,) or (n, k) accelerations that forces on the masses make."""
        return np.asarray((forces.T / self.mass).T)

    @property
    def own_frequency(self) -> float:
        """Of the first mass on its own springs, the others held, in rad per unit of time; of a law
        its mean slope counts."""
        if self.stated_frequency is not None:
            return self.stated_frequency
        return float(np.sqrt(self.spanning_stiffness[0, 0] / self.mass[0]))

    @property
    def spanning_stiffness(self) -> Array:
        """(n, n) stiffness matrix of a motion that spans the points of every law."""
        return self.stiffness + self._spanning("displacement")

    def _spanning(self, quantity: Quantity) -> Array:
        """(n, n) what the laws' mean slopes are more than those at rest."""
        more = np.zeros((self.size, self.size))
        for law in self.laws:
            if law.quantity == quantity:
                more += (law.mean_slope - law.slope) * np.outer(self.push(law), law.row)
        return more

    @property
    def driven_by_ground(self) -> bool:
        """Whether there is a motion of the ground."""
        return bool(self.base or self.base_acceleration)

    @cached_property
    def absolute(self) -> bool:
        """Whether displacements are absolute though the ground may move: its stops stay, and no
        law moves with it."""
        return self.fixed_stops and not any(reaches_ground(law.row) for law in self.laws)

    @property
    def ground_moves(self) -> bool:
        """Whether displacements are counted from a ground that moves."""
        return self.driven_by_ground and not self.absolute

    def ground(self, omega: float) -> float:
        """Amplitude of the ground's displacement at a drive frequency; of a motion that is no sine
        that of its first harmonic's unit (``ground_shape``)."""
        if not self.base_acceleration:
            return self.base
        return self.base + self.base_acceleration / (omega * omega)

    def ground_shape(self, omega: float) -> Shape:
        """The ground's displacement at a drive frequency."""
        return displacement_shape(self.base, self.base_acceleration, self.base_shape, omega)

    def channels(self, omega: float) -> tuple[Channel, ...] | None:
        """What a circuit's generator drives the masses with at a drive frequency, the ground's
        forces included, by its channels, one or two; None where it takes more. Their shapes, and
        their order, are the same at every frequency: first the one whose constant force would move
        the first clearance more, for that is where a generator's offset is set."""
        # A choice of parts asks for the same few frequencies hundreds of times.
        if omega not in self._known_channels:
            self._known_channels[omega] = self._ordered_channels(omega)
        return self._known_channels[omega]

    @cached_property
    def _known_channels(self) -> dict[float, tuple[Channel, ...] | None]:
        return {}

    def _ordered_channels(self, omega: float) -> tuple[Channel, ...] | None:
        groups = self._groups(omega)
        if len(groups) < 2 or (self.absolute and not self.orders and _parallel(groups)):
            if self.driven_by_sine:
                return (Channel(SINE, self.drive_waves(omega)[0].sine),)
            groups = [_parts(self.drive_waves(omega))]
        found: tuple[Channel, ...] = ()
        for group in groups:
            own = channels(group)
            if own is None:
                return None
            found += own
        if len(found) > MOST_CHANNELS:
            return None
        if len(found) == 1 or not self.dead_zones:
            return found
        row = np.linalg.lstsq(
            self.spanning_stiffness.T, self.displacement(self.dead_zones[0]), rcond=None
        )[0]
        moved = [abs(float(row @ each.force)) / float(np.abs(each.force).max()) for each in found]
        return found[::-1] if moved[1] > moved[0] * (1.0 + ROUNDING) else found

    def _groups(self, omega: float) -> list[dict[int, Array]]:
        """The forces in groups that change alike with the drive frequency, those of the file first;
        without those that are 0. Of each the ``_parts``."""
        own, powers = _parts(self._own_waves), dict[int, dict[int, Array]]()
        for power, n, wave in self._ground_waves(omega):
            group = powers.setdefault(power, {} if power else own)
            group[n] = group.get(n, np.zeros((2, self.size))) + wave
        return [
            group
            for group in (own, *(powers[power] for power in sorted(powers) if power))
            if any(wave.any() for wave in group.values())
        ]

    def _ground_waves(self, omega: float) -> Iterator[tuple[int, int, Array]]:
        """(power of the drive frequency, order, (2, n) amplitudes of sine and cosine) of the forces
        that the ground's motion makes."""
        if not self.driven_by_ground:
            return
        over = 0 if self.base else -2
        for n, sine, cosine in self.base_shape:
            acceleration = self.base * (n * omega) ** 2 + self.base_acceleration
            if not self.absolute:
                yield over + 2, n, np.outer(np.array([sine, cosine]) * acceleration, self.mass)
                continue
            displacement = acceleration / (n * omega) ** 2
            springs, dampers = self._ground_joints
            yield over, n, np.outer(np.array([sine, cosine]) * displacement, springs)
            rate = n * omega * displacement
            yield over + 1, n, np.outer(np.array([-cosine, sine]) * rate, dampers)

    @cached_property
    def _ground_joints(self) -> tuple[Array, Array]:
        """(n,) stiffness and damping from each mass to ground."""
        return (
            _without_rounding(self.stiffness.sum(axis=1), self.stiffness),
            _without_rounding(self.damping.sum(axis=1), self.damping),
        )

    @property
    def _own_waves(self) -> tuple[HarmonicForce, ...]:
        """Without the ground's."""
        return (HarmonicForce(1, self.force, self.quadrature), *self.harmonics)

    def ground_channel(self, omega: float) -> tuple[int, float] | None:
        """The channel that makes the ground's motion at a drive frequency, and the peak of the
        ground's acceleration; None where the ground rests, where both channels take part in its
        motion, and where forces take more than two."""
        if not self.ground_moves:
            return None
        ground = channels({n: wave for _, n, wave in self._ground_waves(omega)})
        every = self.channels(omega)
        if not ground or not every:
            return None
        peak = float(np.abs(ground[0].force[0]) / self.mass[0])
        wanted = np.abs(ground[0].force)
        for number, each in enumerate(every):
            near = np.allclose(np.abs(each.force), wanted, rtol=1e-9, atol=0.0)
            if len(every) == 1 or (near and each.shape == ground[0].shape):
                return number, peak
        return None

    def drive_force(self, omega: float, channel: int = 0) -> Array:
        """(n,) amplitude of a channel's shape in the force on each mass at a drive frequency; 0 for
        a channel that there is not.

        Raises
        ------
        ValueError : it takes more than two channels.
        """
        every = self._channels(omega)
        return every[channel].force if channel < len(every) else np.zeros(self.size)

    def drive_shapes(self, omega: float) -> tuple[Shape, ...]:
        """Of each channel at a drive frequency, which only the phase of a sole sine depends on;
        raises as ``drive_force``."""
        return tuple(each.shape for each in self._channels(omega))

    @property
    def largest_force(self) -> float:
        """Largest amplitude of a force at the model's own frequency."""
        return max(float(np.abs(c.force).max()) for c in self._channels(self.own_frequency))

    def _channels(self, omega: float) -> tuple[Channel, ...]:
        found = self.channels(omega)
        if found is None:
            raise ValueError("forces that take more than two channels")
        return found

    def drive_waves(self, omega: float) -> tuple[HarmonicForce, ...]:
        """All forces at a drive frequency, the ground's included, by their order; the first is that
        of the drive itself."""
        waves = _parts(self._own_waves)
        for _, n, wave in self._ground_waves(omega):
            waves[n] = waves.get(n, np.zeros((2, self.size))) + wave
        return tuple(HarmonicForce(n, *waves[n]) for n in sorted(waves))

    @property
    def orders(self) -> tuple[int, ...]:
        """Multiples of the drive's frequency at which a force or the ground acts."""
        of_base = [n for n, *_ in self.base_shape] if self.driven_by_ground else []
        return tuple(sorted({*(wave.order for wave in self.harmonics), *of_base} - {1}))

    @property
    def driven_by_sine(self) -> bool:
        """Whether all forces are in phase, or in antiphase, and of one frequency, whatever it
        is."""
        # Cosines of two groups cancel at one frequency alone.
        return not (self.orders or any(group[1][1].any() for group in self._groups(1.0)))

    @property
    def even(self) -> bool:
        """Whether the mirror image of a motion, half a period later, is a motion too."""
        return (
            all(stop.upper == stop.lower for stop in self.clearances)
            and all(law.even for law in self.laws)
            and all(order % 2 for order in self.orders)
            and not self.constant.any()
        )

    def _waves(self, omega: float) -> Array | None:
        """(2n, 1 + 2 h) ``Mode.waves``."""
        if self.driven_by_sine:
            return None
        first, *further = self.drive_waves(omega)
        columns = [first.cosine]
        for harmonic in further:
            columns += [harmonic.sine, harmonic.cosine]
        return np.stack([_interleaved(self.over_mass(each), 1) for each in columns], axis=1)

    def displacement(self, clearance: Clearance) -> Array:
        """(n,) row over the masses' displacements that gives the one in a clearance."""
        row = np.zeros(self.size)
        for mass, factor in clearance.terms:
            row[mass] = factor
        return row

    def push(self, element: Clearance | ForceLaw) -> Array:
        """(n,) factors with which a force that opposes a displacement acts on the masses."""
        if element.push:
            return np.array(element.push)
        if isinstance(element, ForceLaw):
            return np.array(element.row)
        return self.displacement(element)

    def relative_stiffness(self, clearance: Clearance) -> float:
        """Stiffness of a clearance's upper stop, or its only one, over that of the springs on its
        mass; k0/(1 - k0) of the paper's Eq. (5). Of a dead zone of velocities that of the damper
        over those of the dampers."""
        own = self.own_slope(clearance)
        return abs(clearance.first.stiffness) / own if own else np.inf

    def own_slope(self, clearance: Clearance) -> float:
        """Stiffness of the springs on the mass of a clearance, or damping of the dampers, with the
        mean slope of every law."""
        own = self.damping if clearance.quantity == "velocity" else self.stiffness
        spanning = own + self._spanning(clearance.quantity)
        return abs(float(spanning[clearance.mass, clearance.mass]))

    @cached_property
    def dead_zones(self) -> tuple[Clearance, ...]:
        """Its nonlinear forces as a circuit makes them (``model.dead_zones``).

        Raises
        ------
        InputError : as of ``dead_zones``.
        """
        return dead_zones(self.clearances, self.laws)

    def natural_frequencies(self, *, closed: bool = False) -> Array:
        """(n,) undamped ones, ascending, in rad per unit of time; of a law its mean slope counts.
        closed : with every stop in contact, of each clearance the stiffest; else with none."""
        stiffness = self.spanning_stiffness
        if closed:
            for stop in self.clearances:
                stiffest = max(
                    max(accumulate(k for _, k in side.springs)) for _, side in stop.sides
                )
                stiffness += stiffest * np.outer(self.push(stop), self.displacement(stop))
        squares = np.linalg.eigvals(self.over_mass(stiffness)).real
        return np.asarray(np.sqrt(np.maximum(np.sort(squares), 0.0)))

    @cached_property
    def wired(self) -> SecondOrderSystem:
        """What a circuit's integrators and constant forces make of it: the linear part, without
        what the stages of dead zones that limit (``Clearance.limits``) add to it at rest."""
        stiffness, damping = self.stiffness.copy(), self.damping.copy()
        constant = self.constant.copy()
        for zone in self.dead_zones:
            if zone.limits:
                assert zone.lower is not None
                push = self.push(zone)
                own = damping if zone.quantity == "velocity" else stiffness
                own += zone.first.stiffness * np.outer(push, self.displacement(zone))
                # The stage gives nothing below its lower end, so at rest it pushes back already.
                constant -= zone.first.stiffness * zone.lower.gap * push
        return replace(
            self,
            stiffness=_without_rounding(stiffness, self.stiffness),
            damping=_without_rounding(damping, self.damping),
            constant=_without_rounding(constant, self.constant),
            clearances=(),
            laws=(),
        )

    def state_matrix(self) -> Array:
        """(2n, 2n) A of the open system; states x1, x1', x2, x2', … as in Eq. (10)."""
        return self._first_order(self.stiffness, self.damping)

    def spanning_state_matrix(self) -> Array:
        """The same of a motion that spans the points of every law."""
        damping = self.damping + self._spanning("velocity")
        return self._first_order(self.spanning_stiffness, damping)

    def _first_order(self, stiffness: Array, damping: Array) -> Array:
        n = self.size
        A = np.zeros((2 * n, 2 * n))
        A[0::2, 1::2] = np.eye(n)
        A[1::2, 0::2] = -self.over_mass(stiffness)
        A[1::2, 1::2] = -self.over_mass(damping)
        return A

    def piecewise_linear(self, omega: float | None = None) -> PiecewiseLinearSystem:
        """States x1, x1', x2, x2', …; one key entry per clearance in their order, then one per law:
        how many springs of the upper stop are met, or minus how many of the lower; of a law how
        many corners the motion is above its piece at rest, or minus how many below.

        omega : of the drive; only a moving ground asks for it.

        Raises
        ------
        ValueError : a moving ground without ``omega``.
        """
        if self.driven_by_ground and omega is None:
            raise ValueError("what a moving ground does depends on omega")
        n = self.size
        ground = self.ground(omega or 1.0) if self.ground_moves else 0.0
        contacts = [
            *(_Contact.with_stops(self, k, ground) for k in range(len(self.clearances))),
            *(_Contact.with_law(self, law) for law in self.laws),
        ]
        stops, count = contacts[: len(self.clearances)], len(self.clearances)
        A0 = self.state_matrix()
        B0, d0 = np.zeros(2 * n), np.zeros(2 * n)
        B0[1::2] = self.over_mass(self.drive_waves(omega or 0.0)[0].sine)
        d0[1::2] = self.over_mass(self.constant)
        waves, orders = self._waves(omega or 0.0), self.orders

        def build(key: ModeKey) -> Mode:
            A, B, d = A0.copy(), B0.copy(), d0.copy()
            guards: list[Guard] = []
            for j, (contact, level) in enumerate(zip(contacts, key, strict=True)):
                contact.push(level, A, B, d)
                guards += contact.guards(j, key)
            sides = tuple(int(np.sign(level)) for level in key[:count])
            return Mode(A, B, d, tuple(guards), sides=sides, waves=waves)

        return PiecewiseLinearSystem(
            states=state_names(n),
            build=build,
            start=(0,) * len(contacts),
            clearances=tuple(stop.name for stop in self.clearances),
            displacement=tuple(np.append(c.row, [c.on_drive, 0.0]) for c in stops),
            velocity=tuple(np.append(c.rate, c.on_drive) for c in stops),
            mirror=-np.eye(2 * n) if self.even else None,
            continuous=not any(stop.jumps for stop in self.clearances),
            orders=None if waves is None else orders,
        )


def displacement_shape(
    displacement: float, acceleration: float, shape: Shape, omega: float
) -> Shape:
    """A motion at a drive frequency of which the amplitude of the displacement is given, or of the
    acceleration; 0 for the other."""

    def sized(n: int, part: float) -> float:
        return (displacement + acceleration / (n * omega) ** 2) * part

    if not (displacement or acceleration):
        return ()
    return tuple((n, sized(n, sine), sized(n, cosine)) for n, sine, cosine in shape)


def _without_rounding(less: Array, whole: Array) -> Array:
    """What is left of ``whole``, with zeros where that is rounding."""
    rounding = ROUNDING * max(np.abs(less).max(initial=0.0), np.abs(whole).max(initial=0.0))
    return np.where(np.abs(less) > rounding, less, 0.0)


def reaches_ground(factors: Iterable[float]) -> bool:
    """Whether a sum of displacements with these factors changes where all masses move alike."""
    sizes = list(factors)
    return abs(sum(sizes)) > ROUNDING * sum(map(abs, sizes))


def _parallel(groups: Iterable[Mapping[int, Array]]) -> bool:
    """Whether all forces have one ratio, whatever their phases."""
    rows = np.concatenate([wave for group in groups for wave in group.values()])
    sizes = np.linalg.norm(rows, axis=1)
    rows = rows[sizes > 0.0] / sizes[sizes > 0.0, None]
    return bool((np.abs(np.abs(rows @ rows[0]) - 1.0) < ROUNDING).all())


def _parts(waves: Iterable[HarmonicForce]) -> dict[int, Array]:
    """By order the (2, n) amplitudes of sine and cosine."""
    return {wave.order: np.stack([wave.sine, wave.cosine]) for wave in waves}


@dataclass(frozen=True)
class _Contact:
    """One clearance or one law in the equations of first order: what joins in where."""

    row: Array
    """(2n,) over the states: what its springs watch."""
    rate: Array
    """(2n,) over the states: its rate, of a clearance."""
    push_back: Array
    """(2n,) change of the states' rates for a unit of force."""
    springs: Mapping[int, tuple[tuple[float, float], ...]]
    """(place, stiffness) of what joins in on each side, 1 upper and -1 lower, the nearest first."""
    jumps: Mapping[int, float]
    """Force that is there at once on each side."""
    damping: float = 0.0
    """While there is contact."""
    on_drive: float = 0.0
    """Coefficient of the drive in what is watched."""
    clearance: int = -1
    """Index of the clearance whose contact it is; -1 of a law."""
    name: str = ""
    """What its corners are corners of."""
    corners: tuple[float, ...] = ()
    """Where the slope of its force changes, but where a stop is touched and on a curve."""

    @classmethod
    def with_stops(cls, system: SecondOrderSystem, index: int, ground: float) -> _Contact:
        """One clearance of a system."""
        clearance = system.clearances[index]
        along = system.displacement(clearance)
        fixed = system.fixed_stops and clearance.other is None
        return cls(
            _interleaved(along, 0),
            _interleaved(along, 1),
            _interleaved(system.over_mass(system.push(clearance)), 1),
            {side: stop.springs for side, stop in clearance.sides},
            {side: stop.jump for side, stop in clearance.sides},
            clearance.damping,
            ground * float(along.sum()) if fixed else 0.0,
            index,
            clearance.name,
            tuple(side * (stop.gap + stop.rise) for side, stop in clearance.sides if stop.rise),
        )

    @classmethod
    def with_law(cls, system: SecondOrderSystem, law: ForceLaw) -> _Contact:
        """One law of a system, beyond its piece at rest."""
        along = np.array(law.row)
        watched = _interleaved(along, 0 if law.quantity == "displacement" else 1)
        push_back = _interleaved(system.over_mass(system.push(law)), 1)
        corners = () if law.curved else law.corners
        rate = np.zeros_like(watched)
        return cls(watched, rate, push_back, law.bends, {}, name=law.name, corners=corners)

    def push(self, level: int, A: Array, B: Array, d: Array) -> None:
        """Add the force of what has joined in to the equations.

        level : how many springs; negative on the lower side.
        """
        if not level:
            return
        side = int(np.sign(level))
        d -= side * self.jumps.get(side, 0.0) * self.push_back
        for place, stiffness in self.springs[side][: abs(level)]:
            A -= stiffness * np.outer(self.push_back, self.row)
            B -= stiffness * self.on_drive * self.push_back
            d += stiffness * side * place * self.push_back
        A -= self.damping * np.outer(self.push_back, self.rate)

    def guards(self, index: int, key: ModeKey) -> list[Guard]:
        """Guards of the transitions to one spring more or one fewer."""
        level = key[index]
        out = []
        if level:
            side = int(np.sign(level))
            springs = self.springs[side]
            out.append(self._guard(-side, springs[abs(level) - 1][0], level - side, index, key))
            if abs(level) < len(springs):
                out.append(self._guard(side, -springs[abs(level)][0], level + side, index, key))
            return out
        return [
            self._guard(side, -springs[0][0], side, index, key)
            for side, springs in self.springs.items()
        ]

    def _guard(self, sign: int, constant: float, level: int, index: int, key: ModeKey) -> Guard:
        target = (*key[:index], level, *key[index + 1 :])
        # Contact begins or ends; deeper springs only stiffen it.
        touches = not (level and key[index])
        clearance = self.clearance if touches else -1
        place = -sign * constant
        bends = clearance < 0 and place in self.corners
        sides = (((index, each),) for each in sorted((key[index], level), key=abs))
        corner = ForceCorner(place, self.name, *sides) if bends else None
        row = sign * self.row, sign * self.on_drive, constant
        return Guard(*row, target, clearance, corner=corner)


def _interleaved(row: Array, first: int) -> Array:
    """(2n,) over the states of a row (n,). first : 0 over displacements, 1 over velocities."""
    out = np.zeros(2 * len(row))
    out[first::2] = row
    return out


class MechanicalModel(Hashable, Protocol):
    """What the tool asks of a model, whichever file format it came from."""

    @property
    def b(self) -> float:
        """The clearance that the generator's amplitude is given for: see ``at``."""
        ...

    @property
    def parameters(self) -> Mapping[str, tuple[float, float]]:
        """Names of the numbers that a sweep may change, ``b`` among them, with the closed interval
        of each."""
        ...

    @property
    def units(self) -> Mapping[str, str]:
        """SI unit of each of ``parameters`` that has one."""
        ...

    @property
    def listed(self) -> frozenset[str]:
        """Those of ``parameters`` that stand in lists, and may be very many."""
        ...

    @property
    def idle(self) -> frozenset[str]:
        """Those of ``parameters`` that a title leaves out: with the value of an element that is not
        there, or ``listed``."""
        ...

    def parameter(self, name: str) -> float:
        """The value of one of ``parameters``."""
        ...

    def changed(self, changes: Mapping[str, float]) -> Self:
        """The model with other values of some ``parameters``.

        Raises
        ------
        InputError : a value outside its domain.
        """
        ...

    def at(self, b: float) -> Self:
        """The model at another clearance: every gap and constant force by b/self.b as large, which
        a generator's amplitude by self.b/b as large makes too."""
        ...

    def second_order(self) -> SecondOrderSystem:
        """Its equations of motion."""
        ...

    def as_dict(self) -> dict[str, object]:
        """All that decides it, for hashes and provenance."""
        ...


SLOWEST, FASTEST = 1e-3, 1e3
"""Drive frequencies over the model's own: slower, one period has too many steps to wait for."""


def frequency_range(model: MechanicalModel) -> tuple[float, float]:
    """The lowest and the highest drive frequency that is computed."""
    unit = model.second_order().own_frequency
    return SLOWEST * unit, FASTEST * unit


def check_omega(name: str, omega: float, model: MechanicalModel, file: str | None = None) -> None:
    """Raises InputError for a frequency outside the model's ``frequency_range``."""
    low, high = frequency_range(model)
    if not low <= omega <= high:
        raise InputError(file, name, omega, f"a number from {low:.6g} to {high:.6g}")


def state_names(masses: int) -> tuple[str, ...]:
    """x1, x1', x2, x2', … of so many masses."""
    return tuple(f"x{i // 2 + 1}" + ("'" if i % 2 else "") for i in range(2 * masses))
