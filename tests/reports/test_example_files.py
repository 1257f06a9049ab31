"""The model files of format 2 with clearances in ``examples/``: the response that each wants, by
another road. Those without are in tests/dynamics/test_force_laws.py, combinations in
tests/dynamics/test_matrices.py and tests/synthesis/test_combinations.py."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from designer.model.driven import model_flow
from designer.model.find_responses import find
from designer.model.lumped_system import LumpedSystem
from designer.model.model_file import read_model_file
from reports.makers.first_grazing import first_grazings, located_grazing
from tests.shared.event_integrator import integrate
from tests.shared.exploring import quick
from tests.shared.mechanism_file import mechanism_of, omega_of
from tests.shared.mechanisms import absolute

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(
    path
    for path in EXAMPLES.glob("*.toml")
    if "[[clearance]]\n" in (text := path.read_text("utf-8")) and "\nof = " not in text
)
TOUCHED = {"backlash": 2.4, "hammer-base": 60.0}
"""Examples and the frequency at which their first touch is looked for: between two masses; under a
weight on a moving base."""


def test_every_example_is_here() -> None:
    assert len(FILES) == 12


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_wanted_responses_close_in_an_independent_integrator(path: Path) -> None:
    file = read_model_file(path)
    for number, found in enumerate(find(file.model, file.responses)):
        assert found.found, found.orbit.response
        orbit = found.orbit
        system, wanted = mechanism_of(path, found.omega)
        assert omega_of(wanted[number]) == pytest.approx(found.omega, rel=1e-15)
        end, entries = integrate(
            system, absolute(system, orbit.start), orbit.n * 2.0 * np.pi / found.omega
        )
        size = np.abs(orbit.extremes).max()
        assert end == pytest.approx(absolute(system, orbit.start), abs=1e-7 * size)
        counts = Counter((e.gap, e.side) for e in entries)
        sides = [(counts[k, 1], counts[k, -1]) for k in range(len(system.gaps))]
        text = f"{orbit.n}-" + ";".join(f"{p}-{q}" for p, q in sides)
        assert text == wanted[number]["expect"]


@pytest.mark.parametrize("name", quick(TOUCHED))
def test_the_first_touch_is_where_the_linear_response_fills_the_gap(name: str) -> None:
    model, omega = read_model_file(EXAMPLES / f"{name}.toml").model, TOUCHED[name]
    first = first_grazings(model, omega)[0].b
    assert located_grazing(model, omega, "b", first) == pytest.approx(first, rel=1e-9)


def test_stops_that_stay_see_the_ground_move() -> None:
    """Stops that move with the base watch the relative motion, others the absolute one."""
    model = read_model_file(EXAMPLES / "hammer-base.toml").model
    assert isinstance(model, LumpedSystem)
    assert model.base is not None
    omega, sag = 40.0, 19.6 / 8e3
    far = model.changed({"anvil.lower": 0.1})
    flow = model_flow(far, omega)
    start = flow.run(np.zeros(2), 200).strobes[-1]
    points = 1000
    z = flow.run(start, 1, points=points).strobes[:, 0]
    y = model.base.amplitude * np.sin(2.0 * np.pi * np.arange(points + 1) / points)
    fixed = replace(far, base=replace(model.base, stops="fixed"))
    for system, motion in ((far, z), (fixed, z + y)):
        (grazing,) = first_grazings(system, omega)
        assert grazing.b == pytest.approx(-(motion + sag).min() / (0.1 - sag), rel=1e-5)
