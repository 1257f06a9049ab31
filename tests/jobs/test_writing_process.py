"""Responses that the second process finds before it writes."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer.base import jit, second_process
from designer.base.second_process import Awaited, other_process
from designer.check import synthesis_result
from designer.jobs.compile_ahead import compile_circuits
from designer.jobs.writing_process import ask_responses
from designer.model import find_responses
from designer.model.find_responses import ModelResponse, find
from designer.model.model_file import read_model_file
from designer.synthesis import parts_choice
from designer.verbs.synthesise import synthesise
from tests.shared.exploring import quick
from tests.shared.house import ROOT
from tests.shared.model_text import SMALL

REAL = second_process.OtherProcess
FILE = read_model_file(ROOT / "examples" / "aberdeen.toml")


@pytest.mark.parametrize("stored", [True, False])
def test_responses_are_those_that_are_found_here_where_nothing_has_to_be_compiled(
    stored: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jit, "CACHE", tmp_path)
    if stored:
        (tmp_path / f"circuits-{FILE.model.second_order().size}.whole").touch()
    with other_process(2) as other:
        there = ask_responses(other, pickle.loads(pickle.dumps(FILE)))()
    if not stored:
        assert there is None
        return
    here = find(FILE.model, FILE.responses)
    assert there is not None
    assert len(there) == len(here) > 0
    for one, two in zip(pickle.loads(pickle.dumps(there)), here, strict=True):
        assert (one.spec, one.b, one.found) == (two.spec, two.b, two.found)
        np.testing.assert_array_equal(one.orbit.start, two.orbit.start)
        assert [o.response for o in one.others] == [o.response for o in two.others]


class Chosen(Exception):
    """Parts would be chosen now, for these responses."""

    def __init__(self, responses: tuple[ModelResponse, ...]) -> None:
        self.responses = responses


def responses_for_parts(
    model: Path, out: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[tuple[ModelResponse, ...], int]:
    """Of ``synthesise`` into a folder, up to where it chooses parts; and how often they were sought
    in this process."""
    sought = 0

    def counted(*given: Any) -> tuple[ModelResponse, ...]:
        nonlocal sought
        sought += 1
        return find(*given)

    def chosen(*given: Any, **_: Any) -> None:
        raise Chosen(given[-1])

    for module in (find_responses, synthesis_result):
        monkeypatch.setattr(module, "find", counted)
    monkeypatch.setattr(parts_choice, "synthesise", chosen)
    with pytest.raises(Chosen) as found:
        synthesise(model, out, jobs=2)
    return found.value.responses, sought


class Dying(second_process.OtherProcess):
    """Is killed as soon as it has its first question."""

    def __call__(self, function: Callable[..., Any], *arguments: Any) -> Awaited[Any]:
        answer = super().__call__(function, *arguments)
        self._process.kill()
        return answer


@pytest.mark.parametrize("stage", quick(["stated", "chosen"]))
def test_parts_are_chosen_for_the_responses_of_the_second_process(
    stage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where it dies they are sought here, once, and are the same."""
    if not jit.stored_whole(jit.CIRCUITS.format(masses=2)):
        compile_circuits(2)
    model = tmp_path / "model.toml"
    text = SMALL if stage == "stated" else SMALL.replace('dead_zone = "rectifier"\n', "")
    assert ("dead_zone" in text) is (stage == "stated")
    model.write_text(text, encoding="utf-8")
    monkeypatch.setattr(second_process, "OtherProcess", REAL)
    there, sought = responses_for_parts(model, tmp_path / "there", monkeypatch)
    assert sought == 0
    monkeypatch.setattr(second_process, "OtherProcess", Dying)
    here, sought = responses_for_parts(model, tmp_path / "here", monkeypatch)
    assert sought == 1
    (one,), (two,) = there, here
    assert (one.spec, one.b, one.found) == (two.spec, two.b, two.found)
    np.testing.assert_array_equal(one.orbit.start, two.orbit.start)
