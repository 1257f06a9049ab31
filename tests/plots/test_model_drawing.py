"""The model in pictures and equations: they say what the system of matrices says."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from designer.base import figure_style
from designer.jobs.template import TEXT
from designer.model.ascii_sketch import sketch
from designer.model.clearance import Sides
from designer.model.model import Dimensionless, Mechanical
from designer.plots.system_drawing import pair_drawing
from designer.report.design_page import (
    dimensionless_equations,
    equations_with_numbers,
    mechanical_equations,
)
from tests.shared.figure_text import clipped, overlapping

MODEL = Dimensionless(m=0.2, k=0.6, k0=0.9, c=0.5, zeta=0.05, f20=0.25, b=0.3)
SI = Mechanical(
    M1=2.0, M2=0.75, C1=40.0, C2=12.5, K0=123456.0, K1=20000.0, K2=20321.0, B=1.5e-4, P1=50.25,
    P2=22.5,
)  # fmt: skip
BARE = replace(MODEL, k0=0.0, c=0.0, f20=0.0)
MODELS: dict[str, Dimensionless | Mechanical] = {
    "both": MODEL,
    "upper": replace(MODEL, sides="upper"),
    "lower": replace(MODEL, sides="lower"),
    "bare": BARE,
    "driven at M2": replace(MODEL, f20=1.0),
    "SI": SI,
    "SI upper": replace(SI, sides="upper"),
}
ASCII = str.maketrans("₀₁₂−", "012-")


def _python(text: str) -> str:
    """An expression as it is printed, in Python: primes to names, spaces between factors to *."""
    text = text.translate(ASCII).replace("2ζ", "2 zeta").replace("X", "x")
    text = re.sub(r"sin (?:ωt|ΩT)|sin\((?:omega t|Omega T)\)", "wave", text)
    text = re.sub(r"x(\d)(?:″|'')", r"a\1", text)
    text = re.sub(r"x(\d)[′']", r"v\1", text)
    return re.sub(r"(?<=[\w)]) (?=[\w(])", "*", text)


def _residuals(lines: Sequence[str], known: Mapping[str, Any]) -> list[float]:
    """Left minus right side of both equations; a third line is the law of the stops."""
    names = dict(known) | {"clip": lambda x, low, high: min(max(x, low), high)}
    for line in lines[2:]:
        head, law = line.split(" = ")
        body = _python(law)
        names[head[0]] = lambda x, body=body: eval(body, {**names, "x": x})
    sides = [[eval(_python(side), dict(names)) for side in line.split(" = ")] for line in lines[:2]]
    return [left - right for left, right in sides]


def _state(model: Dimensionless | Mechanical, x: Sequence[float]) -> dict[str, Any]:
    """A state in motion, with the accelerations that the matrices give."""
    system, v, wave = model.second_order(), np.array([0.7, -0.4]), 0.6
    force = system.force * wave - system.damping @ v - system.stiffness @ np.array(x)
    for stop in system.clearances:
        for side, spring in stop.sides:
            depth = side * x[stop.mass] - spring.gap
            force[stop.mass] -= side * spring.stiffness * max(depth, 0.0)
    a = force / system.mass
    return {
        **vars(model), "wave": wave, "x1": x[0], "x2": x[1], "v1": v[0], "v2": v[1],
        "a1": a[0], "a2": a[1],
    }  # fmt: skip


PLACES = [(0.1, 0.5), (0.9, -0.2), (-0.8, 0.3)]
"""Displacements inside the clearance, and in contact with either stop."""


@pytest.mark.parametrize("name", [n for n in MODELS if not n.startswith("SI")])
def test_dimensionless_equations_are_those_of_the_system(name: str) -> None:
    model = MODELS[name]
    assert isinstance(model, Dimensionless)
    for x in PLACES:
        state = _state(model, x)
        for lines in (dimensionless_equations(model), equations_with_numbers(model)):
            assert _residuals(lines, state) == pytest.approx([0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("name", ["SI", "SI upper"])
def test_mechanical_equations_are_those_of_the_system(name: str) -> None:
    model = MODELS[name]
    assert isinstance(model, Mechanical)
    for x in np.array(PLACES) * model.B / 0.3:
        state = _state(model, x)
        assert _residuals(mechanical_equations(model), state) == pytest.approx([0.0] * 2, abs=1e-7)


def test_the_starter_s_equations_are_those_of_the_system() -> None:
    head = TEXT.partition("[model]\n")[0]
    comments = [line[2:] for line in head.splitlines() if re.match(r"# .* = .*", line)]
    equations = [line for line in comments if re.match(r"[xXfFmM][\w/']*[( ]", line)]
    mechanical = [line for line in equations if "X" in line][:3]
    rest = [line for line in equations if line not in mechanical]
    assert (len(mechanical), len(rest)) == (3, 3)
    for x in PLACES:
        assert _residuals(rest, _state(MODEL, x)) == pytest.approx([0.0] * 2, abs=1e-9)
        small = [v * SI.B / 0.3 for v in x]
        assert _residuals(mechanical, _state(SI, small)) == pytest.approx([0.0] * 2, abs=1e-7)


def _texts(figure: Figure) -> list[str]:
    return [t.get_text().replace("\u00a0", " ") for t in figure.axes[0].texts if t.get_text()]


@pytest.mark.parametrize("name", [*MODELS, "names"])
def test_no_text_of_the_drawing_is_cut_off_or_covered(name: str) -> None:
    figure = pair_drawing(MODELS.get(name))
    assert (clipped(figure), overlapping(figure)) == ([], [])
    assert figure_style.to_svg(figure) == figure_style.to_svg(pair_drawing(MODELS.get(name)))


def test_the_drawing_shows_the_values() -> None:
    assert {"M₂\n0.25", "K₂ = 1.5", "C₂ = 0.1", "C₁ = 0.1", "K₀ = 9", "b = 0.3"} <= set(
        _texts(pair_drawing(MODEL))
    )
    shown = _texts(pair_drawing(SI))
    assert {"M₂\n750 g", "K₁ = 20 kN/m", "C₂ = 12.5 N s/m", "B = 0.15 mm"} <= set(shown)
    assert "P₁ sin ΩT, P₁ = 50.25 N" in shown


@pytest.mark.parametrize(
    ("name", "right", "left"), [("upper", 1, 0), ("lower", 0, 1), ("both", 1, 1)]
)
def test_only_the_stops_that_there_are_stand_on_their_side(
    name: Sides, right: int, left: int
) -> None:
    axes = pair_drawing(MODELS[name]).axes[0]
    (mass,) = [t.get_position()[0] for t in axes.texts if t.get_text().startswith("M₁")]
    stops = [t.get_position()[0] for t in axes.texts if t.get_text().startswith("K₀")]
    assert (sum(x > mass for x in stops), sum(x < mass for x in stops)) == (right, left)
    top = sketch(replace(MODEL, sides=name)).splitlines()
    column = top[-2].index("x1") - 5  # below the rod
    assert top[2][column] == "|"
    assert (top[0].rfind("K0") > column, 0 <= top[0].find("K0") < column) == (right, left)


def test_what_a_model_does_not_have_is_not_drawn() -> None:
    for text in (" ".join(_texts(pair_drawing(BARE))), sketch(BARE).translate(ASCII)):
        for name in ("C₂", "K₀", "P₂", "B", "C2", "K0", "P2"):
            assert name not in text
    assert "f(x₁)" not in " ".join(dimensionless_equations(BARE))
    assert "P1" not in sketch(replace(MODEL, f20=1.0))
