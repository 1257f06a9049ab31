"""The front of yield against price, readable alone."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from designer.base.figure_style import GRID, INK, MUTED, new_figure, styled
from designer.centering.repair_trial import Repair, Trial
from designer.model.model_file import ModelFile

MEASURED, PREDICTED = "#0072b2", "#e69f00"
FAR = 2.0
"""Times the dearest point: a budget beyond is not drawn."""
MOST_WORDS = 100
"""Letters of the upgrades in the list below the picture."""


@styled
def front_chart(repair: Repair) -> Figure:
    """Yield of the worst response over the price of the upgrades: measured with its 95 % interval,
    and as the linear picture promised; the upgrades are listed by number.

    Where nothing that was tried costs anything, the rounds take the place of the price.
    """
    front, free = repair.front, all(t.price == 0.0 for t in repair.front)
    if free:
        front = (repair.before, *repair.rounds)
    figure = new_figure(7.4, 3.4 + 0.17 * len(front))
    top, bottom = figure.subplots(2, 1, height_ratios=(3.0, 0.3 + 0.17 * len(front)))
    along = [float(k) if free else t.price for k, t in enumerate(front)]
    lowest = _yields(top, repair, front, along)
    room = 0.07 * (100.0 - lowest)
    top.set_ylim(lowest - room, 100.0 + room)
    if free:
        top.set_xlim(-0.4, max(len(front) - 1, 1) + 0.4)
        top.set_xticks(along, ["as it is", *(f"round {k}" for k in range(1, len(front)))])
        top.set_xlabel("choices one after the other; none costs anything")
    else:
        # An upgrade may be cheaper than what it replaces.
        cheapest, dearest = min(0.0, *along), max(0.0, *along)
        if repair.budget is not None and repair.budget <= FAR * dearest:
            top.axvline(repair.budget, color=MUTED, lw=0.8, ls=":", label="budget")
            dearest = max(dearest, repair.budget)
        width = dearest - cheapest
        top.set_xlim(left=cheapest - 0.04 * width, right=dearest + 0.1 * width)
        top.set_xlabel("price of the upgrades [euro, by the catalogue's price classes]")
    over = "round by round" if free else "against price"
    top.set_ylabel("yield of the worst response [%]")
    top.set_title(f"{repair.base.modelfile.title}: yield {over}", loc="left")
    top.grid(color=GRID, lw=0.7)
    figure.legend(loc="outside upper right", ncols=4)
    _listed(bottom, front, repair.base.modelfile)
    return figure


def _yields(axes: Axes, repair: Repair, front: Sequence[Trial], along: Sequence[float]) -> float:
    """The points of the front over ``along``; the lowest yield that is drawn [%]."""
    rates = [100.0 * t.worst.rate for t in front]
    ends = [t.worst.interval for t in front]
    bars = [
        [max(r - 100.0 * low, 0.0) for r, (low, _) in zip(rates, ends, strict=True)],
        [max(100.0 * high - r, 0.0) for r, (_, high) in zip(rates, ends, strict=True)],
    ]
    axes.step(along, rates, where="post", color=MEASURED, lw=0.8, alpha=0.5)
    axes.errorbar(
        along, rates, bars, fmt="o", ms=5, capsize=3, color=MEASURED, label="measured, 95 %"
    )
    promised = [
        (x, 100.0 * min(t.predicted))
        for x, t in zip(along, front, strict=True)
        if t is not repair.before
    ]
    if promised:
        axes.plot(*zip(*promised, strict=True), "x", ms=6, color=PREDICTED, label="linear picture")
    label = f"asked for: {100.0 * repair.target:g} %"
    axes.axhline(100.0 * repair.target, color=INK, lw=0.8, ls="--", label=label)
    for number, (x, y) in enumerate(zip(along, rates, strict=True)):
        axes.annotate(
            str(number), (x, y), xytext=(7, -11), textcoords="offset points", color=MUTED, size=8
        )
    lowest = [100.0 * low for low, _ in ends] + [y for _, y in promised]
    below = min(1.0, 5.0 * (100.0 - 100.0 * repair.target))
    return min(*lowest, 100.0 * repair.target - below)


def _listed(axes: Axes, front: Sequence[Trial], file: ModelFile) -> None:
    """What each number stands for."""
    axes.set_axis_off()
    for number, t in enumerate(front):
        text = "; ".join(t.upgrades.in_words(file)) or "as it is"
        text = text if len(text) <= MOST_WORDS else text[: MOST_WORDS - 1] + "…"
        axes.text(
            0.0, 1.0 - (number + 0.5) / max(len(front), 1), f"{number}  {t.price:.2f} euro: {text}",
            transform=axes.transAxes, va="center", color=INK, size=7.5,
        )  # fmt: skip
