"""The equations of a system as text: evaluated, they are those that are solved."""

from __future__ import annotations

import re

import numpy as np
import pytest

from designer.model.lumped_system import LumpedSystem
from designer.model.model_file import parse_model_file
from designer.plots.system_equations import (
    approximation_notes,
    element_rows,
    equations_of,
    number_of,
)
from tests.model.test_lumped_system import HAMMER

HERTZ = 'law = "hertz"\nconstant = 3e10\ndepth = "0.3 mm"'
SECOND = '[[clearance]]\nname = "B"\nbetween = ["hammer", "casing"]\nupper = "-0.1 mm"\n'
SECOND += 'stiffness = "90 kN/m"\n'
CHAIN = HAMMER.replace('expect = "1-1-1"\n', "")
FILES = {
    "preload between masses": CHAIN + SECOND,
    "moving base": CHAIN + SECOND + '[base]\namplitude = "0.3 mm"\n',
    "fixed stops, Hertz": CHAIN.replace('stiffness = "540 kN/m"', HERTZ)
    + '[base]\namplitude = "0.3 mm"\nstops = "fixed"\n',
    "a push": CHAIN.replace('stiffness = "540 kN/m"', 'stiffness = "540 kN/m"\npreload = "7 N"'),
    "a push that rises": CHAIN.replace(
        'stiffness = "540 kN/m"', 'stiffness = "540 kN/m"\npreload = "7 N"\npreload_over = "0.3 mm"'
    ),
    "a push that rises beside Hertz": CHAIN.replace(
        'stiffness = "540 kN/m"', f'{HERTZ}\npreload = "7 N"\npreload_over = "0.5 mm"'
    ),
    "restitution": CHAIN.replace(
        'stiffness = "540 kN/m"', 'stiffness = "540 kN/m"\nrestitution = 0.8'
    ),
    "ground first, damped": CHAIN.replace('["hammer", "ground"]', '["ground", "hammer"]').replace(
        'stiffness = "540 kN/m"', 'stiffness = "540 kN/m"\ndamping = 30.0'
    ),
}
PLAIN = str.maketrans("₀₁₂₃₄₅₆₇₈₉−", "0123456789-")


def system(text: str) -> LumpedSystem:
    model = parse_model_file(text).model
    assert isinstance(model, LumpedSystem)
    return model


def as_python(side: str) -> str:
    text = side.translate(PLAIN).replace("sin ωt", "wave").replace("″", "_2").replace("′", "_1")
    return re.sub(r"(?<=[\w)]) (?=[\w(])", " * ", text)


def accelerations(model: LumpedSystem, x: list[float], v: list[float], omega: float) -> list[float]:
    """By the text with numbers, at ωt = 0.7; a stop's damper pushes in contact only."""
    lines = equations_of(model, number_of)
    wave = float(np.sin(0.7))
    known: dict[str, object] = {"wave": wave, "max": max, "min": min}
    base = 0.0 if model.base is None else model.base.amplitude
    known |= {"y": base * wave, "y_1": base * omega * float(np.cos(0.7))}
    for i, (place, speed) in enumerate(zip(x, v, strict=True), start=1):
        known |= {f"x{i}": place, f"x{i}_1": speed, f"x{i}_2": 0.0}
    for line in lines[len(x) :]:
        name, law = line.split(" = ")
        spring, _, damper = law.partition(", and ")
        if name.endswith("(u)"):
            code = compile(as_python(spring), name, "eval")
            coefficient = float(damper.split()[0]) if damper else 0.0
            turned = -1.0 if (model.gaps[0].between or "")[0] == "ground" else 1.0

            def force(u: float, code=code, c=coefficient, w=turned * v[0]) -> float:  # type: ignore[no-untyped-def]
                push = float(eval(code, {**known, "u": u}))
                return push + (c * w if push else 0.0)

            known[name[0]] = force
    out = []
    for line, mass in zip(lines, model.masses, strict=False):
        left, right = (float(eval(as_python(side), dict(known))) for side in line.split(" = "))
        out.append((right - left) / mass.mass)
    return out


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("first", [9e-4, -1.1e-3, 2e-4])
def test_the_text_is_what_is_solved(name: str, first: float) -> None:
    model, omega = system(FILES[name]), 300.0
    x, v = [first, -3e-4], [0.05, -0.02]
    linear = model.second_order().piecewise_linear(omega)
    # Where the stops stay, the states are absolute.
    base = 0.0 if model.second_order().absolute else model.second_order().base
    wave, slope = float(np.sin(0.7)), float(np.cos(0.7))
    z = np.ravel([[a - base * wave, b - base * omega * slope] for a, b in zip(x, v, strict=True)])
    mode = linear.mode(linear.mode_at(z, wave))
    relative = mode.A @ z + mode.B * wave + mode.d
    if mode.waves is not None:
        relative += mode.waves[:, 0] * slope
    absolute = relative[1::2] - base * omega**2 * wave
    assert accelerations(model, x, v, omega) == pytest.approx(absolute, rel=1e-4)


def test_elements_have_units_and_hertz_its_error() -> None:
    model = system(FILES["fixed stops, Hertz"])
    rows = {symbol: value for symbol, value, _ in element_rows(model, si=True)}
    assert (rows["m₁"], rows["k₁"], rows["A.upper"]) == ("2 kg", "60 kN/m", "0.5 mm")
    assert {symbol: value for symbol, value, _ in element_rows(model, si=False)}["k₁"] == "60000"
    assert model.gaps[0].hertz is not None
    (note,) = approximation_notes(model, si=True)
    assert f"at most {100.0 * model.gaps[0].hertz.largest_error:.2g} %" in note
    assert "^1.5" in equations_of(model)[2]
