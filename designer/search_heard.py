"""What ngspice says of a candidate, on op-amps with gain-bandwidth and slew rate.

A search decides on the exact circuit, whose op-amps are ideal up to their limits. Real ones take
time at the dead zone: while its diodes change over, the loop is open and the output has to cross
two diode drops, so a contact comes late by about √(2·V/(GBW·β·dv/dt)), and a late spring force is
negative damping. In units of the model's time this falls with the root of the frequency at ω = 1,
hence the cure is a slower time scale. Boards are those of a prediction, with the spread stretched:
few of them tell what many tell as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from designer import gate
from designer.confirmation import Query, confirm, way_to_rung
from designer.gate import Subject
from designer.opamp_model import Rung
from designer.search_distance import Stand, Stretched
from designer.search_memory import Memory
from designer.workers import SpicePool

RUNG: Rung = "dynamic"
STRETCH, BOARDS = 2.0, 16
"""Stretch of the spread, and boards of each response."""
FEWER = 1
"""Boards of a response that ngspice may lose."""
REFINEMENTS = 1
"""How often the step is halved where ngspice disagrees."""


@dataclass(frozen=True)
class Heard:
    """Of one response: boards that show it on the exact circuit, and those of them that show it in
    ngspice as well."""

    exact: int
    ngspice: int

    @property
    def borne_out(self) -> bool:
        return self.exact > 0 and self.ngspice >= self.exact - FEWER

    @property
    def share(self) -> float:
        return self.ngspice / self.exact if self.exact else 0.0


Listen = Callable[[Stretched, Sequence[Stand | None], Callable[[], None]], tuple[Heard, ...]]
"""Of the boards of a design and its responses' stands; the last is called once a response."""


class Listener:
    """Asks ngspice, and remembers. pool : where it runs. memory : of the search."""

    def __init__(self, pool: SpicePool, memory: Memory) -> None:
        self._pool, self._memory = pool, memory

    def __call__(
        self,
        bench: Stretched,
        stands: Sequence[Stand | None],
        progress: Callable[[], None] = lambda: None,
    ) -> tuple[Heard, ...]:
        """For each response. A design whose numerics gate does not pass has nothing to show."""
        out = []
        for stand in stands:
            heard = Heard(0, 0)
            if stand is not None:
                said = [RUNG, FEWER, REFINEMENTS, bench.said(stand, range(BOARDS), (STRETCH,))]
                (known,) = self._memory.get_all([said], partial(self._ask, bench, stand))
                heard = Heard(*known)
            out.append(heard)
            progress()
        return tuple(out)

    def _ask(self, bench: Stretched, stand: Stand, _: Sequence[int]) -> list[tuple[int, ...]]:
        (nominal,) = gate.check(self._pool, [replace(bench.nominal(stand), rung=RUNG)])
        there = bench.subjects(stand, range(BOARDS), STRETCH)
        if not nominal.passed:
            return [(len(there), 0)]
        queries = [
            Query(_started(subject), nominal.settings, str(stand.spec.expect), REFINEMENTS)
            for subject in there
        ]
        heard = confirm(self._pool, queries)
        return [(len(there), sum(h.response == str(stand.spec.expect) for h in heard))]


def _started(subject: Subject) -> Subject:
    return replace(subject, rung=RUNG, discard=way_to_rung(subject.orbit))
