"""What ngspice says of a candidate, on op-amps with gain-bandwidth and slew rate.

A search decides on the exact circuit, whose op-amps are ideal up to their limits; then the exact
circuit with bandwidth is asked (``bandwidth_check``), and ngspice to confirm that. Real ones take
time at the dead zone: while its diodes change over, the loop is open and the output has to cross
two diode drops, so a contact comes late by about √(2·V/(GBW·β·dv/dt)), and a late spring force is
negative damping. In units of the model's time this falls with the root of the frequency at ω = 1,
so the remedy is a slower time scale. Boards are those of a prediction, with the spread stretched:
few of them tell what many tell as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from designer.base.defaults import Fidelity
from designer.centering.answer_cache import AnswerCache
from designer.centering.scaled_sigma import OperatingOrbit, ScaledBoards
from designer.spice import numerics_gate
from designer.spice.numerics_gate import GateSubject
from designer.spice.pool import SpicePool
from designer.verdicts.cross_check import survives
from designer.verdicts.ngspice_runs import Query, run_queries, way_to_fidelity

FIDELITY: Fidelity = "dynamic"
STRETCH, BOARDS_ASKED = 2.0, 16
"""Stretch of the spread, and boards of each response."""
FEWER, LEAST = 1, 8
"""Boards of a response that ngspice may lose, and answers that it takes to say so."""
LONGEST = 60
"""Drive periods: a board that is further from its orbit in ngspice is not asked."""
LEVELS = 3
"""Step sizes that the numerics gate tries; finer ones, near a border, are not waited for."""
REFINEMENTS = 1
"""Rounds of finer steps where ngspice disagrees."""


@dataclass(frozen=True)
class Agreement:
    """How many of ``BOARDS_ASKED`` boards show one response on the exact circuit and with op-amps
    that take time: in ngspice, or on the exact circuit with bandwidth."""

    exact: int
    """Boards that show it on the exact circuit."""
    survivors: int
    """How many of these boards show it with those op-amps as well."""
    unanswered: int = 0
    """Boards of these without an answer: too long a way to be asked, runs that failed,
    step sizes of which one shows it, a contact that cannot be counted, a numerics gate that does
    not pass."""

    def __str__(self) -> str:
        open_ = f" ({self.unanswered} without an answer)" if self.unanswered else ""
        return f"{self.survivors}/{self.exact}{open_}"

    @property
    def borne_out(self) -> bool | None:
        """None where there are too few answers to tell."""
        answers = self.exact - self.unanswered
        return answers - self.survivors <= FEWER if answers >= LEAST else None


AskAgreement = Callable[
    [ScaledBoards, Sequence[OperatingOrbit | None], Callable[[], None]], tuple[Agreement, ...]
]
"""Asks how many boards of a design show each response with op-amps that take time. It takes the
boards, the nominal board's orbit of each response, and what is called once a response."""


Count = Callable[[ScaledBoards, OperatingOrbit, Sequence[int]], list[tuple[int, ...]]]
"""The figures of an `Agreement` for the boards of one response."""


def agreements(
    memory: AnswerCache,
    bench: ScaledBoards,
    operating_orbits: Sequence[OperatingOrbit | None],
    question: Sequence[object],
    count: Count,
    progress: Callable[[], None] = lambda: None,
) -> tuple[Agreement, ...]:
    """What boards with op-amps that take time answer for each response, once for each question.

    operating_orbits : of the responses; None where the nominal board does not show one, which
    leaves nothing to ask. question : plain data that names it, beside the boards. progress : called
    once a response.
    """
    out = []
    for operating_orbit in operating_orbits:
        agreement = Agreement(0, 0)
        if operating_orbit is not None:
            query = [*question, bench.query(operating_orbit, range(BOARDS_ASKED), (STRETCH,))]
            made = partial(count, bench, operating_orbit)
            (counts,) = memory.get_all([query], made, (BOARDS_ASKED, BOARDS_ASKED, BOARDS_ASKED))
            agreement = Agreement(*counts)
        out.append(agreement)
        progress()
    return tuple(out)


class AgreementCheck:
    """Asks ngspice, and remembers. pool : where it runs. memory : of the search."""

    def __init__(self, pool: SpicePool, memory: AnswerCache) -> None:
        self._pool, self._memory = pool, memory

    def __call__(
        self,
        bench: ScaledBoards,
        operating_orbits: Sequence[OperatingOrbit | None],
        progress: Callable[[], None] = lambda: None,
    ) -> tuple[Agreement, ...]:
        """Agreement of each response with ngspice; see `agreements`."""
        question = (FIDELITY, REFINEMENTS, LONGEST)
        return agreements(self._memory, bench, operating_orbits, question, self._ask, progress)

    def _ask(
        self, bench: ScaledBoards, operating_orbit: OperatingOrbit, _: Sequence[int]
    ) -> list[tuple[int, ...]]:
        there = bench.subjects(operating_orbit, range(BOARDS_ASKED), STRETCH)
        near = [s for s in map(_started, there) if s.discard <= LONGEST]
        if len(near) < LEAST:
            return [(len(there), 0, len(there))]
        (nominal,) = numerics_gate.check(
            self._pool, [replace(bench.nominal(operating_orbit), fidelity=FIDELITY)], LEVELS
        )
        if not nominal.passed:
            return [(len(there), 0, len(there))]
        queries = [Query(s, nominal.settings, s.orbit.response, REFINEMENTS) for s in near]
        survivals = [
            survives(
                operating_orbit.spec.completed(operating_orbit.orbit),
                h.response,
                h.either,
                symmetric=h.symmetric,
            )
            for h in run_queries(self._pool, queries)
        ]
        answers = len(survivals) - survivals.count(None)
        return [(len(there), survivals.count(True), len(there) - answers)]


def _started(subject: GateSubject) -> GateSubject:
    return replace(subject, fidelity=FIDELITY, discard=way_to_fidelity(subject.orbit))
