"""Axes of a picture in the SI units of a model: at the top and the right, beside the dimensionless
values at the bottom and on the left; where plain numbers are SI values, these axes themselves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from matplotlib.ticker import MaxNLocator

from designer.base.si_unit import Unit, quantity_text
from designer.base.units import parse_quantity
from designer.bifurcations.subject import Subject
from designer.plots.titles import in_si_values, parameter_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis


def si_x(axes: Axes, unit: Unit | None, *, below: float = 0.0) -> None:
    """The x axis in an SI unit, once its limits stand; nothing without a unit.

    below : how far below the axes, in their heights; 0 for the top.
    """
    if unit is None:
        return
    scale, name = unit.axis(max(map(abs, axes.get_xlim())))
    if unit.own_si:
        _in_unit(axes.xaxis, scale, name)
        return
    second = axes.secondary_xaxis(-below if below else "top", functions=_both_ways(scale))
    second.set_xlabel(name)


def si_y(axes: Axes, unit: Unit | None, *, power: int = 1) -> None:
    """The y axis in an SI unit at the right, once its limits stand; nothing without a unit.

    power : of the unit, of a quantity that is shown on a logarithmic axis.
    """
    if unit is None:
        return
    scale, name = unit.axis(max(map(abs, axes.get_ylim())) ** (1.0 / power))
    scale, name = scale**power, name + ("" if power == 1 else "²")
    if unit.own_si:
        _in_unit(axes.yaxis, scale, name)
        return
    axes.secondary_yaxis("right", functions=_both_ways(scale)).set_ylabel(name)


def parameter_x(
    axes: Axes, subject: Subject, name: str, ending: str = "", *, below: float = 0.0
) -> None:
    """The x axis of one of a subject's parameters or states, once its limits stand: its label, and
    the SI axis beside it. ending : of the label. below : as ``si_x`` says."""
    if _own_axis(axes.xaxis, axes.get_xlim(), subject, name, ending):
        si_x(axes, subject.si.get(name), below=below)


def parameter_y(axes: Axes, subject: Subject, name: str, ending: str = "") -> None:
    """``parameter_x`` for the y axis."""
    if _own_axis(axes.yaxis, axes.get_ylim(), subject, name, ending):
        si_y(axes, subject.si.get(name))


def _own_axis(
    axis: Axis, limits: tuple[float, float], subject: Subject, name: str, ending: str
) -> bool:
    """Label a parameter's axis; returns whether the SI units that it is shown in are still due."""
    text = (subject.labels.get(name) or parameter_name(subject, name)) + ending
    unit, si = subject.units.get(name, ""), subject.si.get(name)
    axis.set_label_text(text if not unit or (si and si.own_si) else f"{text} [{unit}]")
    if si is not None:
        return True
    if unit and in_si_values(subject):
        axis.set_label_text(text)
        own_axis(axis, max(map(abs, limits)), unit)
    return False


class _RoundIn(MaxNLocator):
    """Ticks at values that are round once ``scale`` times as large."""

    def __init__(self, scale: float) -> None:
        super().__init__(nbins="auto", steps=[1, 2, 2.5, 5, 10])
        self._scale = scale

    def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
        """Ticks in the units of the data."""
        ticks = super().tick_values(vmin * self._scale, vmax * self._scale)
        return [float(tick) / self._scale for tick in ticks]


def own_axis(axis: Axis, largest: float, unit: str) -> None:
    """An axis of SI values up to ``largest`` in their unit, with the prefix that suits them; the
    label is there already."""
    _, _, shown = quantity_text(largest, unit).partition(" ")
    _in_unit(axis, 1.0 / parse_quantity(f"1 {shown}", unit), shown)


def _in_unit(axis: Axis, scale: float, name: str) -> None:
    """Ticks at round values in the unit that is shown."""
    axis.set_major_formatter(lambda value, _: f"{value * scale:.6g}")
    if axis.get_scale() == "linear":
        axis.set_major_locator(_RoundIn(scale))
    axis.set_label_text(f"{axis.get_label_text()} [{name}]")


def _both_ways(scale: float) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    return lambda value: value * scale, lambda value: value / scale
