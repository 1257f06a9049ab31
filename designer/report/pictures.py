"""Figures of a report as elements of its page, with what they show in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from markupsafe import Markup
from matplotlib.figure import Figure

from designer.base.figure_style import to_svg
from designer.base.page import Gallery, Picture
from designer.board.kicad_reader import BoardFile
from designer.check.checked_design import CheckedResponse
from designer.circuit.coefficients import EXACT
from designer.fabrication.board_picture import Side, board_svg
from designer.model.lumped_system import LumpedSystem
from designer.model.model import Dimensionless, Mechanical
from designer.model.relative_motion import different_motions
from designer.plots import (
    attribution_plots,
    map_plots,
    orbit_plots,
    study_plots,
    system_drawing,
)
from designer.report import design_tables, words
from designer.report.data import ReportData, portrait_name, stop_name
from designer.report.design_page import Pictures
from designer.report.inline_svg import InlineSvg, legible_width
from designer.schematic import schematic_drawing

INTRO = (
    "Displacement x₁ and velocity x₁′ of mass 1 over one response; below, "
    "x₁ over time. The engines lie on each other where they agree."
)
EVERY_CLEARANCE = (
    "Displacement and velocity in each clearance over one response; below, "
    "the displacement over time. The engines lie on each other where they agree."
)
OVER_A_BASE = (
    " Where the base moves, x − y is counted from it, as a stop on it sees it; x is absolute."
)
KEY = (
    "Model: broad light line. Exact circuit: dashed line. ngspice: dots. Triangles: an impact "
    "begins. Shaded: contact with a stop."
)
MARGINS = (
    "One mark a board, at the largest multiplier of the response that it settled on, which dies at "
    "1, and at its shallowest contact or nearest miss, where the count of impacts changes at 0. A "
    "lost board stands where its new response has these."
)
AVOIDED = (
    "Per cent of the lost boards that were asked again. Above the line groups, below it the parts "
    "that help most."
)
INDICES = "First-order: what a coordinate explains alone; total: with all others."
NOISE = " Thin lines: the 95 % noise of each."

SEEN: Mapping[Side, str] = {"top": "above", "bottom": "below"}
"""The direction from which each side is seen."""
Element = Callable[[Figure, str], Markup]
DrawnOnce = Callable[[str, Callable[[], Figure], str], Markup]
"""The element of a figure that the design decides, by its name (``ReportData.once``)."""


def pictures(data: ReportData) -> Pictures:
    """The figures of ``report.html``, by name; without those that would show nothing."""
    page = InlineSvg()

    def element(figure: Figure, shows: str) -> Markup:
        return page.element(to_svg(figure), shows)

    def once(name: str, figure: Callable[[], Figure], shows: str) -> Markup:
        return page.element(data.once(name, lambda: to_svg(figure())), shows)

    parameters = data.parameters
    out: dict[str, Picture | Gallery] = {}
    if isinstance(parameters, Dimensionless | Mechanical):
        draw = partial(system_drawing.pair_drawing, parameters)
        drawing = once("model", draw, _drawing_label(data))
        out["model"] = Picture(svg=drawing)
    elif isinstance(parameters, LumpedSystem):
        draw = partial(system_drawing.system_drawing, parameters, si=data.si is not None)
        drawing = once("model", draw, _drawing_label(data))
        out["model"] = Picture(svg=drawing)
    if data.checked:
        out["small portraits"] = _small_portraits(data, once)
        out["portraits"] = _portraits(data, once)
        out |= _study_pictures(data, element)
    for number, stop in enumerate(data.stops):
        svg = once(
            stop_name(number),
            partial(study_plots.stop_chart, design_tables.moved_nets(stop), stop),
            f"Output of the dead zone over the displacement in {stop.clearance}; the figures are "
            "in the table.",
        )
        out[stop_name(number)] = Picture(svg=svg, plot=stop_name(number))
    for curve in data.laws:
        shows = f"Force of {curve.name}: by the model, and as the nominal board makes it."
        name = f"law {curve.name}"
        out[name] = Picture(svg=once(name, partial(study_plots.law_chart, curve), shows))
    angular = data.result.modelfile.angular
    for one in data.study.maps:
        label = words.label(data.checked[data.study.response_indices[one.question]], " ")
        svg = element(
            map_plots.map_chart(label, one, angular=angular), f"Yield over {one.over} of {label}."
        )
        out[f"map {label} {one.over}"] = Picture(svg=svg)
    if data.design.errors.max_error > EXACT:
        unit = design_tables.spring_of(data.design.model)
        errors = {words.coefficient(k, unit): v for k, v in data.design.errors.errors.items()}
        shows = "Size of each coefficient error, as in the table."
        svg = once("errors", partial(study_plots.coefficient_chart, errors), shows)
        out["errors"] = Picture(svg=svg, plot="errors")
    circuit, pins = data.board
    drawn = data.once("schematic", lambda: schematic_drawing.svg(circuit, numbers=pins))
    out["schematic"] = Picture(
        caption="Drawn from the circuit's parts; the same as schematic.svg. What does not fit "
        "scrolls.",
        svg=page.element(drawn, "Schematic: one stage a cell, nets joined by their names."),
        width=legible_width(drawn),
    )
    if data.board_file is not None:
        out["board"] = _board(data, data.board_file, page)
    return out


def _board(data: ReportData, board: BoardFile, page: InlineSvg) -> Gallery:
    """Both sides of the board as its file stands."""
    routed = "with what is routed so far" if board.copper else "placed and not routed yet"
    sides = tuple(
        Picture(
            caption=f"From {seen}.",
            svg=page.element(
                data.once(f"board {side}", partial(board_svg, board, side)),
                f"The board from {seen}.",
            ),
        )
        for side, seen in SEEN.items()
    )
    return Gallery(f"The board of the KiCad project, {routed}.", Picture(), sides)


def _drawing_label(data: ReportData) -> str:
    """The drawing of the model in words."""
    model = data.design.model
    if not isinstance(model, Dimensionless):
        names = ", ".join(model.second_order().names)
        return f"The model: the masses {names} with what joins them, and its clearances."
    stops = f"the {model.sides} side" if model.sides != "both" else "both sides"
    end = f" between stops on springs K0 at {stops}" if model.k0 else ", without stops"
    damper = " and damper C2" if model.c else ""
    return f"The model: ground, spring K2{damper}, mass M2, spring K1 and damper C1, mass M1{end}."


def _small_portraits(data: ReportData, once: DrawnOnce) -> Gallery:
    """One portrait a response, of the motion in its first clearance."""
    small = []
    for response, c in enumerate(data.checked):
        draw = partial(
            orbit_plots.small_portrait, c, data.traces[response], data.motions(response)[0]
        )
        shows = f"Phase portrait of {words.name(c)}, small."
        small.append(Picture(svg=once(f"small {response}", draw, shows)))
    return Gallery("", Picture(), tuple(small))


def _portraits(data: ReportData, once: DrawnOnce) -> Gallery:
    ngspice = any(c.gate is not None for c in data.checked)
    system = data.design.model.second_order()
    key = partial(orbit_plots.legend, ngspice=ngspice, stops=bool(system.clearances))
    cards = [
        _card(data, response, view, once)
        for response in range(len(data.checked))
        for view in range(len(data.motions(response)))
    ]
    alone = [motion.symbol for motion in different_motions(system)] == ["x₁"]
    intro = (INTRO if alone else EVERY_CLEARANCE) + OVER_A_BASE * system.ground_moves
    return Gallery(intro, Picture(svg=once("key", key, KEY)), tuple(cards))


def _card(data: ReportData, response: int, view: int, once: DrawnOnce) -> Picture:
    """One response, by one of its motions (``ReportData.motions``)."""
    c = data.checked[response]
    curves, place_at = data.traces[response], c.model.spec.place_text()
    system = data.design.model.at(c.model.b).second_order()
    motion = data.motions(response)[view]
    engines = f"model {c.model.orbit.response}, exact circuit {c.circuit.response}"
    if c.ngspice is not None:
        engines += f", ngspice {c.ngspice.response}"
    place, caption = "", _caption(data, response, c)
    if len(system.clearances) > 1:
        names = dict.fromkeys(system.clearances[k].name for k in motion.clearances)
        place = f" in {' and '.join(names)}"
        caption = f"{motion.label}{place} · {caption}"
    plot = portrait_name(response, view)
    portrait = partial(orbit_plots.phase_portrait, c, curves, motion)
    shows = once(plot, portrait, f"Phase portrait{place} at {place_at}: {engines}.")
    for each in (motion, *data.companions(response, motion)):
        traces = partial(orbit_plots.time_traces, c, curves, each)
        words_of = f"{each.label} over time at {place_at}."
        shows += once(f"{plot} {each.label}", traces, words_of)
    return Picture("", caption, svg=shows, warning=words.problem(c), plot=plot)


def _caption(data: ReportData, response: int, c: CheckedResponse) -> str:
    parts = [
        words.quantity(c.excitation.frequency, "Hz"),
        f"{words.quantity(c.excitation.amplitude, 'V')} peak",
    ]
    if c.model.orbit.symmetric is not None:
        parts.append("symmetric" if c.model.orbit.symmetric else "asymmetric")
    counted = data.yields[response]
    if counted is not None and counted.samples:
        parts.append(f"{counted.ok} of {counted.samples - counted.failed} boards")
    return " · ".join(parts)


def _study_pictures(data: ReportData, element: Element) -> dict[str, Picture]:
    """Yields, margins and attribution, of what there is."""
    labels = [words.label(c) for c in data.checked]
    responses = range(len(data.checked))
    interval = "among all boards" if data.plan.census else "with its 95 % interval"
    shows = (
        f"Yield of each response {interval}, and counts of ok, lost, grazing, failed; the figures "
        "are in the table."
    )
    svg = element(study_plots.yield_chart(*data.rated), shows)
    out = {"yields": Picture(svg=svg, plot="yields")}
    rows = [data.study.answers_to(i) for i in responses]
    if any(rows):
        shows = "Largest multiplier and nearest grazing of every board, by response."
        svg = element(study_plots.margin_chart(labels, rows), shows)
        out["margins"] = Picture(caption=MARGINS, svg=svg, plot="margins")
    if data.study.rare:
        rare = [(labels[data.study.response_indices[r.question]], r) for r in data.study.rare]
        shows = "Boards of a million that lose each response, as in the table."
        out["rare"] = Picture(svg=element(study_plots.rare_chart(rare), shows))
    attributions = [data.attribution_of(i) for i in responses]
    if any(b is not None and b.subjects for b in attributions):
        shows = (
            "Share of each response's losses that are avoided if one part or one group were exact."
        )
        svg = element(attribution_plots.avoided_chart(labels, attributions), shows)
        out["avoided"] = Picture(caption=AVOIDED, svg=svg)
    if any(b is not None and b.indices for b in attributions):
        shows = "Sobol indices of each response's margin, its largest coordinates."
        svg = element(attribution_plots.index_chart(labels, attributions), shows)
        known = data.study.blame is not None and data.study.blame.noise_known
        out["indices"] = Picture(caption=INDICES + NOISE * known, svg=svg)
    return out
