"""Records of exact orbits that were sure and wrong once."""

from __future__ import annotations

from functools import cache

import pytest

from benchmarks.bench_records import MODEL, WRONG, named_exact
from benchmarks.exact_records import ExactRecord, drawn_records
from designer.check.synthesis_result import Synthesis, synthesise
from designer.model.model_file import read_model_file
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.naming import identify_response
from designer.workbench.prediction import BoardPrediction


@cache
def preloaded() -> tuple[Synthesis, BoardPrediction]:
    synthesis = synthesise(read_model_file(MODEL.with_name("preloaded.toml")))
    return synthesis, BoardPrediction(synthesis)


def drawn(number: int, seed: int) -> ExactRecord:
    (record,) = drawn_records(preloaded()[0], range(number, number + 1), seed)
    return record


@pytest.mark.parametrize("number", [3, 8])
def test_an_output_is_not_surely_a_displacement_that_is_cut_off(number: int) -> None:
    """``fv_B`` on a channel was taken for ``v1`` that is clipped where the stage begins to act."""
    answer = named_exact("preloaded", 881203, drawn(number, 881203), *preloaded())
    assert answer.outcome != WRONG


def test_an_output_mostly_in_contact_is_counted_from_its_level_in_the_clearance() -> None:
    """The mass rests against stop B: half of the time the output is not at its level."""
    truth, (_, prediction) = drawn(57, 78), preloaded()
    told = {net: f"CH{k + 1}" for k, net in enumerate(truth.nets)}
    name = identify_response(recorded_motion(truth.record, prediction, stated=told), prediction)
    assert truth.response == "1-1-0;0-1"
    assert "v1" not in told
    assert truth.response in (name.response, *name.others)
    assert name.response == truth.response or not name.sure
