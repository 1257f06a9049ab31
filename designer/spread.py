"""How boards differ: the reference spread ``bench-1`` of docs/definitions.md.

Resistors and capacitors uniform over ± grade; op-amp offset normal, cut at its limit, each section
its own; saturation uniform ± 5 %, each rail of each section its own; references uniform over ±
their grade. Diodes are exact: their drop stands inside a loop. Every sample is drawn from (seed,
sample index) alone, so a study is the same on one worker or many.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import truncnorm

from designer.boards import Boards
from designer.catalog import OpAmp
from designer.circuit import Board, Circuit

NAME = "bench-1"
SATURATION_SPREAD = 0.05


@dataclass(frozen=True)
class Spread:
    """resistor, capacitor : grades as fractions. offset_sigma, offset_limit [V]. saturation :
    half-width as a fraction. reference : half-width over the grade of each reference."""

    resistor: float
    capacitor: float
    offset_sigma: float
    offset_limit: float
    saturation: float = SATURATION_SPREAD
    reference: float = 1.0

    @classmethod
    def bench_1(cls, opamp: OpAmp, resistor_grade: float, capacitor_grade: float) -> Spread:
        """The reference spread for these grades and this op-amp."""
        return cls(resistor_grade, capacitor_grade, opamp.offset_sigma, opamp.offset_limit)

    def as_dict(self) -> dict[str, float | str]:
        return {"name": NAME, **self.__dict__}


def draw(circuit: Circuit, spread: Spread, seed: int, index: int) -> Board:
    """Board number ``index`` of the study with this seed."""
    rng = np.random.default_rng([seed, index])
    values = {
        r.name: r.value * (1.0 + spread.resistor * rng.uniform(-1.0, 1.0))
        for r in circuit.resistors
    }
    values |= {
        c.name: c.value * (1.0 + spread.capacitor * rng.uniform(-1.0, 1.0))
        for c in circuit.capacitors
    }
    names = [s.name for s in circuit.sections]
    offsets = np.zeros(len(names))
    if spread.offset_sigma > 0.0:
        cut = spread.offset_limit / spread.offset_sigma
        offsets = spread.offset_sigma * truncnorm.ppf(rng.uniform(size=len(names)), -cut, cut)
    limits = circuit.saturation * (
        1.0 + spread.saturation * rng.uniform(-1.0, 1.0, size=(len(names), 2))
    )
    limits = np.minimum(limits, circuit.supply)  # no output passes its rail
    # Drawn last, so that circuits without references keep the boards they had.
    references = {
        r.name: r.volts * (1.0 + spread.reference * r.grade * rng.uniform(-1.0, 1.0))
        for r in circuit.references
    }
    return Board(
        values=values,
        offset=dict(zip(names, (float(v) for v in offsets), strict=True)),
        rails={n: (-float(low), float(high)) for n, (low, high) in zip(names, limits, strict=True)},
        inverse_gain=1.0 / circuit.gain,
        bias=dict.fromkeys(names, circuit.bias),
        reference=references,
        drop={d.name: d.model.drop for d in circuit.diodes},
    )


def draw_many(circuit: Circuit, spread: Spread, seed: int, indices: range) -> Boards:
    """The boards of these numbers of the study with this seed."""
    return Boards.of(circuit, [draw(circuit, spread, seed, index) for index in indices])
