"""What the verbs answer, as tables for people on standard error."""

from __future__ import annotations

import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from designer.base.si_unit import value_text
from designer.base.units import format_quantity
from designer.cli.console import grid, say, table

YES_NO = {True: "yes", False: "no", None: "-"}


def run(answer: Mapping[str, Any]) -> None:
    """Parts and errors, then the responses."""
    synthesised(answer)
    tolerance(answer)


def synthesised(answer: Mapping[str, Any]) -> None:
    """The chosen parts, their error and the generator's settings."""
    equal: dict[tuple[str, float], list[str]] = defaultdict(list)
    for name, value in answer["parts"].items():
        equal[name[0], value].append(name)
    table(
        "Parts",
        (
            {
                "value": format_quantity(value, "F" if kind == "C" else "Ω"),
                "parts": " ".join(names),
            }
            for (kind, value), names in sorted(equal.items())
        ),
    )
    if answer.get("better_grades"):
        from designer.spread.part_grades import BetterGrade, better_grades_text

        better = {
            name: BetterGrade(g["asked"], g["bought"])
            for name, g in answer["better_grades"].items()
        }
        say(better_grades_text(better))
    certificate = answer["certificate"]
    say(
        f"Largest coefficient error {_error(answer['max_error'])} "
        f"({certificate['status']}, lower bound {_error(certificate['lower_bound'])}); "
        f"{answer['distinct_values']} distinct values"
    )
    if answer["knobs"]:
        rows = answer["knobs"]
        table(
            "Generator",
            (
                {
                    "ω": f"{r['omega']:g}",
                    **_mechanism(r, rows, "mechanism_hz"),
                    "expected": r["expected"] or "-",
                    "frequency": f"{r['frequency_hz']:.4g} Hz",
                    "amplitude (peak, high-Z)": f"{r['amplitude_v_peak']:.4g} V",
                }
                for r in rows
            ),
        )


def tolerance(answer: Mapping[str, Any]) -> None:
    """The responses on each engine, and their yields."""
    spread = (answer.get("provenance", {}).get("spread") or {}).get("name", "")
    of_file = f", spread of the {spread}" if spread == "model file" else ""
    rows = answer["responses"]
    table(
        f"Responses, {answer['samples']} samples{of_file}",
        (
            {
                **_response_cells(r, rows),
                "model": r["model"] if r["found"] else f"{r['model']} (not what is wanted)",
                "circuit": r["circuit"],
                "ngspice": r["ngspice"] or "-",
                **_counts(r),
            }
            for r in rows
        ),
        gap=1,
    )
    if answer.get("boards"):
        _boards(answer)
    for r in rows:
        for line in untrusted(_trust_with_figures(r)):
            say(f"ω = {r['omega']:g}: {line}")
    if answer.get("equation_check") is not None:
        from designer.spice.equation_check import EquationCheck

        problem = EquationCheck.read(answer["equation_check"]).problem
        if problem:
            say(problem)
    blame_status(answer)
    if answer.get("until") is not None:
        reached = "reached" if answer.get("narrow") else "NOT reached: some interval is wider"
        say(f"Intervals narrower than {100 * answer['until']:g} % of boards: {reached}")
    _further(answer)


def _counts(row: Mapping[str, Any]) -> dict[str, str]:
    """The yield of a response; of one that was left out, why."""
    y = row["yield"]
    if y is None:
        counted = ["-", row.get("left_out", ""), "", "", ""]
    else:
        lost = [str(y[k]) for k in ("lost", "grazing", "failed")]
        counted = [_percent(row["rate"]), _interval(y, y), *lost]
    return dict(zip(("yield %", "95 %", "lost", "grazing", "failed"), counted, strict=True))


def _boards(answer: Mapping[str, Any]) -> None:
    """One row for each measured board, where the study is of all of them."""
    boards = answer["boards"]
    heads = [f"{r['omega']:g} {r['expected'] or '-'}" for r in answer["responses"]]
    rows = ([b["board"], *(cell or "-" for cell in b["cells"]), b["all"] or "-"] for b in boards)
    grid(f"All {len(boards)} boards", ["board", *heads, "all of them"], rows, gap=1)


def blame_status(answer: Mapping[str, Any]) -> None:
    """One line about a blame that is not whole; none where it is."""
    status = answer.get("blame") or {}
    if status.get("reason"):
        say(f"Blame {status['status']}: {status['reason']}")


def _further(answer: Mapping[str, Any]) -> None:
    """The yields beside those as built, where there are any."""
    rows = answer["responses"]
    kinds: dict[str, Callable[[Mapping[str, Any]], Any]] = {
        "tuned %": lambda r: r.get("tuned"),
        "on the bench %": lambda r: (r.get("tuned") or {}).get("bench"),
        "trimmed %": lambda r: r.get("trimmed"),
        "reached %": lambda r: r.get("reached"),
    }
    kinds_present = {kind: of for kind, of in kinds.items() if any(of(r) for r in rows)}
    both = any(r.get("combined") for r in rows)
    if not kinds_present and not both:
        return
    table(
        "Further yields",
        (
            {
                **_response_cells(r, rows),
                **{kind: _decided(of(r) or {}) for kind, of in kinds_present.items()},
                **(_both_engines(r) if both else {}),
            }
            for r in rows
        ),
        gap=1,
    )
    joint = answer.get("all_on_one_board") or {}
    counts = [
        f"{kind.replace('built', 'as built')} {y['ok']} of {y['samples']}"
        for kind, y in joint.items()
        if y is not None
    ]
    if counts:
        say(f"All on one board: {', '.join(counts)}")


def _both_engines(row: Mapping[str, Any]) -> dict[str, str]:
    both, cells = row.get("combined"), ["-", "", ""]
    if both is not None:
        differ = both["disagreement"]
        cells = [
            _percent(both["estimate"]),
            _interval(both, row["yield"]),
            f"{differ['count']} of {differ['asked']}",
        ]
    return dict(zip(("both engines %", "95 %", "differ"), cells, strict=True))


def simulated(answer: Mapping[str, Any]) -> None:
    """The responses on one engine."""
    head = f"Responses of the {answer['engine']}" if answer["engine"] != "ngspice" else "In ngspice"
    rows = answer["responses"]
    masses = answer.get("masses", ())
    table(
        head,
        (
            {
                **(_response_cells_in_si if masses else _response_cells)(r, rows),
                "response": r["response"]
                + (" (not to be trusted)" if r["trust"]["trusted"] is False else ""),
                "symmetric": YES_NO[r["symmetric"]],
                **_reach(r, rows, masses),
                "twin": "-" if r["twin"] is None else r["twin"]["response"],
                "others": ", ".join(o["response"] for o in r["others"]) or "-",
            }
            for r in rows
        ),
        gap=1,
    )
    in_si = bool(masses) and all("frequency_hz" in r for r in rows)
    for r in rows:
        place = f"ω = {r['omega']:g}{' rad/s' if in_si else ''}"
        if r["starts"] is not None:
            say(f"{place}: {coexisting(r['starts'], masses, in_si=in_si)}")
        if r["reason"]:
            say(f"{place}: {r['response']}: {r['reason']}")
        if r["lyapunov_error"] is not None:
            growth = f"{r['lyapunov']:.4g} ± {r['lyapunov_error']:.1g}{' 1/s' if in_si else ''}"
            say(f"{place}: largest exponent {growth} (standard error)")
        for line in untrusted({"this response": r.get("trust")}):
            say(f"{place}: {line}")


def _reach(
    row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], masses: Sequence[str]
) -> dict[str, str]:
    """How far the masses go: the first one, or each of those that have names."""
    in_si = "frequency_hz" in rows[0]
    cells = {}
    for i, name in enumerate(masses):
        ends = () if row["x_max"] is None else (row["x_min"][i], row["x_max"][i])
        ends_text = (value_text(x, "m") if in_si else f"{x:.6g}" for x in ends)
        cells[f"x{i + 1} ({name})"] = " to ".join(ends_text) or "-"
    if masses:
        return cells
    si = {"x1 max (SI)": "x1_max_m", "x1 min (SI)": "x1_min_m"} if in_si else {}
    for head, key in {"x1 max": "x1_max", "x1 min": "x1_min"}.items():
        cells[head] = "-" if row[key] is None else f"{row[key]:.6g}"
    for head, key in si.items():
        cells[head] = "-" if row[key] is None else value_text(row[key], "m")
    return cells


def coexisting(
    starts: Mapping[str, Any], masses: Sequence[str] = (), *, in_si: bool = False
) -> str:
    """Where the starts that were drawn from a box end, the largest share first.

    masses : their names, if they have some. in_si : whether numbers are SI values.
    """

    def text(value: float, unit: str, digits: int = 4) -> str:
        return value_text(value, unit, digits) if in_si else f"{value:.{digits}g}"

    parts = []
    names = Counter(a["response"] for a in starts["attractors"])
    for a in sorted(starts["attractors"], key=lambda a: -a["share"]):
        name = a["response"] + (" (with its twin)" if a["on_twin"] is not None else "")
        if names[a["response"]] > 1 and a["x1_min"] is not None:
            name += f" (x1 {text(a['x1_min'], 'm')} to {text(a['x1_max'], 'm')})"
        parts.append(f"{name} {_share(a)}")
    if starts["not_settled"]["count"]:
        parts.append(f"not settled {_share(starts['not_settled'])}")
    named = {f"x{i + 1}": f" ({mass})" for i, mass in enumerate(masses)}
    box = starts["box"].items()
    units = {x: "m/s" if x.endswith("'") else "m" for x, _ in box}
    halves = ", ".join(f"{x}{named.get(x, '')} ± {text(half, units[x], 3)}" for x, half in box)
    count = str(starts["count"])
    if starts["count"] < starts["asked"]:
        count += f" (of {starts['asked']}: the others would take too many steps)"
    return f"of {count} starts at drive phase 0 in the box {halves}: {'; '.join(parts)}"


def compared(answer: Mapping[str, Any]) -> None:
    """The design beside the paper's."""
    from designer.report import compare_table

    heads, *rows = compare_table.rows(answer)
    grid("Side by side", heads, rows)
    for note in compare_table.notes(answer):
        say(note)


def searched(answer: Mapping[str, Any]) -> None:
    """A run; then the responses at their places, what limits them, what each lever is worth."""
    run(answer)
    search = answer["search"]
    pairs = zip(search["final"]["responses"], answer["confirmation"]["responses"], strict=True)
    places = [(place["expected"] or "any", place, confirmed) for place, confirmed in pairs]
    table(
        "Places",
        (
            {
                "response": name,
                "ω": f"{place['omega']:.5g}",
                "b": f"{place['b']:.4g}",
                "distance": _sigmas(place["distance"]),
                "predicted": f"{place['predicted_yield']:.4f}",
                "confirmed": f"{confirmed['agreed']}/{confirmed['asked']}",
            }
            for name, place, confirmed in places
        ),
        gap=1,
    )
    for name, _, confirmed in places:
        if confirmed["limited_by"]:
            say(f"{name} is limited by {confirmed['limited_by']['line']}")
    if search["contributions"]:
        table(
            "Levers: smallest distance",
            (
                {
                    **{key: lever[key] for key in ("lever", "from", "to")},
                    **{k: _sigmas(lever[k]["smallest_distance"]) for k in ("alone", "without")},
                }
                for lever in search["contributions"]
            ),
            gap=1,
        )


def cured(answer: Mapping[str, Any]) -> None:
    """The upgrades of a cure."""
    from designer.centering import cure_table

    print(cure_table.text(answer), file=sys.stderr)


def traded(answer: Mapping[str, Any]) -> None:
    """Time and error of every rung."""
    from designer.fidelity.trade_files import sheet

    print(sheet(answer), file=sys.stderr)


def rules(answer: Mapping[str, Any]) -> None:
    """Every rule with its figure and what was found; then what to do about those that fail."""
    from designer.catalog.design_rule import FAIL, NOT_RUN, PASS

    rows = answer["rules"]
    table(
        "Design rules",
        (
            {
                "rule": r["id"],
                "status": r["status"],
                "figure": r["title"],
                "found": r["found"],
                "limit": r["limit"] + (" (model file)" if r["reason"] else ""),
            }
            for r in rows
            if r["status"] != NOT_RUN
        ),
    )
    for r in rows:
        if r["reason"]:
            say(f"{r['id']}: the model file's limit, because: {r['reason']}")
    for r in rows:
        if r["status"] == FAIL:
            say(f"{r['id']} fails: {r['do']}")
    count = answer["counts"]
    say(f"{count[PASS]} pass, {count[FAIL]} fail, {count[NOT_RUN]} not run")
    idle: dict[str, list[str]] = defaultdict(list)
    for r in rows:
        if r["status"] == NOT_RUN:
            idle[r["found"]].append(r["id"])
    if idle:
        say("Not run is no pass. Rules that were not looked at:")
    for why, ids in idle.items():
        say(f"  {why}: {', '.join(ids)}")


def benched(answer: Mapping[str, Any]) -> None:
    """What each record shows; then what is not sure, and what would tell."""
    rows = answer["records"]
    table(
        "Records",
        (
            {
                "record": r["file"],
                "ω": f"{r['omega']:.4g}",
                "drive": f"{r['frequency_hz']:.5g} Hz",
                "shows": r["response"],
                "sure": YES_NO[r["sure"]],
                "wanted there": r["wanted"] or "-",
                "exact circuit": (r["exact_circuit"] or {}).get("response", "-"),
            }
            for r in rows
        ),
    )
    for r in rows:
        if r["others"]:
            say(f"{r['file']}: {r['response']}, or {' or '.join(r['others'])}")
        if r["reason"]:
            say(f"{r['file']}: not sure, for {r['reason']}. What would tell: {r['would_tell']}.")
    for board in answer["boards"]:
        _fitted(board)
    for kind in answer["spread"]:
        say(
            f"{kind['kind']} differ by {kind['factor']:.2g} times what [spread] says "
            f"({kind['low']:.2g} to {kind['high']:.2g})"
        )


def _fitted(board: Mapping[str, Any]) -> None:
    """What the records tell of a board, and what to turn on it."""
    of = f" {board['board']}" if board["board"] else ""
    if board["reason"]:
        say(f"The board{of} was not found: {board['reason']}")
        return
    rows = (
        {
            "figure": f["name"],
            "unit": f["unit"],
            "this board": f"{f['value']:.5g}",
            "95 %": f"{f['low']:.5g} to {f['high']:.5g}",
            "nominal": f"{f['nominal']:.5g}",
        }
        for f in board["figures"]
    )
    table(f"The board{of}, as its records tell it", rows)
    advised = (
        {
            "wanted": a["expected"],
            "ω": f"{a['omega']:.4g}",
            "shows as set": next(iter(a["shown"])),
            "advice": a["words"],
            "then, % of boards": f"{100 * a['share']:.0f}",
        }
        for a in board["advice"]
    )
    table("What to turn", advised)
    if board["doubtful"]:
        say(
            f"The records differ from the board that was found by {board['misfit']:.1f} times what "
            "noise explains: it may not be one of this spread, or the generator was set otherwise."
        )


def pictures(folder: Path, names: Sequence[str]) -> None:
    """Where the pictures are."""
    written = f"{len(names)} pictures written, such as {names[0]}" if names else "no orbit to draw"
    say(f"{folder}: {written}")


def files(folder: Path, reused: bool) -> None:
    """Where the results are."""
    how = "was there already, from the same inputs" if reused else "written"
    say(f"{folder}: {how}")


def exported(folder: Path, reused: bool, refused: Sequence[str], answer: Mapping[str, Any]) -> None:
    """Where the files are and how a board was routed, or why an order is refused."""
    if refused:
        say("\n".join(["No order is written, since the board is not finished:", *refused]))
    elif "routing" not in answer:
        files(folder, reused)
    if "dsn" in answer:
        say(f"{answer['dsn']}: the board for another router")
    if (routing := answer.get("routing")) is not None:
        say(
            f"{folder / routing['board']}: {routing['length_mm']:.0f} mm of track and "
            f"{routing['vias']} vias laid"
        )
        for net, count in routing["open"].items():
            say(f"no way was found on {net}: {count} connections stay open")


def untrusted(trust: Mapping[str, Any]) -> list[str]:
    """A line for each result that is not to be trusted (``check.trust``), by what it is of."""
    results = {quantity: result for quantity, result in trust.items() if result is not None}
    return [
        f"{quantity} not to be trusted here: {'; '.join(result['reasons'])}"
        for quantity, result in results.items()
        if result["trusted"] is False
    ] + [
        f"{quantity} gave no answer: {'; '.join(result['reasons'])}"
        for quantity, result in results.items()
        if result["trusted"] is None and result["reasons"]
    ]


def _trust_with_figures(row: Mapping[str, Any]) -> dict[str, Any]:
    """The trust of a study's response; ngspice's with the reason that has the figures."""
    trust = dict(row.get("trust") or {})
    if trust.get("ngspice") is not None and row.get("ngspice_reason"):
        trust["ngspice"] = {**trust["ngspice"], "reasons": [row["ngspice_reason"]]}
    return trust


def _response_cells(row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """The first cells of a response: its frequency and the wanted n-p-q."""
    return {
        "ω": f"{row['omega']:g}",
        **_mechanism(row, rows, "frequency_hz"),
        "expected": row["expected"] or "-",
    }


def _response_cells_in_si(
    row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]
) -> dict[str, str]:
    """The same cells for a model whose plain numbers are SI values, where it has any."""
    cells = _response_cells(row, rows)
    if "mechanism" not in cells:
        return cells
    return {"ω [rad/s]": cells["ω"], "frequency": cells["mechanism"], "expected": cells["expected"]}


def _mechanism(
    row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], key: str
) -> dict[str, str]:
    """The mechanism's frequency, where all rows have it."""
    return {"mechanism": value_text(row[key], "Hz")} if all(key in r for r in rows) else {}


def _interval(ends: Mapping[str, Any], counted: Mapping[str, Any]) -> str:
    """Of a share in per cent; of all boards there are, which have none, how many they are."""
    if counted.get("census") and ends["low"] == ends["high"]:
        return f"all {counted['samples']}"
    return f"{100 * ends['low']:.0f}–{100 * ends['high']:.0f}"


def _share(counted: Mapping[str, Any]) -> str:
    """With its 95 % interval."""
    low, high = 100 * counted["low"], 100 * counted["high"]
    return f"{100 * counted['share']:.3g} % ({low:.3g} to {high:.3g})"


def _percent(rate: float | None) -> str:
    return "-" if rate is None else f"{100 * rate:.1f}"


def _decided(counted: Mapping[str, Any]) -> str:
    """A yield, and how many boards had no answer, if any."""
    failed = counted.get("failed")
    return _percent(counted.get("rate")) + (f" ({failed} failed)" if failed else "")


def _sigmas(distance: float | None) -> str:
    return "-" if distance is None else f"{distance:.2f} σ"


def _error(value: float) -> str:
    """A coefficient error; below 1e-12 it is rounding."""
    return f"{100 * value:.3g} %" if value >= 1e-12 else "0 to rounding"
