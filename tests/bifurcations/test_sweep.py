"""Sweeps, maps and basins: windows, hysteresis, blocks that are taken up again."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from designer.base.errors import InputError
from designer.bifurcations import basins, parameter_map, sweep, window_ends
from designer.bifurcations.basins import BasinPlan
from designer.bifurcations.parameter_map import MapPlan
from designer.bifurcations.sweep import Sweep, SweepPlan
from designer.circuit.swept_board import BoardSubject
from designer.dynamics import attractors
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.dynamics.steady_state import SteadyMotion, TransientSettings, by_flow
from designer.folders.sweep_store import (
    Blocks,
    WorkFiles,
    grid_blocks,
    sweep_blocks,
    work_hash,
)
from designer.model.swept_model import ModelSubject
from designer.plots import bifurcation_plots, response_colours
from tests.dynamics.test_modal_tables import PAPER
from tests.shared.exploring import quick

SHORT, QUICK = TransientSettings(200, 20, 2000), TransientSettings(40, 16, 400)


def _flow(omega: float) -> Flow:
    return Flow(PAPER.second_order().piecewise_linear(), Drive(omega))


def _plan(
    low: float, high: float, steps: int, *tracks: str, course: TransientSettings = SHORT
) -> SweepPlan:
    values = np.linspace(low, high, steps)
    return SweepPlan(ModelSubject(PAPER), "omega", values, tracks, course=course)


@pytest.fixture(scope="module")
def both() -> Sweep:
    """From below the end of 1-1-2 to above the pitchfork, down and up."""
    return sweep.run(_plan(1.30, 1.55, 201, "down", "up"), jobs=2)


def test_hysteresis(both: Sweep) -> None:
    """Between 1.351 and 1.368 the asymmetric 1-1-1 and 1-1-2 coexist: which is shown depends on
    where the sweep comes from. Settling from either end's state says the same."""
    k = int(np.searchsorted(both.plan.values, 1.36))
    down, up = both.steps["down"][k], both.steps["up"][k]
    assert (down.response, down.symmetric) == ("1-1-1", False)
    assert up.response in ("1-1-2", "1-2-1")
    flow = _flow(float(both.plan.values[k]))
    assert attractors.settle(flow, down.end).response == down.response
    assert attractors.settle(flow, up.end).response == up.response


def test_windows_are_what_the_steps_show(both: Sweep) -> None:
    for track in both.plan.tracks:
        windows = [w for w in both.windows if w.track == track]
        assert sum(w.steps for w in windows) == len(both.plan.values)
        for before, after in itertools.pairwise(windows):
            assert before.high < after.low
            assert (before.response, before.symmetric) != (after.response, after.symmetric)
        for value, step in zip(both.plan.values, both.steps[track], strict=True):
            (window,) = (w for w in windows if w.low <= value <= w.high)
            assert (window.response, window.symmetric) == (step.response, step.symmetric)
    (last,) = (w for w in both.windows if w.track == "down" and w.high > 1.54)
    assert (last.response, last.symmetric) == ("1-1-1", True)
    assert last.low == pytest.approx(1.46, abs=0.02)  # the pitchfork


@pytest.mark.parametrize("seed", range(6))
def test_windows_by_settling(both: Sweep, seed: int) -> None:
    k = int(np.random.default_rng(seed).integers(len(both.plan.values)))
    flow = _flow(float(both.plan.values[k]))
    for track in both.plan.tracks:
        step = both.steps[track][k]
        orbit = attractors.settle(flow, step.end)
        if step.status is OrbitStatus.PERIODIC:
            assert (orbit.response, orbit.symmetric) == (step.response, step.symmetric)


def test_each_step_starts_where_the_one_before_ended(both: Sweep) -> None:
    """Against a plain loop over the slow version, where nothing is chaotic."""
    values = both.plan.values[::-1][:4]
    x = np.zeros(4)
    for value, step in zip(values, both.steps["down"][::-1], strict=False):
        slow = by_flow(_flow(float(value)), x, SHORT)
        np.testing.assert_allclose(step.minima, slow.minima, atol=1e-9)
        np.testing.assert_allclose(step.velocities, slow.velocities, atol=1e-9)
        x = sweep.next_start(slow, np.ones(4))


def test_any_parameter() -> None:
    """Over b at one frequency: b scales the response, so b and the drive are one parameter."""
    subject = ModelSubject(PAPER, omega=0.85)
    plan = SweepPlan(subject, "b", np.linspace(0.2, 0.3, 5), ("start 0",), course=SHORT)
    for value, step in zip(plan.values, sweep.run(plan).steps["start 0"], strict=True):
        system = PAPER.second_order().piecewise_linear()
        drive = Drive(0.85, amplitude=PAPER.b / float(value))
        other = by_flow(Flow(system, drive), np.zeros(4), SHORT)
        assert step.response == other.response
        if step.status is OrbitStatus.PERIODIC:
            np.testing.assert_allclose(step.minima, other.minima * value / PAPER.b, atol=1e-7)


def test_points_lie_within_the_sweep() -> None:
    """The pitchfork at 1.46052 is within two steps of the first sweep, and inside the second."""
    kinds = {}
    for low in (1.462, 1.458):
        made = sweep.run(_plan(low, 1.492, 11, "down"))
        kinds[low] = [(str(p.kind), round(p.value, 5)) for p in window_ends.locate(made)]
    assert kinds == {1.462: [], 1.458: [("pitchfork", 1.46052)]}


def test_marks_are_of_stable_orbits_within_the_sweep() -> None:
    def point(value: float, *stable: bool) -> Any:
        return SimpleNamespace(kind="fold", value=value, stable=stable)

    points = [point(1.0, True, False), point(1.1, False, False), point(1.2, True, True)]
    points.append(point(1.3, True, False))
    found = bifurcation_plots.marks(points, 1.0, 1.25)
    assert [m.value for m in found] == [1.0, 1.2]


def test_only_a_mirror_image_is_red() -> None:
    """The twins at 1.43 are black and red. A motion of the same name that is not the mirror image,
    made by stretching the first, gets another colour."""
    omega = np.array([1.429, 1.43])
    orbits = [attractors.settle(_flow(float(w)), np.zeros(4)) for w in omega]
    twins = [attractors.twin(_flow(float(w)), o) for w, o in zip(omega, orbits, strict=True)]
    plan = _plan(1.429, 1.43, 2, "start 0", "start 1")

    def steps(starts: list[Any]) -> tuple[SteadyMotion, ...]:
        settings = plan.subject.settings([{"omega": float(w)} for w in omega])
        return tuple(s.steady(x, SHORT) for s, x in zip(settings, starts, strict=True))

    first, second = steps([o.start for o in orbits]), steps([t.start for t in twins if t])
    made = Sweep(plan, {"start 0": first, "start 1": second})
    colours = {c for c, _, _ in bifurcation_plots._coloured(made)}
    assert colours == {response_colours.BLACK, response_colours.RED}
    other = tuple(replace(s, start=1.01 * s.start, minima=1.01 * s.minima) for s in first)
    made = Sweep(plan, {"start 0": first, "start 1": other})
    colours = {c for c, _, _ in bifurcation_plots._coloured(made)}
    assert colours == {response_colours.BLACK, response_colours.DOTS[0]}


def test_starts_show_what_coexists() -> None:
    """At 1.55 the paper's model has 1-1-1 and 3-3-3."""
    subject = ModelSubject(PAPER)
    ends = [{"omega": 1.54}, {"omega": 1.56}]
    plan = SweepPlan(
        subject,
        "omega",
        np.linspace(1.54, 1.56, 5),
        course=SHORT,
        **sweep.from_starts(subject, ends, 12),
    )
    made = sweep.run(plan, jobs=2)
    assert {w.response for w in made.windows} == {"1-1-1", "3-3-3"}
    assert {w.steps for w in made.windows} == {5}
    assert {w.track for w in made.windows} == {"starts"}


def test_one_worker_or_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep, "BLOCK", 8)
    plan = _plan(0.9, 1.1, 20, "down", "up", course=QUICK)
    some, many = sweep.run(plan, jobs=1), sweep.run(plan, jobs=3)
    assert _text(some) == _text(many)


def _text(made: Sweep) -> str:
    return repr({t: [s.__dict__ for s in steps] for t, steps in made.steps.items()})


@pytest.mark.parametrize("tracks", quick(map(pytest.param, [("start 0",), ("down", "up")])))
def test_goes_on_from_any_finished_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tracks: tuple[str, ...]
) -> None:
    """Chaotic steps: what comes after a block depends on its last digit."""
    monkeypatch.setattr(sweep, "BLOCK", 8)
    plan = _plan(0.9, 1.1, 18, *tracks, course=QUICK)
    assert len(plan.blocks(tracks[0])) == 3

    def store(name: str, work: str = "w") -> Blocks[list[SteadyMotion]]:
        (tmp_path / name).mkdir(exist_ok=True)
        return sweep_blocks(plan, WorkFiles(tmp_path / name, work, {"seed": None}))

    whole = sweep.run(plan, store=store("whole"))
    for track in tracks:
        for kept in (1, 2):
            place = store(f"{track}{kept}")
            for number in range(kept):
                name = place.name(track, number)
                (place.files.root / name).parent.mkdir(exist_ok=True)
                (place.files.root / name).write_bytes((tmp_path / "whole" / name).read_bytes())
            assert _text(sweep.run(plan, store=place)) == _text(whole)
            for path in sorted((tmp_path / "whole").rglob("*.parquet")):
                if path.is_file():
                    other = place.files.root / path.relative_to(tmp_path / "whole")
                    assert other.read_bytes() == path.read_bytes()
    foreign = store("whole", "another")
    assert foreign.read(tracks[0], 0) is None  # of another sweep
    assert work_hash(plan.as_dict()) != work_hash(_plan(0.9, 1.1, 19, *tracks).as_dict())


def _flipped(path: Path) -> bytes:
    """Flip one bit in the middle of a file; what it was before."""
    whole = path.read_bytes()
    place = len(whole) // 2
    path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
    return whole


def test_damaged_blocks_are_computed_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a sweep and of a map; the other blocks are taken, and the files are again as they were."""
    monkeypatch.setattr(sweep, "BLOCK", 8)
    notes: list[str] = []
    plan = _plan(1.0, 0.9, 12, "down", course=QUICK)
    steps = sweep_blocks(plan, WorkFiles(tmp_path, "w", {}, notes.append))
    whole = sweep.run(plan, store=steps)
    assert len(plan.blocks("down")) > 1
    path = tmp_path / steps.name("down", 0)
    before, last = _flipped(path), tmp_path / steps.name("down", 1)
    written = last.stat().st_mtime_ns
    assert steps.read("down", 0) is None
    again = sweep_blocks(plan, WorkFiles(tmp_path, "w", {}, notes.append))
    assert _text(sweep.run(plan, store=again)) == _text(whole)
    assert notes == [f"{path}: damaged, computed again"] * 2  # by each of the stores
    assert path.read_bytes() == before
    assert last.stat().st_mtime_ns == written
    axes = ("omega", np.linspace(0.8, 1.6, 3), "b", np.linspace(0.2, 0.3, 2))
    mapped = MapPlan(ModelSubject(PAPER), *axes)
    grid = grid_blocks(mapped, WorkFiles(tmp_path, "w", {}, notes.append))
    made = parameter_map.run(mapped, store=grid)
    path = tmp_path / grid.name(1)
    before = _flipped(path)
    assert grid.read(1) is None
    assert parameter_map.run(mapped, store=grid) == made
    assert notes[2:] == [f"{path}: damaged, computed again"]
    assert path.read_bytes() == before


def test_further_clearances_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a column of their own, which files of systems with one clearance do not have."""
    (one,) = sweep.run(_plan(0.9, 0.9, 1, "down", course=QUICK)).steps["down"]
    both = replace(one, more=((1, 0), (0, 3)))
    monkeypatch.setattr(sweep, "BLOCK", 2)
    store = sweep_blocks(_plan(0.9, 0.92, 3, "down"), WorkFiles(tmp_path, "w", {}))
    for block, steps in enumerate(([one, both], [one])):
        store.write(steps, "down", block)
        found = store.read("down", block)
        assert found is not None
        assert [(s.counts, s.response) for s in found] == [(s.counts, s.response) for s in steps]
        names = pq.read_schema(tmp_path / store.name("down", block)).names
        assert ("more" in names) == (block == 0)


def test_map_by_settling(tmp_path: Path) -> None:
    plan = MapPlan(
        ModelSubject(PAPER), "omega", np.linspace(0.8, 1.6, 12), "b", np.linspace(0.15, 0.4, 6)
    )
    store = grid_blocks(plan, WorkFiles(tmp_path, "w", {}))
    made = parameter_map.run(plan, jobs=2, store=store)
    assert parameter_map.run(plan, store=store) == made  # read again
    assert [(c.i, c.j) for c in made.cells] == [(i, j) for i in range(6) for j in range(12)]
    assert sum(made.counts.values()) == 72
    for cell in made.cells[::7]:
        system = (
            ModelSubject(PAPER)
            .settings([{"omega": float(plan.xs[cell.j]), "b": float(plan.ys[cell.i])}])[0]
            .flow()
        )
        orbit = attractors.settle(system, np.array(cell.strobe))
        if cell.status is OrbitStatus.PERIODIC:
            assert (orbit.response, orbit.symmetric) == (cell.response, cell.symmetric)
            from_rest = attractors.settle(system, np.zeros(4))
            assert from_rest.response == cell.response


def test_basins_by_settling() -> None:
    plan = BasinPlan(
        ModelSubject(PAPER),
        {"omega": 1.43},
        "x1",
        np.linspace(-1.5, 1.5, 9),
        "x1'",
        np.linspace(-2.0, 2.0, 8),
        np.zeros(4),
    )
    made = basins.run(plan, jobs=2)
    first, second = made.attractors[:2]
    assert (first.response, first.symmetric) == (second.response, second.symmetric)
    assert (first.twin, second.twin) == (1, 0)  # the two 1-1-1 without symmetry
    assert sum(a.share for a in made.attractors) == pytest.approx(1.0)
    flow = _flow(1.43)
    for cell in made.cells[::5]:
        orbit = attractors.settle(flow, plan.state(cell.i, cell.j))
        met = made.attractors[cell.attractor]
        laps = flow.run(np.array(met.strobe), orbit.n).strobes
        assert orbit.response == met.response
        assert np.abs(laps - orbit.start).max(axis=1).min() < 1e-6


@pytest.mark.parametrize(
    ("name", "value", "part"),
    [
        ("omega", 0.0, "0.001"),
        ("k0", 1.0, "[0, 1)"),
        ("b", -1.0, "> 0"),
        ("beta", 1.0, "one of omega"),
        ("zeta", float("inf"), "finite"),
    ],
)
def test_values_outside_the_domain(name: str, value: float, part: str) -> None:
    with pytest.raises(InputError) as caught:
        ModelSubject(PAPER).check("--from", name, value)
    assert caught.value.field == "--from"
    assert part in str(caught.value)
    with pytest.raises(InputError):
        BoardSubject.check(BoardSubject.__new__(BoardSubject), "--from", "b", 1.0)
