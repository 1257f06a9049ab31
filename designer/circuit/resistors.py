"""Resistors by name, each one part or two in series or parallel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from designer.base.errors import InputError
from designer.circuit.netlist import Circuit, Resistor

Composite = Literal["series", "parallel"]


class Resistors:
    """Makes the parts of a resistor from the values that were chosen.

    values : ohm by part name. composites : names that stand for two parts, NAMEA and NAMEB.

    Raises
    ------
    InputError : a composite that is neither in series nor in parallel.
    """

    def __init__(self, values: Mapping[str, float], composites: Mapping[str, Composite]) -> None:
        for name, kind in composites.items():
            if kind not in ("series", "parallel"):
                raise InputError(None, f"composites.{name}", kind, '"series" or "parallel"')
        self._values = values
        self._composites = dict(composites)

    def __call__(
        self, name: str, a: str, b: str, role: str, *, like: str | None = None
    ) -> list[Resistor]:
        """The parts of resistor ``name`` between nets a and b; series meet at the net ``namem``.

        like : a resistor whose value it has where it has none of its own.

        Raises
        ------
        KeyError : no value for a part.
        """
        kind = self._composites.pop(name, None)
        if kind is None:
            known = name if like is None or name in self._values else like
            return [Resistor(name, a, b, self._values[known], role)]
        middle = f"{name.lower()}m"
        first, second = ((a, middle), (middle, b)) if kind == "series" else ((a, b), (a, b))
        return [
            Resistor(f"{name}A", *first, self._values[f"{name}A"], role),
            Resistor(f"{name}B", *second, self._values[f"{name}B"], role),
        ]

    def done(self) -> None:
        """Every composite must have met its resistor.

        Raises
        ------
        InputError : a name that is no resistor of the circuit.
        """
        if self._composites:
            raise InputError(
                None, "composites", ", ".join(sorted(self._composites)), "resistors of the circuit"
            )


def effective(values: Mapping[str, float], composites: Mapping[str, Composite]) -> dict[str, float]:
    """Values by the names of a circuit without composites: NAME instead of NAMEA and NAMEB."""
    out = dict(values)
    for name, kind in composites.items():
        a, b = out.pop(f"{name}A"), out.pop(f"{name}B")
        out[name] = a + b if kind == "series" else a * b / (a + b)
    return out


def composites_of(circuit: Circuit) -> dict[str, Composite]:
    """The resistors of a circuit that are two parts, and how those are joined."""
    composites: dict[str, Composite] = {}
    by_name = {r.name: r for r in circuit.resistors}
    for name, first in by_name.items():
        second = by_name.get(f"{name[:-1]}B")
        if name.endswith("A") and second is not None:
            parallel = (first.a, first.b) == (second.a, second.b)
            composites[name[:-1]] = "parallel" if parallel else "series"
    return composites
