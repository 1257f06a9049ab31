"""The linear block of any number of masses: its terms, their errors, the side conditions on it.

In logarithms a term from state b into the integrator of state a has the error

    T + p_b - p_a - (r + c_a + w)

with T = ln of the time scale, p = ln of a state's volts per model unit, r and c of the parts, and
w = ln |wanted coefficient|; the displacement integrators are the terms with w = 0. One p is free:
that of x1 is taken as 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.circuit.terms import entry_resistor
from designer.model.circuit_table import CircuitSpec
from designer.model.mechanics import MechanicalModel

ANY = CircuitSpec()
"""What asks for no equal parts and prefers no values."""


@dataclass(frozen=True)
class Targets:
    """The terms that the linear block has to realise."""

    coefficients: Array
    """(2n, 2n) |entries| of the state matrix, states x1, x1', x2, …; 0 where there is no term."""

    @classmethod
    def from_state_matrix(cls, A: Array) -> Targets:
        """From the (2n, 2n) state matrix of a model in its own units."""
        return cls(np.abs(A))

    @classmethod
    def of(cls, model: MechanicalModel) -> Targets:
        """Those of a model."""
        return cls.from_state_matrix(model.second_order().wired.state_matrix())

    @cached_property
    def entries(self) -> tuple[tuple[int, int], ...]:
        """(integrator's state, state fed in) of each term, in the order of the resistors'
        numbers."""
        pairs = [(int(a), int(b)) for a, b in np.argwhere(self.coefficients > 0.0)]
        return tuple(sorted(pairs, key=lambda e: (e[0], 1 - e[1] % 2, e[1])))

    @property
    def resistors(self) -> tuple[str, ...]:
        """Names of the terms' resistors."""
        n = len(self.coefficients) // 2
        return tuple(entry_resistor(n, a, b) for a, b in self.entries)

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the resistors, then of the capacitors in the order of the states."""
        return (*self.resistors, *(f"C{i + 1}" for i in range(len(self.coefficients))))

    @property
    def wanted(self) -> Array:
        """(terms,) ln of the wanted coefficients."""
        return np.log([self.coefficients[entry] for entry in self.entries])

    @property
    def fully_coupled_pair(self) -> bool:
        """Whether these are two masses with all eight terms."""
        return self.coefficients.shape == (4, 4) and bool((self.coefficients[1::2] > 0.0).all())

    @property
    def logs(self) -> Array:
        """(terms - n,) ln of the wanted coefficients, without the displacement integrators."""
        own = [a % 2 == 1 for a, _ in self.entries]
        return np.asarray(self.wanted[own])


@dataclass(frozen=True)
class Bounds:
    """Side conditions of the linear block; infinite or zero where switched off."""

    seconds: tuple[float, float]
    """Range of the time scale."""
    level: float
    """Largest ratio between the peaks of the state voltages of one mass, and between any two
    velocities."""
    share: float
    """How much larger than that of the first stop's displacement the peak voltage of another state
    may be."""
    stop: float
    """Least resistor of the stiffness of the first stop's mass by itself (R4) [ohm]: it leaves
    room for the stop's."""
    peaks: Array
    """(2n,) peaks of x1, x1', x2, x2', … in model units."""
    signal: tuple[float, float] = (0.0, np.inf)
    """Range of the linear block's resistors [ohm]."""
    stop_most: float = np.inf
    """Largest of that resistor that is looked at [ohm]."""
    mass: int = 0
    """Index of the mass at the first stop."""


@dataclass(frozen=True)
class LinearErrors:
    """The errors of chosen parts, as functions of scales: offsets + columns @ scales."""

    offsets: Array
    """(terms,) errors with all scales 0."""
    columns: Array
    """(terms, k) change of the errors with each scale."""
    volts: Array
    """(2n, k) change of ln(volts of each state over those of x1) with each scale."""
    rates: Array
    """(n, k) change with each scale of T + p - p' - c', where p, p', c' are of the displacement, of
    the velocity and of its capacitor: ln of what a resistor of a mass's stiffness by itself
    is, times the coefficient that it makes."""
    rate_offsets: Array
    """(n,) the same with all scales 0."""


def errors_of_terms(values: Mapping[str, float], targets: Targets) -> LinearErrors:
    """The errors of these parts, with the scales T, p of x1', p of x2, … . values : [ohm, F]."""
    rows, states = np.array(targets.entries), len(targets.coefficients)
    c = np.log([values[f"C{i + 1}"] for i in range(states)])
    r = np.log([values[name] for name in targets.resistors])
    volts = np.eye(states, states + 1, 1)[:, [0, *range(2, states + 1)]]
    time = np.eye(states)[0]
    return LinearErrors(
        offsets=-(r + c[rows[:, 0]] + targets.wanted),
        columns=scale_columns(targets),
        volts=volts,
        rates=time + volts[0::2] - volts[1::2],
        rate_offsets=-c[1::2],
    )


def scale_columns(targets: Targets) -> Array:
    """(terms, 2n) change of the errors with T and p of x1', x2, x2', …"""
    rows, states = np.array(targets.entries), len(targets.coefficients)
    columns = np.zeros((len(rows), states + 1))
    columns[:, 0] = 1.0
    for column, (a, b) in zip(columns, rows, strict=True):
        column[1 + b] += 1.0
        column[1 + a] -= 1.0
    return columns[:, [0, *range(2, states + 1)]]


def equal_values(parts: Sequence[str], groups: Sequence[Sequence[str]]) -> Mask:
    """(parts, parts) which must be equal, itself left out; names of other parts do not count."""
    equal = np.eye(len(parts), dtype=bool)
    for group in groups:
        own = [parts.index(name) for name in group if name in parts]
        equal[np.ix_(own, own)] = True
    for _ in parts:  # equal to equal is equal
        equal = (equal.astype(int) @ equal.astype(int)) > 0
    return np.asarray(equal & ~np.eye(len(parts), dtype=bool))


def sums(r: Array, c: Array) -> tuple[Array, Index, Index]:
    """Every sum of one entry of each, ascending, with the indices of both."""
    i, j = np.divmod(np.arange(len(r) * len(c), dtype=np.int64), len(c))
    order = np.argsort(r[i] + c[j], kind="stable")
    return (r[i] + c[j])[order], i[order], j[order]


def preferred_logs(logs: Array, preferred: Sequence[float]) -> Mask:
    """Which of these logarithms are those of preferred values."""
    own = np.log(np.array(sorted(v for v in preferred if v > 0.0), dtype=float))
    return np.asarray((np.abs(logs[:, None] - own[None, :]) < 1e-9).any(axis=1))


@dataclass(frozen=True)
class LinearBlock:
    """The parts chosen, and what is known of them."""

    values: dict[str, float]
    """Chosen values by part name [ohm, F]."""
    error: float
    """The least that the largest error can be made by the scales; with a slack up to that much
    above ``least``."""
    least: float
    """The least error that was found."""
    bound: float
    """No choice under the conditions has a smaller error."""
    proved: bool
    """Whether ``least`` is within ``EXACT`` of ``bound``."""
    proof: str
    """How the bound is known, in words."""
    solver: str
    """The solver's word for the choice among equals."""


@dataclass(frozen=True)
class Shortfall:
    """There is no choice."""

    what: str
    """What leaves no choice."""
    whole: bool
    """Whether every choice was looked at."""


@dataclass(frozen=True)
class LinearQuestion:
    """What is searched: the values that may be used, their conditions and what is asked."""

    targets: Targets
    """The terms to be realised."""
    resistors: Array
    """Resistances that may be used [ohm], ascending."""
    capacitors: Array
    """Capacitances that may be used [F], ascending."""
    prices: Array
    """Price class of each capacitance."""
    bounds: Bounds
    """The side conditions."""
    spec: CircuitSpec
    """Its matched, preferred, most_values and slack count."""

    @property
    def by_joins(self) -> bool:
        """Whether the joins for two masses with all terms and the first stop on the first hold."""
        return self.targets.fully_coupled_pair and self.bounds.mass == 0


@dataclass(frozen=True)
class Levels:
    """Where a search of levels of error ended."""

    error: float
    """The least error that was found; infinite without one."""
    parts: Index
    """Its (parts,) indices of values, in the order of ``Targets.parts``."""
    empty: float
    """The highest level at which nothing can be completed."""
    whole: bool
    """Whether nothing was left out at the last level."""
    reached: int
    """How far any choice came; -1 where none began."""
    rows: int
    """Choices that were looked at."""
    steps: int
    """Steps of the compiled loops."""

    @property
    def nothing(self) -> bool:
        """Whether there is no answer."""
        return not np.isfinite(self.error)

    def after(self, before: Levels) -> Levels:
        """This search with the work of the one before counted too, and its answer if that is
        better."""
        best = before if before.error < self.error else self
        return replace(
            self,
            error=best.error,
            parts=best.parts,
            reached=max(before.reached, self.reached),
            rows=before.rows + self.rows,
            steps=before.steps + self.steps,
        )


class LevelSearch(Protocol):
    """A way to search the choices of one question."""

    @property
    def first(self) -> float:
        """The first level of error."""
        ...

    @property
    def growth(self) -> float:
        """From level to level."""
        ...

    def level(self, level: float, patience: int) -> Levels:
        """The least error up to this level, in so many steps."""
        ...

    def fewest(self, parts: Index, limit: float, patience: int) -> tuple[Index, str]:
        """The choice with the fewest distinct values, then the lowest price, of those with an
        error up to the limit; and the solver's word. parts : one of them."""
        ...

    def error(self, parts: Index) -> float:
        """The least largest error of one choice, from its values alone."""
        ...
