"""The front of yield against price, readable alone."""

from __future__ import annotations

from matplotlib.figure import Figure

from designer.cure_json import words
from designer.cure_trial import Cure
from designer.plots import GRID, INK, MUTED, new_figure, styled

MEASURED, PREDICTED = "#0072b2", "#e69f00"
MOST_WORDS = 100
"""Letters of the upgrades in the list below the picture."""


@styled
def front_chart(found: Cure) -> Figure:
    """Yield of the worst response over the price of the upgrades: measured with its 95 % interval,
    and as the linear picture promised; the upgrades are listed by number."""
    front = found.front
    figure = new_figure(7.4, 3.4 + 0.17 * len(front))
    top, bottom = figure.subplots(2, 1, height_ratios=(3.0, 0.3 + 0.17 * len(front)))
    prices = [t.price for t in front]
    rates = [100.0 * t.worst.rate for t in front]
    ends = [t.worst.counts.interval for t in front]
    bars = [
        [max(r - 100.0 * low, 0.0) for r, (low, _) in zip(rates, ends, strict=True)],
        [max(100.0 * high - r, 0.0) for r, (_, high) in zip(rates, ends, strict=True)],
    ]
    top.step(prices, rates, where="post", color=MEASURED, lw=0.8, alpha=0.5)
    top.errorbar(
        prices, rates, bars, fmt="o", ms=5, capsize=3, color=MEASURED, label="measured, 95 %"
    )
    chosen = [t for t in front if t is not found.before]
    promised = [100.0 * min(t.predicted) for t in chosen]
    if chosen:
        top.plot(
            [t.price for t in chosen], promised, "x", ms=6, color=PREDICTED, label="linear picture"
        )
    asked = f"asked for: {100.0 * found.target:g} %"
    top.axhline(100.0 * found.target, color=INK, lw=0.8, ls="--", label=asked)
    if found.budget is not None:
        top.axvline(found.budget, color=MUTED, lw=0.8, ls=":", label="budget")
    for number, (x, y) in enumerate(zip(prices, rates, strict=True)):
        top.annotate(
            str(number), (x, y), xytext=(7, -11), textcoords="offset points", color=MUTED, size=8
        )
    lowest = min(100.0 * min(low for low, _ in ends), *promised, 100.0 * found.target - 1.0)
    room = 0.07 * (100.0 - lowest)
    top.set_ylim(lowest - room, 100.0 + room)
    top.set_xlim(left=-0.04 * max([*prices, 1e-2]), right=1.1 * max([*prices, 1e-2]))
    top.set_xlabel("price of the upgrades [euro, by the catalogue's price classes]")
    top.set_ylabel("yield of the worst response [%]")
    top.set_title(f"{found.base.modelfile.title}: yield against price", loc="left")
    top.grid(color=GRID, lw=0.7)
    top.legend(loc="lower right")
    bottom.set_axis_off()
    for number, t in enumerate(front):
        said = "; ".join(words(t.upgrades)) or "as it is"
        said = said if len(said) <= MOST_WORDS else said[: MOST_WORDS - 1] + "…"
        bottom.text(
            0.0, 1.0 - (number + 0.5) / max(len(front), 1), f"{number}  {t.price:.2f} euro: {said}",
            transform=bottom.transAxes, va="center", color=INK, size=7.5,
        )  # fmt: skip
    return figure
