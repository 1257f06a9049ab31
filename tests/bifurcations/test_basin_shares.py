"""Counted basins: every start by another integrator, mirrored starts, numbers along a sweep."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer.bifurcations import basin_shares
from designer.bifurcations.basin_shares import BasinShares, SharePlan
from designer.folders.sweep_store import WorkFiles, share_blocks
from designer.model.swept_model import ModelSubject
from tests.dynamics.test_modal_tables import PAPER
from tests.shared.oracles import Array, Plain

PLAIN = Plain(0.5, 0.5, 0.95, 0.5, 0.1, 0.0, 0.25)


def _plan(low: float, high: float, steps: int, count: int) -> SharePlan:
    subject, values = ModelSubject(PAPER), np.linspace(low, high, steps)
    box = np.outer(subject.scale([{"omega": low}, {"omega": high}]), [-1.0, 1.0])
    numbers = np.random.default_rng(3).random((count, 5))
    return SharePlan(subject, "omega", values, box, numbers, seed=3)


def _strobe(omega: float, x: Array, phase: float, periods: int) -> Array:
    """The state at drive phase 0 this many periods later, the stops' law in the right-hand side."""

    def rhs(t: float, y: Array) -> list[float]:
        return PLAIN.rhs(t, y, omega, PLAIN.side_of(float(y[0])))

    span = (phase / omega, 2.0 * np.pi * periods / omega)
    run = solve_ivp(rhs, span, x, "DOP853", rtol=1e-6, atol=1e-8, max_step=0.15)
    return np.asarray(run.y[:, -1])


@pytest.mark.slow
def test_every_start_ends_where_another_integrator_ends() -> None:
    """At ω = 1.43, where both twins of 1-1-1 are: each start is on the one that it counts for."""
    plan = _plan(1.43, 1.5, 2, 5)
    ends = set()
    for k in range(len(plan.numbers)):
        (step, _) = basin_shares.run(replace(plan, numbers=plan.numbers[k : k + 1])).steps
        (share,) = [s for s in step if s.count]
        assert (share.response, share.symmetric, share.count) == ("1-1-1", False, 1)
        end = _strobe(1.43, plan.starts[k], float(plan.phases[k]), 30)
        np.testing.assert_allclose(end, share.strobes[0], atol=2e-3)
        ends.add(np.round(end, 1).tobytes())
    assert len(ends) == 2


def test_mirrored_starts_end_on_the_twins() -> None:
    """Every start mirrored, half a period later: what ended on a twin ends on the other one, so a
    sample with its mirror image halves every pair of basins."""
    plan = _plan(1.37, 1.43, 3, 12)
    image = np.column_stack([1.0 - plan.numbers[:, :4], (plan.numbers[:, 4] + 0.5) % 1.0])
    both = basin_shares.run(replace(plan, numbers=np.vstack([plan.numbers, image])), jobs=2)
    for step in both.steps:
        counts = {s.attractor: s.count for s in step}
        for share in step:
            if share.symmetric is False:
                assert share.twin is not None
                assert counts[share.twin] == share.count
        assert sum(counts.values()) == 24


def _names(shares: BasinShares) -> list[list[tuple[str, bool | None]]]:
    """What each attractor with more than five starts is called along the sweep."""
    return [
        list(dict.fromkeys((s.response, s.symmetric) for _, s in met))
        for met in shares.attractors.values()
        if sum(s.count for _, s in met) > 5
    ]


def test_an_attractor_keeps_its_number_through_a_grazing() -> None:
    """1-8-8 loses an impact on each stop at ω = 0.21848 and goes on as 1-7-7."""
    names = _names(basin_shares.run(_plan(0.217, 0.220, 4, 6), jobs=2))
    assert [("1-8-8", True), ("1-7-7", True)] in names


def test_other_attractors_have_other_numbers() -> None:
    """Below the pitchfork of 1-1-1 at ω = 1.4605 are its twins. 3-4-4 is no longer stable at 1.515,
    where 3-3-3 is: both are on one loop of orbits, but folds lie between."""
    names = _names(basin_shares.run(_plan(1.44, 1.57, 14, 40), jobs=2))
    assert names.count([("1-1-1", False)]) == 2
    for name in ("1-1-1", "3-4-4", "3-3-3"):
        assert names.count([(name, True)]) == 1


def test_blocks_are_taken_up_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the same numbers of attractors, to the byte, whichever block is missing."""
    monkeypatch.setattr(basin_shares, "BLOCK", 2)
    plan = _plan(1.35, 1.47, 6, 5)
    store = share_blocks(plan, WorkFiles(tmp_path, "work", {}))
    whole = basin_shares.run(plan, 2, store)
    files = {p: p.read_bytes() for p in sorted((tmp_path / "shares.parquet").iterdir())}
    assert len(files) == 3
    for path in list(files)[1:]:
        path.unlink()
        again = basin_shares.run(plan, 1, store)
        assert again.steps == whole.steps
        assert path.read_bytes() == files[path]
