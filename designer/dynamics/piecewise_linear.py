"""A piecewise-linear system with one periodic drive: the common ground of model and circuit.

In each mode the state x (n entries) follows

    x' = A x + B u(t) + d,      u(t) = amplitude · shape(ω t) + offset

until a guard becomes positive. The shape is a sine, or another sum of harmonics where one voltage
drives all. Where the drive is a sine, its cosine and harmonics may act beside it, times the same
amplitude: forces of phases and shapes that differ. A guard is a linear function C x + D u + e of
state and drive, negative inside its mode, and names the mode on its other side. A mode's key is a
tuple of small integers, one per switching element (a stop pair: -1 lower, 0 open, 1 upper; an
op-amp: -1 at its lower limit, 0 linear, 1 at its upper limit; a diode: 1 while it conducts, else
0). Modes are built when first entered and kept, never enumerated.

The state is continuous across every boundary. So is the vector field of springs and limiters: a
crossing then changes the mode and nothing else. Dampers that act in contact only make the vector
field jump (``PiecewiseLinearSystem.continuous``), and tangent vectors with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.dynamics.drive_shape import SINE, Shape, slope, wave

LONGEST_WALK = 512
"""Mode changes after which the search for the mode of a state gives up."""

ROUNDING = 1e-14
"""What cannot be told from zero, over the sum of a guard's terms' magnitudes."""

SAME = 1e-9
"""Relative: what may differ between a corner and the mirror image of another."""

ModeKey = tuple[int, ...]


@dataclass(frozen=True)
class ForceCorner:
    """Where a force bends that no contact begins or ends."""

    place: float
    """Of what the force depends on."""
    force: str
    within: tuple[tuple[int, int], ...]
    """What stands in a ``ModeKey`` on the side of rest, each with its index there."""
    beyond: tuple[tuple[int, int], ...]
    """The same on the other side. On a board two diodes turn, one after the other."""

    def key(self, near: ModeKey, *, beyond: bool) -> ModeKey:
        """Key of the mode on one side, other forces and contacts as in ``near``."""
        own = dict(self.beyond if beyond else self.within)
        return tuple(own.get(i, entry) for i, entry in enumerate(near))

    def __str__(self) -> str:
        return f"{self.force} at {self.place:.6g}"


@dataclass(frozen=True)
class Guard:
    """One way out of a mode: the linear function C·x + D·u + e becomes positive there."""

    C: Array
    """(n,) coefficients of the state."""
    D: float
    """Coefficient of the drive."""
    e: float
    """Constant term."""
    target: ModeKey
    """Key of the mode that is entered when it becomes positive."""
    clearance: int = -1
    """Index of the clearance whose contact begins or ends here, or -1. Such guards are scaled to
    displacement; where contact begins, -(C·x + D·u + e) is the distance to the stop."""
    second: float = 0.0
    """Coefficient of the second drive."""
    corner: ForceCorner | None = None
    """The corner that is passed here, if one is."""

    @property
    def row(self) -> Array:
        """(n + 2,) over (states, drive, 1)."""
        return np.concatenate([self.C, [self.D, self.e]])


@dataclass(frozen=True)
class Mode:
    """The linear system x' = A x + B u + d that holds while no guard is positive."""

    A: Array
    """(n, n) state matrix."""
    B: Array
    """(n,) input vector."""
    d: Array
    """(n,) constant term."""
    guards: tuple[Guard, ...]
    """Ways out of the mode."""
    sides: tuple[int, ...]
    """For each clearance -1, 0 or 1: in contact with the lower stop, open, with the upper."""
    clipped: bool = False
    """Whether an element that ought to be linear is at its limit."""
    waves: Array | None = None
    """(n, 1 + 2 h) input vectors of ``PiecewiseLinearSystem.waves``, without the amplitude; None
    where the drive is a sine."""
    second: Array | None = None
    """(n,) input vector of the second drive; None where there is none."""

    @cached_property
    def guard_rows(self) -> tuple[Array, Array, Array]:
        """C (guards, n), D (guards,) and e (guards,) of all guards."""
        C = np.array([g.C for g in self.guards])
        return C, np.array([g.D for g in self.guards]), np.array([g.e for g in self.guards])

    @cached_property
    def second_guards(self) -> Array:
        """(guards,) coefficients of the second drive."""
        return np.array([g.second for g in self.guards])


@dataclass(frozen=True)
class SecondDrive:
    """A drive w(t) = amplitude · shape(omega · t) beside the first, of its frequency."""

    amplitude: float
    """Amplitude of the shape."""
    shape: Shape
    """What it is the sum of, over the amplitude."""

    def at(self, angle: Array) -> Array:
        """(k,) w at angles ωt (k,)."""
        return self.amplitude * wave(self.shape, angle)


@dataclass(frozen=True)
class Drive:
    """The drive u(t) = amplitude · shape(omega · t) + offset.

    Raises
    ------
    InputError : omega is not positive, or anything is not finite.
    """

    omega: float
    """Angular frequency, in rad per unit of the system's time."""
    amplitude: float = 1.0
    """Amplitude of the shape."""
    offset: float = 0.0
    """Constant part of the drive."""
    shape: Shape = SINE
    """What it is the sum of, over the amplitude."""
    second: SecondDrive | None = None
    """What else drives."""

    def __post_init__(self) -> None:
        if not (0.0 < self.omega < np.inf):
            raise InputError(None, "omega", self.omega, "a finite number > 0")
        for name in ("amplitude", "offset"):
            if not np.isfinite(getattr(self, name)):
                raise InputError(None, name, getattr(self, name), "a finite number")

    @property
    def period(self) -> float:
        return 2.0 * np.pi / self.omega

    @property
    def is_sine(self) -> bool:
        """Whether it is a sine about its offset, and nothing else drives."""
        return self.shape == SINE and self.second is None

    @property
    def orders(self) -> tuple[int, ...]:
        """Multiples of ``omega`` that act beside it, in either drive."""
        more = () if self.second is None else self.second.shape
        return tuple(sorted({n for n, *_ in (*self.shape, *more)} - {1}))

    def at(self, angle: Array) -> Array:
        """(k,) u at angles ωt (k,)."""
        return self.amplitude * wave(self.shape, angle) + self.offset

    def second_at(self, angle: Array) -> Array:
        """(k,) the second drive at angles ωt (k,); 0 where there is none."""
        return np.zeros_like(angle) if self.second is None else self.second.at(angle)

    def second_rate_at(self, angle: Array) -> Array:
        """(k,) the second drive's rate at angles ωt (k,)."""
        if self.second is None:
            return np.zeros_like(angle)
        return self.omega * self.second.amplitude * wave(slope(self.second.shape), angle)

    def rate_at(self, angle: Array) -> Array:
        """(k,) du/dt at angles ωt (k,)."""
        return self.amplitude * self.omega * wave(slope(self.shape), angle)

    def bend_at(self, angle: Array) -> Array:
        """(k,) d²u/dt² at angles ωt (k,)."""
        return self.amplitude * self.omega**2 * wave(slope(slope(self.shape)), angle)


@dataclass
class PiecewiseLinearSystem:
    """Named states and a rule that builds the mode for a key."""

    states: tuple[str, ...]
    """Names of the n states."""
    build: Callable[[ModeKey], Mode]
    """Called once for each key that is entered; raises KeyError for a key that cannot be."""
    start: ModeKey
    """Key of the mode that holds near x = 0."""
    clearances: tuple[str, ...]
    """Names of the clearances, in the order of ``Mode.sides``."""
    displacement: tuple[Array, ...]
    """For each clearance the displacement in it: a row (n + 2,) over (states, drive, 1)."""
    velocity: tuple[Array, ...]
    """For each clearance the velocity in it: a row (n + 1,) over (states, the drive's rate)."""
    mirror: Array | None = None
    """(n, n) M with x → M x, u → -u a symmetry of the system, or None."""
    reflection: Array | None = None
    """(n, n) what a state looks like in a mirror, be it a symmetry or not; None: -1."""
    continuous: bool = True
    """Whether the vector field is the same on both sides of every boundary."""
    working: tuple[ModeKey, ...] = ()
    """Keys of the modes that a board as it should be moves between, ``start`` first; the fast path
    of circuits tabulates them."""
    orders: tuple[int, ...] | None = None
    """The h harmonics that act beside the drive's sine and cosine; None where there is nothing but
    the drive."""
    _modes: dict[ModeKey, Mode] = field(default_factory=dict, repr=False)

    @property
    def size(self) -> int:
        return len(self.states)

    @property
    def state_in(self) -> tuple[int | None, ...]:
        """For each clearance the index of the state that its displacement is; None for others."""
        indices = []
        for row in self.displacement:
            places = np.flatnonzero(row)
            alone = len(places) == 1 and places[0] < self.size and row[places[0]] == 1.0
            indices.append(int(places[0]) if alone else None)
        return tuple(indices)

    @property
    def moving(self) -> int:
        """Index of the state that moves most in the first clearance; 0 where there is none."""
        return int(np.argmax(np.abs(self.displacement[0][:-2]))) if self.displacement else 0

    def waves(self, angle: Array) -> Array:
        """(k, 1 + 2 h) at angles ωt (k,) the cosine, then the sine and cosine of each of
        ``orders``."""
        columns = [np.cos(angle)]
        for order in self.orders or ():
            columns += [np.sin(order * angle), np.cos(order * angle)]
        return np.stack(columns, axis=-1)

    def know(self, modes: Mapping[ModeKey, Mode]) -> None:
        """Take modes that somebody else has built, where they are not there yet."""
        self._modes |= {key: mode for key, mode in modes.items() if key not in self._modes}

    def mode(self, key: ModeKey) -> Mode:
        """The mode of this key, built on its first use."""
        known = self._modes.get(key)
        if known is None:
            known = self._modes[key] = self.build(key)
        return known

    def mode_at(
        self, x: Array, u: float, near: ModeKey | None = None, *, second_drive: float = 0.0
    ) -> ModeKey:
        """Key of the mode that holds at state x (n,) and drive u, with the second drive
        ``second_drive``.

        Walks from ``near`` (default: ``start``) across the most violated guard until none is
        violated. Where that walk meets a mode twice it goes on across the first violated guard
        in the key's order, which cannot cycle in a network whose every state and drive has
        exactly one answer (Murty's rule for such complementarity problems). From then on a
        violation that is only rounding does not count: on a boundary two modes hold.

        Raises
        ------
        ArithmeticError : no mode holds, within a bounded walk.
        """
        key = self.start if near is None else near
        seen: set[ModeKey] = set()
        cycling = False
        for _ in range(LONGEST_WALK):
            mode = self.mode(key)
            cycling = cycling or key in seen
            seen.add(key)
            values = [float(g.C @ x) + g.D * u + g.e + g.second * second_drive for g in mode.guards]
            floors = [ROUNDING * _size(g, x, u) if cycling else 0.0 for g in mode.guards]
            violated = [i for i, value in enumerate(values) if value > floors[i]]
            if not violated:
                return key
            chosen = violated[0] if cycling else max(violated, key=values.__getitem__)
            key = mode.guards[chosen].target
        raise ArithmeticError(f"no mode holds at x = {x}, u = {u}")

    def contact_rows(self, clearance: int) -> dict[int, Array]:
        """How far the displacement is past each stop, by side (1 upper, -1 lower); of a number of
        ``corners`` past that, by 1.

        Rows (n + 2,) over (states, drive, 1), scaled to displacement and positive in contact: the
        guards of the mode that holds at rest. They hold however deep the contact is.
        """
        if clearance >= len(self.clearances):
            return {1: self.corners[clearance - len(self.clearances)].row}
        rest = self.mode(self.start)
        rows: dict[int, Array] = {}
        for guard in rest.guards:
            if guard.clearance == clearance:
                rows[self.mode(guard.target).sides[clearance]] = guard.row
        return rows

    @cached_property
    def corners(self) -> tuple[Guard, ...]:
        """The corners of forces that are no contact's begin, positive on the side away from rest.
        Where turning points are looked at they are numbered after the clearances."""
        found, keys = dict[ForceCorner, Guard](), [self.start]
        while keys:
            key = keys.pop(0)
            for guard in self.mode(key).guards:
                if guard.corner and guard.corner not in found:
                    found[guard.corner] = guard
                    keys.append(guard.target)
                elif guard.clearance >= 0 and key == self.start:
                    keys.append(guard.target)
        return tuple(found.values())

    def at_corner(self, number: int, near: ModeKey, *, beyond: bool) -> Mode:
        """The mode on one side of one of ``corners``; as of ``ForceCorner.key``."""
        corner = self.corners[number].corner
        assert corner is not None
        return self.mode(corner.key(near, beyond=beyond))

    @property
    def modes_beyond(self) -> list[Mode]:
        """Those beyond each of ``corners`` alone."""
        return [self.at_corner(k, self.start, beyond=True) for k in range(len(self.corners))]

    @cached_property
    def corner_images(self) -> tuple[int, ...]:
        """Of each of ``corners`` the number of its mirror image; -1 without one."""
        if self.mirror is None:
            return (-1,) * len(self.corners)
        rows = np.array([corner.row for corner in self.corners])
        images = np.column_stack([rows[:, :-2] @ self.mirror, -rows[:, -2], rows[:, -1]])
        scale = np.abs(rows).max(axis=1)
        off = np.abs(images[:, None] - rows).max(axis=2) / scale
        return tuple(int(np.argmin(each)) if each.min() < SAME else -1 for each in off)

    @property
    def built(self) -> int:
        """How many modes have been built so far."""
        return len(self._modes)


def motion_of_states(
    size: int, moving: Iterable[int]
) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """``displacement`` and ``velocity`` where each displacement is a state, the next its velocity.

    size : n. moving : index of the displacement in each clearance.
    """
    indices = tuple(moving)
    displacement = tuple(np.eye(1, size + 2, j)[0] for j in indices)
    return displacement, tuple(np.eye(1, size + 1, j + 1)[0] for j in indices)


def _size(guard: Guard, x: Array, u: float) -> float:
    return float(np.abs(guard.C) @ np.abs(x)) + abs(guard.D * u) + abs(guard.e)
