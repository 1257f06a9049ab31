"""The equations of motion of a model as plain text, with symbols and with its numbers.

Eq. (1), (2) and (4) of Shi and He, "Global bifurcation and circuit simulation of a soft-impacting
system", as corrected in docs/errata.md. Subscripts and primes are Unicode, so that the same line
stands in a page, in Markdown and in a picture.
"""

from __future__ import annotations

from designer.model.clearance import Sides
from designer.model.model import Dimensionless, Mechanical

SYMBOLS = (
    "x₁″ + 2ζ (x₁′ − x₂′) + (x₁ − x₂) + f(x₁) = (1 − f₂₀) sin ωt",
    "m/(1 − m) x₂″ + 2ζ (x₂′/(1 − c) − x₁′) + (x₂/(1 − k) − x₁) = f₂₀ sin ωt",
)
"""Eq. (4) as corrected, dimensionless; ``stop_force`` has f."""

MECHANICAL = (
    "M₁ X₁″ + C₁ (X₁′ − X₂′) + K₁ (X₁ − X₂) + F(X₁) = P₁ sin ΩT",
    "M₂ X₂″ + C₁ (X₂′ − X₁′) + C₂ X₂′ + K₁ (X₂ − X₁) + K₂ X₂ = P₂ sin ΩT",
)
"""Eq. (1) and (2), in SI units; ``stop_force`` has F."""


def dimensionless_equations(model: Dimensionless) -> tuple[str, ...]:
    """Eq. (4) with symbols; the force of the stops only where there are some."""
    return _lines(
        SYMBOLS, " + f(x₁)", stop_force("f(x)", "k₀/(1 − k₀)", "x", "b", model.sides, model.k0)
    )


def mechanical_equations(model: Mechanical) -> tuple[str, ...]:
    """Eq. (1) and (2) with symbols; the force of the stops only where there are some."""
    return _lines(MECHANICAL, " + F(X₁)", stop_force("F(X)", "K₀", "X", "B", model.sides, model.K0))


def equations_with_numbers(model: Dimensionless) -> tuple[str, ...]:
    """Eq. (4) with the values of a model, four digits each."""
    damping = _number(2.0 * model.zeta)
    second = f"{_times(model.m / (1.0 - model.m))}x₂″"
    return _lines(
        (
            f"x₁″ + {damping} (x₁′ − x₂′) + (x₁ − x₂) + f(x₁) = {_wave(1.0 - model.f20)}",
            f"{second} + {damping} ({_times(1.0 / (1.0 - model.c))}x₂′ − x₁′)"
            f" + ({_times(1.0 / (1.0 - model.k))}x₂ − x₁) = {_wave(model.f20)}",
        ),
        " + f(x₁)",
        stop_force("f(x)", _number(model.mu), "x", _number(model.b), model.sides, model.k0),
    )


def stop_force(
    name: str, stiffness: str, x: str, gap: str, sides: Sides, there: float
) -> tuple[str, ...]:
    """The law of the stops, of which there is none where ``there`` is 0."""
    if not there:
        return ()
    inside = {
        "both": f"{x} − clip({x}, −{gap}, {gap})",
        "upper": f"max({x} − {gap}, 0)",
        "lower": f"min({x} + {gap}, 0)",
    }[sides]
    law = f"({inside})" if sides == "both" else inside
    return (f"{name} = {stiffness} {law}",)


def _lines(equations: tuple[str, ...], stops: str, law: tuple[str, ...]) -> tuple[str, ...]:
    if law:
        return (*equations, *law)
    return tuple(line.replace(stops, "") for line in equations)


def _number(value: float) -> str:
    return f"{value:.4g}"


def _times(value: float) -> str:
    text = _number(value)
    return "" if text == "1" else f"{text} "


def _wave(amplitude: float) -> str:
    return f"{_times(amplitude)}sin ωt" if amplitude else "0"
