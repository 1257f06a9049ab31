"""One board and all of its records: what was fitted, what it tells, and what to turn.

A record can tell figures of a board, with intervals: gaps, constant force, resonances. What a
record leaves open is not reported: a figure is told where the records have narrowed it to less than
``DETERMINED`` of what the spread alone says.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import DesignerError
from designer.base.plain_json import plain
from designer.circuit.board_arrays import Boards
from designer.circuit.board_modes import BoardModes
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit
from designer.dynamics.piecewise_linear import ModeKey
from designer.model.model import SiScales
from designer.workbench.advice import Advice, advise
from designer.workbench.board_fit import BoardFit, fit_board
from designer.workbench.board_prior import PROBE
from designer.workbench.free_decay import FreeDecay, resonances
from designer.workbench.naming import NamedMotion
from designer.workbench.observation import Observation, observe
from designer.workbench.prediction import BoardPrediction, PredictedResponse

if TYPE_CHECKING:
    from designer.answers.bench_answer import BoardRecord

DETERMINED = 0.5
"""The widest interval of a figure that the records determine, over the interval of the spread."""
DRAWS = 256
"""Boards of the spread that say how far a figure varies; the first is the middle one."""
NORMAL = 1.959964
"""Standard deviations on either side that hold 95 % of a normal distribution."""
SIDES = {1: "upper", -1: "lower"}


@dataclass(frozen=True)
class BoardFigure:
    """One figure of a board, as records leave it."""

    name: str
    """What it is, such as "upper gap"."""
    unit: str
    """Its unit; "" where it has none."""
    value: float
    """The figure of the most probable board."""
    low: float
    """Lower end of the 95 % interval."""
    high: float
    """Upper end of the 95 % interval."""
    nominal: float
    sigma: float
    """Standard deviation over the boards of the spread."""

    @property
    def determined(self) -> bool:
        """Whether the records say more of it than the spread does."""
        return self.high - self.low < DETERMINED * 2.0 * NORMAL * self.sigma


def determined_figures(fit: BoardFit) -> tuple[BoardFigure, ...]:
    """The figures that the records determine."""
    return tuple(figure for figure in figures(fit) if figure.determined)


def figures(fit: BoardFit) -> tuple[BoardFigure, ...]:
    """Every figure of the board, determined or not: its value on the most probable board, and the
    interval by the figure's slopes there."""
    prior, circuit = fit.prior, fit.prior.circuit
    near = board_figures(circuit, prior.boards(np.vstack([fit.centre, fit.centre + _steps(fit)])))
    drawn = board_figures(circuit, prior.boards(prior.draws(DRAWS)))
    out = []
    for name, (unit, values) in near.items():
        slope = (values[1:] - values[0]) / PROBE
        away = NORMAL * float(np.sqrt(slope @ fit.covariance @ slope))
        value, spread = float(values[0]), drawn[name][1]
        nominal, sigma = float(spread[0]), float(np.nanstd(spread))
        out.append(BoardFigure(name, unit, value, value - away, value + away, nominal, sigma))
    return tuple(out)


def _steps(fit: BoardFit) -> Array:
    return PROBE * np.eye(fit.prior.size)


def board_figures(circuit: Circuit, boards: Boards) -> Mapping[str, tuple[str, Array]]:
    """The unit and the values (N,) of each figure of N boards, by its name.

    A gap is the way of the displacement from rest to where contact begins, over half of the nominal
    board's clearance, both measured by what a volt of the generator moves in contact: so no scope's
    gain and no offset of its screen enters, and it is what a response sees. The constant force is
    the generator's DC voltage that acts like everything that does not oscillate: offsets, bias
    currents, unequal limits. Resonance frequencies [Hz] and damping ratios are those of free motion
    with every clearance open, and in each contact. The op-amps' lag is left out.
    """
    boards = replace(boards, bandwidth=False)
    nominal = _Gaps(BoardModes(Boards.of(circuit, [nominal_board(circuit)])), circuit)
    modes = BoardModes(boards)
    gaps = _Gaps(modes, circuit)
    out: dict[str, tuple[str, Array]] = {}
    for c, stop in enumerate(circuit.stops):
        of = f" of {stop.clearance}" if len(circuit.stops) > 1 else ""
        half = np.mean([abs(ways[0]) for ways in nominal.ways(c).values()])
        for side, way in gaps.ways(c).items():
            out[f"{SIDES[side]} gap{of}"] = ("", way / half)
        out[f"constant force{of}"] = ("V", gaps.constant_force(c))
    for words, key in _motions(circuit).items():
        frequency, damping = resonances(modes.modes.A[:, modes.targets.numbers[key]])
        for j in range(frequency.shape[1]):
            out[f"resonance {j + 1}, {words}"] = ("Hz", frequency[:, j] / (2.0 * np.pi))
            out[f"damping ratio {j + 1}, {words}"] = ("", damping[:, j])
    return out


class _Gaps:
    """Where boards rest, and how far from their stops."""

    def __init__(self, modes: BoardModes, circuit: Circuit) -> None:
        self.modes, self.circuit = modes, circuit
        self.per_volt, self.at_zero = self._static(modes.targets.numbers[circuit.open])

    def _static(self, k: int) -> tuple[Array, Array]:
        """(N, n) rest point of a mode by a volt of the generator, and without any."""
        m = self.modes.modes
        both = np.stack([m.B[:, k], m.d[:, k]], axis=-1)
        per_volt, at_zero = np.moveaxis(-np.linalg.solve(m.A[:, k], both), -1, 0)
        return per_volt, at_zero

    def _contacts(self, clearance: int) -> dict[int, int]:
        """Number of the mode in contact, by side."""
        return {
            side: self.modes.targets.numbers[self.circuit.carrying(contact)]
            for side, contact in self.circuit.stops[clearance].contacts
        }

    def ways(self, clearance: int) -> dict[int, Array]:
        """(N,) from rest to contact by side, in volts of the generator held in contact."""
        m, out = self.modes.modes, {}
        for side, k in self._contacts(clearance).items():
            row = m.past[:, k, clearance]
            n = row.shape[1] - 2
            stiff = (row[:, :n] * self._static(k)[0]).sum(axis=1) + row[:, n]
            rest = (row[:, :n] * self.at_zero).sum(axis=1) + row[:, n + 1]
            out[side] = -rest / np.abs(stiff)
        return out

    def constant_force(self, clearance: int) -> Array:
        """(N,) DC voltage of the generator [V] that acts like what does not oscillate: the mean of
        those that, taken away, bring the rest point to either stop."""
        ends = []
        for k in self._contacts(clearance).values():
            row = self.modes.modes.past[:, k, clearance]
            n = row.shape[1] - 2
            slope = (row[:, :n] * self.per_volt).sum(axis=1) + row[:, n]
            ends.append(((row[:, :n] * self.at_zero).sum(axis=1) + row[:, n + 1]) / slope)
        return np.asarray(np.mean(ends, axis=0))


def _motions(circuit: Circuit) -> dict[str, ModeKey]:
    """Modes of the free motion, by their names: open, and each contact that differs."""
    motions = {"open": circuit.open}
    for stop in circuit.stops:
        of = f" of {stop.clearance}" if len(circuit.stops) > 1 else ""
        for side, contact in stop.contacts:
            if not stop.shared:
                motions[f"at the {SIDES[side]} stop{of}"] = circuit.carrying(contact)
            else:
                motions.setdefault(f"in contact{of}", circuit.carrying(contact))
    return motions


DOUBTFUL = 2.0
"""Misfit from which on it is said: good fits of ngspice's boards have 0.7 to 1.2."""


@dataclass(frozen=True)
class FittedBoard:
    """A board as its records show it."""

    name: str
    """Its name; "" where there is one board alone."""
    files: tuple[str, ...]
    """The names of its records, those without a period among them."""
    fit: BoardFit | None = None
    """The most probable board; None where there is none."""
    figures: tuple[BoardFigure, ...] = ()
    """What the records tell of it."""
    advice: tuple[Advice, ...] = ()
    """The advice for each response that was asked for."""
    reason: str = ""
    """Why there is no fit; "" where there is one."""

    @property
    def misfit(self) -> float | None:
        """The misfit of the worst record; see ``BoardFit.misfits``."""
        return None if self.fit is None else max(self.fit.misfits)

    def as_dict(self, si: SiScales | None = None) -> BoardRecord:
        """The board as a JSON answer has it. The residual is that of the worst record."""
        return {
            "board": self.name,
            "files": list(self.files),
            "figures": plain(self.figures),
            "misfit": self.misfit,
            "doubtful": self.misfit is not None and self.misfit > DOUBTFUL,
            "residual": None if self.fit is None else max(self.fit.residuals),
            "rounds": None if self.fit is None else self.fit.rounds,
            "advice": [one.as_dict(si) for one in self.advice],
            "reason": self.reason,
        }


def board_behind(
    name: str,
    records: Sequence[tuple[str, NamedMotion]],
    prediction: BoardPrediction,
    wanted: Sequence[PredictedResponse] | None = None,
    decays: Sequence[tuple[str, FreeDecay]] = (),
) -> FittedBoard:
    """The board behind these records, each with the name of its file.

    A record without a period says nothing that an orbit could be held against; it is left out.
    wanted : the responses that advice is asked for; None for all that the nominal board shows.
    decays : records with the generator off.
    """
    files = (*(file for file, _ in records), *(file for file, _ in decays))
    periodic = [named for _, named in records if named.counts is not None]
    if not periodic:
        reason = "no record repeats: record the board at the frequency of another response"
        return FittedBoard(name, files, reason=reason)
    starts = [prediction.starts(each.motion.frequency) for each in periodic]
    try:
        seen = [_observation(each, prediction) for each in periodic]
        fit = fit_board(prediction.prior, seen, starts, [decay for _, decay in decays])
    except DesignerError as error:  # a setting that nobody knows, or no such board
        return FittedBoard(name, files, reason=str(error))
    questions = [r.question for r in (prediction.responses if wanted is None else wanted)]
    advice = advise(fit, questions, prediction.synthesis.modelfile.tuning)
    return FittedBoard(name, files, fit, determined_figures(fit), advice)


def _observation(named: NamedMotion, prediction: BoardPrediction) -> Observation:
    n = None if named.counts is None else named.counts.n
    shown = [net for net in prediction.circuit.displacements if named.motion.has(net)]
    setting = prediction.setting_of(named.motion)
    return observe(named.motion, shown or (named.moving,), setting, n=n)
