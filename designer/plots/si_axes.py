"""Axes of a picture in the SI units of a model: at the top and the right, beside the dimensionless
values at the bottom and on the left; where plain numbers are SI values, these axes themselves."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from designer.base.si_unit import Unit

if TYPE_CHECKING:  # matplotlib takes long to import; only drawing needs it
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis


def si_x(axes: Axes, unit: Unit | None, *, below: float = 0.0) -> None:
    """The x axis in an SI unit, once its limits stand; nothing without a unit.

    below : how far below the axes, in their heights; 0 for the top.
    """
    if unit is None:
        return
    scale, name = unit.axis(max(map(abs, axes.get_xlim())))
    if unit.scale == 1.0:
        _in_unit(axes.xaxis, scale, name)
        return
    second = axes.secondary_xaxis(-below if below else "top", functions=_both_ways(scale))
    second.set_xlabel(name)


def si_y(axes: Axes, unit: Unit | None) -> None:
    """The y axis in an SI unit at the right, once its limits stand; nothing without a unit."""
    if unit is None:
        return
    scale, name = unit.axis(max(map(abs, axes.get_ylim())))
    if unit.scale == 1.0:
        _in_unit(axes.yaxis, scale, name)
        return
    axes.secondary_yaxis("right", functions=_both_ways(scale)).set_ylabel(name)


def _in_unit(axis: Axis, scale: float, name: str) -> None:
    axis.set_major_formatter(lambda value, _: f"{value * scale:.6g}")
    axis.set_label_text(f"{axis.get_label_text()} [{name}]")


def _both_ways(scale: float) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    return lambda value: value * scale, lambda value: value / scale
