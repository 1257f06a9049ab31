"""Second axes of a picture, in the SI units of a model: top and right, beside the dimensionless
values at the bottom and on the left."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from designer.base.si_unit import Unit

if TYPE_CHECKING:  # matplotlib takes long to import; only drawing needs it
    from matplotlib.axes import Axes


def si_x(axes: Axes, unit: Unit | None, *, below: float = 0.0) -> None:
    """The x axis in an SI unit, once its limits stand; nothing without a unit.

    below : how far below the axes, in their heights; 0 for the top.
    """
    if unit is None:
        return
    scale, name = unit.axis(max(map(abs, axes.get_xlim())))
    second = axes.secondary_xaxis(-below if below else "top", functions=_both_ways(scale))
    second.set_xlabel(name)


def si_y(axes: Axes, unit: Unit | None) -> None:
    """The y axis in an SI unit at the right, once its limits stand; nothing without a unit."""
    if unit is None:
        return
    scale, name = unit.axis(max(map(abs, axes.get_ylim())))
    axes.secondary_yaxis("right", functions=_both_ways(scale)).set_ylabel(name)


def _both_ways(scale: float) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    return lambda value: value * scale, lambda value: value / scale
