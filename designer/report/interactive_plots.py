"""Plots of a report that zoom and show values: documents of Bokeh, whose script draws them in the
page.

Their colours are those of the static pictures; the page's script puts its own in their place
(``inline_svg.VARIABLES``). Equal data give equal documents.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import count
from typing import Any

import numpy as np
from bokeh.embed import json_item
from bokeh.layouts import column
from bokeh.models import ColumnDataSource, FixedTicker, HoverTool, Model, Range1d, TapTool
from bokeh.models.annotations import BoxAnnotation, Span, Title
from bokeh.plotting import figure

from designer.base.arrays import Array
from designer.base.figure_style import (
    CIRCUIT_COLOUR,
    CONTACT,
    GRID,
    IMPACT_COLOUR,
    INK,
    MODEL_COLOUR,
    MUTED,
    NGSPICE_COLOUR,
)
from designer.check.checked_design import CheckedResponse
from designer.circuit.coefficients import EXACT
from designer.circuit.nominal import Trace
from designer.dynamics.orbit import OrbitStatus
from designer.model.relative_motion import RelativeMotion
from designer.plots import orbit_plots
from designer.plots.study_plots import VERDICTS, stop_curve
from designer.report import design_tables, words
from designer.report.data import ReportData, portrait_name, stop_name
from designer.verdicts.verdict import Verdict
from designer.workbench.prediction import PredictedStop
from designer.yields.yield_count import Yield

MOST_POINTS = 4096
"""The most points of one curve."""
POINTS = 1024
"""The most points of one drive period."""
BOARD = "board"
"""Name of the data that the page fills in for the boards of a study (``boards.js``)."""
ROW = 30
"""Height of a row of a chart, px."""
TOOLS = "pan,wheel_zoom,box_zoom,reset"
_NUMBER = "{0.[0000]}"


def plots(data: ReportData) -> dict[str, str]:
    """The documents of a page as JSON, by the names that its pictures have for them."""
    drawn: dict[str, Callable[[], Model]] = {}
    for i, (c, traces) in enumerate(zip(data.checked, data.traces, strict=True)):
        for k, motion in enumerate(data.motions(i)):
            drawn[portrait_name(i, k)] = partial(_orbit, c, traces, motion)
    for k, stop in enumerate(data.stops):
        drawn[stop_name(k)] = partial(_stop, stop)
    if data.design.errors.max_error > EXACT:
        unit = design_tables.spring_of(data.design.model)
        errors = {words.coefficient(n, unit): e for n, e in data.design.errors.errors.items()}
        drawn["errors"] = partial(_errors, errors)
    made = {name: data.once(f"plot {name}", partial(_made, plot)) for name, plot in drawn.items()}
    if data.checked:
        made["yields"] = document(_yields(*data.rated))
        made["margins"] = document(_margins(data))
    return made


def _made(plot: Callable[[], Model]) -> str:
    return document(plot())


def document(plot: Model) -> str:
    """A plot as JSON for ``Bokeh.embed.embed_item``, its parts numbered from 1."""
    numbers = count(1)
    known: dict[str, str] = {}

    def numbered(value: Any) -> Any:
        if isinstance(value, dict):
            return {
                key: known.setdefault(each, f"p{next(numbers)}")
                if key in ("id", "root_id") and isinstance(each, str)
                else numbered(each)
                for key, each in value.items()
            }
        return [numbered(each) for each in value] if isinstance(value, list) else value

    return json.dumps(numbered(json_item(plot)), allow_nan=False, separators=(",", ":"))


def _figure(height: int, x: str, y: str = "", **more: Any) -> figure:
    """An empty plot in the style of the static pictures."""
    plot = figure(
        height=height,
        sizing_mode="stretch_width",
        tools=TOOLS,
        active_drag="box_zoom",
        x_axis_label=x,
        y_axis_label=y,
        background_fill_color=None,
        border_fill_color=None,
        outline_line_color=None,
        **more,
    )
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    for axis in plot.axis:
        axis.axis_label_text_color = axis.major_label_text_color = INK
        axis.axis_line_color = axis.major_tick_line_color = MUTED
        axis.minor_tick_line_color = None
        axis.axis_label_text_font_style = "normal"
    plot.grid.grid_line_color = GRID
    return plot


def _hover(plot: figure, renderers: Sequence[Any], tips: Sequence[tuple[str, str]]) -> None:
    plot.add_tools(HoverTool(renderers=list(renderers), tooltips=list(tips)))


def _orbit(c: CheckedResponse, traces: Mapping[str, Trace], motion: RelativeMotion) -> Model:
    """Phase portrait over the displacement in time, every engine over each other."""
    portrait = _figure(315, *motion.axes)
    portrait.title = Title(text=_title(c), text_color=INK)
    wave = _figure(180, "drive periods", motion.axes[0])
    for plot, along in ((portrait, "width"), (wave, "height")):
        _shade(plot, motion.stops, along)
    lines: list[Any] = []
    points: list[Any] = []
    for name, curve in orbit_plots.aligned_curves(c, traces, motion).items():
        source = ColumnDataSource(_columns(_thinned(curve)))
        for plot, x, y in ((portrait, "x", "v"), (wave, "t", "x")):
            look = _look(name)
            draw: Any = plot.scatter if name == "ngspice" else plot.line
            renderer = draw(x, y, source=source, name=orbit_plots.ENGINES[name], **look)
            (lines if plot is portrait else points).append(renderer)
    board = ColumnDataSource({"t": [], "x": [], "v": []}, name=BOARD)
    for plot, x, y in ((portrait, "x", "v"), (wave, "t", "x")):
        plot.line(x, y, source=board, color=VERDICTS[Verdict.LOST], line_width=2)
    _impacts(portrait, c, motion)
    tips = [
        ("", "$name"),
        (motion.axes[0], f"@x{_NUMBER}"),
        (motion.axes[1], f"@v{_NUMBER}"),
        ("periods", f"@t{_NUMBER}"),
    ]
    _hover(portrait, lines, tips)
    _hover(wave, points, tips)
    if c.model.orbit.status is not OrbitStatus.PERIODIC:
        wave.x_range.update(start=0.0, end=float(orbit_plots.APERIODIC_PERIODS))
    return column(portrait, wave, sizing_mode="stretch_width")


def _title(c: CheckedResponse) -> str:
    wanted = f", wanted {c.model.expected}" if c.model.expected else ""
    return f"{c.model.spec.place_text()}{wanted}"


def _thinned(curve: Array) -> Array:
    """So few points of a curve (k, 3) as show it."""
    periods = max(float(curve[-1, 0]) if len(curve) else 0.0, 1.0)
    most = min(MOST_POINTS, round(POINTS * periods))
    return curve[:: max(1, math.ceil(len(curve) / (most + 1)))]


def _columns(curve: Array) -> dict[str, Any]:
    return dict(zip("txv", curve.T.astype(np.float32), strict=True))


def _look(name: str) -> dict[str, Any]:
    if name == "ngspice":
        return {"color": NGSPICE_COLOUR, "size": 4, "line_color": None}
    if name == "model":
        return {"color": MODEL_COLOUR, "line_width": 5, "line_cap": "round"}
    return {"color": CIRCUIT_COLOUR, "line_width": 1.3, "line_dash": [5, 3]}


def _shade(plot: figure, stops: Sequence[tuple[int, float]], dimension: str) -> None:
    """What lies beyond each stop, and the stop."""
    edges = ("left", "right") if dimension == "width" else ("bottom", "top")
    across = "height" if dimension == "width" else "width"
    for side, place in stops:
        beyond: dict[str, Any] = {edges[0] if side > 0 else edges[1]: place}
        beyond |= {"fill_color": CONTACT, "fill_alpha": 1.0, "line_color": None}
        line: dict[str, Any] = {"dimension": across, "line_color": MUTED}
        plot.add_layout(BoxAnnotation(**beyond, level="underlay"))
        plot.add_layout(Span(location=place, level="underlay", **line))


def _impacts(plot: figure, c: CheckedResponse, motion: RelativeMotion) -> None:
    impacts = [
        (side, place, speed)
        for side, place, velocities in motion.impacts(c.model.orbit)
        for speed in velocities.tolist()
    ]
    if not impacts:
        return
    columns: dict[str, Any] = {
        "x": [place for _, place, _ in impacts],
        "v": [speed for *_, speed in impacts],
        "angle": [-0.5 * math.pi * float(side) for side, *_ in impacts],
    }
    look: dict[str, Any] = {"marker": "triangle", "size": 9, "line_color": "#ffffff"}
    marks = plot.scatter(
        "x", "v", angle="angle", source=ColumnDataSource(columns), color=IMPACT_COLOUR, **look
    )
    _hover(plot, [marks], [("impact at", f"@v{_NUMBER}")])


def _stop(stop: PredictedStop) -> Model:
    """Output of a dead zone over the displacement, nominal."""
    displacement, output = stop_curve(stop)
    plot = _figure(300, f"{design_tables.moved_nets(stop)} [V]", f"{stop.output} [V]")
    _shade(plot, tuple(stop.ends.items()), "width")
    source = ColumnDataSource({"x": displacement, "y": output})
    line = plot.line("x", "y", source=source, color=VERDICTS[Verdict.OK], line_width=2)
    _hover(plot, [line], [("in", f"@x{_NUMBER} V"), ("out", f"@y{_NUMBER} V")])
    return plot


def _rows(plot: figure, names: Sequence[str]) -> None:
    """A row for each name, the first at the top."""
    plot.yaxis.ticker = FixedTicker(ticks=list(range(len(names))))
    plot.yaxis.major_label_overrides = dict(enumerate(names))
    plot.y_range.update(start=len(names) - 0.4, end=-0.6)
    plot.ygrid.grid_line_color = None


def _yields(names: Sequence[str], yields: Sequence[Yield | None]) -> Model:
    """The yield of each response with its interval."""
    plot = _figure(ROW * len(names) + 70, "yield [%]", x_range=(-2.0, 102.0))
    rows = [(i, y) for i, y in enumerate(yields) if y is not None and math.isfinite(y.rate)]
    columns: dict[str, Any] = {
        "row": [i for i, _ in rows],
        "name": [names[i] for i, _ in rows],
        "rate": [100.0 * y.rate for _, y in rows],
        "low": [100.0 * y.interval[0] for _, y in rows],
        "high": [100.0 * y.interval[1] for _, y in rows],
    }
    columns |= {str(v): [getattr(y, str(v)) for _, y in rows] for v in Verdict}
    source, blue = ColumnDataSource(columns), VERDICTS[Verdict.OK]
    plot.segment("low", "row", "high", "row", source=source, line_width=3, color=blue)
    dots = plot.scatter("rate", "row", source=source, size=10, color=blue, line_color="#ffffff")
    counts = [(str(v), f"@{v}") for v in Verdict]
    tips = [("", "@name"), ("yield", "@rate{0.[00]} %"), ("95 %", "@low{0.[00]} to @high{0.[00]}")]
    _hover(plot, [dots], [*tips, *counts])
    _rows(plot, names)
    return plot


def _margins(data: ReportData) -> Model:
    """How near each board is to losing its response; the page fills it from the boards' data."""
    names = [words.label(c) for c in data.checked]
    edges = [min(a.penetration, a.miss) for a in data.study.answers]
    positive = [e for e in edges if math.isfinite(e) and e > 0.0] or [1.0]
    columns: dict[str, Any] = {name: [] for name in ("x", "edge", "row", "colour")}
    source = ColumnDataSource(columns, name=BOARD)
    height = ROW * len(names) + 70
    radius = _figure(height, "largest multiplier; stable below 1", x_range=(0.0, 1.05))
    edge = _figure(height, "shallowest contact or nearest miss [V]", x_axis_type="log")
    edge.x_range = Range1d(start=min(positive) / 2.0, end=max(positive) * 2.0)
    tips = [("", "@name"), ("board", "@board"), ("", "@verdict")]
    for plot, x in ((radius, "x"), (edge, "edge")):
        look: dict[str, Any] = {"fill_color": "colour", "line_color": None, "fill_alpha": 0.75}
        dots = plot.scatter(x, "row", source=source, size=5, nonselection_fill_alpha=0.75, **look)
        _hover(plot, [dots], tips)
        plot.add_tools(TapTool(renderers=[dots]))
        _rows(plot, names)
    return column(radius, edge, sizing_mode="stretch_width")


def _errors(errors: Mapping[str, float]) -> Model:
    """Size of each coefficient error on a logarithmic axis."""
    percent = [100.0 * abs(e) for e in errors.values()]
    shown = [p for p in percent if math.isfinite(p) and p > 100.0 * EXACT]
    low = min(shown) / 10.0
    plot = _figure(ROW * len(errors) + 70, "|ln(realised/wanted)| [%]", x_axis_type="log")
    columns: dict[str, Any] = {
        "row": list(range(len(errors))),
        "name": list(errors),
        "size": [p if p in shown else low for p in percent],
        "text": [words.error(e) for e in errors.values()],
    }
    source = ColumnDataSource(columns)
    dots = plot.scatter("size", "row", source=source, size=10, color=VERDICTS[Verdict.OK])
    _hover(plot, [dots], [("", "@name"), ("error", "@text")])
    _rows(plot, list(errors))
    return plot
