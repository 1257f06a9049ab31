"""What ``bench_fits`` has found, as a page and a picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from benchmarks.bench_flow import commit, machine, table
from designer.base.figure_style import new_figure, styled
from designer.dynamics.counts import Counts
from designer.workbench.advice import HELPS

LOST_OF = (6, 7, 8)
"""Numbers of the responses that boards lose often: 1-6-6, 1-7-7, 1-8-8."""
GAPS, FORCE = ("upper gap", "lower gap"), "constant force"
GAP_ERROR, FORCE_ERROR = 0.01, 0.1
"""What is asked: of half of the clearance; of the force's standard deviation over the spread."""
ONE, TWO, THREE = "one record", "two records", "two and a free decay"
KINDS = {THREE: "#26547c", TWO: "#2b6a4d", ONE: "#e0b040"}
"""What a board is fitted to, and its colour."""


@dataclass(frozen=True)
class FigureError:
    """A figure of a board as it was fitted, beside the truth."""

    name: str
    """What it is."""
    value: float
    """As fitted."""
    low: float
    """Lower end of its 95 % interval."""
    high: float
    """Upper end."""
    truth: float
    """What the drawn parts make of it."""
    sigma: float
    """Standard deviation over the boards of the spread."""
    told: bool
    """Whether ``bench`` reports it."""

    @property
    def covered(self) -> bool:
        """Whether the interval holds the truth."""
        return self.low <= self.truth <= self.high


@dataclass(frozen=True)
class BoardError:
    """A board that was fitted to its records."""

    sample: int
    """Number of the board."""
    kind: str
    """One of ``KINDS``."""
    responses: tuple[str, ...]
    """What ngspice shows on the records."""
    figures: tuple[FigureError, ...]
    """Every figure of the board; none without a fit."""
    misfit: float
    """As ``FittedBoard`` has it; nan without a fit."""
    reason: str
    """Why there is no fit."""
    seconds: float
    """Processor time of the fit."""

    def of(self, name: str) -> FigureError:
        return next(figure for figure in self.figures if figure.name == name)

    @property
    def gaps_right(self) -> bool:
        """Whether both ends of the clearance are as near to the truth as is asked."""
        return bool(self.figures) and all(
            abs(self.of(name).value - self.of(name).truth) < GAP_ERROR for name in GAPS
        )

    @property
    def force_right(self) -> bool:
        """Whether the constant force is."""
        if not self.figures:
            return False
        force = self.of(FORCE)
        return abs(force.value - force.truth) < FORCE_ERROR * force.sigma


@dataclass(frozen=True)
class AdvisedBoard:
    """A board that does not show a wanted response in ngspice, and what was advised."""

    question: int
    """Number of the wanted response."""
    sample: int
    """Number of the board."""
    as_set: str
    """What ngspice shows at the setting of ``setup.csv``."""
    advised: tuple[float, float, float] | None
    """The setting that is advised, as changes of frequency, amplitude and offset; None without a
    fit."""
    share: float
    """Of the boards that the records allow, those that are said to show the response there."""
    shows: str
    """What ngspice shows there; "" where nothing was advised."""
    known: tuple[float, float, float] | None
    """A setting that a search on the drawn parts found; None where it found none."""
    known_shows: str
    """What ngspice shows at that one."""
    wanted: str
    """The wanted response."""
    reason: str
    """Why there is no advice."""

    @property
    def tunable(self) -> bool:
        """Whether ngspice shows the response at any setting that was tried."""
        return self.helped or shows(self.known_shows, self.wanted)

    @property
    def helped(self) -> bool:
        """Whether ngspice shows it where it was advised."""
        return shows(self.shows, self.wanted)


def shows(shown: str, wanted: str) -> bool:
    """Whether a response is the wanted one or its mirror twin."""
    if "-" not in shown:
        return False
    counts = Counts.parse(shown)
    return wanted in (str(counts), str(counts.mirrored))


@styled
def fit_figure(
    errors: Sequence[BoardError], advised: Sequence[AdvisedBoard], wanted: Sequence[str]
) -> Figure:
    """Errors of the fitted ends and forces, and what became of the lost boards."""
    figure = new_figure(7.0, 3.6)
    gaps, force, bars = figure.subplots(1, 3)
    for kind, colour in KINDS.items():
        fits = [board for board in errors if board.kind == kind and board.figures]
        worst = [max(abs(b.of(n).value - b.of(n).truth) for n in GAPS) for b in fits]
        off = [abs(b.of(FORCE).value - b.of(FORCE).truth) / b.of(FORCE).sigma for b in fits]
        share = np.arange(1, len(fits) + 1) / max(len(fits), 1)
        for axes, values in ((gaps, worst), (force, off)):
            axes.step(np.sort(values), share, color=colour, label=kind, where="post")
    for axes, bound, words in (
        (gaps, GAP_ERROR, "error of the worse end\n[half clearances]"),
        (force, FORCE_ERROR, "error of the constant force\n[σ of the spread]"),
    ):
        axes.axvline(bound, color="#808080", linestyle=":")
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.set_ylim(0.0, 1.0)
        axes.set_xlabel(words)
    gaps.set_ylabel("share of boards")
    for place, question in enumerate(LOST_OF):
        own = [board for board in advised if board.question == question]
        tunable, back = sum(b.tunable for b in own), sum(b.helped for b in own)
        for count, colour, words in (
            (len(own), "#c8c8c8", "lost"),
            (tunable, "#e0b040", "can be tuned"),
            (back, "#2b6a4d", "brought back"),
        ):
            bars.bar(place, count, color=colour, label="" if place else words)
    bars.set_xticks(range(len(LOST_OF)), [wanted[k] for k in LOST_OF])
    bars.set_ylabel("boards")
    lines, boxes = gaps.get_legend_handles_labels()[0], bars.get_legend_handles_labels()[0]
    figure.legend(
        handles=[each for pair in zip(lines, boxes, strict=True) for each in pair],
        loc="outside lower center",
        ncols=3,
        frameon=False,
    )
    return figure


def fit_report(
    intro: str,
    errors: Sequence[BoardError],
    advised: Sequence[AdvisedBoard],
    wanted: Sequence[str],
) -> str:
    """``fits.md``. wanted : the responses of the model file."""
    return "\n".join(
        [
            "# Boards behind their records",
            "",
            f"Made by `python -m benchmarks fits` at commit {commit()} on {machine()}.",
            "",
            intro.strip(),
            "",
            "## Figures of the board",
            "",
            "The two responses of a board are drawn from the paper's nine. A gap is right within "
            f"{GAP_ERROR:g} of half of the clearance, the constant force within {FORCE_ERROR:g} of "
            "its standard deviation over the spread. The decay is that after the generator is "
            "switched off in the first response.",
            "",
            *table(
                ["records", "boards", "fitted", "both gaps right", "force right", "seconds"],
                [_row([b for b in errors if b.kind == kind], kind) for kind in KINDS],
            ),
            "",
            "![Errors of gaps and force, and boards brought back](fits.png)",
            "",
            "Intervals of 95 %: how many of those reported hold the truth.",
            "",
            *table(["figure", *KINDS], list(_covered(errors))),
            "",
            "## Advice",
            "",
            "Boards that do not show the response as set, with a record of what they show and one "
            "of another response. Can be tuned: ngspice shows the response at the advised setting, "
            "or where a search on the drawn parts found it.",
            "",
            *table(
                ["wanted", "lost", "can be tuned", "brought back", "said to be", "no advice"],
                [_advice_row([b for b in advised if b.question == k], wanted[k]) for k in LOST_OF]
                + [_advice_row(advised, "all")],
            ),
            "",
        ]
    )


def _row(boards: Sequence[BoardError], kind: str) -> list[str]:
    fitted = [board for board in boards if board.figures]
    seconds = float(np.median([board.seconds for board in boards])) if boards else float("nan")
    return [
        kind,
        str(len(boards)),
        str(len(fitted)),
        str(sum(board.gaps_right for board in fitted)),
        str(sum(board.force_right for board in fitted)),
        f"{seconds:.1f}",
    ]


def _covered(errors: Sequence[BoardError]) -> Iterator[list[str]]:
    """A row for each figure, then one for all."""
    names = list(dict.fromkeys(f.name for board in errors for f in board.figures))
    for name in (*names, ""):
        cells = []
        for kind in KINDS:
            told = [
                f
                for board in errors
                if board.kind == kind
                for f in board.figures
                if f.told and name in ("", f.name)
            ]
            cells.append(f"{sum(f.covered for f in told)} of {len(told)}" if told else "none")
        yield [name or "all", *cells]


def _advice_row(boards: Sequence[AdvisedBoard], name: str) -> list[str]:
    given = [board for board in boards if board.advised is not None]
    return [
        name,
        str(len(boards)),
        str(sum(board.tunable for board in boards)),
        str(sum(board.helped for board in boards)),
        str(sum(board.share >= HELPS for board in given)),
        str(len(boards) - len(given)),
    ]
