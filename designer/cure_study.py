"""The studies of a cure: fresh boards, as many as it takes to tell which side of the target a yield
is on, and kept so that interrupted work goes on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from designer import exact, pipeline
from designer.api import Synthesis
from designer.bands import Bands
from designer.orbit import OrbitStatus
from designer.responses import ModelResponse
from designer.spread import Spread
from designer.study_hash import study_hash
from designer.tuning import MOST_TRIES, tuned_block
from designer.verdict import BLOCK, Question, StudyPlan, Verdict, Yield

MOST = 8000
"""Boards of a study at which it gives up."""
TAG = 0xC04E
"""Sets the boards of a cure apart from those of a study with the same seed."""
VERDICTS = {"o": Verdict.OK, "l": Verdict.LOST, "g": Verdict.GRAZING, "f": Verdict.FAILED}
_LETTERS = {verdict: letter for letter, verdict in VERDICTS.items()}


def fresh(seed: int, number: int) -> int:
    """The seed of study ``number`` of a cure: boards that no other one has seen."""
    return int(np.random.SeedSequence([seed, number, TAG]).generate_state(1)[0])


def asked(made: Synthesis, responses: Sequence[ModelResponse]) -> list[Question | None]:
    """What the boards of a design are asked; None where the model or its circuit does not show the
    response."""
    checked = pipeline.check(made.design, responses, None)
    return [
        Question(c.model.spec, c.excitation, c.circuit, None)
        if c.model.found and c.circuit.status is OrbitStatus.PERIODIC
        else None
        for c in checked
    ]


def plan_of(made: Synthesis, question: Question, seed: int, samples: int = MOST) -> StudyPlan:
    """The study of one response of a design, boards as its model file says."""
    circuit = made.design.circuit
    spread = Spread.of(made.modelfile, circuit, made.catalog)
    return StudyPlan(circuit, spread, seed, samples, (question,))


class Book:
    """Verdicts that are known, by study and by block of boards: one letter a board.

    save : called with everything after each block.
    """

    def __init__(
        self,
        known: Mapping[str, Mapping[str, str]] | None = None,
        save: Callable[[dict[str, Any]], None] = lambda _: None,
    ) -> None:
        self._known = {study: dict(blocks) for study, blocks in (known or {}).items()}
        self._save = save

    def block(
        self, plan: StudyPlan, indices: range, trim: float | None, jobs: int
    ) -> tuple[str, bool]:
        """The letters of these boards, and whether they had to be found.

        trim : each board's DC offset is trimmed by the bench procedure within this band.
        """
        bands = None if trim is None else Bands(0.0, 0.0, trim)
        layer, more = "samples", dict[str, Any]()
        if bands is not None:
            layer, more = "tuned", {"bands": bands.as_dict(), "tries": MOST_TRIES}
        study, place = study_hash(plan, layer, more), str(indices.start)
        letters = self._known.get(study, {}).get(place, "")
        if len(letters) == len(indices):
            return letters, False
        answers = exact.block(plan, indices, jobs)
        verdicts = [a.verdict for a in answers]
        if bands is not None:
            verdicts = [t.bench_verdict for t in tuned_block(plan, indices, answers, bands, jobs)]
        letters = "".join(_LETTERS[v] for v in verdicts)
        self._known.setdefault(study, {})[place] = letters
        self._save({"format": 1, "studies": self._known})
        return letters, True


@dataclass(frozen=True)
class Measured:
    """A yield, and whether its 95 % interval says on which side of the target it is."""

    counts: Yield
    target: float

    @property
    def rate(self) -> float:
        """The yield; 0 where nothing was decided."""
        return self.counts.rate if self.counts.samples > self.counts.failed else 0.0

    @property
    def reached(self) -> bool:
        """The whole interval is at the target or above."""
        return self.counts.interval[0] >= self.target

    @property
    def decided(self) -> bool:
        """Whether more boards would not change the answer."""
        return self.reached or self.counts.interval[1] < self.target

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        low, high = self.counts.interval
        y = self.counts
        return {
            "ok": y.ok,
            "lost": y.lost,
            "grazing": y.grazing,
            "failed": y.failed,
            "samples": y.samples,
            "rate": y.rate,
            "low": low,
            "high": high,
        }


def measure(
    plan: StudyPlan,
    target: float,
    book: Book,
    *,
    trim: float | None = None,
    least: int = 2 * BLOCK,
    most: int = MOST,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> Measured:
    """The yield of a plan of one question on ``least`` boards, and on more until it is decided.

    most : boards at which it gives up. progress : called once a block.
    """
    letters, found = "", Measured(Yield(0, 0, 0, 0), target)
    while len(letters) < least or (len(letters) < most and not found.decided):
        stop = min(len(letters) + BLOCK, max(least, most))
        letters += book.block(
            replace(plan, samples=max(least, most)), range(len(letters), stop), trim, jobs
        )[0]
        found = Measured(Yield(*(letters.count(letter) for letter in VERDICTS)), target)
        progress()
    return found
