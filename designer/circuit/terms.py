"""Matching conditions by rule from the state equations.

One inverting integrator per state, one inverter where a sign is needed, one resistor per non-zero
coefficient; a term that is zero gets no part. For n masses, mass i (from 1) takes the numbers
(2n + 2)(i - 1) + 1 … (2n + 2) i: the displacement integrator's resistor, n velocities, n
displacements, the force. With n = 2 these are the paper's R1 … R12; with the capacitors C1 … C2n in
the order of the states they realise its Eq. (14) as corrected in docs/errata.md. From five masses
on 1000 is added: the numbers would meet those of the stops.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

Quantity = tuple[Literal["mass", "damping", "stiffness", "force"], int, int]
"""Which entry of M, C, K or the forces; indices from 0 (of a force: mass, channel)."""


@dataclass(frozen=True)
class Term:
    """One input resistor of one integrator."""

    resistor: str
    state: int
    """Index of the integrator's state (x1, x1', x2, …)."""
    source: int | None
    """Index of the state fed in, or None for the generator."""
    inverted: bool
    """Whether the negative of the state, or of the generator, is needed."""
    quantity: Quantity
    """The coefficient that it realises; of a force the column is the generator's channel."""


MOST_PLAIN = 4
"""Masses whose resistors are numbered from 1; of more, from 1001."""


def term_resistor(masses: int, mass: int, place: int) -> str:
    """Name of a resistor of the linear block. place : 0 the displacement integrator, 1 … n the
    velocities, n + 1 … 2n the displacements, 2n + 1 the force."""
    return f"R{(2 * masses + 2) * mass + 1 + place + (1000 if masses > MOST_PLAIN else 0)}"


def entry_resistor(masses: int, state: int, source: int) -> str:
    """Name of the resistor of one entry of the state matrix (x1, x1', x2, …)."""
    place = 1 + source // 2 + (0 if source % 2 else masses) if state % 2 else 0
    return term_resistor(masses, state // 2, place)


def drive_resistor(masses: int, mass: int, channel: int = 0) -> str:
    """Name of the resistor from a channel of the generator to a mass."""
    if not channel:
        return term_resistor(masses, mass, 2 * masses + 1)
    return f"R{(170 if masses <= MOST_PLAIN else 1900) + mass}"


def _sign(value: Any) -> int:
    return int(np.sign(float(value)))


def terms(
    damping: Sequence[Sequence[Any]],
    stiffness: Sequence[Sequence[Any]],
    force: Sequence[Any],
    sign: Callable[[Any], int] = _sign,
    second: Sequence[Any] = (),
) -> tuple[Term, ...]:
    """The input resistors that the model needs, mass by mass.

    second : forces of the generator's second channel.

    Entries may be numbers or symbols; ``sign`` tells -1, 0 or 1 of an entry. An inverting
    integrator fed with +s realises a coefficient of -s: positive entries of C and K take the
    state itself, negative ones its inverse. The generator's inversion is its phase; a force in
    antiphase to others of its channel takes the channel's inverse.
    """
    n = len(force)
    out: list[Term] = []
    for i in range(n):
        velocity = 2 * i + 1
        out.append(Term(term_resistor(n, i, 0), 2 * i, velocity, True, ("mass", i, i)))
        for j in range(n):
            if s := sign(damping[i][j]):
                quantity: Quantity = ("damping", i, j)
                out.append(Term(term_resistor(n, i, 1 + j), velocity, 2 * j + 1, s < 0, quantity))
        for j in range(n):
            if s := sign(stiffness[i][j]):
                quantity = ("stiffness", i, j)
                name = term_resistor(n, i, 1 + n + j)
                out.append(Term(name, velocity, 2 * j, s < 0, quantity))
        for channel, forces in enumerate((force, second)):
            if s := sign(forces[i]) if len(forces) else 0:
                name = drive_resistor(n, i, channel)
                out.append(Term(name, velocity, None, s < 0, ("force", i, channel)))
    return tuple(out)


def inverted_states(inputs: Sequence[Term]) -> tuple[int, ...]:
    """States whose negative some term needs: one inverter each."""
    return tuple(sorted({t.source for t in inputs if t.inverted and t.source is not None}))
