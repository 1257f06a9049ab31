"""One board and all of its records: what was fitted, what it tells, and what to turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from designer.base.errors import DesignerError
from designer.model.model import SiScales
from designer.workbench.advice import Advice, advise
from designer.workbench.board_fit import BoardFit, fit_board
from designer.workbench.fitted_quantities import BoardFigure, told_figures
from designer.workbench.free_decay import FreeDecay
from designer.workbench.naming import NamedMotion
from designer.workbench.observation import Observation, observe
from designer.workbench.prediction import BoardPrediction, PredictedResponse

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
    """For each response that it was asked for."""
    reason: str = ""
    """Why there is no fit; "" where there is one."""

    @property
    def misfit(self) -> float | None:
        """Of the worst record; see ``BoardFit.misfits``."""
        return None if self.fit is None else max(self.fit.misfits)

    def as_dict(self, si: SiScales | None = None) -> dict[str, Any]:
        """As a JSON answer has it. The residual is that of the worst record."""
        return {
            "board": self.name,
            "files": list(self.files),
            "figures": [figure.as_dict() for figure in self.figures],
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
    return FittedBoard(name, files, fit, told_figures(fit), advice)


def _observation(named: NamedMotion, prediction: BoardPrediction) -> Observation:
    n = None if named.counts is None else named.counts.n
    shown = [net for net in prediction.circuit.displacements if named.motion.has(net)]
    setting = prediction.setting_of(named.motion)
    return observe(named.motion, shown or (named.moving,), setting, n=n)
