"""The page of a board: what its records show, each laid over the prediction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from markupsafe import Markup
from matplotlib.figure import Figure

from designer.base.figure_style import to_svg
from designer.base.page import Block, Page, PageSection, Picture, SmallPrint, Table, table_of
from designer.base.si_unit import drive_text
from designer.base.units import format_quantity
from designer.report.inline_svg import InlineSvg
from designer.report.page_html import render_page

if TYPE_CHECKING:
    from designer.answers.bench_answer import (
        AdviceRow,
        BenchJson,
        BoardRecord,
        KindSpreadRow,
        NgspiceOverlay,
        RecordKeys,
        RecordRow,
        StopEnd,
    )

YES_NO = {True: "yes", False: "no", None: ""}


def record_page_html(answer: BenchJson, figures: Sequence[Figure]) -> str:
    """``bench.html`` as text. answer : of ``bench``. figures : of each record."""
    inline = InlineSvg()
    drawings = [
        inline.element(to_svg(figure), f"{record['file']} over the prediction")
        for record, figure in zip(answer["records"], figures, strict=True)
    ]
    return render_page(record_page(answer, drawings))


def record_page(answer: BenchJson, drawings: Sequence[Markup]) -> Page:
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
            "drive": at,
            "generator": lambda r: drive_words(r),
            "shows": lambda r: shown_words(r),
            "wanted there": lambda r: r["wanted"] or "",
            "exact circuit": lambda r: "" if (e := r["exact_circuit"]) is None else e["response"],
            "ngspice": lambda r: ngspice_words(r["ngspice"]),
        },
    )
    sections = [
        PageSection(r["file"], list(_blocks(r, drawing)))
        for r, drawing in zip(records, drawings, strict=True)
    ]
    boards = [PageSection(_board_title(b), list(_board(b))) for b in answer["boards"]]
    if answer["spread"]:
        boards.append(PageSection("How far the boards differ", list(_spread(answer["spread"]))))
    return Page(f"On the bench: {answer['title']}", [intro, overview], [*boards, *sections])


def at(row: RecordKeys | AdviceRow) -> str:
    """The drive frequency of a record, in the model's own units."""
    return drive_text(row["omega"], row.get("mechanism_hz"))


def _board_title(board: BoardRecord) -> str:
    return f"Board {board['board']}" if board["board"] else "The board"


def _board(board: BoardRecord) -> Iterator[Block]:
    """What the records tell of a board, and what to turn on it."""
    if board["reason"]:
        yield f"It was not found: {board['reason']}."
        return
    yield (
        "The most probable board of the model file's spread whose exact orbits draw "
        f"{' and '.join(board['files'])}, with what the records tell of it; the rest is open."
    )
    if board["doubtful"]:
        yield (
            f"The records differ from it by {board['misfit']:.1f} times what noise explains: the "
            "board may not be one of this spread, or the generator was set otherwise."
        )
    yield table_of(
        board["figures"],
        {
            "figure": lambda f: f["name"],
            "this board": lambda f: f"{f['value']:.5g} {f['unit']}".strip(),
            "95 %": lambda f: f"{f['low']:.5g} to {f['high']:.5g}",
            "nominal": lambda f: f"{f['nominal']:.5g}",
        },
    )
    yield PageSection("What to turn", [_advice_table(board["advice"])])


def _advice_table(advice: Sequence[AdviceRow]) -> Table | None:
    return table_of(
        advice,
        {
            "wanted": lambda a: a["expected"],
            "drive": at,
            "shows as set": lambda a: _shares(a["shown"]),
            "advice": lambda a: a["words"],
            "generator": lambda a: _generator(a),
            "shown then": lambda a: f"{a['share']:.0%}",
        },
    )


def _shares(shown: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {share:.0%}" for name, share in shown.items())


def _generator(advice: AdviceRow) -> str:
    volts = f"{advice['amplitude_v_peak']:.4g} V peak, {1e3 * advice['offset_v']:.3g} mV DC"
    return f"{advice['frequency_hz']:.5g} Hz, {volts}"


def _spread(kinds: Sequence[KindSpreadRow]) -> Iterator[Block]:
    yield "Standard deviation on these boards over that of the spread in the model file."
    yield table_of(
        kinds,
        {
            "kind": lambda k: k["kind"],
            "factor": lambda k: f"{k['factor']:.3g}",
            "95 %": lambda k: f"{k['low']:.3g} to {k['high']:.3g}",
        },
    )


def shown_words(record: RecordKeys) -> str:
    """What a record shows, with what else it may be."""
    if record["sure"]:
        return str(record["response"])
    others = " or ".join([record["response"], *record["others"]])
    return f"{others}: not sure"


def ngspice_words(answer: NgspiceOverlay | None) -> str:
    """What a board shows in ngspice, and which board; "" where it was not run."""
    if answer is None:
        return ""
    return f"{answer['response']} ({'fitted board' if answer['fitted'] else 'nominal'})"


def drive_words(record: RecordRow) -> str:
    """The drive of a record: frequency, and amplitude where it was recorded."""
    volts, hertz = record["amplitude_v_peak"], f"{record['frequency_hz']:.5g} Hz"
    return hertz if volts is None else f"{hertz}, {volts:.3g} V peak"


def _end_words(end: StopEnd) -> str:
    """Where a stop begins, within two standard errors."""
    if end["error"] is None:
        return "not reached"
    return f"{format_quantity(end['volts'], 'V')} ± {format_quantity(2.0 * end['error'], 'V')}"


def _blocks(record: RecordRow, drawing: Markup) -> Iterator[str | Picture | SmallPrint]:
    channels = ", ".join(f"{net} at {channel}" for net, channel in record["channels"].items())
    yield (
        f"{record['kind'] or 'A record'}, {record['samples']} samples over {record['periods']:.3g} "
        f"drive periods; {channels}. It shows {shown_words(record)}."
    )
    for cut in record["clipped"]:
        yield cut["words"]
    if record["reason"]:
        yield f"Why it is not sure: {record['reason']}. What would tell: {record['would_tell']}."
    for stop in record["stops"]:
        ends = [
            f"{side} {_end_words(end)}"
            for side, end in (("upper", stop.get("upper")), ("lower", stop.get("lower")))
            if end is not None
        ]
        yield f"The board's own stops in clearance {stop['clearance']}: {', '.join(ends)}."
    asymmetry, noise = record["asymmetry"], record["asymmetry_error"]
    if asymmetry is not None and noise is not None:
        symmetric = {True: "symmetric", False: "not symmetric", None: "within the noise"}
        yield (
            f"Asymmetry {100.0 * asymmetry:.2g} % of the peak (noise {100.0 * noise:.2g} %): "
            f"{symmetric[record['symmetric']]}."
        )
    caption = "Blue: the record, all laps on one another. Dashed: the exact circuit, nominal."
    if record["ngspice"] is not None:
        caption += " Dotted: ngspice on full op-amps."
    yield Picture(caption=caption, svg=drawing)
    yield SmallPrint("Differences from both engines have the scope's gain and offset in them.")
