"""Results as tables for people, on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from designer.base.si_unit import value_text
from designer.base.units import format_quantity
from designer.catalog.catalog import Catalog
from designer.report import compare_table

if TYPE_CHECKING:
    from designer.spice.opamp_check import FigureCheck


def run(answer: Mapping[str, Any]) -> None:
    """Parts and errors, then the responses."""
    synthesised(answer)
    tolerance(answer)


def synthesised(answer: Mapping[str, Any]) -> None:
    """The chosen parts, their error and the generator's settings."""
    console = new_console()
    table = new_table("Parts", "value", "parts")
    kinds: dict[tuple[str, float], list[str]] = {}
    for name, value in answer["parts"].items():
        kinds.setdefault((name[0], value), []).append(name)
    for (kind, value), names in sorted(kinds.items()):
        add_row(table, format_quantity(value, "F" if kind == "C" else "Ω"), " ".join(names))
    console.print(table)
    if answer.get("better_grades"):
        from designer.spread.part_grades import (  # only here is it needed
            BetterGrade,
            better_grades_text,
        )

        better = {name: BetterGrade(**said) for name, said in answer["better_grades"].items()}
        print_line(console, better_grades_text(better))
    certificate = answer["certificate"]
    print_line(
        console,
        f"Largest coefficient error {_error(answer['max_error'])} "
        f"({certificate['status']}, lower bound {_error(certificate['lower_bound'])}); "
        f"{answer['distinct_values']} distinct values",
    )
    if answer["knobs"]:
        knobs, key = answer["knobs"], "mechanism_hz"
        heads = ("ω", *_hertz_heads(knobs, key), "expected", "frequency")
        table = new_table("Generator", *heads, "amplitude (peak, high-Z)")
        for knob in knobs:
            add_row(
                table,
                f"{knob['omega']:g}",
                *_hertz(knob, knobs, key),
                knob["expected"] or "-",
                f"{knob['frequency_hz']:.4g} Hz",
                f"{knob['amplitude_v_peak']:.4g} V",
            )
        console.print(table)


def tolerance(answer: Mapping[str, Any]) -> None:
    """The responses on each engine, and their yields."""
    console = new_console()
    spread = (answer.get("provenance", {}).get("spread") or {}).get("name", "")
    table = new_table(
        f"Responses, {answer['samples']} samples"
        + (f", spread of the {spread}" if spread == "model file" else ""),
        "ω",
        *_hertz_heads(answer["responses"]),
        "expected",
        "model",
        "circuit",
        "ngspice",
        "yield %",
        "95 %",
        "lost",
        "grazing",
        "failed",
        gap=1,
    )
    for r in answer["responses"]:
        y = r["yield"]
        counted = ["-", r.get("left_out", ""), "", "", ""]
        if y is not None:
            rate = "-" if r["rate"] is None else f"{100 * r['rate']:.1f}"
            counted = [
                rate,
                _interval(y, y),
                str(y["lost"]),
                str(y["grazing"]),
                str(y["failed"]),
            ]
        found = r["model"] if r["found"] else f"{r['model']} (not what is wanted)"
        add_row(
            table,
            f"{r['omega']:g}",
            *_hertz(r, answer["responses"]),
            r["expected"] or "-",
            found,
            r["circuit"],
            r["ngspice"] or "-",
            *counted,
        )
    console.print(table)
    _boards(console, answer)
    for r in answer["responses"]:
        for doubt in doubts(_with_its_figures(r)):
            print_line(console, f"ω = {r['omega']:g}: {doubt}")
    if answer.get("equation_check") is not None:
        from designer.spice.equation_check import EquationCheck  # only here is it needed

        problem = EquationCheck.read(answer["equation_check"]).problem
        if problem:
            print_line(console, problem)
    blame_status(answer)
    if answer.get("until") is not None:
        reached = "reached" if answer.get("narrow") else "NOT reached: some interval is wider"
        print_line(
            console, f"Intervals narrower than {100 * answer['until']:g} % of boards: {reached}"
        )
    _further(console, answer)


def _boards(console: Console, answer: Mapping[str, Any]) -> None:
    """One row for each measured board, where the study is of all of them."""
    rows = answer.get("boards")
    if not rows:
        return
    heads = [f"{r['omega']:g} {r['expected'] or '-'}" for r in answer["responses"]]
    table = new_table(f"All {len(rows)} boards", "board", *heads, "all of them", gap=1)
    for row in rows:
        add_row(table, row["board"], *(cell or "-" for cell in row["cells"]), row["all"] or "-")
    console.print(table)


def blame_status(answer: Mapping[str, Any]) -> None:
    """One line about a blame that is not whole; none where it is."""
    status = answer.get("blame") or {}
    if status.get("reason"):
        print_line(new_console(), f"Blame {status['status']}: {status['reason']}")


def _further(console: Console, answer: Mapping[str, Any]) -> None:
    """The yields beside those as built, where there are any."""
    kinds: dict[str, Callable[[Mapping[str, Any]], Any]] = {
        "tuned": lambda r: r.get("tuned"),
        "on the bench": lambda r: (r.get("tuned") or {}).get("bench"),
        "trimmed": lambda r: r.get("trimmed"),
        "reached": lambda r: r.get("reached"),
    }
    shown = [k for k, of in kinds.items() if any(of(r) for r in answer["responses"])]
    both = any(r.get("combined") for r in answer["responses"])
    if not shown and not both:
        return
    heads = [*(f"{kind} %" for kind in shown), *(["both engines %", "95 %", "differ"] * both)]
    first = ("ω", *_hertz_heads(answer["responses"]), "expected")
    table = new_table("Further yields", *first, *heads, gap=1)
    for r in answer["responses"]:
        cells = [_percent((kinds[kind](r) or {}).get("rate")) for kind in shown]
        c = r.get("combined")
        if both and c is None:
            cells += ["-", "", ""]
        elif both:
            differ = c["disagreement"]
            cells += [
                _percent(c["estimate"]),
                _interval(c, r["yield"]),
                f"{differ['count']} of {differ['asked']}",
            ]
        hertz = _hertz(r, answer["responses"])
        add_row(table, f"{r['omega']:g}", *hertz, r["expected"] or "-", *cells)
    console.print(table)
    whole = answer.get("all_on_one_board") or {}
    said = [
        f"{kind.replace('built', 'as built')} {y['ok']} of {y['samples']}"
        for kind, y in whole.items()
        if y is not None
    ]
    if said:
        print_line(console, f"All on one board: {', '.join(said)}")


def _interval(ends: Mapping[str, Any], counted: Mapping[str, Any]) -> str:
    """Of a share in per cent; of all boards there are, which have none, how many they are."""
    if counted.get("census") and ends["low"] == ends["high"]:
        return f"all {counted['samples']}"
    return f"{100 * ends['low']:.0f}–{100 * ends['high']:.0f}"


def _percent(rate: float | None) -> str:
    return "-" if rate is None else f"{100 * rate:.1f}"


def simulated(answer: Mapping[str, Any]) -> None:
    """The responses on one engine."""
    head = f"Responses of the {answer['engine']}" if answer["engine"] != "ngspice" else "In ngspice"
    responses = answer["responses"]
    si = all("x1_max_m" in r for r in responses)
    table = new_table(
        head,
        "ω",
        *_hertz_heads(responses),
        "expected",
        "response",
        "symmetric",
        "x1 max",
        "x1 min",
        *(["x1 max (SI)", "x1 min (SI)"] if si else []),
        "twin",
        "others",
        gap=1,
    )
    for r in responses:
        add_row(
            table,
            f"{r['omega']:g}",
            *_hertz(r, responses),
            r["expected"] or "-",
            r["response"] + (" (not to be trusted)" if r["trust"]["trusted"] is False else ""),
            {True: "yes", False: "no", None: "-"}[r["symmetric"]],
            "-" if r["x1_max"] is None else f"{r['x1_max']:.6g}",
            "-" if r["x1_min"] is None else f"{r['x1_min']:.6g}",
            *(_metres(r[key]) for key in ("x1_max_m", "x1_min_m") if si),
            "-" if r["twin"] is None else r["twin"]["response"],
            ", ".join(o["response"] for o in r["others"]) or "-",
        )
    console = new_console()
    console.print(table)
    for r in answer["responses"]:
        if r["starts"] is not None:
            print_line(console, f"ω = {r['omega']:g}: {coexisting(r['starts'])}")
        if r["reason"]:
            print_line(console, f"ω = {r['omega']:g}: {r['response']}: {r['reason']}")
        for doubt in doubts({"this response": r.get("trust")}):
            print_line(console, f"ω = {r['omega']:g}: {doubt}")


def _hertz_heads(rows: Sequence[Mapping[str, Any]], key: str = "frequency_hz") -> list[str]:
    """The heading of the mechanism's frequency, where it is known."""
    return ["mechanism"] if rows and all(key in row for row in rows) else []


def _hertz(
    row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], key: str = "frequency_hz"
) -> list[str]:
    """Its cell in one of the rows."""
    return [value_text(row[key], "Hz") for _ in _hertz_heads(rows, key)]


def _metres(value: float | None) -> str:
    return "-" if value is None else value_text(value, "m")


def coexisting(starts: Mapping[str, Any]) -> str:
    """Where the starts that were drawn from a box end, the largest share first."""
    parts = []
    for a in sorted(starts["attractors"], key=lambda a: -a["share"]):
        name = a["response"] + (" (with its twin)" if a["on_twin"] is not None else "")
        parts.append(f"{name} {_share(a)}")
    if starts["not_settled"]["count"]:
        parts.append(f"not settled {_share(starts['not_settled'])}")
    box = ", ".join(f"{name} ± {half:.3g}" for name, half in starts["box"].items())
    count = str(starts["count"])
    if starts["count"] < starts["asked"]:
        count += f" (of {starts['asked']}: the others would take too many steps)"
    return f"of {count} starts at drive phase 0 in the box {box}: {'; '.join(parts)}"


def _share(counted: Mapping[str, Any]) -> str:
    """With its 95 % interval."""
    low, high = 100 * counted["low"], 100 * counted["high"]
    return f"{100 * counted['share']:.3g} % ({low:.3g} to {high:.3g})"


def compared(answer: Mapping[str, Any]) -> None:
    """The design beside the paper's."""
    console = new_console()
    head, *rest = compare_table.rows(answer)
    table = new_table("Side by side", *head)
    for cells in rest:
        add_row(table, *cells)
    console.print(table)
    for note in compare_table.notes(answer):
        print_line(console, note)


def pictures(folder: Path, names: Sequence[str]) -> None:
    """Where the pictures are."""
    said = f"{len(names)} pictures written, such as {names[0]}" if names else "no orbit to draw"
    print_line(new_console(), f"{folder}: {said}")


def checks(name: str, measured: Sequence[FigureCheck]) -> None:
    """An op-amp's figures, by the catalogue and by its model in ngspice."""
    table = new_table(f"{name} in ngspice", "figure", "catalogue", "measured", "")
    for row in measured:
        add_row(
            table,
            row.figure + (" (assumed)" if row.assumed else ""),
            format_quantity(row.expected, row.unit),
            format_quantity(row.measured, row.unit),
            "" if row.agrees else f"differ by more than {100 * row.tolerance:g} %",
        )
    new_console().print(table)


def catalog(held: Catalog) -> None:
    """What can be bought."""
    console = new_console()
    table = new_table("Families", "name", "kind", "series", "range", "grade", "price class")
    for family in held.families:
        unit = "Ω" if family.kind == "resistor" else "F"
        low, high = (format_quantity(end, unit) for end in family.range)
        add_row(
            table,
            family.name,
            family.kind,
            " ".join(family.series),
            f"{low} to {high}",
            f"{100 * family.grade:g} %",
            str(family.price),
        )
    console.print(table)
    table = new_table("Op-amps", "name", "sections", "saturation", "gain-bandwidth", "price class")
    for opamp in held.opamps:
        add_row(
            table,
            opamp.name,
            str(opamp.sections),
            f"{opamp.saturation.nominal:g} V at ± {opamp.rated_supply:g} V",
            format_quantity(opamp.gbw.nominal, "Hz"),
            str(opamp.price),
        )
    console.print(table)
    for what, names in (
        ("Diodes", [entry.name for entry in held.diodes]),
        ("References", [entry.name for entry in held.references]),
        ("Trimmers", [entry.name for entry in held.trimmers]),
        ("Headers", [entry.name for entry in held.headers]),
    ):
        print_line(console, f"{what}: {', '.join(names) or 'none'}")


def files(folder: Path, reused: bool) -> None:
    """Where the results are."""
    how = "was there already, from the same inputs" if reused else "written"
    print_line(new_console(), f"{folder}: {how}")


def doubts(trust: Mapping[str, Any]) -> list[str]:
    """A line for each result that is not to be trusted (``check.trust``), by what it is of."""
    return [
        f"{what} not to be trusted here: {'; '.join(said['reasons'])}"
        for what, said in trust.items()
        if said is not None and said["trusted"] is False
    ] + [
        f"{what} gave no answer: {'; '.join(said['reasons'])}"
        for what, said in trust.items()
        if said is not None and said["trusted"] is None and said["reasons"]
    ]


def _with_its_figures(row: Mapping[str, Any]) -> dict[str, Any]:
    """The trust of a study's response; ngspice's with the reason that has the figures."""
    said = dict(row.get("trust") or {})
    if said.get("ngspice") is not None and row.get("ngspice_reason"):
        said["ngspice"] = {**said["ngspice"], "reasons": [row["ngspice_reason"]]}
    return said


def new_console() -> Console:
    """On standard error; wide enough for a row where there is no terminal to ask."""
    return Console(stderr=True, width=None if sys.stderr.isatty() else 120)


def new_table(title: str, *columns: str, gap: int = 2) -> Table:
    """No lines, so that the longest fits into 80 columns."""
    table = Table(title=f"\n{title}", title_justify="left", box=None, padding=(0, gap, 0, 0))
    for column in columns:
        table.add_column(column)
    return table


def add_row(table: Table, *cells: str) -> None:
    table.add_row(*(Text(cell) for cell in cells))


def print_line(console: Console, text: str) -> None:
    console.print(Text(text), soft_wrap=True)


def _error(value: float) -> str:
    """A coefficient error in words: below 1e-12 it is rounding."""
    return f"{100 * value:.3g} %" if value >= 1e-12 else "0 to rounding"
