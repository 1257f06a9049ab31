"""Matching conditions by rule from the state equations.

One inverting integrator per state, one inverter where a sign is needed, one resistor per non-zero
coefficient; a term that is zero gets no part. For n masses, mass i (from 1) takes the numbers
(2n + 2)(i - 1) + 1 … (2n + 2) i: the displacement integrator's resistor, n velocities, n
displacements, the force. With n = 2 these are the paper's R1 … R12, and the conditions below are
its Eq. (14) as corrected in docs/errata.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

Quantity = tuple[Literal["mass", "damping", "stiffness", "force"], int, int]
"""Which entry of M, C, K or the force vector; indices from 0 (force: column 0)."""


@dataclass(frozen=True)
class Term:
    """One input resistor of one integrator."""

    resistor: str
    """Name of the resistor."""
    capacitor: str
    """Name of the integrator's capacitor."""
    state: int
    """Index of the integrator's state (x1, x1', x2, …)."""
    source: int | None
    """Index of the state fed in, or None for the generator."""
    inverted: bool
    """Whether the state's negative is needed."""
    quantity: Quantity
    """The coefficient that it realises."""


@dataclass(frozen=True)
class Condition:
    """A matching condition: quantity = sign · Π part**exponent (· V_M for a force)."""

    quantity: Quantity
    """The coefficient that is realised."""
    sign: int
    """Sign of the product, 1 or -1."""
    monomial: dict[str, int]
    """Exponent by part name."""


def _sign(value: Any) -> int:
    return int(np.sign(float(value)))


def terms(
    damping: Sequence[Sequence[Any]],
    stiffness: Sequence[Sequence[Any]],
    force: Sequence[Any],
    sign: Callable[[Any], int] = _sign,
) -> tuple[Term, ...]:
    """The input resistors that the model needs, in the order of their numbers.

    Entries may be numbers or symbols; ``sign`` tells -1, 0 or 1 of an entry. An inverting
    integrator fed with +s realises a coefficient of -s: positive entries of C and K take the
    state itself, negative ones its inverse; the generator's inversion is its phase.
    """
    n = len(force)
    found: list[Term] = []
    for i in range(n):
        base = (2 * n + 2) * i + 1
        integrators = (f"C{2 * i + 1}", f"C{2 * i + 2}")
        found.append(Term(f"R{base}", integrators[0], 2 * i, 2 * i + 1, True, ("mass", i, i)))
        for offset, kind, entries in (
            (1, "damping", damping[i]),
            (1 + n, "stiffness", stiffness[i]),
        ):
            for j in range(n):
                s = sign(entries[j])
                if s == 0:
                    continue
                quantity: Quantity = ("damping" if kind == "damping" else "stiffness", i, j)
                source = 2 * j + (1 if kind == "damping" else 0)
                found.append(
                    Term(
                        f"R{base + offset + j}",
                        integrators[1],
                        2 * i + 1,
                        source,
                        s < 0,
                        quantity,
                    )
                )
        if sign(force[i]) != 0:
            found.append(
                Term(
                    f"R{base + 2 * n + 1}", integrators[1], 2 * i + 1, None, False, ("force", i, 0)
                )
            )
    return tuple(found)


def conditions(found: Sequence[Term]) -> tuple[Condition, ...]:
    """The matching conditions of these terms, in second-order form.

    With v_i' = (velocity state)/(R C of mass i's displacement integrator), a velocity term's
    coefficient is R_j C_j/(R C), a displacement term's 1/(R C), and the mass is R_i C_i.
    """
    integrator = {t.quantity[1]: t for t in found if t.quantity[0] == "mass"}
    out: list[Condition] = []
    for t in found:
        kind, _, j = t.quantity
        if kind == "mass":
            out.append(Condition(t.quantity, 1, {t.resistor: 1, t.capacitor: 1}))
            continue
        monomial = {t.resistor: -1, t.capacitor: -1}
        if kind == "damping":
            other = integrator[j]
            monomial[other.resistor] = monomial.get(other.resistor, 0) + 1
            monomial[other.capacitor] = monomial.get(other.capacitor, 0) + 1
        out.append(Condition(t.quantity, -1 if t.inverted else 1, monomial))
    return tuple(out)


def inverted_states(found: Sequence[Term]) -> tuple[int, ...]:
    """States whose negative some term needs: one inverter each."""
    return tuple(sorted({t.source for t in found if t.inverted and t.source is not None}))
