"""The mechanical model, in SI units and dimensionless, and the way between them.

Eq. (1)-(5) of Shi and He, "Global bifurcation and circuit simulation of a soft-impacting system",
as corrected in docs/errata.md. Mass M1 carries the clearance; K1, C1 join the masses; K2, C2 join
M2 to ground; stops of stiffness K0 stand at distance B on one or both sides of M1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from designer.base.errors import InputError
from designer.base.schema import (
    GREATEST,
    SMALLEST,
    Accepts,
    FileTable,
    check_values,
    choice,
    number,
    physical,
)
from designer.model.clearance import Clearance, Sides
from designer.model.mechanics import SecondOrderSystem

TRIED = {
    "m": (1e-9, 1.0 - 1e-9),
    "k": (1e-9, 1.0 - 1e-9),
    "c": (0.0, 1.0 - 1e-9),
    "zeta": (0.0, 1e6),
}
"""Closed intervals beyond which a parameter is refused, though it is a number in its domain: the
slowest and the fastest motion are then so far apart that the linear algebra, or a single drive
period, comes to no end (docs/stability.md)."""
BELOW_ONE = math.nextafter(1.0, 0.0)
DOMAINS = {
    "b": (SMALLEST, GREATEST),
    "k0": (0.0, BELOW_ONE),
    "zeta": (SMALLEST, TRIED["zeta"][1]),
    "m": TRIED["m"],
    "k": TRIED["k"],
    "c": TRIED["c"],
    "f20": (0.0, 1.0),
}
"""Closed intervals in which a parameter can be followed."""


_SIDES = choice("both", "upper", "lower")


def _parameter(domain: str, inside: Callable[[float], bool]) -> Accepts:
    return number("", f"a number {domain}", inside)


_INSIDE_0_1 = _parameter("in (0, 1)", lambda value: 0.0 < value < 1.0)
_HOLDING = _parameter(
    "in (0, 1); k = 0 leaves a mode of motion without stiffness, which no circuit can hold",
    lambda k: 0.0 < k < 1.0,
)
_BELOW_1 = _parameter("in [0, 1)", lambda value: 0.0 <= value < 1.0)
_SHARE = _parameter("in [0, 1]", lambda value: 0.0 <= value <= 1.0)
_POSITIVE = _parameter("> 0", lambda value: value > 0.0)


@dataclass(frozen=True)
class Dimensionless(FileTable):
    """Dimensionless parameters, Eq. (3). Each lies in its domain and within ``TRIED``.

    Raises
    ------
    InputError : a parameter lies outside its domain, or outside what was tried of it.
    """

    m: Annotated[float, _INSIDE_0_1]
    """Mass ratio M2/(M1 + M2), in (0, 1)."""
    k: Annotated[float, _HOLDING]
    """Stiffness ratio K2/(K1 + K2), in (0, 1)."""
    k0: Annotated[float, _BELOW_1]
    """Stop stiffness ratio K0/(K0 + K1), in [0, 1)."""
    c: Annotated[float, _BELOW_1]
    """Damping ratio C2/(C1 + C2), in [0, 1)."""
    zeta: Annotated[float, _POSITIVE]
    """Damping C1/(2 sqrt(K1 M1)), > 0."""
    f20: Annotated[float, _SHARE]
    """Share of the force on the second mass P2/(P1 + P2), in [0, 1]."""
    b: Annotated[float, _POSITIVE]
    """Clearance B K1/(P1 + P2), > 0."""
    sides: Annotated[Sides, _SIDES] = "both"
    """The stops that exist."""

    def __post_init__(self) -> None:
        check_values(self, "model")
        for name, (low, high) in TRIED.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(
                    None,
                    f"model.{name}",
                    value,
                    f"a number from {low:g} to {_close(high)}: beyond it one drive period has more "
                    "steps than can be run, or the equations are singular to rounding",
                )

    @property
    def mu(self) -> float:
        """Stop stiffness over K1: k0/(1 - k0), Eq. (5)."""
        return self.k0 / (1.0 - self.k0)

    @property
    def parameters(self) -> Mapping[str, tuple[float, float]]:
        """``DOMAINS``."""
        return DOMAINS

    @property
    def units(self) -> Mapping[str, str]:
        """A length; the others are ratios."""
        return {"b": "m"}

    @property
    def listed(self) -> frozenset[str]:
        """None."""
        return frozenset()

    @property
    def idle(self) -> frozenset[str]:
        """None: a title has every parameter of the paper."""
        return frozenset()

    def parameter(self, name: str) -> float:
        """The value of one of ``parameters``."""
        return float(getattr(self, name))

    def changed(self, changes: Mapping[str, float]) -> Dimensionless:
        """The model with other values of some ``parameters``.

        Raises
        ------
        InputError : a value outside its domain.
        """
        values: dict[str, Any] = dict(changes)
        return replace(self, **values) if values else self

    def as_dict(self) -> dict[str, object]:
        """The parameters by name."""
        return dict(self.__dict__)

    def at(self, b: float) -> Dimensionless:
        """The model at another clearance."""
        return replace(self, b=b)

    def second_order(self) -> SecondOrderSystem:
        """Eq. (4) as corrected, in dimensionless time and displacement."""
        z2 = 2.0 * self.zeta
        clearances: tuple[Clearance, ...] = ()
        if self.k0 > 0.0:
            clearances = (Clearance.even(0, self.mu, self.b, self.sides),)
        return SecondOrderSystem(
            mass=np.array([1.0, self.m / (1.0 - self.m)]),
            damping=np.array([[z2, -z2], [-z2, z2 / (1.0 - self.c)]]),
            stiffness=np.array([[1.0, -1.0], [-1.0, 1.0 / (1.0 - self.k)]]),
            force=np.array([1.0 - self.f20, self.f20]),
            clearances=clearances,
        )


@dataclass(frozen=True)
class SiScales:
    """SI values of a model's units; 1 each for a model whose numbers are SI."""

    time_scale: float = 1.0
    """Seconds per unit of the model's time."""
    length_scale: float = 1.0
    """Metres per unit of its displacements."""
    force_scale: float = 1.0
    """Newtons per unit of its forces."""

    @property
    def speed_scale(self) -> float:
        """Metres per second per unit of its velocities."""
        return self.length_scale / self.time_scale

    @property
    def acceleration_scale(self) -> float:
        """Metres per second squared per unit of its accelerations."""
        return self.speed_scale / self.time_scale

    def omega(self, Omega: float) -> float:
        """The model's frequency of an excitation at ``Omega`` rad/s."""
        return Omega * self.time_scale

    def hertz(self, omega: float) -> float:
        """Frequency in Hz of an excitation at the model's frequency ``omega``."""
        return omega / (2.0 * math.pi * self.time_scale)


def _close(value: float) -> str:
    """A number near 1 with its distance from it."""
    return f"1 - {1.0 - value:.0e}" if 0.99 < value < 1.0 else f"{value:g}"


@dataclass(frozen=True)
class Mechanical(FileTable):
    """Parameters of Eq. (1)-(2) in SI units."""

    M1: Annotated[float, physical("kg")]
    """Mass that carries the clearance [kg]."""
    M2: Annotated[float, physical("kg")]
    """Second mass [kg]."""
    C1: Annotated[float, physical("N s/m")]
    """Damping between the masses [N s/m]."""
    C2: Annotated[float, physical("N s/m", zero=True)]
    """Damping between the second mass and ground [N s/m]."""
    K0: Annotated[float, physical("N/m", zero=True)]
    """Stiffness of the stops [N/m]."""
    K1: Annotated[float, physical("N/m")]
    """Stiffness between the masses [N/m]."""
    K2: Annotated[float, physical("N/m")]
    """Stiffness between the second mass and ground [N/m]."""
    B: Annotated[float, physical("m")]
    """Distance of a stop from the rest position [m]."""
    P1: Annotated[float, physical("N", zero=True)]
    """Amplitude of the force on the first mass [N]."""
    P2: Annotated[float, physical("N", zero=True)]
    """Amplitude of the force on the second mass [N]."""
    sides: Annotated[Sides, _SIDES] = "both"
    """The stops that exist."""

    def __post_init__(self) -> None:
        check_values(self, "mechanical")
        if self.P1 + self.P2 <= 0.0:
            raise InputError(
                None, "mechanical.P1", self.P1, "P1 + P2 > 0: without a force nothing moves"
            )

    @property
    def scales(self) -> SiScales:
        """Those of Eq. (3): sqrt(M1/K1), (P1 + P2)/K1 and P1 + P2."""
        force = self.P1 + self.P2
        return SiScales(math.sqrt(self.M1 / self.K1), force / self.K1, force)

    def dimensionless(self) -> Dimensionless:
        """Eq. (3)."""
        return Dimensionless(
            m=self.M2 / (self.M1 + self.M2),
            k=self.K2 / (self.K1 + self.K2),
            k0=self.K0 / (self.K0 + self.K1),
            c=self.C2 / (self.C1 + self.C2),
            zeta=self.C1 / (2.0 * math.sqrt(self.K1 * self.M1)),
            f20=self.P2 / (self.P1 + self.P2),
            b=self.B * self.K1 / (self.P1 + self.P2),
            sides=self.sides,
        )

    @classmethod
    def from_dimensionless(
        cls,
        model: Dimensionless,
        *,
        M1: float,
        K1: float,
        force: float,
    ) -> Mechanical:
        """The inverse of Eq. (3) for a chosen mass M1 [kg], stiffness K1 [N/m], force P1 + P2 [N].

        Eq. (3) fixes only ratios, so three scales are free.
        """
        C1 = 2.0 * model.zeta * math.sqrt(K1 * M1)
        return cls(
            M1=M1,
            M2=M1 * model.m / (1.0 - model.m),
            C1=C1,
            C2=C1 * model.c / (1.0 - model.c),
            K0=K1 * model.mu,
            K1=K1,
            K2=K1 * model.k / (1.0 - model.k),
            B=model.b * force / K1,
            P1=force * (1.0 - model.f20),
            P2=force * model.f20,
            sides=model.sides,
        )

    def second_order(self) -> SecondOrderSystem:
        """Eq. (1)-(2) in SI units."""
        clearances: tuple[Clearance, ...] = ()
        if self.K0 > 0.0:
            clearances = (Clearance.even(0, self.K0, self.B, self.sides),)
        return SecondOrderSystem(
            mass=np.array([self.M1, self.M2]),
            damping=np.array([[self.C1, -self.C1], [-self.C1, self.C1 + self.C2]]),
            stiffness=np.array([[self.K1, -self.K1], [-self.K1, self.K1 + self.K2]]),
            force=np.array([self.P1, self.P2]),
            clearances=clearances,
        )
