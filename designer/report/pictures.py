"""Figures of a report as parts of its page, with what they show in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from designer.base.figure_style import to_svg
from designer.board import schematic_drawing
from designer.check.checked_design import traces
from designer.circuit.coefficients import EXACT
from designer.circuit.design import Design
from designer.report import blame_plots, map_plots, model_page, orbit_plots, study_plots, words
from designer.report.data import ReportData
from designer.report.inline_svg import InlineSvg
from designer.report.model_drawing import model_drawing
from designer.report.tolerance import blame_of


@dataclass(frozen=True)
class ReportPicture:
    """A figure with its caption."""

    svg: Markup
    """An ``<svg>`` element, which says what it shows."""
    caption: str = ""
    """The caption."""


@dataclass(frozen=True)
class Card:
    """The pictures of one response."""

    portrait: ReportPicture
    """The orbit in the phase plane."""
    trace: ReportPicture
    """The orbit over time."""
    caption: str
    """The caption of both."""
    warning: str
    """What is wrong with the response, or ""."""


def pictures(data: ReportData) -> dict[str, Any]:
    """The figures of ``report.html``, by name; None for one that would show nothing."""
    page = InlineSvg()
    return {
        "model_picture": _picture(
            page,
            model_drawing(model_page.drawn(data)),
            model_page.drawing_label(data),
            model_page.drawing_note(data),
        ),
        "cards": _cards(data, page),
        "legend": _legend(data, page),
        "yield_picture": _yield_picture(data, page),
        "margin_picture": _margin_picture(data, page),
        "avoided_picture": _avoided_picture(data, page),
        "index_picture": _index_picture(data, page),
        "map_pictures": _map_pictures(data, page),
        "error_picture": _error_picture(data.design, page),
        "schematic": _schematic(data, page),
    }


def _cards(data: ReportData, page: InlineSvg) -> list[Card]:
    sides, cards = _sides(data.design), []
    for i, c in enumerate(data.checked):
        drawn = traces(data.design, c)
        engines = f"model {c.model.orbit.response}, exact circuit {c.circuit.response}"
        if c.ngspice is not None:
            engines += f", ngspice {c.ngspice.response}"
        y = data.yield_of(i)
        said = [
            words.quantity(c.excitation.frequency, "Hz"),
            f"{words.quantity(c.excitation.amplitude, 'V')} peak",
        ]
        if c.model.orbit.symmetric is not None:
            said.append("symmetric" if c.model.orbit.symmetric else "asymmetric")
        if y is not None and y.samples:
            said.append(f"{y.ok} of {y.samples - y.failed} boards")
        cards.append(
            Card(
                _picture(
                    page,
                    orbit_plots.phase_portrait(c, drawn, sides=sides, legend=False),
                    f"Phase portrait at ω = {words.number(c.model.omega)}: {engines}.",
                ),
                _picture(
                    page,
                    orbit_plots.time_traces(c, drawn, sides=sides, legend=False),
                    f"x₁ over time at ω = {words.number(c.model.omega)}.",
                ),
                " · ".join(said),
                words.problem(c),
            )
        )
    return cards


def _legend(data: ReportData, page: InlineSvg) -> ReportPicture | None:
    if not data.checked:
        return None
    ngspice = any(c.gate is not None for c in data.checked)
    figure = orbit_plots.legend(ngspice=ngspice, sides=_sides(data.design))
    return _picture(
        page,
        figure,
        "Model: broad light line. Exact circuit: dashed line. ngspice: dots. Triangles: an impact "
        "begins. Shaded: contact with a stop.",
    )


def _yield_picture(data: ReportData, page: InlineSvg) -> ReportPicture | None:
    if data.yields is None or not data.checked:
        return None
    yields = [data.yield_of(i) for i in range(len(data.checked))]
    labels = _labels(data)
    if data.all_on_one_board is not None:
        labels, yields = [*labels, "all on one board"], [*yields, data.all_on_one_board]
    return _picture(
        page,
        study_plots.yield_chart(labels, yields),
        f"Yield of each response {'among all boards' if data.census else 'with its 95 % interval'}"
        ", and counts of ok, lost, grazing, failed; the figures are in the table.",
    )


def _margin_picture(data: ReportData, page: InlineSvg) -> ReportPicture | None:
    rows = [data.answers_to(i) for i in range(len(data.checked))]
    if not any(rows):
        return None
    return _picture(
        page,
        study_plots.margin_chart(_labels(data), rows),
        "Largest multiplier and nearest grazing of every board, by response.",
        "One mark a board. Left: the largest multiplier of the response that the board settled on; "
        "it dies at 1. Right: its shallowest contact or nearest miss; the count of impacts changes "
        "at 0. A lost board stands where its new response has these.",
    )


def _avoided_picture(data: ReportData, page: InlineSvg) -> ReportPicture | None:
    blames = [blame_of(data, i) for i in range(len(data.checked))]
    if not any(b is not None and b.subjects for b in blames):
        return None
    return _picture(
        page,
        blame_plots.avoided_chart(_labels(data), blames),
        "Share of each response's losses that are avoided if one part or one group were exact.",
        "Per cent of the lost boards that were asked again. Above the line groups, below it the "
        "parts that help most.",
    )


def _index_picture(data: ReportData, page: InlineSvg) -> ReportPicture | None:
    blames = [blame_of(data, i) for i in range(len(data.checked))]
    if not any(b is not None and b.indices for b in blames):
        return None
    return _picture(
        page,
        blame_plots.index_chart(_labels(data), blames),
        "Sobol indices of each response's margin, its largest coordinates.",
        "First-order: what a coordinate explains alone; total: with all others.",
    )


def _map_pictures(data: ReportData, page: InlineSvg) -> list[ReportPicture]:
    labels = dict(zip(data.question_of, _labels(data), strict=True))
    return [
        _picture(
            page,
            map_plots.map_chart(" ".join(labels[found.question].split()), found),
            f"Yield over {found.over} of {' '.join(labels[found.question].split())}.",
        )
        for found in data.layers.maps
        if found.question in labels
    ]


def _error_picture(design: Design, page: InlineSvg) -> ReportPicture | None:
    if design.errors.max_error <= EXACT:
        return None  # a row of "exact" says nothing that the sentence above it does not
    errors = {words.coefficient(k): v for k, v in design.errors.errors.items()}
    return _picture(
        page,
        study_plots.coefficient_chart(errors),
        "Size of each coefficient error, as in the table.",
    )


def _schematic(data: ReportData, page: InlineSvg) -> ReportPicture | None:
    if data.board is None:
        return None
    return ReportPicture(
        page.element(
            schematic_drawing.svg(data.board, numbers=data.pins),
            "Schematic: one stage a cell, nets joined by their names.",
        ),
        "Drawn from the circuit's parts; the same as schematic.svg.",
    )


def _labels(data: ReportData) -> list[str]:
    return [
        f"ω = {words.number(c.model.omega)}   {c.model.expected or c.model.orbit.response}"
        for c in data.checked
    ]


def _sides(design: Design) -> tuple[int, ...]:
    if not design.circuit.stops:
        return ()
    return {"both": (1, -1), "upper": (1,), "lower": (-1,)}[design.model.sides]


def _picture(page: InlineSvg, figure: Figure, shows: str, caption: str = "") -> ReportPicture:
    return ReportPicture(page.element(to_svg(figure), shows), caption)
