"""What the exact circuit with bandwidth says of a candidate, before ngspice is asked.

The question is that of ``ngspice_check``: which boards that show a response on the exact circuit
keep it with op-amps that take time, started on their own orbit. The exact flow answers it in
milliseconds a board (``circuit.nodal_bandwidth``), where ngspice takes seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from designer.centering.answer_cache import AnswerCache
from designer.centering.ngspice_check import BOARDS_ASKED, STRETCH, Agreement, agreements
from designer.centering.scaled_sigma import OperatingOrbit, ScaledBoards
from designer.verdicts.verdict import Verdict, judge

BANDWIDTH = "bandwidth"
"""Name of the fidelity that is asked."""


class LaggingBoards:
    """Asks the exact circuit with bandwidth, and remembers. memory : of the search."""

    def __init__(self, memory: AnswerCache) -> None:
        self._memory = memory

    def __call__(
        self,
        bench: ScaledBoards,
        operating_orbits: Sequence[OperatingOrbit | None],
        progress: Callable[[], None] = lambda: None,
    ) -> tuple[Agreement, ...]:
        """Agreement of each response with the exact circuit; see `ngspice_check.agreements`."""
        return agreements(self._memory, bench, operating_orbits, (BANDWIDTH,), _counted, progress)


def _counted(
    bench: ScaledBoards, operating_orbit: OperatingOrbit, _: Sequence[int]
) -> list[tuple[int, ...]]:
    orbits = bench.lagging(operating_orbit, range(BOARDS_ASKED), STRETCH)
    verdicts = [judge(orbit, operating_orbit.spec, operating_orbit.orbit)[0] for orbit in orbits]
    unanswered = sum(v in (Verdict.GRAZING, Verdict.FAILED) for v in verdicts)
    return [(len(orbits), verdicts.count(Verdict.OK), unanswered)]
