"""The page of a model: its controls, its plots, and the state that it begins with.

The plots are Bokeh figures, empty; the page fills their columns and colours them.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from functools import cache
from typing import Any

from bokeh.core.types import ID
from bokeh.embed import json_item
from bokeh.models import BasicTicker, ColumnDataSource, DataRange1d, HoverTool, NoOverlap, Range1d
from bokeh.plotting import figure
from bokeh.resources import Resources
from jinja2 import Environment
from markupsafe import Markup

from designer.base.html_templates import page_templates
from designer.base.script_policy import script_source
from designer.base.units import axis_label
from designer.explorer.controls import Control, controls, length_unit, units_note
from designer.explorer.folder_losses import FolderLosses
from designer.explorer.omega_strip import PERIODS
from designer.explorer.place import OMEGA, first_place
from designer.explorer.response_view import IN_SIGHT, shown_motions
from designer.explorer.wire import Message
from designer.model.model_file import ModelFile

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


ASSETS = ("explore.css", "explore.js", "bokeh.js")
"""Names of the files that a served page loads."""


@cache
def asset(name: str) -> str:
    """The text of one of ``ASSETS``; Bokeh's own script comes with Bokeh."""
    if name == "bokeh.js":
        return "\n".join(Resources(mode="inline", components=["bokeh"]).js_raw)
    return _templates().get_template(name).render()


@cache
def _templates() -> Environment:
    return page_templates("designer.explorer")


def page(
    modelfile: ModelFile, losses: FolderLosses | None = None, asked: Collection[str] = ()
) -> str:
    """The page that ``server`` gives out; it loads ``ASSETS`` from beside itself. losses : of the
    model's folder. asked : words of its address."""
    css, *scripts = ("explore.css", "bokeh.js", "explore.js")
    return _render(
        modelfile,
        styles=Markup(f'<link rel="stylesheet" href="{css}">'),
        scripts=Markup("".join(f'<script src="{name}"></script>' for name in scripts)),
        asked=asked,
        losses=losses,
    )


def recorded_page(
    modelfile: ModelFile, recording: Message, losses: FolderLosses | None = None
) -> str:
    """The page as one file: it carries ``ASSETS``, and the answers that it shows.

    recording : what ``saved_page.message_of`` makes. Only the slider of ω is there. losses : of
    the model's folder.
    """
    scripts = [asset("bokeh.js"), asset("explore.js")]
    loads = "".join(f"<script>{script}</script>" for script in scripts)
    return _render(
        modelfile,
        styles=Markup(f"<style>{asset('explore.css')}</style>"),
        scripts=Markup(loads),
        recording=recording,
        losses=losses,
        allowed=[script_source(script) for script in scripts],
    )


def _render(
    modelfile: ModelFile,
    *,
    styles: Markup,
    scripts: Markup,
    asked: Collection[str] = (),
    recording: Message | None = None,
    losses: FolderLosses | None = None,
    allowed: Sequence[str] = (),
) -> str:
    each = controls(modelfile, asked)
    (omega,) = (control for control in each if control.name == OMEGA)
    shown = each if recording is None else (omega,)
    motions = shown_motions(first_place(modelfile).model.second_order())
    if recording is not None:
        motions = motions[: len(recording["views"][0]["motions"])]
    unit, scale = length_unit(modelfile)
    plots = items(omega, unit, motions[0].motion.symbol)
    if recording is None:
        plots |= map_item()
    data = _script_text(
        {
            "plots": plots,
            "recording": recording,
            "losses": None if losses is None else losses.message(),
            "settled_within": PERIODS,
            "in_sight": IN_SIGHT,
            "length": {"unit": unit, "scale": scale},
        }
    )
    return (
        _templates()
        .get_template("explore.html.j2")
        .render(
            title=modelfile.title,
            motions=[motion.label for motion in motions],
            stem=stem_for(modelfile),
            plots=TITLES,
            units=units_note(modelfile),
            groups=_groups(shown),
            axes=each,
            upward=next(control.name for control in each if control.name != OMEGA),
            fixed=[control for control in each if control not in shown],
            recorded=recording is not None,
            losses=losses,
            allowed=allowed,
            styles=styles,
            data=Markup(data),
            scripts=scripts,
        )
    )


def stem_for(modelfile: ModelFile) -> str:
    """The name under which a place is saved unless another is typed."""
    source = modelfile.source
    return f"{'model' if source is None else source.stem}-explored"


def _groups(each: tuple[Control, ...]) -> list[tuple[str, list[Control]]]:
    drive = [control for control in each if control.drive]
    return [("Drive", drive), ("Model", [c for c in each if not c.drive])]


def _script_text(data: object) -> str:
    """JSON that may stand inside a script of a page, whatever texts it has."""
    return json.dumps(data, allow_nan=False).replace("<", "\\u003c")
