"""Shares of the starts in a box, against a plain settling of the same starts."""

from __future__ import annotations

import json
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer import parse_model_file, simulate
from designer.base.arrays import Array
from designer.base.defaults import SEED
from designer.base.proportion import wilson
from designer.check import coexistence, simulation
from designer.cli import entry
from designer.dynamics import coexisting_attractors
from designer.dynamics.coexisting_attractors import outlived
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit
from designer.dynamics.piecewise_linear import Drive
from designer.model.find_responses import find, scale_of
from designer.model.model import Dimensionless
from designer.model.response_table import Response
from tests.shared.model_text import SMALL, dimensionless

SI = """format = 1
[mechanical]
M1 = 0.12
M2 = 0.31
K1 = 1900
K2 = 2600
C1 = 0.6
C2 = 1.1
K0 = 45000
B = 0.0008
P1 = 4
P2 = 0
"""
OMEGA = 0.76
MODEL = dimensionless(parse_model_file(SI).model)


def brute(model: Dimensionless, omega: float, x: Array, periods: int = 600) -> tuple[str, Array]:
    """n-p-q and the last strobes, by running on and looking: no Newton, no fast path, no rule."""
    flow = Flow(model.second_order().piecewise_linear(), Drive(omega), fast=False)
    run = flow.run(x, periods)
    size = np.abs(run.strobes).max()
    for n in range(1, 17):
        if np.abs(run.strobes[-1] - run.strobes[-1 - n]).max() < 1e-5 * size:
            lower, upper = run.counts[-n:].sum(axis=(0, 1))
            return f"{n}-{upper}-{lower}", run.strobes[-n:]
    return "none", run.strobes[-1:]


def settled(x: Array) -> tuple[str, Array] | None:
    """The same; None where a push of 1e-9 leads elsewhere: a chaotic transient, which two engines
    leave as their rounding errors say."""
    response, strobes = brute(MODEL, OMEGA, x)
    again = brute(MODEL, OMEGA, x * (1.0 + 1e-9))
    same = again[0] == response and np.abs(strobes - again[1][-1]).max(axis=1).min() < 1e-4
    return (response, strobes) if same and response != "none" else None


@pytest.mark.slow
def test_shares_are_those_of_a_plain_settling() -> None:
    count = 60
    (found,) = simulate(parse_model_file(SI), [OMEGA], starts=count)
    box = scale_of(MODEL, OMEGA)
    states = coexistence.random_starts(box, count, SEED)
    assert (np.abs(states) <= box).all()
    assert (np.abs(states).max(axis=0) > 0.8 * box).all()  # the whole box, not a part of it
    ends = [settled(x) for x in states]
    truth = Counter(end[0] for end in ends if end is not None)
    unsure = sum(end is None for end in ends)
    assert len(truth) >= 3
    assert unsure < count / 2
    met = found.coexistence
    assert met is not None
    assert met.starts == count == sum(b.count for b in met.basins) + met.not_settled
    counts = Counter({b.orbit.response: b.count for b in met.basins})
    for response, least in truth.items():
        assert least <= counts[response] <= least + unsure
    shown = [found.orbit.response, *(o.response for o in found.others)]
    assert shown == [b.orbit.response for b in met.basins]
    # Twins: by the strobe of the orbit that the basin is of, or of its mirror image.
    (basin,) = [b for b in met.basins if b.orbit.response == "1-2-2"]
    assert basin.twins is not None
    near = [
        bool(np.abs(end[1] - basin.orbit.start).max(axis=1).min() < 1e-2)
        for end in ends
        if end is not None and end[0] == "1-2-2"
    ]
    assert sum(near) <= basin.count - basin.twins <= sum(near) + unsure
    assert len(near) - sum(near) <= basin.twins <= len(near) - sum(near) + unsure
    assert near
    assert met.basins[0].twins is None  # 1-1-1 is its own


def test_a_start_is_the_same_whatever_their_number() -> None:
    box = scale_of(MODEL, OMEGA)
    many = coexistence.random_starts(box, 50, 7)
    assert np.array_equal(many[:20], coexistence.random_starts(box, 20, 7))
    assert not np.array_equal(many[:20], coexistence.random_starts(box, 20, 8))


def test_starts_that_do_not_settle_are_counted() -> None:
    """Hardly damped and far above resonance, a free motion does not decay within 4000 periods."""
    model = Dimensionless(m=0.5, k=0.5, k0=0.0, c=0.5, zeta=1e-7, f20=0.0, b=0.25)
    met = coexistence.of_model(model, 300.0, 3)
    assert (met.basins, met.not_settled) == ((), 3)
    said = met.as_dict()["not_settled"]
    assert (said["share"], said["low"], said["high"]) == (1.0, *wilson(3, 3))


CHAOS = 1.22
ENDING = parse_model_file(SMALL.replace("0.85", str(CHAOS)).replace("1-2-2", "1-1-1"))
"""Chaos of ``ENDING`` lives here for some hundreds of periods, and ends on 1-1-1."""


@pytest.fixture
def briefly_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawn starts alone are hardly watched; those of the search for a response are."""

    def briefly(*arguments: Any, **named: Any) -> list[Orbit]:
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(coexisting_attractors, "CALM", 60)
            patched.setattr(coexisting_attractors, "with_exponent", lambda _, orbit: orbit)
            return outlived(*arguments, **named)

    monkeypatch.setattr(coexistence, "outlived", briefly)


@pytest.mark.usefixtures("briefly_watched")
@pytest.mark.parametrize("engine", ["model", "circuit"])
def test_drawn_starts_know_of_chaos_that_ended_before(engine: Any) -> None:
    (found,) = simulation.simulate(ENDING, engine=engine, starts=4)
    assert (found.orbit.response, found.others) == ("1-1-1", ())
    assert found.coexistence is not None
    assert [(b.orbit.response, b.count) for b in found.coexistence.basins] == [("1-1-1", 4)]


@pytest.mark.usefixtures("briefly_watched")
def test_a_report_lists_no_chaos_that_ended_beside_a_response(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (response,) = find(ENDING.model, [Response(omega=CHAOS)])
    few = partial(coexistence.of_model.__wrapped__, starts=4)
    assert "aperiodic" in [b.orbit.response for b in few(ENDING.model, CHAOS).basins]
    monkeypatch.setattr(coexistence, "of_model", few)
    assert coexistence.coexisting_with(ENDING.model, response) == ()


def test_table_and_json_say_how_many_starts_went_where(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "model.toml"
    path.write_text(SI, encoding="utf-8")
    words = ["simulate", str(path), "--omega", "0.76", "--starts", "30", "--seed", "4"]
    assert entry.status([*words, "--json", "-q"]) == 0
    answer = json.loads(capfd.readouterr().out)
    starts = answer["responses"][0]["starts"]
    assert (starts["count"], starts["seed"], starts["phase"]) == (30, 4, 0.0)
    assert list(starts["box"]) == ["x1", "x1'", "x2", "x2'"]
    assert sum(a["count"] for a in starts["attractors"]) + starts["not_settled"]["count"] == 30
    for a in starts["attractors"]:
        assert (a["low"], a["high"]) == wilson(a["count"], 30)
    assert answer["provenance"]["seed"] == 4
    assert entry.status(words) == 0
    table = " ".join(capfd.readouterr().err.split())
    assert "of 30 starts at drive phase 0 in the box x1 ± 2.11" in table
    assert f"1-1-1 {100 * starts['attractors'][0]['share']:.3g} %" in table
    assert "1-2-2 (with its twin)" in table
    assert entry.status([*words[:-4], "--starts", "-1"]) == 2
    assert "--starts: found -1" in capfd.readouterr().err


def test_no_drawn_starts_leave_what_is_reached_from_rest_without_shares(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "model.toml"
    path.write_text(SI, encoding="utf-8")
    words = ["simulate", str(path), "--omega", "0.7", "--starts", "0"]
    assert entry.status([*words, "--json", "-q"]) == 0
    (row,) = json.loads(capfd.readouterr().out)["responses"]
    response, strobes = brute(MODEL, 0.7, np.zeros(4))
    assert (row["response"], row["starts"], row["others"]) == (response, None, [])
    assert np.abs(strobes - row["start"]).max(axis=1).min() < 1e-6 * np.abs(strobes).max()
    assert entry.status(words) == 0
    assert " starts at drive phase" not in capfd.readouterr().err
