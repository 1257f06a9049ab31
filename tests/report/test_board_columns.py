"""The boards of a page: what is packed is what the study has, motions are its boards' own."""

from __future__ import annotations

import base64
import json
import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.circuit.ensemble import Ensemble
from designer.kernels.kernel_boards import POINTS
from designer.report import board_columns
from designer.report.board_columns import boards_json, shown_boards
from designer.report.data import ReportData
from designer.report.write import render_html
from designer.spread.board_quantities import column, quantities
from designer.verdicts.verdict import Verdict
from tests.shared.report_data import changed, plain_report


def unpacked(packed: dict[str, Any]) -> Array:
    kind = "<u2" if packed["steps"] > 255 else "u1"
    codes = np.frombuffer(base64.b64decode(packed["codes"]), dtype=kind).astype(float)
    step = (packed["high"] - packed["low"]) / (packed["steps"] - 1)
    return np.where(codes == packed["steps"], np.nan, packed["low"] + step * codes)


def many(samples: int) -> ReportData:
    """The plain report with its three boards' answers drawn again, four in ten of them lost."""
    data, random = plain_report(), np.random.default_rng(3)
    answers = []
    for k in range(samples):
        for a in data.study.answers[:2]:
            lost = random.random() < 0.4
            met = f"{random.integers(1, 4)}-{random.integers(1, 9)}-3"
            answers.append(
                replace(
                    a,
                    sample=k,
                    verdict=Verdict.LOST if lost else Verdict.OK,
                    response=met if lost else a.response,
                    reason=f"to {met}" if lost else "",
                    radius=float(random.random()),
                    penetration=float(random.random()),
                )
            )
    return changed(data, answers=tuple(answers), plan=replace(data.plan, samples=samples))


@pytest.fixture(scope="module")
def boards() -> dict[str, Any]:
    document: dict[str, Any] = json.loads(boards_json(plain_report()))
    return document


def test_every_answer_is_there(boards: dict[str, Any]) -> None:
    study = plain_report().study
    for index, response in enumerate(boards["responses"]):
        kinds = np.frombuffer(base64.b64decode(response["kind"]), dtype="<u2")
        for answer in study.answers_to(index):
            expected = [str(answer.verdict), answer.response, answer.reason]
            assert response["kinds"][kinds[answer.sample]] == expected
        radius, margin = unpacked(response["radius"]), unpacked(response["margin"])
        for answer in study.answers_to(index):
            assert radius[answer.sample] == pytest.approx(answer.radius, rel=1e-4)
            nearest = min(answer.penetration, answer.miss)
            assert np.exp(margin[answer.sample]) == pytest.approx(nearest, rel=1e-3)


def test_every_quantity_is_there_to_a_255th_of_its_range(boards: dict[str, Any]) -> None:
    plan = plain_report().plan
    drawn = plan.boards(range(plan.samples))
    every = quantities(plan.circuit, drawn)
    assert [q["name"] for q in boards["quantities"]] == [q.name for q in every]
    assert {"R50", "U1A.offset"} <= {q.name for q in every}
    for packed, quantity in zip(boards["quantities"], every, strict=True):
        values = column(drawn, quantity)
        bound = (values.max() - values.min()) / 254
        assert np.abs(unpacked(packed) - values).max() <= bound
        assert packed["unit"] in ("Ω", "F", "V")


def test_stored_motions_are_those_of_the_boards(boards: dict[str, Any]) -> None:
    """The motion in volts by the compiled way, from which the study's waveform errors are."""
    data = plain_report()
    ensemble = Ensemble(data.plan.boards(range(data.plan.samples)))
    assert len(boards["orbits"]) == len(data.study.answers)
    for stored in boards["orbits"]:
        question = data.plan.questions[stored["response"]]
        (board,) = ensemble.respond(
            [stored["sample"]], [question.excitation.drive], question.start.start[None, :]
        )
        assert stored["periods"] == pytest.approx(board.orbit.n)
        (moved,) = stored["clearances"]
        x = unpacked(moved["x"])
        volts = data.design.volts(data.checked[stored["response"]].model.b)[0]
        at = np.linspace(0.0, board.orbit.n, len(x))[:-1]
        cycles = np.arange(len(board.trace)) / POINTS
        expected = np.interp(at, cycles, board.trace, period=board.orbit.n) / volts
        assert np.abs(x[:-1] - expected).max() < 0.01 * np.abs(expected).max()


def test_every_way_of_losing_a_response_is_shown_before_a_second_of_the_same() -> None:
    data = many(200)
    shown = shown_boards(data)
    assert len(shown) <= board_columns.MOST_ORBITS
    for index in range(len(data.checked)):
        lost = {a.response for a in data.study.answers_to(index) if a.verdict is Verdict.LOST}
        mine = [a for a in shown if data.study.response_indices[a.question] == index]
        assert {a.response for a in mine if a.verdict is Verdict.LOST} == lost
        assert any(a.verdict is Verdict.OK for a in mine)


@pytest.mark.slow
def test_a_large_study_is_a_small_page() -> None:
    """4000 boards; of two responses here, of nine 2.2 MB were measured."""
    html = render_html(many(4000))
    assert len(html.encode("utf-8")) < 2_000_000
    assert len(zlib.compress(boards_json(many(4000)).encode())) < 600_000
