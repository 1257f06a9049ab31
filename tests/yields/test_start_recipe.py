"""Start recipes: what they say, what they try, and whether they keep their word."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from designer.base.proportion import wilson
from designer.base.second_process import Awaited, other_process
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import BRIEF, Ensemble
from designer.circuit.netlist import Excitation, Resistor
from designer.circuit.reduction import Reduction
from designer.dynamics.flow import Flow
from designer.model.response_table import HertzResponse
from designer.spread.spread import draw, draw_many
from designer.verdicts.verdict import Question, Verdict
from designer.yields import start_recipe_search
from designer.yields.power_up import (
    PowerUp,
    phases,
    power_up_block,
    switched_on,
    until_strobe,
)
from designer.yields.start_recipe import FINER, SLOWER, Recipe, RecipeKind, hertz, volts
from designer.yields.start_recipe_search import (
    ASIDE,
    HOLD,
    STEP,
    _Trials,
    candidates,
    find_recipes,
    highest_resonance,
    phase,
)
from tests.shared.bench_plans import answers, ensemble, period_counts, plan, question
from tests.shared.paper_cases import OMEGA, subject


def recipes(p: int) -> dict[RecipeKind, Recipe]:
    return {r.way: r for r in candidates(question(p), subject(p).system)}


def nominal(p: int) -> Ensemble:
    return ensemble([subject(p).board], p)


class Ended:
    """What became of a start."""

    def __init__(self, ok: bool) -> None:
        self.verdict = Verdict.OK if ok else Verdict.LOST


# What a recipe is.


@pytest.mark.parametrize("way", list(RecipeKind))
def test_a_recipe_ends_at_the_wanted_setting_in_small_steps(way: RecipeKind) -> None:
    recipe = recipes(2)[way]
    stages = list(recipe.stages())
    assert stages[-1] == (recipe.target, recipe.wait)
    assert recipe.target == question(2).excitation
    assert stages[0][0] == recipe.first
    for (a, held), (b, _) in pairwise(stages):
        assert held == HOLD
        assert abs(math.log(b.frequency / a.frequency)) <= math.log1p(STEP) + 1e-12
        assert abs(math.log(b.amplitude / a.amplitude)) <= math.log1p(STEP) + 1e-12
    swept = sum(periods / setting.frequency for setting, periods in stages[:-1])
    assert recipe.sweep_seconds == pytest.approx(swept)
    assert [d.omega for d, _ in recipe.drives] == pytest.approx(
        [2 * math.pi * e.frequency for e, _ in stages]
    )


def test_a_recipe_names_the_frequency_of_a_mechanism() -> None:
    """ω in rad/s is read in hertz; other models give their own scale (``setup.csv``)."""
    own = question(1)
    omega = 72.0 * math.pi
    spec = HertzResponse(omega, own.spec.expect)
    found = {r.way: r for r in candidates(replace(own, spec=spec), subject(1).system)}
    text = found[RecipeKind.FROM_ABOVE].text
    assert "Hz (39.6 Hz of the mechanism), " in text
    assert "Hz (36 Hz of the mechanism) in " in text
    assert "omega" not in text


def test_candidates_are_what_their_names_say() -> None:
    found = recipes(2)
    target = question(2).excitation
    assert next(iter(found)) is RecipeKind.DIRECT
    assert found[RecipeKind.DIRECT].first == target
    assert found[RecipeKind.FROM_ABOVE].first.frequency == pytest.approx(
        (1 + ASIDE) * target.frequency
    )
    assert found[RecipeKind.FROM_BELOW].first.frequency == pytest.approx(
        (1 - ASIDE) * target.frequency
    )
    assert found[RecipeKind.AMPLITUDE].first == Excitation(target.frequency, 0.5 * target.amplitude)


def test_the_long_sweep_begins_above_the_model_s_resonances() -> None:
    """Inside the clearance the paper's two masses have ω² = (3 ± √5)/2, a little damped."""
    hertz = highest_resonance(subject(1).system)
    per_omega = subject(1).excitation.frequency / OMEGA[1]
    undamped = math.sqrt((3.0 + math.sqrt(5.0)) / 2.0)
    assert hertz / per_omega == pytest.approx(undamped, rel=0.05)
    assert hertz / per_omega < undamped


def test_a_recipe_in_words_and_in_json() -> None:
    tried = replace(
        recipes(1)[RecipeKind.FROM_ABOVE],
        reached=12,
        trials=12,
        board_reached=13,
        board_trials=15,
        boards=6,
        able=5,
        smooth=True,
        slower=True,
    )
    text = tried.text
    high, low = (float(f"{factor * tried.target.frequency:.6g}") for factor in (1.1, 1.0))
    assert f"set {high:g} Hz (omega 1.705), " in text
    swept = f"{float(f'{tried.sweep_seconds:.2g}'):g} s"
    assert f"sweep logarithmically to {low:g} Hz (omega 1.55) in {swept}, once, then hold" in text
    assert "up to 10 times slower is fine" in text
    assert "from 12 of 12 switch-on phases, and at 13 of 15 starts of 5 sample boards" in text
    assert "caution" not in text
    said = json.loads(json.dumps(tried.as_dict()))
    assert said["text"] == text
    assert said["to_frequency_hz"] == tried.target.frequency
    assert said["sweep_seconds"] > 0.0
    direct = recipes(1)[RecipeKind.DIRECT]
    assert direct.sweep_seconds == 0.0
    assert "at this setting" in direct.text


def test_only_what_was_tried_is_promised() -> None:
    sweep = recipes(1)[RecipeKind.FROM_ABOVE]
    assert "in 10 steps of equal ratio, 20 periods each" in sweep.text
    assert "slower" not in sweep.text
    assert "worked" not in sweep.text
    few = replace(sweep, reached=12, trials=12, board_reached=3, board_trials=3, boards=6, able=1)
    assert "caution: 1 of 6 sample boards" in few.text
    assert "caution: none of 6" in replace(few, board_trials=0, board_reached=0, able=0).text
    raised = replace(recipes(1)[RecipeKind.AMPLITUDE], smooth=True).text
    assert "raise the amplitude to " in raised
    assert "steps" not in raised


@pytest.mark.parametrize("way", list(RecipeKind))
def test_a_recipe_that_never_worked_is_not_offered(way: RecipeKind) -> None:
    never = replace(recipes(1)[way], reached=0, trials=12, boards=24, able=3)
    text = "none: no recipe that was tried led to it from any of 12 switch-on phases"
    assert never.text == f"{text}; caution: 3 of 24 sample boards can show it at this setting"
    some = replace(never, board_reached=2, board_trials=9, able=20)
    assert some.text == f"{text}, and at most at 2 of 9 starts of boards"
    assert not some.text.startswith("none: the nominal circuit")
    assert "switch on at" in replace(recipes(1)[RecipeKind.DIRECT], reached=1, trials=12).text


@pytest.mark.parametrize("works", [None, RecipeKind.FROM_BELOW])
def test_only_a_recipe_that_worked_on_the_nominal_board_is_taken(
    monkeypatch: pytest.MonkeyPatch, works: RecipeKind | None
) -> None:
    """Sample boards that all start directly are no reason to offer that, if the nominal one does
    not; and nothing is, where no recipe works on it."""

    def ends(
        ensemble_: Ensemble,
        starts: list[tuple[int, Question, Recipe, float]],
        _jobs: int,
        _known: object,
        *,
        within: int | None,
    ) -> list[Ended]:
        assert within == BRIEF
        alone = len(ensemble_.boards.values["R1"]) == 1
        return [
            Ended(
                recipe.way is works and begun == phase(1)
                if alone
                else recipe.way is RecipeKind.DIRECT
            )
            for _, _, recipe, begun in starts
        ]

    monkeypatch.setattr(start_recipe_search, "switched_on", ends)
    (found,) = find_recipes(plan(3))
    if works is None:
        assert found.text.startswith("none: no recipe that was tried led to it from any of 12")
    else:
        assert (found.way, found.reached, found.trials) == (works, 1, 12)


@pytest.mark.parametrize("value", [300.109685878878, 4.952314987479351, 0.0123456789, 98765.4321])
def test_a_generator_takes_the_numbers(value: float) -> None:
    for text, digits in ((hertz(value), 6), (volts(value), 5)):
        assert len(text.replace(".", "").lstrip("0")) <= digits
        assert float(text) == pytest.approx(value, rel=0.5 * 10.0 ** (1 - digits))


@pytest.mark.parametrize("slower", [1, SLOWER])
def test_a_finer_sweep_is_the_same_one(slower: int) -> None:
    sweep = recipes(2)[RecipeKind.FROM_BELOW]
    fine = sweep.refined(slower)
    assert fine.sweep_seconds == pytest.approx(slower * sweep.sweep_seconds, rel=0.01)
    assert (fine.first, fine.target, fine.wait) == (sweep.first, sweep.target, sweep.wait)
    frequencies = [setting.frequency for setting, _ in fine.stages()]
    coarse = [setting.frequency for setting, _ in sweep.stages()]
    assert frequencies[::FINER] == pytest.approx(coarse)


def test_phases_fill_the_half_circle_too() -> None:
    """A mirror symmetric circuit does not tell a phase from the one half a turn away."""
    half = sorted((phase(k) % math.pi) / math.pi for k in range(12))
    gaps = [b - a for a, b in pairwise(half)]
    assert max(gaps) < 0.2
    assert min(gaps) > 0.03


# What the paper's circuit does (measured independently before: about a quarter of the starts from
# rest end on 3-3-3 at ω = 1.55 and on 1-1-1 at ω = 0.85; a sweep reaches the wanted one always).


@pytest.mark.parametrize(("p", "other"), [(1, "3-3-3"), (2, "1-1-1")])
def test_a_direct_start_is_left_to_chance(p: int, other: str) -> None:
    starts = [(0, question(p), recipes(p)[RecipeKind.DIRECT], phase(k)) for k in range(32)]
    ended = switched_on(nominal(p), starts)
    met = [e.orbit.response for e in ended]
    assert set(met) == {f"1-{p}-{p}", other}
    assert 0.12 <= met.count(other) / len(met) <= 0.40
    for e in ended:
        assert (e.verdict is Verdict.OK) == (e.orbit.response == f"1-{p}-{p}")


@pytest.mark.parametrize("p", [1, 2])
def test_what_has_come_to_a_known_orbit_settles_on_it(p: int) -> None:
    """The same ends with the board's own orbit known as by settling every start, those that end on
    another attractor among them; and a start that is not there yet is no arrival."""
    short = replace(recipes(p)[RecipeKind.DIRECT], wait=3)
    for recipe in (recipes(p)[RecipeKind.DIRECT], short):
        starts = [(0, question(p), recipe, phase(k)) for k in range(24)]
        plain = switched_on(nominal(p), starts)
        known = switched_on(nominal(p), starts, 2, [question(p).start] * len(starts))
        assert [e.verdict for e in known] == [e.verdict for e in plain]
        assert [e.orbit.response for e in known] == [e.orbit.response for e in plain]
        assert len({e.verdict for e in plain}) == 2
        quick = sum(k.orbit is question(p).start for k in known)
        assert quick == 0 if recipe is short else quick > 8


@pytest.mark.parametrize("p", [1, 2])
def test_a_sweep_from_above_all_resonances_is_not(p: int) -> None:
    recipe = recipes(p)[RecipeKind.FROM_FAR]
    starts = [(0, question(p), recipe, phase(k)) for k in range(8)]
    ended = switched_on(nominal(p), starts)
    assert {e.orbit.response for e in ended} == {f"1-{p}-{p}"}


@pytest.mark.slow
def test_recipes_found_keep_their_word_at_other_phases() -> None:
    """On phases that the search has not seen; and 1-3-3 needs no more than to be switched on."""
    of = plan(1, 3)
    found = find_recipes(of, 2)
    assert found[0].way is not RecipeKind.DIRECT
    assert found[1].way is RecipeKind.DIRECT
    for recipe, p in zip(found, (1, 3), strict=True):
        assert recipe.reached == recipe.trials > 0
        assert recipe.reached + recipe.board_reached == recipe.trials + recipe.board_trials
        starts = [(0, question(p), recipe, 0.1 + 0.77 * k) for k in range(8)]
        assert {e.verdict for e in switched_on(nominal(p), starts)} == {Verdict.OK}
    # What the text allows a person to do, one period at a step, and ten times slower.
    assert found[0].smooth
    assert found[0].slower
    for periods in (1, SLOWER):
        by_hand = replace(found[0], steps=found[0].steps * HOLD, hold=periods)
        starts = [(0, question(1), by_hand, 0.1 + 0.77 * k) for k in range(8)]
        assert {e.verdict for e in switched_on(nominal(1), starts)} == {Verdict.OK}
    third = replace(of, seed=99, samples=1000, questions=of.questions[1:])
    assert find_recipes(third, 1) == found[1:]
    # A second process changes nothing, whether it takes a recipe or half of the trials of one.
    first = replace(of, questions=of.questions[:1])
    with other_process(2) as other:
        assert find_recipes(of, 2, other) == found
        assert find_recipes(first, 2, other) == found[:1]


def test_one_recipe_beats_another_by_more_than_chance() -> None:
    """McNemar: only starts at which one of the two failed say anything about the difference."""

    def trials(*worked: int) -> _Trials:
        boards = {(i, 0): bool(yes) for i, yes in enumerate(worked)}
        return _Trials(recipes(1)[RecipeKind.DIRECT], (True,) * 12, boards)

    always, once_off = trials(1, 1, 1, 1, 1, 1), trials(1, 1, 0, 1, 1, 1)
    assert always.certain
    assert not once_off.certain
    assert once_off.beaten_by(always)
    assert not always.beaten_by(once_off)
    assert not always.beaten_by(always)
    assert not trials(0, 0, 1, 1, 1, 1).beaten_by(trials(1, 1, 1, 1, 0, 1))  # 2 against 1
    assert trials(0, 0, 0, 1, 1, 1).beaten_by(trials(1, 1, 1, 1, 0, 1))  # 3 against 1
    assert not trials(0, 1, 1).beaten_by(trials(0, 1, 1, 1, 1, 1))  # of the same starts


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_long_sweep_is_tried_where_no_shorter_one_is_good(
    monkeypatch: pytest.MonkeyPatch, share: float
) -> None:
    """It takes minutes on the bench and most of the search's time; it is tried on fewer starts."""
    seen = set[tuple[RecipeKind, int, float]]()

    def ends(
        ensemble_: Ensemble,
        starts: list[tuple[int, Question, Recipe, float]],
        *_: object,
        **__: object,
    ) -> list[Ended]:
        alone = len(ensemble_.boards.values["R1"]) == 1
        if not alone:
            seen.update((recipe.way, board, begun) for board, _, recipe, begun in starts)
        return [
            Ended(recipe.way is RecipeKind.FROM_FAR or alone or board % 10 >= 10.0 * (1.0 - share))
            for board, _, recipe, _ in starts
        ]

    monkeypatch.setattr(start_recipe_search, "switched_on", ends)
    assert recipes(2)[RecipeKind.FROM_FAR].sweep_periods > start_recipe_search.LONG_SWEEP
    (found,) = find_recipes(plan(2))
    far = [start for start in seen if start[0] is RecipeKind.FROM_FAR]
    if share > start_recipe_search.GOOD:
        assert found.way is not RecipeKind.FROM_FAR
        assert not far
    else:
        assert found.way is RecipeKind.FROM_FAR
        assert found.board_reached == found.board_trials == len(far)
        periods = len(far) * found.sweep_periods
        assert periods <= start_recipe_search.BOARD_PERIODS
        assert not found.slower  # ten times as slow would be too long to try
    assert recipes(2)[RecipeKind.AMPLITUDE].sweep_periods > start_recipe_search.LONG_SWEEP
    short = [start for start in seen if start[0] is RecipeKind.FROM_ABOVE]
    assert len(short) >= 3 * start_recipe_search.FEW_BOARDS


def test_a_short_sweep_from_afar_is_tried_though_the_amplitude_s_is_long(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A good recipe leaves out the long sweeps alone, not every one after them."""

    def ends(
        ensemble_: Ensemble,
        starts: list[tuple[int, Question, Recipe, float]],
        *_: object,
        **__: object,
    ) -> list[Ended]:
        alone = len(ensemble_.boards.values["R1"]) == 1
        return [
            Ended(recipe.way is RecipeKind.FROM_FAR or alone or board % 10 > 0)
            for board, _, recipe, _ in starts
        ]

    monkeypatch.setattr(start_recipe_search, "switched_on", ends)
    far, amplitude = (recipes(1)[way] for way in (RecipeKind.FROM_FAR, RecipeKind.AMPLITUDE))
    assert far.sweep_periods < start_recipe_search.LONG_SWEEP < amplitude.sweep_periods
    (found,) = find_recipes(plan(1))
    assert found.way is RecipeKind.FROM_FAR


@pytest.mark.slow
def test_what_a_recipe_promises_of_boards_holds_on_others() -> None:
    """Within the intervals of both; the boards here are of large offsets."""
    of = plan(2)
    (found,) = find_recipes(of, 2)
    assert found.board_trials == start_recipe_search.STARTS * found.able > 36
    ok = [a.verdict is Verdict.OK for a in answers(of, range(40))]
    rows = power_up_block(of, range(40), [found], 2)
    worked = sum(r.verdict is Verdict.OK and able for r, able in zip(rows, ok, strict=True))
    promised, seen = wilson(found.board_reached, found.board_trials), wilson(worked, sum(ok))
    assert promised[0] < seen[1]
    assert seen[0] < promised[1]


# Rows of a study.


def test_reached_rows_are_what_a_plain_run_from_zero_shows() -> None:
    """900 periods from discharged capacitors, without sweep, counted by eye."""
    of = plan(2)
    direct = recipes(2)[RecipeKind.DIRECT]
    rows = power_up_block(of, range(6), [direct], 2)
    assert [(r.sample, r.question) for r in rows] == [(i, 0) for i in range(6)]
    seen = 0
    for row in rows:
        board = draw(of.circuit, of.spread, of.seed, row.sample)
        system = Reduction(of.circuit, board).system()
        drive = direct.target.drive
        met = until_strobe(Flow(system, drive, fast=False), row.phase)
        assert met is not None
        run = Flow(system, drive).run(met[0], 900)
        counted = period_counts(run.strobes, run.counts)
        if counted is not None:
            assert row.response == "-".join(map(str, counted))
            seen += 1
        assert row.clipped is False
        assert row.periods > direct.wait
    assert seen >= 4


def test_neither_jobs_nor_blocks_change_what_is_reached() -> None:
    of = plan(1, 3)
    known = [recipes(1)[RecipeKind.FROM_ABOVE], recipes(3)[RecipeKind.DIRECT]]
    calls: list[int] = []
    whole = power_up_block(of, range(4), known, 2, lambda: calls.append(1))
    assert len(calls) == len(whole) == 8
    parts: list[PowerUp] = []
    for block in (range(1), range(1, 4)):
        parts += power_up_block(of, block, known, 1)
    assert parts == whole


def test_phases_are_drawn_from_seed_sample_and_response_alone() -> None:
    drawn = phases(3, question(1), range(400))
    assert len(set(drawn)) == 400
    assert ((drawn >= 0.0) & (drawn < 2.0 * math.pi)).all()
    assert drawn.mean() == pytest.approx(math.pi, abs=4.0 * 2.0 * math.pi / math.sqrt(12 * 400))
    assert phases(3, question(1), range(7, 9)).tolist() == drawn[7:9].tolist()
    assert not set(phases(4, question(1), range(400))) & set(drawn)
    assert not set(phases(3, question(2), range(400))) & set(drawn)


def test_a_response_in_front_changes_nothing_of_the_others() -> None:
    known = [recipes(1)[RecipeKind.DIRECT], recipes(3)[RecipeKind.DIRECT]]
    alone = power_up_block(plan(3), range(4), known[1:], 2)
    both = power_up_block(plan(1, 3), range(4), known, 2)
    assert [replace(r, question=0) for r in both if r.question == 1] == alone


@pytest.mark.parametrize("answered", [0, 1, 2, 9])
def test_each_recipe_is_found_once_and_in_order_whoever_finds_it(
    monkeypatch: pytest.MonkeyPatch, answered: int
) -> None:
    """Half of the threads here, half in a process that ends after so many questions."""
    found: list[float] = []

    def find(bench: Any) -> float:
        found.append(bench.question.omega)
        return found[-1]

    def ask(function: Callable[..., Any], *arguments: Any) -> Awaited[Any]:
        there: Future[tuple[Any] | None] = Future()
        asked.append(function)
        there.set_result((function(*arguments),) if len(asked) <= answered else None)
        return Awaited(function, arguments, there)

    asked: list[object] = []
    of = plan(1, 2, 3, 4)
    monkeypatch.setattr(start_recipe_search, "_find", find)
    omegas = [each.omega for each in of.questions]
    given: list[Any] = list(find_recipes(of, 2, ask))
    assert given == omegas
    assert sorted(found) == sorted(omegas)


@pytest.mark.parametrize("seed", [0, 0x57A27])
def test_recipes_are_tried_on_boards_that_no_study_has(
    monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """Not those of the seed 0, nor of one that the search once had for its own."""
    of = replace(plan(3), seed=seed)
    tried: list[Ensemble] = []
    monkeypatch.setattr(start_recipe_search, "_find", lambda bench: tried.append(bench.sample))
    find_recipes(of)
    theirs = draw_many(of.circuit, of.spread, seed, range(start_recipe_search.BOARDS))
    for name, values in theirs.values.items():
        assert not (tried[0].boards.values[name] == values).any()


def test_reached_agrees_with_as_built_where_one_attractor_is_left() -> None:
    """At ω = 0.54 the nominal circuit has one attractor: how it is started does not matter."""
    of = plan(3)
    rows = power_up_block(of, range(8), [recipes(3)[RecipeKind.DIRECT]], 2)
    ok = [a.verdict is Verdict.OK for a in answers(of, range(8))]
    assert any(ok)
    assert sum(r.verdict is Verdict.OK for r in rows) == pytest.approx(sum(ok), abs=1)


def test_a_board_that_cannot_be_reduced_is_failed() -> None:
    of = plan(1, samples=1)
    broken = replace(of.circuit, parts=(*of.circuit.parts, Resistor("R999", "e1", "e2", 1e3, "")))
    boards = Boards.of(broken, [nominal_board(broken)])
    (ended,) = switched_on(Ensemble(boards), [(0, question(1), recipes(1)[RecipeKind.DIRECT], 1.0)])
    assert ended.verdict is Verdict.FAILED
    assert ended.reason
    (row,) = power_up_block(
        replace(of, circuit=broken), range(1), [recipes(1)[RecipeKind.DIRECT]], 1
    )
    assert row.verdict is Verdict.FAILED
