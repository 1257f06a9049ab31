"""Runge-Kutta of any system against the exact flow, and against the one for the paper's masses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from designer.circuit.paper_values import MODEL
from designer.fidelity import runge_kutta, system_runge_kutta
from designer.model.driven import model_flow
from designer.model.model_file import parse_model_file
from tests.shared.system_text import clearance, system_text, table

THREE = system_text(
    {"a": 1.0, "b": 2.0, "c": 0.5},
    {("a", "b"): 1.0, ("b", "c"): 2.0, ("c", "ground"): 1.5},
    {("a", "b"): 0.1, ("c", "ground"): 0.3},
    clearance("A", "a", "ground", upper=0.3, lower=0.5, stiffness=9.0),
    clearance("B", "b", "c", upper=0.1, upper_stiffness=4.0),
    table("force", on="b", amplitude=-0.4, constant=0.1),
    table("force", on="a", amplitude=0.2, phase=0.7, harmonics=[[2, 0.1, 0.0], [3, 0.1, 1.0]]),
    '[base]\namplitude = 0.2\nstops = "fixed"\n',
    table("cubic_spring", between=("c", "ground"), k1=-0.5, k3=0.5, range=1.0, points=6),
    table("friction", between=("a", "b"), force=0.1, velocity=0.2, speed=0.1),
)


def test_smaller_steps_come_to_the_exact_flow() -> None:
    """Blind to the stops it is not of fourth order there, but it comes to the same motion."""
    model, omega = parse_model_file(THREE, Path("three.toml")).model, 0.9
    start = np.array([0.2, 0.1, -0.1, 0.0, 0.05, 0.2])
    flow = model_flow(model, omega)
    exact = flow.run(start, 3)
    assert exact.counts.sum() > 0
    coarse, fine = (
        np.abs(system_runge_kutta.run(model, omega, start, 3, n) - exact.strobes[-1]).max()
        for n in (2000, 32000)
    )
    assert coarse < 1e-5
    assert fine < coarse / 50.0
    drawn = system_runge_kutta.trace(model, omega, start, 3, 40, 2000)
    dense = flow.run(start, 3, points=40).strobes
    np.testing.assert_allclose(drawn, dense, atol=1e-5)


def test_the_paper_s_masses_are_one_case() -> None:
    start = np.array([0.1, 0.2, -0.1, 0.05])
    ours = system_runge_kutta.run(MODEL, 0.85, start, 3, 1000)
    theirs = runge_kutta.run(MODEL, 0.85, start, 3, 1000)
    assert ours == pytest.approx(theirs, rel=1e-10, abs=1e-12)
