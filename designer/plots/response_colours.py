"""Colours of responses, attractors and bifurcations in pictures of sweeps, maps and basins."""

from __future__ import annotations

from collections.abc import Mapping

from designer.dynamics.counts import read_counts
from designer.dynamics.orbit import OrbitStatus

BLACK, RED = "#000000", "#d40000"
OTHERS = (
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#8c564b", "#f0e442", "#7f3fbf",
    "#17becf", "#b3de69", "#1f3a5f", "#ff9896", "#8a8d0f", "#c5b0d5",
)  # fmt: skip
DOTS = tuple(c for c in OTHERS if c not in ("#f0e442", "#b3de69", "#c5b0d5", "#ff9896"))
"""Those that are dark enough for small dots."""
CHAOS, TORUS, REST, OPEN = "#3a3a3a", "#6b7a99", "#c9c9c9", "#ffffff"
"""Of aperiodic and of quasi-periodic motions, of responses too rare for a colour, and of what is
not settled."""
WITHOUT_N: dict[str, str] = {OrbitStatus.APERIODIC: CHAOS, OrbitStatus.QUASI_PERIODIC: TORUS}
"""Colour of what has settled without a period, by its status."""
SHADES = {True: "#b9cfe4", False: "#ecd9b4"}
"""Colours of windows of symmetric responses and of others."""
MARKS = {
    "pitchfork": ("o", "#0072b2"),
    "period-doubling": ("s", "#e69f00"),
    "fold": ("^", "#009e73"),
    "grazing": ("x", "#cc79a7"),
    "torus": ("D", "#7f3fbf"),
    "corner": ("+", "#56b4e9"),
}
"""Marker and colour of each kind of bifurcation."""
NAMED = 12
"""Responses that get a colour of their own in a map."""


def response_palette(counts: Mapping[str, int]) -> dict[str, str]:
    """Colour by response: the most frequent ones of a map, then one for all others.

    counts : points of the map by response.
    """
    frequent = sorted(counts, key=lambda response: (-counts[response], response))
    periodic = {r: read for r in frequent if (read := read_counts(r))}
    named = sorted(list(periodic)[:NAMED], key=periodic.__getitem__)
    looks = dict(zip(named, OTHERS, strict=False))
    others = {response: REST for response in periodic if response not in looks}
    plain = [response for response in frequent if response not in periodic]
    return looks | others | {r: WITHOUT_N.get(r, OPEN) for r in plain}


def palette_legend(
    counts: Mapping[str, int], looks: Mapping[str, str]
) -> list[tuple[str, str, float]]:
    """Colour, words and share of the points of each colour of a ``response_palette``; responses
    that it does not have count among the others."""
    named = {colour: response for response, colour in looks.items() if colour not in (REST, OPEN)}
    points = dict.fromkeys(named, 0)
    for response, count in counts.items():
        colour = looks.get(response, REST)
        points[colour] = points.get(colour, 0) + count
    words = {**named, REST: "other periodic", OPEN: "not settled"}
    total = sum(counts.values())
    return [(c, text, points[c] / total) for c, text in words.items() if c in points]
