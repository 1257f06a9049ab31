"""The page of a board: what its records show, each laid over the prediction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from designer.base.figure_style import to_svg
from designer.base.page import Page, PageSection, Picture, SmallPrint, table_of
from designer.base.units import format_quantity
from designer.report.inline_svg import InlineSvg
from designer.report.write import render_page

YES_NO = {True: "yes", False: "no", None: ""}


def record_page_html(answer: Mapping[str, Any], figures: Sequence[Figure]) -> str:
    """``bench.html`` as text. answer : of ``bench``. figures : of each record."""
    inline = InlineSvg()
    drawings = [
        inline.element(to_svg(figure), f"{record['file']} over the prediction")
        for record, figure in zip(answer["records"], figures, strict=True)
    ]
    return render_page(record_page(answer, drawings))


def record_page(answer: Mapping[str, Any], drawings: Sequence[Markup]) -> Page:
    """The page. drawings : the ``<svg>`` element of each record."""
    records = answer["records"]
    intro = (
        "One board, as an oscilloscope recorded it, beside what the nominal board of this design "
        "does under the same drive. Impacts are counted on the board's own stops."
    )
    overview = table_of(
        records,
        {
            "record": lambda r: r["file"],
            "ω": lambda r: f"{r['omega']:.4g}",
            "drive": lambda r: drive_words(r),
            "shows": lambda r: shown_words(r),
            "wanted there": lambda r: r["wanted"] or "",
            "exact circuit": lambda r: (r["exact_circuit"] or {}).get("response", ""),
        },
    )
    sections = [
        PageSection(r["file"], list(_blocks(r, drawing)))
        for r, drawing in zip(records, drawings, strict=True)
    ]
    return Page(f"On the bench: {answer['title']}", [intro, overview], sections)


def shown_words(record: Mapping[str, Any]) -> str:
    """What a record shows, with what else it may be."""
    if record["sure"]:
        return str(record["response"])
    others = " or ".join([record["response"], *record["others"]])
    return f"{others}: not sure"


def drive_words(record: Mapping[str, Any]) -> str:
    """The drive of a record: frequency, and amplitude where it was recorded."""
    volts, hertz = record["amplitude_v_peak"], f"{record['frequency_hz']:.5g} Hz"
    return hertz if volts is None else f"{hertz}, {volts:.3g} V peak"


def _blocks(record: Mapping[str, Any], drawing: Markup) -> Iterator[str | Picture | SmallPrint]:
    channels = ", ".join(f"{net} at {channel}" for net, channel in record["channels"].items())
    yield (
        f"{record['kind'] or 'A record'}, {record['samples']} samples over {record['periods']:.3g} "
        f"drive periods; {channels}. It shows {shown_words(record)}."
    )
    if record["reason"]:
        yield f"Why it is not sure: {record['reason']}. What would tell: {record['would_tell']}."
    for stop in record["stops"]:
        ends = [
            f"{side} {format_quantity(stop[side]['volts'], 'V')} "
            f"± {format_quantity(2.0 * stop[side]['error'], 'V')}"
            for side in ("upper", "lower")
            if side in stop
        ]
        yield f"The board's own stops in clearance {stop['clearance']}: {', '.join(ends)}."
    if record["asymmetry"] is not None:
        symmetric = {True: "symmetric", False: "not symmetric", None: "within the noise"}
        yield (
            f"Asymmetry {100.0 * record['asymmetry']:.2g} % of the peak "
            f"(noise {100.0 * record['asymmetry_error']:.2g} %): "
            f"{symmetric[record['symmetric']]}."
        )
    caption = "Blue: the record, all laps on one another. Dashed: the exact circuit, nominal."
    yield Picture(caption=caption, svg=drawing)
    yield SmallPrint("Differences from the exact circuit have the scope's gain and offset in them.")
