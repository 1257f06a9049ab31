"""The fitted trimmer: its force against Ohm's law, its setting against exact rest points, and what
boards show there against plain runs and a grid of settings."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.base.toml_writer import toml_text
from designer.board.board_parts import drive_resistance, driven_nodes
from designer.centering.repair_upgrade import with_same_parts
from designer.circuit.board_arrays import Boards
from designer.circuit.board_modes import at_rest
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Resistor, Trimmer
from designer.circuit.reduction import Reduction
from designer.dynamics import attractors
from designer.dynamics.flow import Flow
from designer.folders.study_json import study_json
from designer.model.distributions import Normal
from designer.model.model_file import parse_model_file
from designer.spread.spread import OpAmpDrift, Spread, draw, draw_many
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import StudyPlan, Verdict, judge
from designer.yields.adjustment import rest_distances
from designer.yields.tolerance_study import tolerance
from designer.yields.trimmed_yield import (
    END,
    FINER,
    HIGH,
    LOW,
    SCREEN,
    DcTrim,
    Trimmed,
    dc_trim,
    settings,
    trimmed_answers,
    trimmed_block,
    trimmed_boards,
)
from designer.yields.yield_count import all_on_one
from tests.shared.bench_plans import period_counts, plan
from tests.shared.paper_cases import subject, synthesised

ROUGH = Spread(0.01, 0.01, 3e-4, 1e-3)
"""Of which many boards fail as built."""
TRACK = 10e3
REACH = 0.3
"""DC force at either end over the drive."""


@cache
def trim(reach: float = REACH, adjustability: float = 1e-4) -> DcTrim:
    """A trimmer on the paper's circuit."""
    circuit = subject(1).circuit
    node = next(iter(driven_nodes(circuit)))
    wanted = reach * subject(1).excitation.amplitude
    ohms = circuit.supply * drive_resistance(circuit, node) / wanted
    part = Trimmer("RV901", "vee", "trim", "vcc", TRACK, "DC trim")
    series = Resistor("R911", "trim", node, ohms, "DC trim")
    return DcTrim.of(circuit, part, series, adjustability)


def at(of: DcTrim, board: Board, position: float) -> Board:
    """One board with the wiper there, written down by hand."""
    track = {HIGH: TRACK * (1.0 - position), LOW: TRACK * position}
    return replace(board, values={**board.values, **track})


@pytest.mark.parametrize("position", [0.05, 0.5, 0.8])
def test_the_trimmer_is_a_dc_of_the_generator(position: float) -> None:
    """By Ohm's and Thévenin's laws; amplifiers of infinite gain hold the summing node at 0 V."""
    circuit, of = subject(1).circuit, trim()
    series = of.circuit.values["R911"] + TRACK * position * (1.0 - position)
    volts = circuit.supply * (2.0 * position - 1.0)
    r6 = drive_resistance(circuit, next(iter(driven_nodes(circuit))))
    bare = Reduction(circuit, nominal_board(circuit, ideal=True)).system()
    board = at(of, nominal_board(of.circuit, ideal=True), position)
    shown = Reduction(of.circuit, board).system()
    for key in (bare.start, shown.start):
        known, seen = bare.mode(key), shown.mode(key)
        wanted = known.d + known.B * volts * r6 / series
        for found, rates in ((seen.A, known.A), (seen.B, known.B), (seen.d, wanted)):
            assert found == pytest.approx(rates, rel=1e-9, abs=1e-9 * np.abs(known.B).max())


def test_a_turned_trimmer_is_no_mirror_symmetric_board() -> None:
    of = trim()
    board = nominal_board(of.circuit, ideal=True)
    assert Reduction(of.circuit, at(of, board, 0.5)).system().mirror is not None
    assert Reduction(of.circuit, at(of, board, 0.6)).system().mirror is None


def test_rest_points_are_those_of_each_board_alone() -> None:
    of = trim()
    boards = draw_many(of.circuit, ROUGH, 5, range(6))
    rest, stops = at_rest(boards)
    for i in range(6):
        system = Reduction(of.circuit, draw(of.circuit, ROUGH, 5, i)).system()
        distances, _ = rest_distances(system)  # past the upper stop, then past the lower one
        assert rest[i] - stops[1][i] == pytest.approx(distances[0], abs=1e-9)
        assert stops[-1][i] - rest[i] == pytest.approx(distances[1], abs=1e-9)


def test_the_setting_centres_the_board_as_well_as_the_screen_shows() -> None:
    """A reading is off by at most a step and half a step of rounding, so is the mean of several."""
    of, count = trim(adjustability=0.0), 40
    boards = draw_many(of.circuit, ROUGH, 9, range(count))
    position = settings(of, boards, 9, range(count))
    away = []
    nominal = Reduction(of.circuit, nominal_board(of.circuit)).system()
    wanted = float(np.diff(rest_distances(nominal)[0])[0])
    stop = float(at_rest(boards)[1][1].mean())
    step = SCREEN * stop / 256
    for i, here in enumerate(position):
        system = Reduction(of.circuit, at(of, boards.board(i), float(here))).system()
        # Half the difference of the distances to the stops is how far rest is from their middle.
        away.append(0.5 * (float(np.diff(rest_distances(system)[0])[0]) - wanted))
    assert np.abs(away).max() < 1.5 * step * (1.0 + 1.0 / FINER)
    # Two stops, four readings each: uniform within a step, then rounded.
    sigma = step * np.sqrt((1.0 / 3.0 + 1.0 / 12.0) / 4.0 * (0.5 + 1.0 / FINER**2))
    assert np.std(away) == pytest.approx(sigma, rel=0.35)
    assert np.abs(position - 0.5).max() > 0.02


def test_a_trimmer_is_set_on_the_new_board_and_drift_comes_after() -> None:
    """At 85 °C a slope of the offsets moves the rest point by what it moves an untrimmed one."""
    of = trim(adjustability=0.0)
    drift = OpAmpDrift(offset=Normal(18e-6, 54e-6))
    warm = replace(plan(7), spread=replace(ROUGH, temperature=(85.0, 85.0), opamps=drift))
    new = replace(warm, spread=ROUGH)
    (set_warm, at_warm), (set_new, at_new) = (
        trimmed_boards(of, each, range(60)) for each in (warm, new)
    )
    assert at_warm == pytest.approx(at_new, abs=1e-12)
    moved = at_rest(set_warm)[0] - at_rest(set_new)[0]
    middle = np.full(60, 0.5)
    plain = [
        at_rest(of.at(draw_many(of.circuit, each.spread, each.seed, range(60)), middle))[0]
        for each in (warm, new)
    ]
    assert moved == pytest.approx(plain[0] - plain[1], rel=0.02, abs=0.02 * np.abs(moved).max())
    assert np.std(moved) > 3.0 * np.std(at_rest(set_new)[0])


def test_the_setting_is_as_fine_as_the_part() -> None:
    fine, coarse = trim(adjustability=0.0), trim(adjustability=0.01)
    boards = draw_many(fine.circuit, ROUGH, 9, range(40))
    apart = settings(coarse, boards, 9, range(40)) - settings(fine, boards, 9, range(40))
    assert 0.008 < np.abs(apart).max() <= 0.01 + 1e-12


def test_a_constant_force_is_trimmed_away() -> None:
    """The only defect of the board is the offset of one section, a DC force of 4 % of the drive."""
    of, ratio = trim(adjustability=0.0), 0.04
    known = subject(7)
    gain = sum(1.0 / r.value for r in known.circuit.resistors if "s2" in r.nets)
    lever = known.circuit.values["R6"] * gain
    volts = ratio * known.excitation.amplitude / lever
    board = nominal_board(of.circuit)
    board = replace(board, offset={**board.offset, "U2C": volts})
    boards = Boards.of(of.circuit, [board])
    asked = plan(7)
    question = asked.questions[0]
    (built,) = Ensemble(boards).quick(
        [0], [question.excitation.drive], question.start.start[None, :]
    )
    assert built is None or judge(built, question.spec, question.start)[0] is not Verdict.OK
    position = settings(of, boards, 11, range(1))
    # The drive is ± 1; the ends of the trimmer are ± REACH.
    assert abs(position[0] - 0.5) * 2.0 * REACH == pytest.approx(ratio, abs=5e-3)
    (there,) = exact_circuit.of_boards(asked, of.at(boards, position), range(1), 1)
    assert there.verdict is Verdict.OK
    assert there.penetration == pytest.approx(known.orbit.penetration, rel=0.2)


def test_what_is_out_of_reach_stands_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor is the wiper ever turned past an end of its travel."""
    of = trim(reach=0.01)
    turned: list[float] = []
    at = DcTrim.at

    def recorded(self: DcTrim, boards: Boards, position: Array) -> Boards:
        turned.extend(position.tolist())
        return at(self, boards, position)

    with monkeypatch.context() as patch:
        patch.setattr(DcTrim, "at", recorded)
        rows = trimmed_block(of, plan(3, spread=ROUGH), range(8), 1)
    assert (min(turned), max(turned)) == pytest.approx((END, 1.0 - END), abs=1e-12)
    ends = [r for r in rows if r.at_end]
    assert ends
    assert all(min(r.position, 1.0 - r.position) == pytest.approx(END) for r in ends)
    assert not any(r.at_end for r in trimmed_block(trim(), plan(3, spread=ROUGH), range(8), 1))


@pytest.fixture(scope="module")
def rows() -> list[Trimmed]:
    return trimmed_block(trim(), plan(3, 6, spread=ROUGH), range(10), 2)


def test_one_setting_a_board_for_all_its_responses(rows: list[Trimmed]) -> None:
    assert [(r.sample, r.question) for r in rows] == [(i, k) for i in range(10) for k in range(2)]
    for first, second in pairwise(rows):
        assert (first.position == second.position) is (first.sample == second.sample)


def test_trimming_helps(rows: list[Trimmed]) -> None:
    of = plan(3, 6, spread=ROUGH)
    built = exact_circuit.block(of, range(10), 2)
    works = sum(a.verdict is Verdict.OK for a in built)
    assert works < sum(r.verdict is Verdict.OK for r in rows)


def test_verdicts_are_those_of_plain_runs(rows: list[Trimmed]) -> None:
    """900 periods from the nominal orbit on each board's own reduction, counted by eye."""
    of, checked = plan(3, 6, spread=ROUGH), 0
    for row in rows:
        asked = of.questions[row.question]
        board = at(trim(), draw(trim().circuit, ROUGH, of.seed, row.sample), row.position)
        flow = Flow(Reduction(trim().circuit, board).system(), asked.excitation.drive)
        run = flow.run(asked.start.start, 900)
        found = period_counts(run.strobes, run.counts)
        if found is None:
            continue
        assert f"{found[0]}-{found[1]}-{found[2]}" == row.response
        checked += 1
    assert checked >= 12


@pytest.mark.slow
def test_the_one_setting_is_nearly_as_good_as_any(rows: list[Trimmed]) -> None:
    """Against a grid of settings, by the general kernel: on which boards does any show both
    responses? Where the procedure's setting does, the grid has one that does, but for its mesh."""
    of, grid, boards = plan(3, 6, spread=ROUGH), np.linspace(0.35, 0.65, 25), range(4)
    exists, found = [], []
    for i in boards:
        shown = False
        for position in grid:
            board = at(trim(), draw(trim().circuit, ROUGH, of.seed, i), float(position))
            system = Reduction(trim().circuit, board).system()
            shown = shown or all(
                judge(
                    attractors.settle(Flow(system, q.excitation.drive), q.start.start),
                    q.spec,
                    q.start,
                )[0]
                is Verdict.OK
                for q in of.questions
            )
        exists.append(shown)
        found.append(all(r.verdict is Verdict.OK for r in rows if r.sample == i))
    assert sum(found) >= 1
    assert sum(exists) - sum(found) <= 1


def test_neither_jobs_nor_blocks_change_the_rows(rows: list[Trimmed]) -> None:
    of = plan(3, 6, spread=ROUGH)
    split = [*trimmed_block(trim(), of, range(3), 1), *trimmed_block(trim(), of, range(3, 10), 1)]
    assert [repr(r) for r in split] == [repr(r) for r in rows]
    answers, position = trimmed_answers(trim(), of, range(2, 4), 1)
    assert [a.verdict for a in answers] == [r.verdict for r in rows[4:8]]
    assert len(position) == 2


def test_the_boards_are_those_of_the_study() -> None:
    of = plan(3, spread=ROUGH)
    trimmed, _ = trimmed_boards(trim(), of, range(5))
    built = draw_many(of.circuit, ROUGH, of.seed, range(5))
    for name, column in built.values.items():
        assert (trimmed.values[name] == column).all()
    for name, column in built.offset.items():
        assert (trimmed.offset[name] == column).all()


@pytest.mark.slow
def test_only_a_fitted_trimmer_is_one() -> None:
    made = synthesised()
    assert dc_trim(made) is None
    data = tomllib.loads(made.modelfile.text)
    data["board"] = {"dc_trim": "fitted"}
    fitted = with_same_parts(made, parse_model_file(toml_text(data)))
    found = dc_trim(fitted)
    assert found is not None
    assert found.circuit.parts[: len(made.design.circuit.parts)] == made.design.circuit.parts
    assert found.adjustability == made.catalog.trimmer(TRACK).adjustability > 0.0
    # Both rails and the generator's own DC offset: as far as the model file's [tuning] goes.
    rails = [
        Reduction(found.circuit, at(found, nominal_board(found.circuit), p))
        for p in (END, 1.0 - END)
    ]
    low, high = (float(-np.linalg.solve(m.A, m.d)[0]) for m in (r.system().mode(r.circuit.rest)
                                                                for r in rails))  # fmt: skip
    mode = rails[0].system().mode(found.circuit.rest)
    per_volt = float(-np.linalg.solve(mode.A, mode.B)[0])
    reach = abs(high - low) / abs(per_volt) / 2.0 / made.design.amplitude()
    assert made.modelfile.tuning.offset * 0.99 < reach < made.modelfile.tuning.offset * 1.2


def test_a_study_of_a_board_with_a_trimmer_has_its_column() -> None:
    made = synthesised()
    data = tomllib.loads(made.modelfile.text)
    data["board"] = {"dc_trim": "fitted"}
    data["response"] = [r for r in data["response"] if r["omega"] in (1.55, 0.85)]
    fitted = with_same_parts(made, parse_model_file(toml_text(data)))
    study = tolerance(fitted, samples=6, fidelity="exact", attributed=False, jobs=1)
    assert study.trimmed is not None
    assert len(study.trimmed) == 12
    no_origin: Any = {}
    answer: Any = study_json(study, no_origin, {})
    for response in answer["responses"]:
        shown = response["trimmed"]
        assert shown["samples"] == 6
        assert shown["ok"] + shown["lost"] + shown["grazing"] == 6
        assert shown["at_end"] == 0
    whole = all_on_one(study.trimmed)
    assert answer["all_on_one_board"]["trimmed"]["ok"] == whole.ok
    plain = tolerance(made, samples=2, fidelity="exact", attributed=False, jobs=1)
    assert plain.trimmed is None
    assert study_json(plain, no_origin, {})["responses"][0]["trimmed"] is None


def test_the_setting_knows_no_response() -> None:
    """The setting is found with the generator off: it depends on the board alone."""
    of = trim()
    one: StudyPlan = plan(1, spread=ROUGH)
    two: StudyPlan = plan(6, spread=ROUGH)
    assert (trimmed_boards(of, one, range(4))[1] == trimmed_boards(of, two, range(4))[1]).all()
