"""Where the model shows a response: against continuation, and what is refused."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest

from designer.base.errors import InputError
from designer.bifurcations import windows
from designer.centering.response_windows import STEP, check, clearances, stretches
from designer.dynamics.counts import Counts
from designer.model import find_responses, swept_model
from designer.model.response_table import Response
from designer.model.search_table import SearchSpec
from tests.shared.search_cases import file

MODEL = file('omega = 0.85\nexpect = "1-2-2"').model
WANTED = Response(None, Counts(1, ((2, 2),)))
BAND = SearchSpec(omega=(0.7, 1.0))


@pytest.mark.slow
def test_a_stretch_ends_where_continuation_says() -> None:
    """A symmetric 1-2-2: the pitchfork below, and the fold or grazing above."""
    spec = replace(WANTED, symmetric=True)
    ((widest, *_),) = stretches(MODEL, [spec], BAND)
    middle = widest.at((0.5,))[0]
    found = find_responses.find(MODEL, [Response(middle.omega, spec.expect)])[0]
    exact = windows.window(
        swept_model.of_model(MODEL, 1.0, "omega"), found.orbit, middle.omega, 0.7, 1.0
    )
    # A sweep sees a step less; a follower may lose it a little before the end.
    assert exact.low.value <= widest.low <= exact.low.value * (1.0 + 2.0 * STEP)
    assert exact.high.value * (1.0 - 2.0 * STEP) <= widest.high <= exact.high.value


@pytest.mark.slow
def test_every_place_shows_the_response() -> None:
    (found,) = stretches(MODEL, [replace(WANTED, b=(0.25, 0.27))], BAND)
    assert {s.b for s in found} == set(clearances(MODEL, replace(WANTED, b=(0.25, 0.27))))
    for place in found[0].at((0.0, 0.5, 1.0)):
        shown = find_responses.find(
            MODEL.at(place.b), [Response(place.omega, WANTED.expect, b=place.b)]
        )[0]
        assert shown.found


def test_a_fixed_place_is_one_place() -> None:
    (found,) = stretches(MODEL, [Response(0.85, Counts(1, ((2, 2),)))], BAND)
    (one,) = found
    assert (one.low, one.high, one.b) == (0.85, 0.85, 0.25)


def test_clearances_are_close_together() -> None:
    found = clearances(MODEL, replace(WANTED, b=(0.2, 0.4)))
    assert found[0] == 0.2
    assert found[-1] == pytest.approx(0.4)
    assert all(1.0 < b / a <= 1.06 for a, b in itertools.pairwise(found))


@pytest.mark.parametrize(
    ("spec", "field", "word"),
    [
        (Response(None), "response[1].expect", "window"),
        (Response(0.85, None, b=(0.2, 0.3)), "response[1].expect", "range"),
        (Response(None, Counts(1, ((2, 2),)), b=(0.3, 0.3)), "response[1].b", "low < high"),
    ],
)
def test_what_cannot_be_sought_is_refused(spec: Response, field: str, word: str) -> None:
    with pytest.raises(InputError) as refused:
        check([spec])
    assert refused.value.field == field
    assert word in refused.value.expected


def test_a_response_without_a_window_is_refused() -> None:
    with pytest.raises(InputError) as refused:
        stretches(MODEL, [WANTED], SearchSpec(omega=(1.6, 1.8)))
    assert refused.value.field == "response[1].omega"
    assert "1-2-2" in refused.value.expected
    assert "search.omega" in refused.value.expected
