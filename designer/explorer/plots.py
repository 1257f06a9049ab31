"""The plots of the page: Bokeh figures, empty; the page fills their columns and colours them."""

from __future__ import annotations

from typing import Any

from bokeh.core.types import ID
from bokeh.embed import json_item
from bokeh.models import BasicTicker, ColumnDataSource, DataRange1d, HoverTool, NoOverlap, Range1d
from bokeh.plotting import figure

from designer.base.units import axis_label
from designer.explorer.controls import Control

PLOTS = ("portrait", "trace", "strip")
"""Names of the plots, and of the elements of the page that take them."""
MAP = "map"
"""Name of the map and of its element, which only a page with a server has."""
TITLES = {
    "portrait": "phase portrait",
    "trace": "displacement over time",
    "strip": "bifurcation diagram around the present drive frequency",
}
COLUMNS = {
    "trace": ("t", "x", "v"),
    "strobes": ("x", "v"),
    "impacts": ("t", "x", "v"),
    "stops": ("at",),
    "strip": ("omega", "x", "colour", "period"),
    "now": ("at",),
    "cells": ("left", "right", "bottom", "top", "colour"),
    "borders": ("xs", "ys", "colour"),
    "here": ("x", "y"),
    "cursor": ("x", "y"),
}
"""Columns of each source of data, by its name."""
INK, FAINT, STROBE, IMPACT = "#0072b2", "#999999", "#d55e00", "#009e73"
"""Of Okabe and Ito: seen on light and on dark, and told apart by most."""
NOW = "#767676"
"""Colour of the line at the present ω: no period of the diagram has this colour."""
BORDERS = {"left": 72, "right": 24, "top": 10, "bottom": 50}
"""Pixels around a frame: room for labels, also at its corners, before the first are known."""
TICKS = 5
"""About how many ticks an axis has."""
APART = 8
"""Pixels between labels; the second of a closer pair is left out."""


def sources() -> dict[str, ColumnDataSource]:
    """A source for each name in ``COLUMNS``, empty."""
    return {
        name: ColumnDataSource({key: [] for key in keys}, name=name)
        for name, keys in COLUMNS.items()
    }


def items(omega: Control, unit: str, least: str) -> dict[str, Any]:
    """What ``Bokeh.embed.embed_item`` takes, for each of ``PLOTS``, a document each.

    omega : the slider of ω, whose unit an axis names. unit : that of displacements, "" for none.
    least : the symbol of the displacement whose least values the diagram has.
    """
    made = (
        _portrait(sources(), unit),
        _trace(sources()),
        _strip(sources(), omega, axis_label(f"least {least}", unit)),
    )
    return {name: json_item(plot, ID(name)) for name, plot in zip(PLOTS, made, strict=True)}


def map_item() -> dict[str, Any]:
    """The item of the map of responses."""
    return {MAP: json_item(_map(sources()), ID(MAP))}


def _empty(tools: str, **more: Any) -> figure:
    """A plot as large as its place on the page."""
    plot = figure(
        sizing_mode="stretch_both",
        tools=tools,
        active_scroll=None,
        toolbar_location="above",
        output_backend="canvas",
        **more,
    )
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    plot.background_fill_color = None
    plot.border_fill_color = None
    plot.update(**{f"min_border_{side}": pixels for side, pixels in BORDERS.items()})
    for axis in plot.axis:
        axis.major_label_policy = NoOverlap(min_distance=APART)
        axis.ticker = BasicTicker(desired_num_ticks=TICKS)
    return plot


def _portrait(data: dict[str, ColumnDataSource], unit: str) -> figure:
    plot = _empty("pan,box_zoom,wheel_zoom,save,reset")
    plot.vspan(x="at", source=data["stops"], color=FAINT, line_dash="dashed", line_width=1)
    plot.line("x", "v", source=data["trace"], color=INK, line_width=1.6)
    plot.scatter("x", "v", source=data["impacts"], color=IMPACT, size=8, marker="triangle")
    strobes = plot.scatter("x", "v", source=data["strobes"], color=STROBE, size=7)
    words = f"@x {unit}, @v {unit}/s" if unit else "@x, @v"
    plot.add_tools(HoverTool(renderers=[strobes], tooltips=[("strobe", words)]))
    plot.xaxis.axis_label, plot.yaxis.axis_label = "x", "x′"
    return plot


def _trace(data: dict[str, ColumnDataSource]) -> figure:
    plot = _empty("xpan,xbox_zoom,xwheel_zoom,save,reset", x_range=DataRange1d(range_padding=0.01))
    plot.hspan(y="at", source=data["stops"], color=FAINT, line_dash="dashed", line_width=1)
    plot.line("t", "x", source=data["trace"], color=INK, line_width=1.6)
    plot.scatter("t", "x", source=data["impacts"], color=IMPACT, size=8, marker="triangle")
    plot.xaxis.axis_label, plot.yaxis.axis_label = "time [drive periods]", "x"
    return plot


def _strip(data: dict[str, ColumnDataSource], omega: Control, least: str) -> figure:
    plot = _empty(
        "xpan,xbox_zoom,save,reset",
        x_range=Range1d(start=omega.scale * omega.low, end=omega.scale * omega.high),
    )
    points = plot.scatter(
        "omega", "x", source=data["strip"], color="colour", size=3.5, line_color=None
    )
    plot.vspan(x="at", source=data["now"], color=NOW, line_width=1.5)
    # The period in words too: nobody tells ten colours of small dots apart.
    tooltips = [(omega.label, f"@omega {omega.unit}"), ("period", "@period")]
    plot.add_tools(HoverTool(renderers=[points], tooltips=tooltips, limit=1))
    plot.xaxis.axis_label = axis_label(omega.label, omega.unit)
    plot.yaxis.axis_label = least
    return plot


def _map(data: dict[str, ColumnDataSource]) -> figure:
    plot = _empty("save", x_range=Range1d(start=0.0, end=1.0), y_range=Range1d(start=0.0, end=1.0))
    plot.quad(
        left="left",
        right="right",
        bottom="bottom",
        top="top",
        source=data["cells"],
        fill_color="colour",
        line_color=None,
    )
    # White below the lines: colours of curves and of cells are the same ones.
    for colour, width in (("white", 5.0), ("colour", 2.2)):
        plot.multi_line("xs", "ys", source=data["borders"], color=colour, line_width=width)
    for colour, width in (("white", 6.0), ("black", 2.0)):
        plot.scatter(
            "x",
            "y",
            source=data["here"],
            marker="cross",
            size=18,
            line_color=colour,
            line_width=width,
        )
    plot.scatter(
        "x", "y", source=data["cursor"], marker="circle", size=12, fill_color="white", line_width=2
    )
    plot.grid.visible = False
    return plot
