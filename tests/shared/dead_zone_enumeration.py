"""The least error of a dead-zone stage by trying every choice: the reference for its sizing.

Nothing here comes from the package: the gains are those of Fig. 5 by Kirchhoff's current law.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from designer.base.arrays import Array
from designer.synthesis.dead_zone_target import DeadZoneTarget

MAX = 2_000_000
"""Choices that are looked at together."""


@dataclass(frozen=True)
class Ranges:
    """Ranges (low, high) of what a choice may have."""

    steep: tuple[float, float] = (1.25, np.inf)
    linear: tuple[float, float] = (0.0, np.inf)
    stop: tuple[float, float] = (0.0, np.inf)
    shift: tuple[float, float] = (0.0, 0.9)
    first: float = 0.0
    noise_gain: float = np.inf
    load: float = 0.0


def choices(
    names: Sequence[str], values: Array, tied: Sequence[Sequence[str]] = ()
) -> Iterator[dict[str, Array]]:
    """Every choice, in blocks; parts of a group in ``tied`` are equal."""
    root = {name: group[0] for group in tied for name in group}
    free = list(dict.fromkeys(root.get(name, name) for name in names))
    # The first few are looped over, so that a block stays small.
    outer = 0
    while len(values) ** (len(free) - outer) > MAX:
        outer += 1
    inner = [a.ravel() for a in np.meshgrid(*[values] * (len(free) - outer), indexing="ij")]
    for head in product(values.tolist(), repeat=outer):
        column = dict(zip(free, [*(np.full(len(inner[0]), v) for v in head), *inner], strict=True))
        yield {name: column[root.get(name, name)] for name in names}


def saturating_errors(
    v: dict[str, Array],
    mu: float,
    slope: tuple[float, float],
    *,
    saturation: float = 13.0,
    supply: float = 15.0,
    ranges: Ranges = Ranges(),
) -> Array:
    """The largest error of each choice, infinite where it is outside the ranges."""
    one_sided = "R211" in v
    with np.errstate(divide="ignore", invalid="ignore"):
        steep = v["R201"] / v["R200"] * v["R203"] / v["R202"]
        shift = steep * supply * v["R200"] / v["R211"] if one_sided else np.zeros(len(steep))
        # v11 between R204, R205 and R208, whose other end is a virtual ground.
        g4, g5, g8 = 1.0 / v["R204"], 1.0 / v["R205"], 1.0 / v["R208"]
        per_volt = g4 / (g4 + g5 + g8) * g8  # current through R208 per volt at U3C
        linear = v["R207"] / v["R206"]
        contact = linear / v["R209"]  # current into U3D's node per volt of v1 in contact
        inside = contact - steep * per_volt
        realised = contact * v["R210"] / v["R50"]
        error = np.maximum(np.log(realised / slope[1]), np.log(slope[0] / realised))
        error = np.maximum(error, mu * np.abs(np.log1p(-inside / contact)))
        threshold = (saturation - shift) / steep
        if one_sided:
            left = shift * per_volt - supply / v["R212"]
            error = np.maximum(error, mu * np.abs(left / contact / threshold))
        noise = np.maximum(1.0 + v["R201"] / v["R200"], 1.0 + v["R203"] / v["R202"])
        noise = np.maximum(noise, 1.0 + linear)
        behind = v["R208"] + 1.0 / (g4 + g5)
        noise = np.maximum(noise, 1.0 + v["R210"] / v["R209"] + v["R210"] / behind)
    good = (v["R203"] / v["R202"] >= 1.15) & (v["R201"] / v["R200"] >= ranges.first)
    bounded = [(steep, ranges.steep), (linear, ranges.linear), (v["R50"], ranges.stop)]
    if one_sided:
        bounded.append((shift / saturation, ranges.shift))
    for found, (low, high) in bounded:
        good &= (found >= low * (1 - 1e-9)) & (found <= high * (1 + 1e-9))
    good &= noise <= ranges.noise_gain
    for name in v:
        if name not in ("R205", "R211", "R212"):
            good &= v[name] >= ranges.load
    return np.where(good, np.maximum(error, 0.0), np.inf)


def least_saturating(
    names: Sequence[str],
    values: Array,
    mu: float,
    slope: tuple[float, float],
    ranges: Ranges,
    tied: Sequence[Sequence[str]] = (),
) -> float:
    """The least error of all choices; infinite where the ranges leave none."""
    blocks = choices(names, values, tied)
    return float(min(saturating_errors(v, mu, slope, ranges=ranges).min() for v in blocks))


def rectifier_errors(v: dict[str, Array], wanted: DeadZoneTarget, *, narrow: bool) -> Array:
    """The slope's error of each choice of one half, infinite where a condition is not kept.

    narrow : threshold within 1.2 and fv slope within 2.5 of their largest.
    """
    gain = v["R202"] / v["R200"]
    slope = gain / v["R50"]
    error = np.maximum(np.log(slope / wanted.slope[1]), np.log(wanted.slope[0] / slope))
    threshold = wanted.reference * v["R200"] / v["R201"]
    noise = 1.0 + v["R202"] / v["R200"] + v["R202"] / v["R201"]
    current = (wanted.supply - wanted.reference) / v["R206"] - wanted.reference / v["R201"]
    one = 1 + 1e-9
    good = (threshold <= wanted.threshold * one) & (gain <= wanted.output_gain * one)
    if narrow:
        good &= threshold * one >= wanted.threshold / 1.2
        good &= gain * one >= wanted.output_gain / 2.5
    good &= noise <= wanted.noise_gain * one
    least, most = wanted.reference_current
    good &= (current >= least / one) & (current <= most * one)
    for name in ("R200", "R201", "R202", "R50"):
        good &= v[name] >= wanted.load
    return np.where(good, np.maximum(error, 0.0), np.inf)
