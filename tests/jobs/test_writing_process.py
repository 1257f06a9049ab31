"""Responses that the second process finds before it writes."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from designer.base import jit
from designer.base.second_process import other_process
from designer.jobs.writing_process import ask_responses
from designer.model.find_responses import find
from designer.model.model_file import read_model_file
from tests.shared.house import ROOT

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
