"""The plots of the page: Bokeh figures, empty; the page fills their columns and colours them."""

from __future__ import annotations

from typing import Any

from bokeh.core.types import ID
from bokeh.embed import json_item
from bokeh.models import ColumnDataSource, DataRange1d, HoverTool, Range1d
from bokeh.plotting import figure

from designer.explorer.controls import Control

PLOTS = ("portrait", "trace", "strip")
"""Names of the plots, and of the elements of the page that take them."""
MAP = "map"
"""The same of the map, which only a page with a server has."""
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
    "strip": ("omega", "x", "colour"),
    "now": ("at",),
    "cells": ("left", "right", "bottom", "top", "colour"),
    "borders": ("xs", "ys", "colour"),
    "here": ("x", "y"),
    "cursor": ("x", "y"),
}
"""Columns of each source of data, by its name."""
INK, FAINT, STROBE, IMPACT = "#0072b2", "#999999", "#d55e00", "#009e73"
"""Of Okabe and Ito: seen on light and on dark, and told apart by most."""


def sources() -> dict[str, ColumnDataSource]:
    """A source for each name in ``COLUMNS``, empty."""
    return {
        name: ColumnDataSource({key: [] for key in keys}, name=name)
        for name, keys in COLUMNS.items()
    }


def items(omega: Control) -> dict[str, Any]:
    """What ``Bokeh.embed.embed_item`` takes, for each of ``PLOTS``, a document each.

    omega : the slider of ω, whose unit an axis names.
    """
    made = (_portrait(sources()), _trace(sources()), _strip(sources(), omega))
    return {name: json_item(plot, ID(name)) for name, plot in zip(PLOTS, made, strict=True)}


def map_item() -> dict[str, Any]:
    """The same of the map of responses."""
    return {MAP: json_item(_map(sources()), ID(MAP))}


def _empty(height: int, tools: str, **more: Any) -> figure:
    plot = figure(
        height=height,
        sizing_mode="stretch_width",
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
    plot.min_border_left = 58
    return plot


def _portrait(data: dict[str, ColumnDataSource]) -> figure:
    plot = _empty(400, "pan,box_zoom,wheel_zoom,save,reset")
    plot.vspan(x="at", source=data["stops"], color=FAINT, line_dash="dashed", line_width=1)
    plot.line("x", "v", source=data["trace"], color=INK, line_width=1.6)
    plot.scatter("x", "v", source=data["impacts"], color=IMPACT, size=8, marker="triangle")
    strobes = plot.scatter("x", "v", source=data["strobes"], color=STROBE, size=7)
    plot.add_tools(HoverTool(renderers=[strobes], tooltips=[("strobe", "@x, @v")]))
    plot.xaxis.axis_label, plot.yaxis.axis_label = "x", "x′"
    return plot


def _trace(data: dict[str, ColumnDataSource]) -> figure:
    plot = _empty(
        190, "xpan,xbox_zoom,xwheel_zoom,save,reset", x_range=DataRange1d(range_padding=0.01)
    )
    plot.hspan(y="at", source=data["stops"], color=FAINT, line_dash="dashed", line_width=1)
    plot.line("t", "x", source=data["trace"], color=INK, line_width=1.6)
    plot.scatter("t", "x", source=data["impacts"], color=IMPACT, size=8, marker="triangle")
    plot.xaxis.axis_label, plot.yaxis.axis_label = "drive periods", "x"
    return plot


def _strip(data: dict[str, ColumnDataSource], omega: Control) -> figure:
    plot = _empty(
        200,
        "xpan,xbox_zoom,save,reset",
        x_range=Range1d(start=omega.scale * omega.low, end=omega.scale * omega.high),
    )
    plot.scatter("omega", "x", source=data["strip"], color="colour", size=2.5, line_color=None)
    plot.vspan(x="at", source=data["now"], color=STROBE, line_width=1)
    plot.xaxis.axis_label = f"{omega.label} [{omega.unit}]" if omega.unit else "ω"
    plot.yaxis.axis_label = "least x"
    return plot


def _map(data: dict[str, ColumnDataSource]) -> figure:
    plot = _empty(
        360, "save", x_range=Range1d(start=0.0, end=1.0), y_range=Range1d(start=0.0, end=1.0)
    )
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
