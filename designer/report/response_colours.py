"""Colours of responses and attractors in pictures of sweeps, maps and basins."""

from __future__ import annotations

BLACK, RED = "#000000", "#d40000"
OTHERS = (
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#8c564b", "#f0e442", "#7f3fbf",
    "#17becf", "#b3de69", "#1f3a5f", "#ff9896", "#8a8d0f", "#c5b0d5",
)  # fmt: skip
DOTS = tuple(c for c in OTHERS if c not in ("#f0e442", "#b3de69", "#c5b0d5", "#ff9896"))
"""Those that are dark enough for small dots."""
CHAOS, REST, OPEN = "#3a3a3a", "#c9c9c9", "#ffffff"
"""Of aperiodic motions, of responses too rare for a colour, and of what is not settled."""
SHADES = {True: "#b9cfe4", False: "#ecd9b4"}
"""Of windows of symmetric responses and of others."""
