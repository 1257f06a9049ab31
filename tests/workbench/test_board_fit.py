"""The board behind its records, against boards whose motion another integrator ran."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.piecewise_linear import Drive, ModeKey, PiecewiseLinearSystem
from designer.spread.spread import Spread, draw_many
from designer.workbench.board_fit import (
    BoardFit,
    NetOrbit,
    NoSuchBoard,
    fit_board,
    follow,
    orbit_slopes,
)
from designer.workbench.board_prior import Prior
from designer.workbench.fitted_board import NORMAL, board_figures, determined_figures, figures
from designer.workbench.observation import observe
from designer.workbench.record import Record, RecordedMotion
from tests.shared.paper_cases import subject

SPREAD = Spread(0.01, 0.01, 1e-3, 4e-3)
PERIODS, SAMPLES, BITS = 3, 4000, 8
PS = (1, 2)
"""Records of the responses 1-1-1 and 1-2-2."""


def integrated(system: PiecewiseLinearSystem, drive: Drive, x: Array, times: Array) -> Array:
    """(k, states) at times from 0 on by DOP853, restarted at every boundary."""
    t, key, out = 0.0, system.mode_at(x, drive.offset), []

    def guard(number: int, mode: ModeKey):  # type: ignore[no-untyped-def]
        g = system.mode(mode).guards[number]

        def value(t: float, x: Array) -> float:
            u = drive.amplitude * np.sin(drive.omega * t) + drive.offset
            return float(g.C @ x + g.D * u + g.e)

        value.terminal, value.direction = True, 1.0  # type: ignore[attr-defined]
        return value

    while t < times[-1]:
        m = system.mode(key)

        def rate(t: float, x: Array, m=m) -> Array:  # type: ignore[no-untyped-def]
            u = drive.amplitude * np.sin(drive.omega * t) + drive.offset
            return np.asarray(m.A @ x + m.B * u + m.d)

        here = times[(times >= t) & (times <= times[-1])]
        events = [guard(i, key) for i in range(len(m.guards))]
        run = solve_ivp(
            rate, (t, times[-1]), x, "DOP853", here, events=events, rtol=1e-9, atol=1e-9,
            max_step=drive.period / 20,
        )  # fmt: skip
        out.append(np.reshape(np.asarray(run.y).T, (-1, len(x))))
        if run.status != 1:
            break
        assert run.t_events is not None
        assert run.y_events is not None
        which = next(i for i, at in enumerate(run.t_events) if len(at))
        x, t, key = run.y_events[which][0], float(run.t_events[which][0]), m.guards[which].target
        t = np.nextafter(t, np.inf)
    return np.concatenate(out)


def recorded(
    reduction: Reduction, excitation: Excitation, start: Array, rng: np.random.Generator
) -> RecordedMotion:
    """A scope's record of v1 and the generator: 8 bits, noise 1 %, gain ± 2 %, offset ± 1 %."""
    drive, first = excitation.drive, rng.uniform(0.0, 1.0)
    times = (first + np.arange(SAMPLES) * PERIODS / SAMPLES) * drive.period
    states = integrated(reduction.system(), drive, start, times)
    u = drive.amplitude * np.sin(drive.omega * times) + drive.offset
    screens = {}
    for name, volts in {"v1": states[:, 0], "vm": u}.items():
        span = 2.5 * np.abs(volts).max()
        shown = volts * (1.0 + rng.uniform(-0.02, 0.02)) + rng.uniform(-0.01, 0.01) * span
        shown = shown + rng.normal(0.0, 0.01 * np.abs(volts).max(), SAMPLES)
        screens[name] = np.round(shown / span * 2**BITS) * span / 2**BITS
    record = Record(times - times[0], screens, "scope")
    phase = (drive.omega * times[0] + np.pi) % (2.0 * np.pi)
    return RecordedMotion(
        record, {"v1": "v1", "vm": "vm"}, "vm", excitation.frequency, 0.0,
        excitation.amplitude, 0.0, phase,
    )  # fmt: skip


@pytest.fixture(scope="module")
def prior() -> Prior:
    return Prior(subject(1).circuit, SPREAD, bandwidth=False)


@pytest.fixture(scope="module")
def fitted(prior: Prior) -> tuple[BoardFit, dict[str, float]]:
    """The fit of one board of the spread's own laws, and that board's figures."""
    boards, rng = draw_many(prior.circuit, SPREAD, 7, range(1)), np.random.default_rng(3)
    ensemble, seen = Ensemble(boards), []
    for p in PS:
        drive = subject(p).excitation.drive
        (orbit,) = ensemble.settle([0], [drive], subject(p).orbit.start[None])
        assert orbit.response == f"1-{p}-{p}"
        seen.append(recorded(ensemble.reduction(0), subject(p).excitation, orbit.start, rng))
    observations = [
        observe(motion, ("v1",), subject(p).excitation) for motion, p in zip(seen, PS, strict=True)
    ]
    starts = [[subject(p).orbit.start] for p in PS]
    truth = {name: float(v[0]) for name, (_, v) in board_figures(prior.circuit, boards).items()}
    return fit_board(prior, observations, starts), truth


def test_gaps_and_force_are_those_of_the_board(
    fitted: tuple[BoardFit, dict[str, float]],
) -> None:
    fit, truth = fitted
    told = {figure.name: figure for figure in determined_figures(fit)}
    for gap in ("upper gap", "lower gap"):
        assert told[gap].value == pytest.approx(truth[gap], abs=0.01)
    force = told["constant force"]
    assert abs(force.value - truth["constant force"]) < 0.1 * force.sigma


def test_intervals_hold_the_truth_and_what_is_not_told_is_left_out(
    fitted: tuple[BoardFit, dict[str, float]],
) -> None:
    fit, truth = fitted
    every, told = figures(fit), {figure.name for figure in determined_figures(fit)}
    for figure in every:
        sigma = (figure.high - figure.low) / (2.0 * NORMAL)
        assert abs(figure.value - truth[figure.name]) < 3.5 * sigma, figure
        # Records never make a figure less certain than the spread; 256 draws say how wide it is.
        assert sigma < 1.3 * figure.sigma
    assert "resonance 2, open" in told
    assert told < {figure.name for figure in every}


def test_the_fitted_board_draws_the_record(fitted: tuple[BoardFit, dict[str, float]]) -> None:
    fit, _ = fitted
    assert max(fit.misfits) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("bandwidth", [False, True])
def test_slopes_are_those_between_orbits(bandwidth: bool) -> None:
    """Of v1 and of the force, by four coordinates and the amplitude, against orbits on both sides;
    to a hundredth of what moves an orbit most."""
    known, nets, h = subject(2), ("v1", "fv"), 1e-3
    prior = Prior(known.circuit, SPREAD, bandwidth=bandwidth)
    z = 0.5 * prior.draws(2, seed=1)[1]

    def orbit(z: Array, louder: float = 1.0) -> NetOrbit:
        drive = replace(known.excitation, amplitude=louder * known.excitation.amplitude)
        (reduction,) = prior.reductions(z[None])
        there = follow(reduction, drive, nets, known.orbit.start, 1)
        assert there is not None
        return there

    slopes = orbit_slopes(prior, z, orbit(z), known.excitation, nets)
    steps = {k: h * np.eye(prior.size)[k] for k in range(0, prior.size, prior.size // 4)}
    pairs = {k: (orbit(z + step), orbit(z - step)) for k, step in steps.items()}
    pairs[prior.size] = orbit(z, 1.0 + h), orbit(z, 1.0 - h)
    for k, (more, less) in pairs.items():
        most = np.abs(slopes.volts[..., k]).max(axis=0) + 1e-2 * np.abs(orbit(z).volts).max(axis=0)
        between = (more.volts - less.volts) / (2.0 * h)
        error = np.abs(slopes.volts[..., k] - between) / most
        # A point that the step carries through a stop has no derivative in between.
        assert (np.quantile(error, 0.98, axis=0) < 0.01).all()
        begun = (more.start - less.start) / (2.0 * h)
        np.testing.assert_allclose(slopes.start[:, k], begun, atol=0.01 * most.max())


def test_a_net_behind_the_dead_zone_follows_its_mode(prior: Prior) -> None:
    """fv as the walk over the modes has it, point by point."""
    known = subject(2)
    (reduction,) = prior.reductions(np.zeros((1, prior.size)))
    system, drive = reduction.system(), known.excitation.drive
    run = known.orbit.start
    orbit = follow(reduction, known.excitation, ("fv",), run, 1)
    assert orbit is not None
    states = integrated(system, drive, orbit.start, np.arange(0, 512, 37) * drive.period / 512)
    plain = []
    for k, x in zip(range(0, 512, 37), states, strict=True):
        u = drive.amplitude * np.sin(2.0 * np.pi * k / 512) + drive.offset
        key = system.mode_at(x, u)
        plain.append(float(reduction.output(key, "fv", x[None], np.array([u]))[0]))
    np.testing.assert_allclose(orbit.volts[::37, 0], plain, atol=1e-5)


def test_no_start_no_board(prior: Prior) -> None:
    record = Record(np.linspace(0.0, 0.01, 500), {"v1": np.sin(np.arange(500.0))}, "scope")
    motion = RecordedMotion(record, {"v1": "v1"}, "vm", 300.0, 0.0, 5.0, 0.0, 0.0)
    with pytest.raises(NoSuchBoard, match="settles on motions of these periods"):
        fit_board(prior, [observe(motion, ("v1",))], [[]])


def test_what_was_not_recorded_is_asked_for() -> None:
    record = Record(np.linspace(0.0, 0.01, 500), {"v1": np.sin(np.arange(500.0))}, "scope.csv")
    motion = RecordedMotion(record, {"v1": "v1"}, "vm", 300.0, 0.0, np.nan, np.nan, np.nan)
    with pytest.raises(InputError, match="amplitude"):
        observe(motion, ("v1",))
    with pytest.raises(InputError, match="a channel that shows v3"):
        observe(motion, ("v3",), Excitation(300.0, 5.0))
    seen = observe(motion, ("v1", "v3"), Excitation(300.0, 5.0))
    assert seen.nets == ("v1",)
    assert not seen.aligned
