"""Poincaré sections and spectra of traces, against closed forms."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest
from scipy.integrate import trapezoid

from designer.check import simulation
from designer.check.motion_record import power_spectrum, section
from designer.model.driven import model_flow
from designer.model.model_file import parse_model_file
from designer.plots.simulate_plots import section_csv, section_figure, spectrum_figure
from tests.cli.test_entry import BASE
from tests.shared.figure_text import clipped, overlapping
from tests.shared.oracles import Plain, response_amplitude


def test_the_linear_response_has_one_line_of_the_amplitude_in_closed_form() -> None:
    file = parse_model_file(BASE.replace("k0 = 0.95", "k0 = 0.0"))
    (found,) = simulation.simulate(file, [0.9], traces=True, starts=1)
    trace = found.traces[0]
    plain = Plain(0.5, 0.5, 0.0, 0.5, 0.1, 0.0, 0.25)
    for column, amplitude in ((0, 0), (2, 1)):
        x = trace.states[:, column]
        spectrum = power_spectrum(trace.time, x, 0.9, periodic=True)
        wanted = np.zeros(len(spectrum.power))
        wanted[1] = abs(response_amplitude(plain, 0.9)[amplitude])
        np.testing.assert_allclose(np.sqrt(spectrum.power), wanted, atol=1e-9)
        assert spectrum.frequency[1] == 1.0


def test_lines_are_the_amplitudes_of_a_sum_of_sines() -> None:
    """Over three drive periods: a mean, a third of its frequency, and its fifth harmonic."""
    omega = 1.7
    time = np.linspace(0.0, 3.0 * 2.0 * np.pi / omega, 3 * 64 + 1)
    x = 0.2 + 0.5 * np.cos(omega * time / 3.0 + 1.0) + 0.03 * np.sin(5.0 * omega * time)
    spectrum = power_spectrum(time, x, omega, periodic=True)
    lines = np.flatnonzero(spectrum.power > 1e-20)
    np.testing.assert_allclose(spectrum.frequency[lines], [0.0, 1.0 / 3.0, 5.0], rtol=1e-12)
    np.testing.assert_allclose(np.sqrt(spectrum.power[lines]), [0.2, 0.5, 0.03], rtol=1e-9)


def test_a_density_holds_the_mean_square_of_what_it_shows() -> None:
    """A sine off the grid of frequencies: its mean square stands about its frequency."""
    time = np.linspace(0.0, 2.0 * np.pi * 512, 512 * 32 + 1)
    spectrum = power_spectrum(time, 0.4 * np.sin(np.sqrt(2.0) * time), 1.0, periodic=False)
    near = np.abs(spectrum.frequency - np.sqrt(2.0)) < 0.1
    mean_square = trapezoid(spectrum.power[near], spectrum.frequency[near])
    assert mean_square == pytest.approx(0.08, rel=1e-3)


def test_a_section_of_period_two_has_two_points_that_follow_each_other() -> None:
    file = parse_model_file(BASE)
    (found,) = simulation.simulate(file, [0.7], traces=True, starts=1)
    assert found.orbit.n == 2
    points = section(found.traces[0], 0.7)
    flow = model_flow(file.model, 0.7)
    for here, there in zip(points, points[::-1], strict=True):
        np.testing.assert_allclose(flow.run(here, 1).strobes[-1], there, atol=1e-9)
    rows = list(csv.DictReader(io.StringIO(section_csv(found))))
    assert [row["motion"] for row in rows] == ["orbit"] * 2 + ["twin"] * 2
    assert [float(row["x1"]) for row in rows[:2]] == points[:, 0].tolist()


@pytest.mark.slow
def test_chaos_has_a_long_record_and_readable_pictures() -> None:
    (found,) = simulation.simulate(parse_model_file(BASE), [1.25], traces=True, starts=1)
    assert found.record is not None
    points = section(found.record, 1.25)
    assert len(points) == 2048
    assert len(np.unique(np.round(points[:, 0], 6))) > 1500
    for draw in (section_figure, spectrum_figure):
        figure = draw(found)
        assert clipped(figure) == []
        assert overlapping(figure) == []
