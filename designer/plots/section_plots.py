"""Pictures and tables of ``simulate --plots``: Poincaré section and power spectrum of a response.

Both are of the displacement in each clearance: of a periodic response from its periods, of another
one from a long record.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from designer.base.arrays import Array
from designer.base.csv_tables import csv_text
from designer.base.figure_style import (
    GRID,
    INK,
    axis_limits,
    new_figure,
    plain_numbers,
    shade_stops,
    styled,
)
from designer.base.si_unit import Unit
from designer.check.motion_record import PowerSpectrum, power_spectrum, section
from designer.check.simulation import Simulated
from designer.circuit.nominal import Trace
from designer.dynamics.orbit import OrbitStatus
from designer.model.mechanics import state_names
from designer.model.si_units import NO_UNITS
from designer.plots.response_colours import BLACK, RED
from designer.plots.si_axes import si_x, si_y

QUIET = 1e-10
"""Of the largest line or density: what lies below it is left out of the picture."""
_PLAIN = str.maketrans("₀₁₂₃₄₅₆₇₈₉−", "0123456789-")
MANY = 40
"""Points of a section above which they are drawn small."""


@styled
def section_figure(response: Simulated, units: Mapping[str, Unit] = NO_UNITS) -> Figure:
    """States at drive phase 0 in the plane of displacement and velocity in each clearance, black;
    of the mirror twin red. units : SI units shown beside the model's."""
    count = len(response.motions)
    figure = new_figure(4.2 * count, 3.9)
    panels = figure.subplots(1, count, squeeze=False)[0]
    sections = [section(trace, response.omega) for trace in _records(response)]
    for number, axes in enumerate(panels):
        _section_panel(axes, response, number, sections)
        si_x(axes, units.get("x1"))
        si_y(axes, units.get("x1'"))
    points = len(sections[0])
    what = f"{points} points" if points > 1 else "one point"
    what += "" if len(sections) == 1 else "; red: the mirror twin"
    _title(figure, response, f"states at drive phase 0, {what}", units)
    return figure


def _section_panel(axes: Axes, response: Simulated, number: int, sections: list[Array]) -> None:
    """The points in the plane of one clearance."""
    motion = response.motions[number]
    # At drive phase 0 the base is at 0 and moves fastest.
    planes = [motion.of(np.zeros(len(s)), s, response.omega) for s in sections]
    every = np.concatenate(planes)
    xlim, ylim = axis_limits(every[:, 0], motion.gaps), axis_limits(every[:, 1], ())
    shade_stops(axes, motion.stops, xlim)
    for plane, colour in zip(planes, (BLACK, RED), strict=False):
        size = 5.0 if len(plane) <= MANY else 1.6
        axes.plot(*plane.T, ls="", marker="o", ms=size, mew=0, color=colour, zorder=3)
    axes.set_xlim(*xlim)
    axes.set_ylim(*ylim)
    axes.set_xlabel(motion.label)
    axes.set_ylabel(motion.rate)


@styled
def spectrum_figure(response: Simulated, units: Mapping[str, Unit] = NO_UNITS) -> Figure:
    """Amplitude of each line of a periodic response, density of another one, over the frequency in
    drive frequencies; a panel for the displacement in each clearance."""
    count = len(response.motions)
    figure = new_figure(6.4, 3.0 + 2.0 * (count - 1))
    panels = figure.subplots(count, 1, squeeze=False, sharex=True)[:, 0]
    spectra = list(_spectra(response))
    for axes, motion, spectrum in zip(panels, response.motions, spectra, strict=True):
        _spectrum_panel(axes, spectrum)
        axes.set_ylabel(f"{'amplitude' if spectrum.lines else 'power density'} of\n{motion.label}")
        si_y(axes, units.get("x1"), power=1 if spectrum.lines else 2)
    panels[-1].set_xlabel("frequency / drive frequency")
    panels[-1].set_xlim(0.0, max(_highest(spectrum) for spectrum in spectra))
    panels[-1].xaxis.set_major_locator(MaxNLocator(10, integer=True))
    _title(figure, response, "power spectrum", units)
    return figure


def _spectrum_panel(axes: Axes, spectrum: PowerSpectrum) -> None:
    largest = float(spectrum.power[1:].max(initial=0.0))
    shown = spectrum.power > max(QUIET * largest, 1e-300)
    axes.set_yscale("log")
    plain_numbers(axes.yaxis)
    axes.grid(True, color=GRID, lw=0.5)
    if not spectrum.lines:
        axes.plot(spectrum.frequency, np.where(shown, spectrum.power, np.nan), color=BLACK, lw=0.7)
        return
    amplitude = np.sqrt(spectrum.power[shown])
    foot = np.sqrt(max(QUIET * largest, 1e-300))
    axes.vlines(spectrum.frequency[shown], foot, amplitude, color=BLACK, lw=1.0)
    axes.plot(spectrum.frequency[shown], amplitude, ls="", marker="o", ms=3, mew=0, color=BLACK)
    axes.set_ylim(bottom=foot)


def _highest(spectrum: PowerSpectrum) -> float:
    """Highest frequency of what is shown; at least twice the drive's."""
    shown = spectrum.power > QUIET * spectrum.power[1:].max(initial=0.0)
    return max(2.5, 1.02 * float(spectrum.frequency[np.flatnonzero(shown).max(initial=0)]))


def section_csv(response: Simulated) -> str:
    """A row for each point of the section: "orbit" or "twin", its number, and every state."""
    states = state_names(response.traces[0].states.shape[1] // 2)
    rows = []
    for name, trace in zip(("orbit", "twin"), _records(response), strict=False):
        for number, point in enumerate(section(trace, response.omega).tolist()):
            cells = map(repr, point)
            head = {"motion": name, "period": str(number)}
            rows.append(head | dict(zip(states, cells, strict=True)))
    return csv_text(("motion", "period", *states), rows)


def spectrum_csv(response: Simulated) -> str:
    """A row for each frequency: in drive frequencies, and for the displacement in each clearance
    the line's amplitude, or the density of its mean square."""
    spectra = list(_spectra(response))
    kind = "amplitude" if spectra[0].lines else "density"
    names = [f"{kind} {motion.label.translate(_PLAIN)}" for motion in response.motions]
    values = [np.sqrt(s.power) if s.lines else s.power for s in spectra]
    columns = ("frequency", *names)
    table = np.column_stack([spectra[0].frequency, *values]).tolist()
    return csv_text(columns, [dict(zip(columns, map(repr, row), strict=True)) for row in table])


def _records(response: Simulated) -> tuple[Trace, ...]:
    """What is shown of the orbit and of its twin."""
    return response.traces if response.record is None else (response.record,)


def _spectra(response: Simulated) -> Iterator[PowerSpectrum]:
    """Of the displacement in each clearance."""
    trace = _records(response)[0]
    periodic = response.orbit.status in (OrbitStatus.PERIODIC, OrbitStatus.GRAZING)
    for motion in response.motions:
        values = motion.of(trace.time, trace.states, response.omega)[:, 0]
        yield power_spectrum(trace.time, values, response.omega, periodic=periodic)


def place_title(omega: float, units: Mapping[str, Unit]) -> str:
    """The drive frequency of a response; in hertz alone where ω is in rad/s. units : SI units of
    the model's quantities."""
    plain = f"ω = {omega:.6g}"
    if "omega" not in units:
        return plain
    unit = units["omega"]
    return unit.text(omega, 6) if unit.own_si else f"{plain} ({unit.text(omega)})"


def _title(figure: Figure, response: Simulated, text: str, units: Mapping[str, Unit]) -> None:
    heading = f"{place_title(response.omega, units)}: {response.orbit.response}\n{text}"
    look: dict[str, Any] = {"x": 0.012, "ha": "left", "fontsize": 9, "color": INK}
    figure.suptitle(heading, **look)
