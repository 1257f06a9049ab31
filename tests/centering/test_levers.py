"""Levers: what they change, and the search against every combination of a small set."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest

from designer.base.errors import InputError, Unreachable
from designer.centering import levers
from designer.centering.bandwidth_check import BANDWIDTH
from designer.centering.candidate import ALIKE, GAIN, Candidate, FidelityOutcome, better
from designer.centering.design_search import BOARDS, look, search
from designer.centering.levers import LEVERS, DesignChoice, slower, topologies, variants
from designer.centering.ngspice_check import FIDELITY, Agreement
from designer.centering.operating_points import Scored, score
from designer.centering.response_windows import OperatingPoint, Stretch
from designer.centering.scaled_sigma import OperatingOrbit, ScaledBoards
from designer.model import find_responses
from designer.model.model_file import ModelFile, parse_model_file
from designer.model.response_table import Response
from designer.spread.part_rules import spread_of
from designer.synthesis import parts_choice
from tests.shared.chains import chain_text
from tests.shared.exploring import quick
from tests.shared.search_cases import asked, catalog, file
from tests.shared.system_text import clearance

pytestmark = pytest.mark.usefixtures("designs_are_made_once")

PLACE = 'omega = 0.8\nexpect = "1-2-2"'
LOW_BAND = asked(PLACE).replace("[circuit]", "[circuit]\nfrequency = [5, 1000]")
"""With a band that leaves room for slower time scales, whichever design is found."""
BOTH = file(PLACE, zone="saturation", zones='"saturation", "rectifier"')


def test_the_file_s_own_choice_is_first() -> None:
    found = topologies(BOTH, catalog())
    assert found[0] == DesignChoice.of(BOTH)
    assert [c.dead_zone for c in found] == ["saturation", "rectifier"]
    wider = replace(BOTH, search=replace(BOTH.search, opamps=("TL074H", "TL074C")))
    found = topologies(wider, catalog())
    assert len(found) == 4
    assert found[0] == DesignChoice.of(BOTH)


def test_a_dead_zone_that_cannot_make_the_clearances_is_no_choice() -> None:
    unequal = clearance("A", "m1", "ground", upper=0.5, lower=0.6, stiffness=5.0)
    asked = parse_model_file(chain_text(1, unequal, '[circuit]\ndead_zone = "rectifier"\n'))
    assert [c.dead_zone for c in topologies(asked, catalog())] == ["rectifier"]


def test_a_stage_that_is_not_stated_is_one_that_the_search_can_begin_with() -> None:
    for lower, kind in ((0.6, "rectifier"), (0.5, "saturation")):
        stops = clearance("A", "m1", "ground", upper=0.5, lower=lower, stiffness=5.0)
        asked = parse_model_file(chain_text(1, stops))
        assert asked.circuit.dead_zone is None
        assert DesignChoice.of(asked).dead_zone == kind
        assert topologies(asked, catalog())[0].dead_zone == kind


def test_an_unknown_op_amp_is_refused() -> None:
    wider = replace(BOTH, search=replace(BOTH.search, opamps=("LM741X",)))
    with pytest.raises(InputError) as refused:
        topologies(wider, catalog())
    assert refused.value.field == "search.opamps"


@pytest.mark.parametrize("lever", LEVERS[2:])
def test_a_variant_moves_one_lever(lever: str) -> None:
    own = DesignChoice.of(BOTH)
    found = list(variants(own, lever))
    assert found
    for other in found:
        assert other.get(lever) != own.get(lever)
        assert other.with_lever(lever, own.get(lever)) == own


@pytest.mark.slow
def test_the_match_error_binds() -> None:
    strict = replace(BOTH, search=replace(BOTH.search, match_error=0.0, dead_zones=("rectifier",)))
    strict = replace(
        strict, circuit=replace(strict.circuit, resistors=("E12",), capacitors=("E3",))
    )
    with pytest.raises(Unreachable) as refused:
        search(strict, catalog())
    assert refused.value.field == "search.match_error"
    assert "least error" in refused.value.expected


def test_what_is_better() -> None:
    assert better((2.0 + 2.0 * ALIKE, -1.0), (2.0, -0.1))
    assert not better((2.0, -0.1), (2.0 + 2.0 * ALIKE, -1.0))
    assert better((2.0, -0.1), (2.0 + 0.5 * ALIKE, -0.1 - 2.0 * GAIN))
    assert not better((2.0 + 0.5 * ALIKE, -0.1), (2.0, -0.1))
    assert better((1.0, -0.5), (float("-inf"), float("-inf")))
    nothing = float("-inf")
    assert better((nothing, -900.0), (nothing, -1800.0))
    assert not better((nothing, -1800.0), (nothing, -900.0))


def test_what_is_refused_is_refused_before_any_work() -> None:
    open_ = file('omega = "best"')
    with pytest.raises(InputError) as refused:
        look(open_, catalog(), 1)
    assert refused.value.field == "response[1].expect"


@pytest.mark.slow
def test_the_search_finds_the_best_of_every_combination(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two dead zones and two amplitudes at one place: the search is as good as all four."""
    monkeypatch.setattr(levers, "SWINGS", (0.85, 0.5))
    monkeypatch.setattr(levers, "SHARES", (1.6,))
    monkeypatch.setattr(levers, "NOISE_GAINS", (30.0,))
    monkeypatch.setattr(
        "designer.centering.design_search.LEVERS", ("opamp", "dead zone", "amplitude")
    )
    hard = file(
        'omega = 0.215\nexpect = "1-8-8"', zone="saturation", zones='"saturation", "rectifier"'
    )
    found = search(hard, catalog())
    every = [
        _enumerated(hard, choice.with_lever("amplitude", swing))
        for choice in topologies(hard, catalog())
        for swing in (0.85, 0.5)
    ]
    assert not any(better(c.rank, found.final.rank) for c in every)
    assert found.candidates > 3
    (worth,) = [c for c in found.contributions if c.lever == "dead zone"]
    assert found.final.choice.dead_zone == "rectifier"
    assert worth.alone is not None
    assert found.start is not None
    assert worth.alone > found.start.rank


@pytest.mark.slow
def test_places_that_stay_where_they_were_are_worth_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The best place is found to be the middle of the window, where the search began."""

    def middle(
        bench: ScaledBoards, spec: Response, seen: Sequence[Stretch], *_: object, **__: object
    ) -> tuple[list[Scored], int]:
        return score(bench, spec, [seen[0].at((0.5,))[0]], 16), 1

    monkeypatch.setattr("designer.centering.design_search.best_points", middle)
    monkeypatch.setattr("designer.centering.design_search.LEVERS", ("opamp", "dead zone"))
    found = search(file('omega = "best"\nexpect = "1-2-2"'), catalog())
    assert found.start is not None
    assert found.final.wanted == found.start.wanted
    assert found.contributions == ()


@pytest.mark.slow
def test_a_dead_zone_gets_its_chance_at_the_places_that_were_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The one that lost in the middle of the window is tried again at the place."""
    monkeypatch.setattr("designer.centering.design_search.LEVERS", ("opamp", "dead zone"))
    wanted = file(
        'omega = "best"\nexpect = "1-2-2"', zone="saturation", zones='"saturation", "rectifier"'
    )
    found = search(wanted, catalog())
    tried = [s.setting for s in found.steps if s.lever == "opamp and dead zone"]
    assert tried == ["TL074C, saturation", "TL074C, rectifier", "TL074C, saturation"]
    every = [
        _enumerated(replace(wanted, responses=found.final.wanted), c)
        for c in topologies(wanted, catalog())
    ]
    assert not any(better(c.rank, found.final.rank) for c in every)


Agreements = tuple[Agreement, ...]


def _enumerated(modelfile: ModelFile, choice: DesignChoice) -> Candidate:
    model, spec = modelfile.model, choice.spec(modelfile.circuit)
    found = find_responses.find(model, modelfile.responses)
    held = find_responses.peaks(model, found)
    design = parts_choice.synthesise(model, spec, catalog(), held, found, aims=choice.aims)
    spread = spread_of(modelfile, design.circuit, catalog())
    bench = ScaledBoards(design, spread, 1, BOARDS)
    places = [OperatingPoint(r.omega, r.b, r.orbit.start) for r in found]
    scored = tuple(score(bench, r.spec, [p], BOARDS)[0] for r, p in zip(found, places, strict=True))
    return Candidate(choice, design, found, scored)


@pytest.mark.slow
def test_a_design_that_ngspice_does_not_bear_out_is_made_slower(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """ngspice is played by a rule: below a frequency it keeps every board, above it half."""
    monkeypatch.setattr("designer.centering.design_search.LEVERS", ("opamp", "dead zone"))
    wanted = parse_model_file(LOW_BAND)

    def checks_of(limit: float) -> list[FidelityOutcome]:
        def ask_agreement(
            bench: ScaledBoards,
            operating_orbits: Sequence[OperatingOrbit | None],
            progress: Callable[[], None],
        ) -> tuple[Agreement, ...]:
            fast = bench.design.errors.scales.frequency(1.0) > limit
            assert all(s is not None for s in operating_orbits)
            return (Agreement(16, 8 if fast else 15),) * len(operating_orbits)

        found = search(wanted, catalog(), ask_agreement=ask_agreement)
        lagging = [h for h in found.checks if h.fidelity == BANDWIDTH]
        checks = [h for h in found.checks if h.fidelity == FIDELITY]
        assert all(h.holds for h in lagging)
        assert [h.frequency for h in lagging] == [h.frequency for h in checks]
        (kept,) = [h for h in checks if h.adopted]
        assert found.synthesis.design.errors.scales.frequency(1.0) == pytest.approx(kept.frequency)
        return checks

    free = checks_of(1e9)
    assert len(free) == 1
    (own,) = (h.frequency for h in free)
    slower = checks_of(0.4 * own)
    assert [h.adopted for h in slower] == [False] * (len(slower) - 1) + [True]
    assert slower[-1].frequency <= 0.4 * own < slower[-2].frequency
    # Where no time scale is slow enough, the first of the best stands.
    never = checks_of(0.0)
    assert [h.adopted for h in never] == [True] + [False] * (len(never) - 1)
    assert len(never) > len(slower) - 1


@pytest.mark.slow
def test_a_slower_design_that_shows_fewer_boards_is_not_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """ngspice bears the slower one out, but few of its boards show the response at all."""
    monkeypatch.setattr("designer.centering.design_search.LEVERS", ("opamp", "dead zone"))

    def ask_agreement(
        bench: ScaledBoards,
        operating_orbits: Sequence[OperatingOrbit | None],
        progress: Callable[[], None],
    ) -> tuple[Agreement, ...]:
        first = bench.design.errors.scales.frequency(1.0) == pytest.approx(fastest[0])
        return (Agreement(16, 13) if first else Agreement(10, 10),) * len(operating_orbits)

    wanted = file(PLACE)
    fastest = [search(wanted, catalog()).synthesis.design.errors.scales.frequency(1.0)]
    found = search(wanted, catalog(), ask_agreement=ask_agreement)
    assert [h.adopted for h in found.checks if h.fidelity == FIDELITY] == [True, False]


@pytest.mark.parametrize("bears_out", quick([True, False]))
def test_ngspice_is_asked_about_what_the_bandwidth_bears_out(
    monkeypatch: pytest.MonkeyPatch, bears_out: bool
) -> None:
    """The bandwidth bears out the third time scale or none, ngspice all: it is asked once."""
    monkeypatch.setattr("designer.centering.design_search.LEVERS", ("opamp", "dead zone"))
    heard: list[float] = []

    def ask_agreement(
        bench: ScaledBoards, operating_orbits: Sequence[OperatingOrbit | None], _: object
    ) -> Agreements:
        heard.append(bench.design.errors.scales.frequency(1.0))
        return (Agreement(16, 16),) * len(operating_orbits)

    played = itertools.chain([8, 8], itertools.repeat(15 if bears_out else 8))

    def lagging(_: object) -> Callable[..., Agreements]:
        return lambda bench, operating_orbits, progress: (
            (Agreement(16, next(played)),) * len(operating_orbits)
        )

    monkeypatch.setattr("designer.centering.design_search.LaggingBoards", lagging)
    found = search(parse_model_file(LOW_BAND), catalog(), ask_agreement=ask_agreement)
    answers = [h.adopted for h in found.checks if h.fidelity == BANDWIDTH]
    if bears_out:
        assert answers == [False, False, True]
    else:  # the first of the best
        assert answers == [True] + [False] * (len(answers) - 1)
        assert len(answers) > 2
    assert heard == [h.frequency for h in found.checks if h.fidelity == FIDELITY and h.adopted]


def test_slower_bands_stay_inside_the_file_s_band() -> None:
    own = DesignChoice.of(BOTH)
    low, high = own.frequency
    found = list(slower(own, high, low))
    for before, after in itertools.pairwise((high, *(c.frequency[1] for c in found))):
        assert after == before / 2.0
    assert all(low < c.frequency[0] < c.frequency[1] for c in found)
    assert list(slower(own, low, low)) == []
    # A lever that has gone to the upper third leaves the way down open.
    third = replace(own, frequency=(0.7 * high, high))
    assert list(slower(third, high, low)) == found
