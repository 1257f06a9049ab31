"""Which lever to turn, by how much, for a wanted response on a fitted board; and which part to
change where no lever helps.

Everything is asked of boards as the records leave them (``BoardFit.samples``), not of the most
probable one alone: a setting is as good as the share of them that show the response there. The
boards have the bandwidth of their op-amps, which decides where a contact is near grazing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import qmc

from designer.base.arrays import Array
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics.orbit import Orbit
from designer.model.model import SiScales
from designer.model.si_units import mechanism_json
from designer.model.tuning_bands import Bands
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import Question, Verdict
from designer.workbench.board_fit import BoardFit
from designer.yields.adjustment import AS_BUILT, Adjustment, centring_offset, widths
from designer.yields.setting_search import BoardCase, seek
from designer.yields.window_path import find_window

if TYPE_CHECKING:
    from designer.answers.bench_answer import AdviceRow

SAMPLES = 40
"""Boards that a setting is asked of."""
SURE = 0.95
"""Share of them from which on a response counts as shown, and nothing is to be turned."""
HELPS = 0.5
"""Share of them from which on a setting is advised; below it parts are named too."""
DEEPEST = 6
"""Settings on the way into the window (``yields.window_path``) that are asked of every board."""
AROUND = 32
"""Settings around the best one that are asked of every board, in two rounds."""
WIDTHS = (0.15, 0.05)
"""Half-bands: how far around, in each round."""
PARTS, TRIED, FEW = 3, 6, 12
"""Parts that are named at most; those that are tried on more than the most probable board; on how
many boards."""


@dataclass(frozen=True)
class Replacement:
    """A part that would bring a response back, with one of its nominal value in its place."""

    part: str
    """Name of the part, or of the package of op-amps."""
    share: float
    """Share of the boards that then show the response."""


@dataclass(frozen=True)
class Advice:
    """What a board shows of one wanted response, and what to do about it."""

    question: Question
    """The wanted response."""
    shown: Mapping[str, float]
    """Share of the boards by what they show as set, n-p-q or status; the largest first."""
    as_set: float
    """Share of the boards that show the wanted response at the setting of ``setup.csv``."""
    setting: Adjustment = AS_BUILT
    """The best setting that was found; as set where nothing is to be turned, or nothing helps."""
    share: float = 0.0
    """Share of the boards that show it there."""
    parts: tuple[Replacement, ...] = field(default=())
    """Parts to change where no setting helps, the best first."""

    @property
    def excitation(self) -> Excitation:
        """The generator's setting that is advised."""
        return self.setting.of(self.question.excitation)

    @property
    def helps(self) -> bool:
        """Whether the advised setting shows the response on most boards."""
        return self.share >= HELPS

    @property
    def words(self) -> str:
        """What to do, in words."""
        if self.helps:
            changes = zip(_LEVERS, self.setting.vector.tolist(), strict=True)
            turned = [f"{name} {_signed(change)}" for name, change in changes if change]
            return ", ".join(turned) or "leave it as it is set"
        if self.parts:
            named = ", ".join(f"{part.part} ({part.share:.0%})" for part in self.parts)
            return f"no setting helps; exact, this part would: {named}"
        return "no setting and no single part helps"

    def as_dict(self, si: SiScales | None = None) -> AdviceRow:
        """The advice as a JSON answer has it."""
        to = self.excitation
        return {
            "omega": self.question.omega,
            **mechanism_json(self.question.omega, si),
            "expected": str(self.question.wanted.expect),
            "shown": dict(self.shown),
            "as_set": self.as_set,
            "share": self.share,
            "helps": self.helps,
            "turn": self.setting != AS_BUILT,
            "words": self.words,
            "frequency_hz": to.frequency,
            "amplitude_v_peak": to.amplitude,
            "offset_v": to.offset,
            "change": dict(zip(_LEVERS, self.setting.vector.tolist(), strict=True)),
            "parts": [{"part": part.part, "share": part.share} for part in self.parts],
        }


_LEVERS = ("frequency", "amplitude", "offset")


def _signed(change: float) -> str:
    """A change as a share; that of the offset is of the amplitude."""
    return f"{100.0 * change:+.2g} %"


def advise(fit: BoardFit, questions: Sequence[Question], bands: Bands) -> tuple[Advice, ...]:
    """What to do for each wanted response on the board of a fit, within the bands."""
    boards = fit.prior.ensemble(fit.samples(SAMPLES, 0))
    return tuple(_Advisor(fit, boards, question, bands).advice() for question in questions)


class _Advisor:
    """One response on the boards of one fit; board 0 is the most probable one."""

    def __init__(self, fit: BoardFit, boards: Ensemble, question: Question, bands: Bands) -> None:
        self.fit, self.boards = fit, boards
        self.question, self.bands = question, bands

    def advice(self) -> Advice:
        orbits, verdicts = self._as_set()
        counted = Counter(orbit.response for orbit in orbits)
        shown = {name: count / len(orbits) for name, count in counted.most_common()}
        as_set = verdicts.count(Verdict.OK) / SAMPLES
        if as_set >= SURE:
            return Advice(self.question, shown, as_set, AS_BUILT, as_set)
        setting, share = self._best(self._candidates())
        if share <= as_set:
            setting, share = AS_BUILT, as_set
        parts = () if share >= HELPS else self._replacements(setting)
        return Advice(self.question, shown, as_set, setting, share, parts)

    def _as_set(self) -> tuple[list[Orbit], list[Verdict]]:
        """What every board answers at the setting of ``setup.csv``, from the nominal orbit."""
        excitation, start = self.question.excitation, self.question.start.start
        cases: list[Case] = [(i, self.question, excitation, start) for i in range(SAMPLES)]
        rows = settled(self.boards, cases)
        return [row[0] for row in rows], [row[1] for row in rows]

    def _candidates(self) -> list[Adjustment]:
        """Settings at which the most probable board shows the response, or is nearest to it."""
        if not widths(self.bands).any():
            return [AS_BUILT]
        centre = self._centring()
        case = BoardCase(0, self.question, centre)
        seek(self.boards, [case], self.bands)
        out = [Adjustment.at(np.array([0.0, 0.0, centre]), self.bands)]
        out += [t.setting for t in case.tries if t.verdict is Verdict.OK]
        if case.best is not None:  # it is inside the window, which has a middle
            board = self.boards.boards.take([0])
            spots, _ = find_window(board, self.question, self.bands)
            deepest = sorted(spots, key=lambda spot: -spot.radius)[:DEEPEST]
            out += [spot.setting for spot in deepest]
        return list(dict.fromkeys(out))

    def _centring(self) -> float:
        """DC offset over the amplitude that centres the most probable board."""
        circuit = self.fit.prior.circuit
        nominal = Reduction(circuit, nominal_board(circuit)).system()
        try:
            volts = centring_offset(self.boards.reduction(0).system(), nominal)
        except FloatingCircuit:
            return 0.0
        return volts / self.question.excitation.amplitude

    def _best(self, candidates: Sequence[Adjustment]) -> tuple[Adjustment, float]:
        """The setting that the largest share shows, after a look around the best of them; of equal
        ones that with the deepest margin on its worst board but one in ten."""
        best = max((self._worth(c), tuple(c.vector)) for c in candidates)
        box = qmc.scale(qmc.Sobol(3, seed=0).random(AROUND), -np.ones(3), np.ones(3))
        for width, some in zip(WIDTHS, np.array_split(box, len(WIDTHS)), strict=True):
            middle = np.array(best[1])
            near = [self._inside(middle + width * step * widths(self.bands)) for step in some]
            best = max(best, *((self._worth(c), tuple(c.vector)) for c in near))
        return Adjustment(*best[1]), best[0][0]

    def _inside(self, vector: Array) -> Adjustment:
        return Adjustment.at(vector, self.bands)

    def _worth(self, setting: Adjustment, boards: Ensemble | None = None) -> tuple[float, float]:
        """Share of the boards that show the response, and the margin that nine of ten have.

        A board that has not settled after 140 drive periods does not count as showing it.
        """
        boards = boards or self.boards
        drives = [setting.of(self.question.excitation).drive] * len(boards)
        starts = np.tile(self.question.start.start, (len(boards), 1))
        orbits = boards.quick(range(len(boards)), drives, starts)
        margins = np.array([self._margin(orbit) for orbit in orbits])
        return float((margins > 0.0).mean()), float(np.quantile(margins, 0.1))

    def _margin(self, orbit: Orbit | None) -> float:
        """How far the impacts of a wanted orbit are from changing their number; 0 of another."""
        if orbit is None or self.question.judge(orbit)[0] is not Verdict.OK:
            return 0.0
        return min(orbit.penetration, orbit.miss)

    def _replacements(self, setting: Adjustment) -> tuple[Replacement, ...]:
        """Parts whose nominal value brings the response back, as set or at the best setting."""
        circuit = self.fit.prior.circuit
        groups = {name: [name] for name in circuit.values}
        groups |= {reference.name: [reference.name] for reference in circuit.references}
        for section in circuit.sections:
            groups.setdefault(section.package, []).append(section.name)
        tried = tuple(dict.fromkeys((AS_BUILT, setting)))
        first = {name: self._changed([0], same, tried) for name, same in groups.items()}
        best = sorted((name for name in first if first[name][0]), key=lambda n: -first[n][1])
        found = []
        for name in best[:TRIED]:
            share, _ = self._changed(range(FEW), groups[name], tried)
            found.append(Replacement(name, share))
        found.sort(key=lambda part: -part.share)
        return tuple(found[:PARTS])

    def _changed(
        self, which: Sequence[int], names: Sequence[str], tried: Sequence[Adjustment]
    ) -> tuple[float, float]:
        """``_worth`` of the better of some settings on these boards, with these parts at their
        nominal values."""
        changed = Ensemble(self.boards.boards.take(which).exact(names))
        return max(self._worth(one, changed) for one in tried)
