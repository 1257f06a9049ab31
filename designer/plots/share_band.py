"""Counted basins along a sweep as a band: each attractor a stripe as high as its share."""

from __future__ import annotations

from itertools import groupby
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb

from designer.base.arrays import Array
from designer.base.figure_style import MUTED, ON_DARK, ON_LIGHT
from designer.bifurcations.basin_shares import AttractorShare, BasinShares
from designer.dynamics.orbit import OrbitStatus
from designer.plots.response_colours import OPEN, OTHERS, REST, WITHOUT_N

PALE = 0.45
"""How far the colour of a mirror twin is from that of the other twin towards white."""
DARK = 0.45
"""Luminance below which names are light."""
HIGH, LETTER = 0.11, 0.0068
"""Least height of a stripe that is named, and the width of a letter, in parts of the axes."""


def share_band(axes: Axes, shares: BasinShares) -> None:
    """The stripes, named where there is room; twins lie beside each other, one of them pale."""
    plan, heights = shares.plan, _heights(shares)
    colours = _colours(shares)
    order = _order(shares)
    values = plan.values
    edges = np.concatenate([values[:1], 0.5 * (values[1:] + values[:-1]), values[-1:]])
    bottom = np.zeros(len(values))
    for number in order:
        top = bottom + heights[number]
        axes.stairs(top, edges, baseline=bottom, fill=True, fc=colours[number], ec=MUTED, lw=0.15)
        _names(axes, shares, number, (edges, bottom, top), colours[number])
        bottom = top
    axes.set_ylim(0.0, 1.0)
    axes.set_ylabel(f"share of\n{len(plan.numbers)} starts")


def _heights(shares: BasinShares) -> dict[int, Array]:
    """(N,) share of each attractor at each value; 0 where it was not met."""
    place = {value: k for k, value in enumerate(shares.plan.values.tolist())}
    out: dict[int, Array] = {}
    for number, met in shares.attractors.items():
        out[number] = np.zeros(len(place))
        for value, share in met:
            out[number][place[value]] = share.count / len(shares.plan.numbers)
    return out


def _pairs(shares: BasinShares) -> dict[int, int]:
    """The lower number of an attractor and its twin, by number."""
    out: dict[int, int] = {}
    for number, met in shares.attractors.items():
        twins = [share.twin for _, share in met if share.twin is not None]
        out[number] = min(number, out.get(twins[0], twins[0])) if twins else number
    return out


def _order(shares: BasinShares) -> list[int]:
    """Periodic attractors from below, twins together; what is not periodic on top."""
    pairs, every = _pairs(shares), shares.attractors
    status = {number: met[0][1].status for number, met in every.items()}
    return sorted(
        every, key=lambda k: (status[k] is not OrbitStatus.PERIODIC, status[k], pairs[k], k)
    )


def _colours(shares: BasinShares) -> dict[int, str]:
    """A colour for each pair of twins, those met at the most values first; the rest are grey."""
    pairs, totals = _pairs(shares), dict[int, int]()
    every = shares.attractors
    for number, met in every.items():
        if met[0][1].status is OrbitStatus.PERIODIC:
            count = sum(share.count > 0 for _, share in met)
            totals[pairs[number]] = totals.get(pairs[number], 0) + count
    ranked = sorted(totals, key=lambda k: (-totals[k], k))
    base = dict(zip(ranked, OTHERS, strict=False))
    out = {}
    for number, met in every.items():
        if met[0][1].status is OrbitStatus.PERIODIC:
            colour = base.get(pairs[number], REST)
            out[number] = colour if pairs[number] == number else _pale(colour)
        else:
            out[number] = WITHOUT_N.get(met[0][1].status, OPEN)
    return out


def _pale(colour: str) -> str:
    red, green, blue = (c + PALE * (1.0 - c) for c in to_rgb(colour))
    return to_hex((red, green, blue))


def _names(
    axes: Axes,
    shares: BasinShares,
    number: int,
    stripe: tuple[Array, Array, Array],
    colour: str,
) -> None:
    """The response of an attractor, in each stretch of its stripe that is large enough.

    stripe : (N + 1,) edges of the values, (N,) lower and (N,) upper ends.
    """
    edges, bottom, top = stripe
    met = dict(shares.attractors[number])
    texts = [_text(met.get(value)) for value in shares.plan.values.tolist()]
    k = 0
    for text, steps in groupby(texts):
        first, k = k, k + len(list(steps))
        wide = (edges[k] - edges[first]) / (edges[-1] - edges[0])
        if not text or wide < LETTER * (len(text) + 1):
            continue
        # Judged on the middle half: a stripe that tapers off has room for its name there.
        margin = (k - first) // 4
        inside = slice(first + margin, k - margin)
        low, high = float(bottom[inside].max()), float(top[inside].min())
        if high - low >= HIGH:
            ink: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7}
            red, green, blue = to_rgb(colour)
            dark = 0.299 * red + 0.587 * green + 0.114 * blue < DARK
            at = 0.5 * (edges[first] + edges[k]), 0.5 * (low + high)
            axes.text(*at, text, color=ON_DARK if dark else ON_LIGHT, **ink)


def _text(share: AttractorShare | None) -> str:
    return "" if share is None or not share.count else share.response
