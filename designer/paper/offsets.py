"""What the op-amps' input offsets do to each response: every section at ± one size.

All offsets of a board have the same size, the typical or the largest of the data sheet, and only
their signs differ. Each of these boards is asked from the nominal circuit's own orbit, as a board
of a tolerance study is; the other parts are exact.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import Ensemble
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit
from designer.model.find_responses import ModelResponse
from designer.model.response_table import Response
from designer.paper.circuits import Built
from designer.verdicts.verdict import Verdict, judge
from designer.yields.yield_count import Yield

PATTERNS = 512
"""Sign patterns, at most; twelve sections have 4096."""


def signs(sections: int, most: int = PATTERNS) -> Array:
    """(k, sections) of ±1: every pattern, or ``most`` of them drawn without replacement.

    The first is all plus. A pattern and its negative give mirror images of the same board, but
    for bias currents; both are kept, for they cost little and need no argument.
    """
    total = 2**sections
    numbers = np.arange(total)
    if total > most:
        drawn = np.random.default_rng(0).choice(total - 1, most - 1, replace=False) + 1
        numbers = np.concatenate([[0], np.sort(drawn)])
    bits = (numbers[:, None] >> np.arange(sections)) & 1
    return np.asarray(1.0 - 2.0 * bits)


def shifts(
    one: Built,
    wanted: Sequence[ModelResponse],
    size: float,
    *,
    jobs: int = 1,
    most: int = PATTERNS,
) -> list[dict[str, Any]]:
    """Each response on every board with offsets of ± size [V], a row each.

    there : whether the nominal circuit shows the response; where not, nothing is counted.
    counted, interval : verdicts over the sign patterns, and the yield's 95 % interval. to : what
    the boards that lose it show, and on how many patterns, most frequent first.
    """
    circuit = one.circuit
    patterns = signs(len(circuit.sections), most)
    nominal = Boards.of(circuit, [nominal_board(circuit)])
    many = nominal.take(np.zeros(len(patterns), dtype=np.intp))
    offset = {s.name: size * patterns[:, i] for i, s in enumerate(circuit.sections)}
    ensemble = Ensemble(replace(many, offset=offset), jobs=jobs)
    system = one.reduction().system()
    rows = []
    for r in wanted:
        drive = one.excitation(r.omega).drive
        own = settle(Flow(system, drive), r.orbit.start * one.volts)
        there = judge(own, r.spec, own)[0] is Verdict.OK
        orbits: Sequence[Orbit] = ()
        if there:
            starts = np.tile(own.start, (len(patterns), 1))
            drives = [drive] * len(patterns)
            orbits = ensemble.settle(range(len(patterns)), drives, starts, jobs=jobs)
        row = {"omega": r.omega, "expected": r.expected, "size": size, "there": there}
        rows.append(row | _counts(orbits, r.spec, own))
    return rows


def _counts(orbits: Sequence[Orbit], wanted: Response, own: Orbit) -> dict[str, Any]:
    """What became of the boards. own : the nominal circuit's orbit."""
    verdicts = [judge(orbit, wanted, own)[0] for orbit in orbits]
    tally = Counter(verdicts)
    lost = Counter(
        orbit.response for orbit, v in zip(orbits, verdicts, strict=True) if v is not Verdict.OK
    )
    counted = Yield(
        tally[Verdict.OK], tally[Verdict.LOST], tally[Verdict.GRAZING], tally[Verdict.FAILED]
    )
    return {
        "counted": asdict(counted),
        "to": sorted(lost.items(), key=lambda item: (-item[1], item[0])),
        "interval": counted.interval,
    }
