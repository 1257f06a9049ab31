"""Blame: indices against closed formulas, counts and crossings against slow obvious ways."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import sobol_indices, uniform

from designer.base.arrays import Array
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import BRIEF
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.continued_orbit import Function, follow, functions
from designer.dynamics.counts import Counts
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.model.distributions import Uniform
from designer.model.response_table import Response
from designer.spread.board_quantities import Quantity, between, column, quantities, with_column
from designer.spread.spread import Group, Spread, draw_many
from designer.verdicts.exact_circuit import block, settled
from designer.verdicts.verdict import Answer, Question, StudyPlan, Verdict, judge
from designer.yields import loss_replay
from designer.yields.loss_attribution import NOTHING_LOST, Attribution, attribute
from designer.yields.loss_replay import PROBE, extent_of
from designer.yields.margins import Limit, Margin, Prediction, crossings
from designer.yields.stored_parts import StoredParts
from designer.yields.worst_corner import Index, saltelli, sobol, worst_corners
from tests.shared import paper_cases

NO_SPREAD = Spread(0.0, 0.0, 0.0, 0.0, saturation=0.0)
OFFSETS = replace(NO_SPREAD, offset_sigma=3e-3, offset_limit=10e-3)

SPREADS = {"offsets": OFFSETS, "tiny": replace(NO_SPREAD, resistor=1e-5)}


@cache
def plan(p: int, spread: str, samples: int = 24) -> StudyPlan:
    subject = paper_cases.subject(p)
    spec = Response(omega=paper_cases.OMEGA[p], expect=Counts(1, ((p, p),)))
    question = Question(spec, subject.excitation, subject.orbit, None)
    return StudyPlan(subject.reduction.circuit, SPREADS[spread], 5, samples, (question,))


@cache
def answers(p: int, spread: str, samples: int = 24) -> tuple[Answer, ...]:
    return tuple(block(plan(p, spread, samples), range(samples), 2))


@cache
def offsets_attributed() -> Attribution:
    return attribute(plan(2, "offsets"), answers(2, "offsets"), lost=6, ok=2, jobs=2)


def margin_of(slopes: dict[str, tuple[float, ...]], nominal: float = 1.0) -> tuple[Margin, Boards]:
    """A margin of linear limits: for each quantity its slope in each limit."""
    spread = replace(OFFSETS, resistor=0.01)
    circuit = plan(1, "offsets").circuit
    drawn = draw_many(circuit, spread, 1, range(400))
    differing = quantities(circuit, drawn)
    number = len(next(iter(slopes.values())))
    rows = np.zeros((number, len(differing)))
    for k, q in enumerate(differing):
        rows[:, k] = slopes.get(q.name, np.zeros(number))
    return Margin(differing, tuple(Limit("x", "contact", nominal, 1.0, row) for row in rows)), drawn


def indices(margin: Margin, base: int = 4096) -> dict[str, Index]:
    spread = replace(OFFSETS, resistor=0.01)
    found = sobol(plan(1, "offsets").circuit, spread, [margin], 3, base)[0]
    assert [x.total for x in found] == sorted((x.total for x in found), reverse=True)
    return {x.coordinate: x for x in found}


def test_sobol_indices_of_a_linear_margin_are_its_shares_of_the_variance() -> None:
    found = indices(margin_of({"R4": (3.0,), "R5": (1.0,), "U1A.offset": (2.0,)})[0], 1024)
    # Slopes are per sampled standard deviation, which is the true one within a few per cent.
    for name, share in {"R4": 9 / 14, "R5": 1 / 14, "U1A.offset": 4 / 14}.items():
        assert found[name].first == pytest.approx(share, abs=0.05)
        assert found[name].total == pytest.approx(share, abs=0.05)
    assert found["U1A.offset"].part == "U1A"
    assert all(abs(x.total) < 1e-9 for n, x in found.items() if n not in ("R4", "R5", "U1A.offset"))


@pytest.mark.slow
def test_sobol_indices_of_the_least_of_two_equal_limits() -> None:
    """min(x, y) of two equal uniform numbers: first-order 0.4, total 0.6, by integration."""
    found = indices(margin_of({"R4": (1.0, 0.0), "R5": (0.0, 1.0)})[0])
    for name in ("R4", "R5"):
        assert found[name].first == pytest.approx(0.4, abs=0.04)
        assert found[name].total == pytest.approx(0.6, abs=0.04)


def test_indices_and_their_noise_are_those_of_scipy_and_of_a_slow_bootstrap() -> None:
    """Of the Ishigami function, whose indices are known in closed form."""
    kept: list[tuple[Array, Array, Array]] = []

    def ishigami(cube: Array) -> Array:
        x, y, z = np.pi * (2.0 * cube - 1.0)
        values: Array = np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)
        return values[None]

    def method(f_A: Array, f_B: Array, f_AB: Array) -> tuple[Array, Array]:
        kept.append((f_A, f_B, f_AB))
        first, total = saltelli(f_A, f_B, f_AB, np.ones((1, f_A.shape[1])))
        return first[..., 0], total[..., 0]

    even: Any = uniform()
    methods: tuple[Any, Any] = (method, "saltelli_2010")
    found, theirs = (
        sobol_indices(
            func=ishigami, n=512, dists=[even] * 3, rng=np.random.default_rng(4), method=one
        )
        for one in methods
    )
    np.testing.assert_allclose(found.first_order, theirs.first_order, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(found.total_order, theirs.total_order, rtol=1e-10, atol=1e-12)
    ((a, b, ab),) = kept
    generator = np.random.default_rng(1)
    picks = generator.integers(0, 512, (200, 512))
    counts = np.array([np.bincount(row, minlength=512) for row in picks], dtype=float)
    slow = np.array([_indices_of(a[0, row], b[0, row], ab[:, 0, row]) for row in picks])
    for fast, each in zip(saltelli(a, b, ab, counts), np.moveaxis(slow, 1, 0), strict=True):
        np.testing.assert_allclose(fast[0], each.T, rtol=1e-9, atol=1e-12)
    exact = np.array([[0.3139, 0.4424, 0.0], [0.5576, 0.4424, 0.2437]])
    off = np.array([theirs.first_order, theirs.total_order]) - exact
    assert (np.abs(off) < 3.0 * slow.std(axis=0)).all()


def _indices_of(a: Array, b: Array, ab: Array) -> list[list[float]]:
    """The estimators one by one."""
    variance = np.concatenate([a, b]).var()
    return [
        [float(np.mean(b * (one - a)) / variance) for one in ab],
        [float(np.mean((one - a) ** 2) / (2.0 * variance)) for one in ab],
    ]


@pytest.mark.slow
def test_the_noise_of_an_index_shrinks_with_the_base_and_covers_the_truth() -> None:
    margin = margin_of({"R4": (3.0,), "R5": (1.0,), "U1A.offset": (2.0,)})[0]
    few, many = indices(margin, 128), indices(margin, 2048)
    for name, share in {"R4": 9 / 14, "R5": 1 / 14, "U1A.offset": 4 / 14}.items():
        for found in (few[name], many[name]):
            assert abs(found.first - share) < 4.0 * found.first_error + 0.02
            assert abs(found.total - share) < 4.0 * found.total_error + 0.02
        assert 2.5 < few[name].total_error / many[name].total_error < 6.0  # 4 by the square root
        assert 0.0 < many[name].first_error < 0.1
    assert few["C1"].total_error < 1e-9
    assert indices(margin, 128) == few


def test_a_margin_without_limits_has_no_indices_and_is_never_negative() -> None:
    margin, drawn = margin_of({"R4": (1.0,)})
    empty = replace(margin, limits=())
    assert np.isinf(empty.of(drawn)).all()
    assert sobol(plan(1, "offsets").circuit, OFFSETS, [empty], 0) == [()]


def test_a_margin_is_the_least_of_its_limits_whatever_the_batch() -> None:
    margin, drawn = margin_of({"R4": (1.0, -0.5), "U1A.offset": (0.3, 2.0)})
    q = {q.name: (column(drawn, q) - q.nominal) / q.sigma for q in margin.quantities}
    a = 1.0 + q["R4"] + 0.3 * q["U1A.offset"]
    b = 1.0 - 0.5 * q["R4"] + 2.0 * q["U1A.offset"]
    np.testing.assert_allclose(margin.of(drawn), np.minimum(a, b), rtol=1e-12)
    alone = np.concatenate([margin.of(drawn.take([i])) for i in range(20)])
    assert (alone == margin.of(drawn)[:20]).all()


@pytest.mark.parametrize("p", [1, 3])
def test_the_functions_of_the_nominal_orbit_are_its_own_margins(p: int) -> None:
    """Against the flow's refined penetration and miss, and the multipliers."""
    subject = paper_cases.subject(p)
    orbit = follow(paper_cases.flow_of(subject), subject.orbit.start, 1)
    assert orbit is not None
    found = functions(orbit, symmetric=False)
    peak = float(np.abs(subject.orbit.extremes[0]).max())
    contacts = [f.value for f in found if f.kind == "contact"]
    assert len(contacts) == 2 * p
    assert min(contacts) == pytest.approx(subject.orbit.penetration, abs=1e-5 * peak)
    missed = [f.value for f in found if f.kind in ("miss", "parting")]
    if np.isfinite(subject.orbit.miss):
        assert min(missed) == pytest.approx(subject.orbit.miss, abs=1e-5 * peak)
    mu = subject.orbit.multipliers
    value = {f.kind: f.value for f in found}
    assert value["doubling"] == pytest.approx(float(np.prod(1.0 + mu).real), rel=1e-6)
    assert value["fold"] == pytest.approx(float(np.prod(1.0 - mu).real) ** 2, rel=1e-6)
    assert not any(f.kind == "fold" for f in functions(orbit, symmetric=True))
    assert len({f.what for f in found if f.kind == "contact"}) == 2 * p


def test_a_function_follows_the_orbit_past_a_grazing() -> None:
    """Contact 3 of 1-3-3 as the drive falls: linear in it through zero, where settling ends."""
    subject = paper_cases.subject(3)
    values = []
    watched: Function | None = None
    for factor in (1.0, 0.98, 0.96, 0.94):
        drive = subject.excitation.drive
        flow = Flow(subject.system, replace(drive, amplitude=factor * drive.amplitude))
        orbit = follow(flow, subject.orbit.start, 1)
        if watched is None:
            assert orbit is not None
            found = [f for f in functions(orbit, True) if f.kind == "contact"]
            watched = min(found, key=lambda f: f.value)
        value = watched.on(orbit)
        assert value is not None
        values.append(value)
    steps = np.diff(values)
    assert (steps < 0.0).all()
    np.testing.assert_allclose(steps, steps.mean(), rtol=0.25)


def test_between_is_a_straight_line_from_the_nominal_board() -> None:
    spread = replace(OFFSETS, resistor=0.01, capacitor=0.01)
    circuit = plan(1, "offsets").circuit
    drawn = draw_many(circuit, spread, 1, range(3))
    exact = Boards.of(circuit, [nominal_board(circuit)])
    some = between(drawn, np.array([0.0, 0.5, 1.0]))
    for name in ("R4", "C1"):
        nominal = exact.values[name][0]
        want = [nominal, 0.5 * (nominal + drawn.values[name][1]), drawn.values[name][2]]
        np.testing.assert_allclose(some.values[name], want, rtol=1e-14)
    assert some.offset["U1A"][0] == 0.0
    assert some.offset["U1A"][2] == drawn.offset["U1A"][2]


def test_a_crossing_is_where_the_response_ends_along_the_line() -> None:
    """One part alone, against a plain scan of its value from both sides of the crossing."""
    study = plan(2, "offsets")
    question, circuit = study.questions[0], study.circuit
    nominal = Boards.of(circuit, [nominal_board(circuit)])
    q = Quantity("U2C", "offset", 0.0, 3e-3)
    board = with_column(nominal, q, np.array([40e-3]))
    met = crossings(board, [(0, 0)], study.questions)[0]
    assert 0.0 < met.inside < met.outside <= 1.0
    assert met.outside - met.inside < 0.01

    def kept(share: float) -> bool:
        orbit = question.start
        for at in np.linspace(0.0, share, 24)[1:]:
            moved = with_column(nominal, q, np.array([40e-3 * at]))
            system = Reduction(circuit, moved.board(0)).system()
            orbit = settle(Flow(system, question.excitation.drive), orbit.start)
        return judge(orbit, question.spec, question.start)[0] is Verdict.OK

    assert kept(met.inside)
    assert not kept(met.outside)


@pytest.mark.slow
def test_where_only_offsets_differ_offsets_have_all_the_attribution() -> None:
    found = offsets_attributed().responses[0]
    assert found.lost == sum(a.verdict is Verdict.LOST for a in answers(2, "offsets")) > 6
    assert {s.kind for s in found.subjects} == {"op-amp", "group"}
    everything = next(s for s in found.subjects if s.name == "all offsets")
    assert (everything.avoided, everything.replayed) == (6, 6)
    assert (everything.caused, everything.kept) == (0, 2)
    assert found.subjects[0] == everything
    assert {x.coordinate.rpartition(".")[2] for x in found.indices if x.total > 1e-9} == {"offset"}
    low, high = everything.interval
    assert low == pytest.approx(6 / (6 + 1.959964**2), rel=1e-5)  # Wilson's, all of n
    assert high == pytest.approx(1.0)


@pytest.mark.slow
def test_a_replay_says_what_a_board_with_that_part_exact_does() -> None:
    found = offsets_attributed().responses[0]
    study = plan(2, "offsets")
    question = study.questions[0]
    lost = [a.sample for a in answers(2, "offsets") if a.verdict is Verdict.LOST][:6]
    for name in ("U2C", "U3C"):
        avoided = 0
        for sample in lost:
            board = draw_many(study.circuit, OFFSETS, 5, range(sample, sample + 1)).board(0)
            board = replace(board, offset={**board.offset, name: 0.0})
            flow = Flow(Reduction(study.circuit, board).system(), question.excitation.drive)
            orbit = settle(flow, question.start.start)
            avoided += judge(orbit, question.spec, question.start)[0] is Verdict.OK
        assert next(s for s in found.subjects if s.name == name).avoided == avoided


def test_a_board_that_is_replayed_may_take_no_longer_than_a_trial(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """But for a motion without a period, which is known only once it was watched."""
    given: list[int | None] = []

    def listened(*asked: Any, within: int | None, **more: Any) -> Any:
        given.append(within)
        return settled(*asked, within=within, **more)

    monkeypatch.setattr(loss_replay, "settled", listened)
    study, rows = plan(2, "offsets"), answers(2, "offsets")
    chaotic = replace(study.questions[0], spec=Response(omega=1.0, expect=OrbitStatus.APERIODIC))
    for asked, steps in ((study, BRIEF), (replace(study, questions=(chaotic,)), None)):
        extent = extent_of(asked, rows, 1)
        loss_replay.replay(asked, extent, StoredParts(), 2, lambda: None)
        assert len(given) == len(extent.changes)
        assert set(given) == {steps}
        given.clear()


def test_the_margin_foretells_boards_it_has_not_seen() -> None:
    """As built at the paper's own level: half the boards are lost, by what is not linear."""
    found = offsets_attributed().responses[0]
    assert found.prediction.ok + found.prediction.lost == sum(
        a.verdict in (Verdict.OK, Verdict.LOST) for a in answers(2, "offsets") if a.sample % 2
    )
    assert found.prediction.right >= 0.8 * (found.prediction.ok + found.prediction.lost)
    assert found.limits
    assert all(x.distance > 0.0 for x in found.limits)


def test_the_worst_corner_is_tried_on_the_exact_circuit() -> None:
    corner = offsets_attributed().responses[0].corner
    assert corner is not None
    assert corner.corners == 32
    assert len(corner.coordinates) == len(corner.worst) == 5
    study = plan(2, "offsets")
    question = study.questions[0]
    offset = {
        name.removesuffix(".offset"): 10e-3 if end == "high" else -10e-3
        for name, end in zip(corner.coordinates, corner.worst, strict=True)
    }
    board = nominal_board(study.circuit)
    board = replace(board, offset={**board.offset, **offset})
    flow = Flow(Reduction(study.circuit, board).system(), question.excitation.drive)
    orbit = settle(flow, question.start.start)
    assert judge(orbit, question.spec, question.start)[0] is corner.verdict
    assert orbit.response == corner.response


def test_corners_put_temperature_tracking_and_ageing_to_their_ends() -> None:
    """A margin that falls with R4 alone: its worst corner is R4's largest value, by hand."""
    spread = replace(
        NO_SPREAD,
        resistor=0.001,
        temperature=(10.0, 45.0),
        tempco={"R4": Uniform(-100e-6, 100e-6)},
        ageing={"R4": Uniform(-0.002, 0.002)},
        groups=(Group("network:1", ("R4", "R5"), 0.5),),
    )
    study = replace(plan(1, "tiny"), spread=spread)
    nominal = {r.name: r.value for r in study.circuit.resistors}["R4"]
    q = Quantity("R4", "values", nominal, 1e-3 * nominal)
    margin = Margin((q,), (Limit("x", "contact", 2.0, 1.0, np.array([-1.0])),))
    chosen = ("R4", "R4.tempco", "temperature", "R4.ageing", "network:1")
    ranked = [Index(name, "R4", 0.0, 0.1) for name in chosen]
    ranked.append(Index("C1", "C1", 0.0, 0.0))
    calls: list[int] = []
    (corner,) = worst_corners(study, [margin], [ranked], 1, lambda: calls.append(1))
    assert corner is not None
    assert corner.coordinates == chosen
    assert corner.worst == ("high",) * 5
    assert len(calls) == corner.corners == 32
    # Half of what ages and warms is in common with R5, and stays in the middle.
    value = nominal * 1.001 * (1.0 + 0.5 * 0.002) * (1.0 + 0.5 * 100e-6 * (45.0 - 25.0))
    assert corner.margin == pytest.approx(2.0 - (value - nominal) / q.sigma, rel=1e-9)


@pytest.mark.parametrize("name", ["VEE", "VCC"])
def test_a_rails_corner_is_named_by_its_number(name: str) -> None:
    """Low is the smaller number, of the negative rail too."""
    study = replace(plan(1, "tiny"), spread=replace(NO_SPREAD, supply=0.01))
    rail = next(r for r in study.circuit.rails if r.name == name)
    q = Quantity(name, "supply", rail.volts, 0.01 * abs(rail.volts))
    margin = Margin((q,), (Limit("x", "contact", 3.0, 1.0, np.array([-1.0])),))
    (corner,) = worst_corners(study, [margin], [[Index(name, name, 1.0, 1.0)]], 1, lambda: None)
    assert corner is not None
    assert (corner.coordinates, corner.worst) == ((name,), ("high",))
    assert corner.margin == pytest.approx(2.0)


def test_no_loss_no_replay_and_the_nearest_limit_is_named() -> None:
    found = attribute(plan(1, "tiny", 4), answers(1, "tiny", 4), jobs=1).responses[0]
    assert (found.lost, found.subjects) == (0, ())
    assert found.prediction == Prediction(4 // 2, 0, 0, 0)
    assert found.limited_by.startswith("nothing was lost; nearest is ")
    assert found.skipped == NOTHING_LOST
    assert found.corner is not None
    assert found.corner.survived == found.corner.corners


@pytest.mark.slow
def test_attribution_is_the_same_on_one_core_and_says_what_it_cost() -> None:
    calls = 0

    def step() -> None:
        nonlocal calls
        calls += 1

    few = replace(plan(2, "offsets"), samples=12)
    some = [a for a in answers(2, "offsets") if a.sample < 12]
    one = attribute(few, some, lost=2, ok=1, jobs=1, progress=step)
    two = attribute(few, list(reversed(some)), lost=2, ok=1, jobs=2)
    assert replace(one, seconds=0.0) == replace(two, seconds=0.0)
    assert calls == extent_of(few, some, lost=2, ok=1).steps >= one.attractors + one.orbits
    plain = one.as_dict()
    assert plain["cost"]["attractors"] == one.attractors
    first = plain["responses"][0]
    assert set(first["subjects"][0]) >= {"name", "kind", "avoided", "replayed", "low", "high"}
    assert "right" in first["prediction"]


class _Stopped(Exception):
    """Somebody has had enough."""


class _Memory(StoredParts):
    """Pieces that stay."""

    def __init__(self) -> None:
        self.known: dict[str, Any] = {}

    def get(self, name: str) -> Any | None:
        return self.known.get(name)

    def put(self, values: Mapping[str, Any]) -> None:
        self.known |= values


@pytest.mark.slow
def test_an_attribution_that_was_interrupted_goes_on_where_it_was(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    few = replace(plan(2, "offsets"), samples=12)
    some = [a for a in answers(2, "offsets") if a.sample < 12]
    whole = attribute(few, some, lost=2, ok=1, jobs=1)
    total = extent_of(few, some, lost=2, ok=1).steps
    pieces, steps = _Memory(), 0

    def stop_late() -> None:
        nonlocal steps
        steps += 1
        if steps > 0.6 * total:
            raise _Stopped

    monkeypatch.setattr(loss_replay, "AT_ONCE", 1)
    with pytest.raises(_Stopped):
        attribute(few, some, lost=2, ok=1, jobs=1, progress=stop_late, parts=pieces)
    before = dict(pieces.known)
    assert {name.split()[0] for name in before} >= {"replay", "crossing"}
    replayed: list[object] = []
    some_again = loss_replay._some

    def counted(*args: Any) -> Any:
        replayed.append(args)
        return some_again(*args)

    monkeypatch.setattr(loss_replay, "_some", counted)
    steps = 0

    def step() -> None:
        nonlocal steps
        steps += 1

    again = attribute(few, some, lost=2, ok=1, jobs=1, progress=step, parts=pieces)
    assert replace(again, seconds=0.0) == replace(whole, seconds=0.0)
    assert replayed == []
    assert steps == total
    assert all(pieces.known[name] is value for name, value in before.items())


@pytest.mark.slow
def test_a_budget_leaves_out_boards_and_says_what_share_was_done() -> None:
    study = plan(2, "offsets")
    rows = tuple(replace(a, periods=50) for a in answers(2, "offsets"))
    whole = extent_of(study, rows)
    budget = round(0.5 * whole.steps)
    half = extent_of(study, rows, budget)
    assert 0.4 * whole.steps < half.steps <= budget
    assert half.share == half.steps / whole.steps
    assert half.replays == whole.replays[: len(half.replays)]
    assert {r.before for r in half.replays} == {Verdict.LOST, Verdict.OK}
    assert half.changes == whole.changes
    least = extent_of(study, rows, 1)
    assert len(least.replays) == len(least.crossings) == 1
    assert extent_of(study, rows, whole.steps).share == 1.0
    found = attribute(study, rows, budget=1, jobs=2)
    assert found.share == least.share
    assert {s.replayed for s in found.responses[0].subjects} <= {0, 1}
    assert found.responses[0].subjects


def test_boards_that_take_long_are_fewer_within_a_budget() -> None:
    """Lost boards of 1250 drive periods are ten steps each, so a budget holds fewer of them."""
    study = plan(2, "offsets")
    rows = tuple(replace(a, periods=50) for a in answers(2, "offsets"))
    slow = tuple(replace(a, periods=1250) if a.verdict is Verdict.LOST else a for a in rows)
    budget = round(0.5 * extent_of(study, rows).steps)
    lost = [
        sum(replay.before is Verdict.LOST for replay in extent_of(study, asked, budget).replays)
        for asked in (rows, slow)
    ]
    assert 1 <= lost[1] < 0.5 * lost[0]


@pytest.mark.slow
def test_a_larger_budget_does_the_rest() -> None:
    few = replace(plan(2, "offsets"), samples=12)
    some = [a for a in answers(2, "offsets") if a.sample < 12]
    pieces = _Memory()
    part = attribute(few, some, lost=2, ok=1, budget=1, jobs=2, parts=pieces)
    assert part.share < 1.0
    assert part.budget == 1
    more = attribute(few, some, lost=2, ok=1, budget=10**6, jobs=2, parts=pieces)
    whole = attribute(few, some, lost=2, ok=1, jobs=2)
    assert replace(more, seconds=0.0) == replace(whole, seconds=0.0)


def test_where_every_board_is_lost_whatever_is_exact_few_are_replayed() -> None:
    """Boards without any spread to speak of do what the nominal one does: not what is asked."""
    study = plan(1, "tiny", PROBE + 4)
    asked = replace(
        study.questions[0], spec=replace(study.questions[0].spec, expect=Counts(1, ((5, 5),)))
    )
    study = replace(study, questions=(asked,))
    rows = block(study, range(study.samples), 2)
    assert {a.verdict for a in rows} == {Verdict.LOST}
    found = attribute(study, rows, jobs=2).responses[0]
    assert {s.replayed for s in found.subjects} == {PROBE}
    assert found.skipped.startswith("every board is lost (to 1-1-1), and no part or group")


def test_quantities_leave_out_what_does_nothing() -> None:
    drawn = draw_many(plan(1, "offsets").circuit, Spread(0.01, 0.01, 3e-3, 1e-2), 0, range(50))
    found = {q.name for q in quantities(drawn.circuit, drawn)}
    limiting = {s.name for s in drawn.circuit.sections if s.limits}
    assert {n.removesuffix(".high") for n in found if n.endswith(".high")} == limiting
    assert {"R4", "C1", "U1A.offset"} <= found
    assert not any(n.endswith(".bias") for n in found)


def test_column_of_a_rail_that_the_boards_do_not_have() -> None:
    circuit = plan(1, "offsets").circuit
    nominal = Boards.of(circuit, [nominal_board(circuit)])
    rail = circuit.rails[0]
    values: Array = column(nominal, Quantity(rail.name, "supply", rail.volts, 0.1))
    assert (values == rail.volts).all()
