"""Pictures of ``simulate --plots``: phase portrait, time trace, Poincaré section and power spectrum
of each response, the last two as tables too.

Each has a panel for the displacement in each clearance. Black is the orbit that was found, red its
mirror twin where it is not its own; shaded is contact with a stop. The names are fixed by the
frequencies, so that what would be replaced is known before anything is computed.

Poincaré section and power spectrum are of the displacement in each clearance: of a periodic
response from its periods, of another one from a long record.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from designer.base.arrays import Array
from designer.base.atomic_write import appearing
from designer.base.csv_tables import csv_text
from designer.base.errors import InputError
from designer.base.figure_style import (
    CONTACT,
    GRID,
    INK,
    MUTED,
    axis_limits,
    new_figure,
    picture,
    plain_numbers,
    shade_stops,
    state_plane,
    styled,
)
from designer.base.si_unit import Unit
from designer.base.units import distinct_texts
from designer.check.motion_record import PowerSpectrum, power_spectrum, section
from designer.check.simulation import Simulated
from designer.circuit.nominal import Trace
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.mechanics import state_names
from designer.model.relative_motion import RelativeMotion
from designer.model.si_units import NO_UNITS
from designer.plots.response_colours import BLACK, RED
from designer.plots.si_axes import si_x, si_y

QUIET = 1e-10
"""What lies below this share of the largest line or density is left out of the picture."""
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
    _plane(axes, motion, planes)
    for plane, colour in zip(planes, (BLACK, RED), strict=False):
        size = 5.0 if len(plane) <= MANY else 1.6
        axes.plot(*plane.T, ls="", marker="o", ms=size, mew=0, color=colour, zorder=3)


def _plane(axes: Axes, motion: RelativeMotion, curves: Sequence[Array]) -> None:
    """The plane of displacement and velocity in one clearance."""
    state_plane(axes, curves, motion.stops)
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
    """The spectra of the displacement in each clearance."""
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


DIGITS = 12
"""The most digits of a frequency in a file's name."""
FORMATS = ("png", "svg")
FOLDER = "a directory that can be written"
LEAST_PERIODS = 2
"""A time trace shows at least so many drive periods."""
MOST_PERIODS = 8
"""And of a response without a period so many."""
CROWD = 8
"""Impacts on a stop above which their marks are small."""
MOST_PORTRAIT = 30
"""Drive periods of a response without a period in its phase portrait."""


def names(omegas: Sequence[float], digits: int = DIGITS) -> tuple[str, ...]:
    """What the files of each response begin with; a frequency that comes again gets a number.

    digits : significant ones of a frequency, or as many more as tell those of this run apart.
    """
    out: list[str] = []
    for text in distinct_texts(omegas, digits, DIGITS):
        stem = name = f"omega-{text}"
        count = 1
        while name in out:
            count += 1
            name = f"{stem}-{count}"
        out.append(name)
    return tuple(out)


def check(folder: Path, stems: Sequence[str], overwrite: bool) -> None:
    """InputError where pictures cannot be written or would replace a file; writes nothing."""
    above = folder
    while not above.exists() and above != above.parent:
        if above.is_symlink():
            raise InputError(above, "--plots", "a link to nothing", "a directory")
        above = above.parent
    if not above.is_dir():
        raise InputError(above, "--plots", "a file", FOLDER)
    if not os.access(above, os.W_OK | os.X_OK):
        raise InputError(above, "--plots", "no right to write", FOLDER)
    kinds = [(k, f) for k in KINDS for f in FORMATS] + [(k, "csv") for k in TABLES]
    for name in (_file(s, *kind) for s in stems for kind in kinds):
        path = folder / name
        if path.is_dir() and not path.is_symlink():
            raise InputError(path, "--plots", "a directory", "a name that is free")
        if (path.exists() or path.is_symlink()) and not overwrite:
            raise InputError(path, "--plots", "a file", "a name that is free, or --overwrite")


def write(
    folder: Path,
    stems: Sequence[str],
    simulated: Sequence[Simulated],
    overwrite: bool,
    units: Mapping[str, Unit] = NO_UNITS,
) -> list[str]:
    """Write the pictures of each response that has an orbit; their names, in order.

    units : SI units of the model's quantities, shown beside the dimensionless values.
    """
    check(folder, stems, overwrite)
    names: list[str] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, "--plots", error.strerror or str(error), FOLDER) from None
    for stem, response in zip(stems, simulated, strict=True):
        for kind, draw in KINDS.items() if response.traces else ():
            figure = draw(response, units)
            for file_format in FORMATS:
                names.append(_file(stem, kind, file_format))
                with appearing(folder / names[-1], "--plots", FOLDER) as partial:
                    partial.write_bytes(picture(figure, file_format, 200.0))
        for kind, table in TABLES.items() if response.traces else ():
            names.append(_file(stem, kind, "csv"))
            with appearing(folder / names[-1], "--plots", FOLDER) as partial:
                partial.write_text(table(response), encoding="utf-8")
    return names


@styled
def portrait(response: Simulated, units: Mapping[str, Unit] = NO_UNITS) -> Figure:
    """The orbit and its twin in the plane (x1, x1'), and likewise in each further clearance;
    triangles where an impact begins."""
    count = len(response.motions)
    figure = new_figure(4.2 * count, 4.0)
    panels = figure.subplots(1, count, squeeze=False)[0]
    for number, axes in enumerate(panels):
        _portrait(axes, response, number, units)
    _finish(figure, panels[0], response, units)
    return figure


def _portrait(axes: Axes, response: Simulated, number: int, units: Mapping[str, Unit]) -> None:
    """The plane of the motion in one clearance."""
    motion = response.motions[number]
    period = 2.0 * np.pi / response.omega
    last = MOST_PORTRAIT * period * (1.0 + 1e-9)
    curves = [_curve(motion, response.omega, t, t.time <= last) for t in response.traces]
    _plane(axes, motion, curves)
    for orbit, curve, look in zip(_traced_orbits(response), curves, _LOOKS, strict=False):
        axes.plot(curve[:, 0], curve[:, 1], **look, lw=_width(orbit))
        for side, gap in motion.stops:
            speeds = orbit.impact_velocities[_at_stop(orbit, number, side)]
            _impacts(axes, np.full(len(speeds), gap), speeds, side, look)
    si_x(axes, units.get("x1"))
    si_y(axes, units.get("x1'"))


def _curve(motion: RelativeMotion, omega: float, trace: Trace, keep: Any) -> Array:
    return motion.of(trace.time[keep], trace.states[keep], omega)


def _at_stop(orbit: Orbit, clearance: int, side: int) -> Any:
    """Which of the impacts are on one stop."""
    return (orbit.impact_clearances == clearance) & (orbit.impact_sides == side)


@styled
def time_trace(response: Simulated, units: Mapping[str, Unit] = NO_UNITS) -> Figure:
    """x1 over drive periods, orbit and twin, and likewise in each further clearance, then what
    masses over a moving base do beside it; triangles where an impact begins."""
    motions = (*response.motions, *response.companions)
    figure = new_figure(6.4, 3.0 + 2.0 * (len(motions) - 1))
    panels = figure.subplots(len(motions), 1, squeeze=False, sharex=True)[:, 0]
    for number, (axes, motion) in enumerate(zip(panels, motions, strict=True)):
        _time_panel(axes, response, (number, motion), units)
    panels[-1].set_xlabel("drive periods t / T")
    _finish(figure, panels[0], response, units)
    return figure


def _time_panel(
    axes: Axes, response: Simulated, shown: tuple[int, RelativeMotion], units: Mapping[str, Unit]
) -> None:
    """One displacement over time. shown : of clearances their number, and the motion."""
    number, motion = shown
    period = 2.0 * np.pi / response.omega
    n = response.orbit.n if response.orbit.status is OrbitStatus.PERIODIC else 0
    span = max(n, LEAST_PERIODS) if n else MOST_PERIODS
    curves = []
    for orbit, trace, look in zip(_traced_orbits(response), response.traces, _LOOKS, strict=False):
        cycles = trace.time / period
        x = motion.of(trace.time, trace.states, response.omega)[:, 0]
        impacts = {side: _at_stop(orbit, number, side) for side, _ in motion.stops}
        times = {side: orbit.impact_times[at] / period for side, at in impacts.items()}
        if 0 < n < span:  # again, to fill what is shown
            laps = -(-span // n)
            cycles = np.concatenate([cycles + k * n for k in range(laps)])
            x = np.tile(x, laps)
            again = n * np.arange(laps)[:, None]
            times = {side: (at + again).ravel() for side, at in times.items()}
        keep = cycles <= span * (1.0 + 1e-9)
        axes.plot(cycles[keep], x[keep], **look, lw=1.3 if n else 0.9)
        curves.append(x[keep])
        for side, gap in motion.stops:
            at = times[side][times[side] <= span]
            _impacts(axes, at, np.full(len(at), gap), side, look)
    limits = axis_limits(np.concatenate(curves), motion.gaps)
    shade_stops(axes, motion.stops, limits, across=True)
    axes.set_xlim(0.0, span)
    axes.set_ylim(limits)
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=span > LEAST_PERIODS))
    axes.set_ylabel(motion.label)
    si_y(axes, units.get("x1"))


KINDS: dict[str, Callable[[Simulated, Mapping[str, Unit]], Figure]] = {
    "phase": portrait,
    "time": time_trace,
    "section": section_figure,
    "spectrum": spectrum_figure,
}
TABLES: dict[str, Callable[[Simulated], str]] = {"section": section_csv, "spectrum": spectrum_csv}
_LOOKS: tuple[dict[str, Any], ...] = (
    {"color": BLACK, "zorder": 3, "ls": "-"},
    {"color": RED, "zorder": 2, "ls": "-"},
)


def _file(stem: str, kind: str, file_format: str) -> str:
    return f"{stem}-{kind}.{file_format}"


def _traced_orbits(response: Simulated) -> list[Orbit]:
    """The orbits of the traces: the one that was found, then its twin."""
    return [o for o in (response.orbit, response.twin) if o is not None]


def _width(orbit: Orbit) -> float:
    """A response without a period in thin lines, or it is a blot."""
    return 1.3 if orbit.status is OrbitStatus.PERIODIC else 0.5


def _impacts(axes: Axes, x: Any, y: Any, side: int, look: dict[str, Any]) -> None:
    if not len(x):
        return
    axes.plot(
        x,
        y,
        ls="",
        marker="^" if side > 0 else "v",
        ms=5.5 if len(x) <= CROWD else 3.5,
        mfc="white",
        mec=look["color"],
        mew=1.0,
        zorder=look["zorder"] + 3,
        clip_on=False,
    )


def _finish(figure: Figure, axes: Axes, response: Simulated, units: Mapping[str, Unit]) -> None:
    """Title and key."""
    wanted = f", wanted {response.expected}" if response.expected and not response.found else ""
    axes.set_title(
        f"{place_title(response.omega, units)}: {response.orbit.response}{wanted}",
        loc="left",
        weight="bold",
        color=INK,
    )
    handles = []
    twin = response.twin
    labels = [response.orbit.response, "" if twin is None else f"{twin.response}, its mirror twin"]
    for orbit, look, label in zip(_traced_orbits(response), _LOOKS, labels, strict=False):
        handles.append(Line2D([], [], **look, lw=max(_width(orbit), 1.0), label=label))
    if any(motion.stops for motion in response.motions):
        if len(response.orbit.impact_sides):
            mark: dict[str, Any] = {"mfc": "white", "mec": MUTED, "ms": 5.5}
            handles.append(Line2D([], [], ls="", marker="^", **mark, label="impact begins"))
        box: dict[str, Any] = {"mfc": CONTACT, "mec": MUTED, "ms": 8, "mew": 0.6}
        handles.append(Line2D([], [], ls="", marker="s", **box, label="contact with a stop"))
    figure.legend(handles=handles, loc="outside lower center", ncols=2 if len(handles) > 3 else 3)
