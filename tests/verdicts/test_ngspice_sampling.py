"""Who is asked in ngspice, and how its word is taken."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from designer.circuit.netlist import Excitation
from designer.dynamics.counts import Counts
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.response_table import Response
from designer.spice.deck import SolverSettings
from designer.verdicts.cross_check import (
    BOUNDARY_SAMPLES,
    NOMINAL_SAMPLES,
    OWN_SAMPLES,
    STEPS_EACH,
    SUBSET,
    Ask,
    CrossCheck,
    StartKind,
    Why,
    affordable,
    ask_all,
    ask_boundary,
    ask_differing,
    ask_random,
    longest_way,
    margin_share,
    not_asked,
)
from designer.verdicts.verdict import Answer, Question, Verdict

BLANK = Answer(0, 0, Verdict.OK, "1-2-2", "", 0.5, 1.0, 1.0, 0.0, 40)
HEARD = CrossCheck(0, 0, StartKind.OWN, Why.RANDOM, "1-2-2", "", "", 2, False)
NOMINAL = Orbit(
    OrbitStatus.PERIODIC,
    n=1,
    p=2,
    q=2,
    multipliers=np.array([0.5 + 0j]),
    graze=np.array([[2.0, 4.0]]),
)


def question(expect: str | None = "1-2-2", nominal: Orbit = NOMINAL, **more: object) -> Question:
    wanted = None if expect is None else Counts.parse(expect)
    spec = Response(1.0, wanted, **more)  # type: ignore[arg-type]
    return Question(spec, Excitation(300.0, 2.0), nominal, None)


def test_the_random_subset_and_every_slow_one() -> None:
    """Fifty at least from the nominal orbit; of two hundred, those above 0.9 too."""
    radii = {i: 0.95 if i % 3 == 0 else math.nan if i % 3 == 1 else 0.9 for i in range(300)}
    answers = [replace(BLANK, sample=i, radius=r) for i, r in radii.items()]
    asks = ask_random(answers)
    own = [a for a in asks if a.kind is StartKind.OWN]
    assert [a.sample for a in own] == list(range(OWN_SAMPLES))
    nominal = {a.sample: a.why for a in asks if a.kind is StartKind.NOMINAL}
    assert NOMINAL_SAMPLES >= 50
    assert nominal == {
        i: Why.RANDOM if i < NOMINAL_SAMPLES else Why.SLOW
        for i in range(SUBSET)
        if i < NOMINAL_SAMPLES or i % 3 == 0
    }
    assert ask_random(answers[:60]) == [a for a in asks if a.sample < 60]
    assert ask_random([replace(BLANK, verdict=Verdict.FAILED)]) == []


def test_where_ways_are_long_the_first_boards_are_asked() -> None:
    """At 1000 steps a period 1 - ρ = 5/512 takes 512 000 steps: of 10 million 19 fit. Boards whose
    way is too long are named at no cost; after the last that fits no quick one is asked, and no
    other that is too long: these would be more of those asked than of the boards."""
    settings = SolverSettings("trap", 1.0 / (300.0 * 1000.0))
    slow = replace(question(), settings=settings)
    assert STEPS_EACH * NOMINAL_SAMPLES == 10_000_000
    assert longest_way(slow) == pytest.approx(1000.0, abs=1.0)
    radii = [1.0 - 5.0 / 4096.0] * 3 + [1.0 - 5.0 / 512.0] * 30 + [0.1] * 10
    radii.append(radii[0])
    answers = [replace(BLANK, sample=i, radius=r) for i, r in enumerate(radii)]
    asks = ask_random(answers)
    kept = affordable(asks, answers, [slow])
    nominal = [a.sample for a in kept if a.kind is StartKind.NOMINAL]
    assert nominal == list(range(3 + 19))
    assert not_asked(asks, kept, [slow, slow]) == (11 + 10 + 1, 0)
    assert [a for a in kept if a.kind is StartKind.OWN] == [
        a for a in asks if a.kind is StartKind.OWN
    ]
    assert affordable(asks, answers, [question()]) == asks  # it is not asked at all
    more = affordable(asks, answers, [slow], 2 * NOMINAL_SAMPLES)
    assert len(more) > len(kept)


def test_all_are_asked_where_all_are_wanted() -> None:
    asks = ask_all(replace(BLANK, sample=i) for i in range(300))
    assert [a.sample for a in asks if a.kind is StartKind.NOMINAL] == list(range(300))
    assert sum(a.kind is StartKind.OWN for a in asks) == OWN_SAMPLES


@pytest.mark.parametrize(
    ("radius", "penetration", "miss", "expected"),
    [
        (0.5, 2.0, 4.0, 1.0),
        (0.9, 2.0, 4.0, 0.2),
        (0.5, 0.2, 4.0, 0.1),
        (0.5, 2.0, 0.4, 0.1),
        (0.5, math.inf, math.inf, 1.0),
        (0.1, 20.0, 40.0, 1.8),
        (1.0, 2.0, 4.0, 0.0),
        (math.nan, math.inf, math.inf, math.inf),
    ],
)
def test_the_distance_is_the_least_margin_over_the_nominal_one(
    radius: float, penetration: float, miss: float, expected: float
) -> None:
    answer = replace(BLANK, radius=radius, penetration=penetration, miss=miss)
    assert margin_share(answer, NOMINAL) == pytest.approx(expected)


def test_the_nearest_to_a_boundary_are_asked_once() -> None:
    rng = np.random.default_rng(3)
    gaps = rng.permutation(400) / 400.0
    answers = [
        replace(BLANK, sample=i // 2, question=i % 2, penetration=float(gaps[i]))
        for i in range(400)
    ]
    known = [Ask(i, 0, StartKind.OWN, Why.RANDOM) for i in range(200)]
    asks = ask_boundary(answers, [question(), question()], known)
    for number in (0, 1):
        mine = np.argsort(gaps[number::2])[:BOUNDARY_SAMPLES].tolist()
        for kind in StartKind:
            met = {a.sample for a in asks if a.question == number and a.kind is kind}
            assert met == (set() if (number, kind) == (0, StartKind.OWN) else set(mine))
    assert {a.why for a in asks} == {Why.BOUNDARY}


def test_boards_that_differ_are_asked_from_their_own_orbit() -> None:
    """Boards 0 and 1 agree, 2 has no answer, 3 to 5 differ and 3 is asked anyway; 6 differs from
    its own orbit alone."""
    answers = [replace(BLANK, sample=i) for i in range(7)]
    said = ["1-2-2", "1-2-2", "undecided", "1-1-1", "1-1-1", "aperiodic"]
    heard = [
        replace(HEARD, sample=i, kind=StartKind.NOMINAL, response=response)
        for i, response in enumerate(said)
    ]
    heard.append(replace(HEARD, sample=6, response="1-1-1"))
    asks = ask_differing(answers, heard, [Ask(3, 0, StartKind.OWN, Why.RANDOM)])
    assert asks == [Ask(i, 0, StartKind.OWN, Why.DIFFERS) for i in (4, 5)]


def test_agreement_and_survival() -> None:
    assert HEARD.agrees(BLANK) is True
    assert HEARD.survives(question()) is True
    for said in ("failed", "undecided", "not settled", ""):
        assert replace(HEARD, response=said).agrees(BLANK) is None
        assert replace(HEARD, response=said).survives(question()) is None
    for said in ("1-1-1", "aperiodic"):
        assert replace(HEARD, response=said).agrees(BLANK) is False
        assert replace(HEARD, response=said).survives(question()) is False
    near = replace(HEARD, response="grazing")
    assert near.agrees(BLANK) is None
    assert near.agrees(replace(BLANK, response="grazing")) is True
    for exact in ("clipped", "aperiodic"):
        assert near.agrees(replace(BLANK, response=exact)) is False
    assert near.survives(question()) is None
    for either, shown in (
        ("1-1-1 or aperiodic", False),
        ("1-1-1 or 1-2-2", None),
        ("1-1-1 or grazing", None),
        ("", None),
    ):
        open_ = replace(HEARD, response="undecided", either=either)
        assert open_.survives(question()) is shown
        assert open_.agrees(BLANK) is shown  # which is what is wanted
    for said, outcome in (
        ("1-2-2", "agreed"),
        ("1-1-1", "differed"),
        ("undecided", "undecided"),
        ("grazing", "undecided"),
        ("failed", "failed"),
        ("not settled", "failed"),
    ):
        assert replace(HEARD, response=said).outcome(BLANK) == outcome
    third = replace(HEARD, response="undecided", either="1-1-1 or 1-2-2")
    assert third.agrees(replace(BLANK, response="1-3-3")) is False
    # Nor does it look for periods above 16: there the two say the same in other words.
    chaos = replace(HEARD, response="aperiodic")
    assert chaos.agrees(replace(BLANK, response="22-44-46")) is True
    assert chaos.agrees(replace(BLANK, response="16-44-46")) is False
    assert third.survives(question()) is None
    twin = replace(HEARD, response="1-2-1")
    assert twin.survives(question("1-1-2")) is True
    assert twin.survives(question("1-1-2", twin="exact")) is False
    assert twin.survives(question(None, replace(NOMINAL, p=1))) is True
    assert twin.survives(question(None)) is False
    wanted = question(symmetric=True)
    assert HEARD.survives(wanted) is False
    assert replace(HEARD, symmetric=True).survives(wanted) is True
