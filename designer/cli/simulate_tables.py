"""What ``simulate`` answers, as a table and lines for people on standard error."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from designer.base.si_unit import value_text
from designer.cli.console import say, table
from designer.cli.tables import YES_NO, response_cells, untrusted


def simulated(answer: Mapping[str, Any]) -> None:
    """The responses on one engine."""
    head = f"Responses of the {answer['engine']}" if answer["engine"] != "ngspice" else "In ngspice"
    rows = answer["responses"]
    masses = answer.get("masses", ())
    table(
        head,
        (
            {
                **(_response_cells_in_si if masses else response_cells)(r, rows),
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
    if any("base_amplitude" in r for r in rows):
        from_base = [_from_base(r, masses, in_si=in_si) for r in rows]
        table("Displacements from the base", from_base, gap=1)
    for r in rows:
        place = _place(r, in_si=in_si)
        if r["starts"] is not None:
            say(f"{place}: {coexisting(r['starts'], masses, in_si=in_si)}")
        if r["reason"]:
            say(f"{place}: {r['response']}: {r['reason']}")
        if r["frequencies"] is not None:
            say(f"{place}: {frequencies(r)}")
        for other in r["others"]:
            if other["frequencies"] is not None:
                say(f"{place}: of the others, {frequencies(other)}")
        if r["lyapunov_error"] is not None:
            growth = f"{r['lyapunov']:.4g} ± {r['lyapunov_error']:.1g}{' 1/s' if in_si else ''}"
            say(f"{place}: largest exponent {growth} (standard error)")
        for line in untrusted({"this response": r.get("trust")}):
            say(f"{place}: {line}")


def _place(row: Mapping[str, Any], *, in_si: bool) -> str:
    """The drive frequency that a response belongs to."""
    return value_text(row["frequency_hz"], "Hz", 6) if in_si else f"ω = {row['omega']:g}"


def _from_base(row: Mapping[str, Any], masses: Sequence[str], *, in_si: bool) -> dict[str, str]:
    """How far the masses go from a base that moves, and how far that goes."""
    lows, highs = row["from_base_min"], row["from_base_max"]
    cells = {"at": _place(row, in_si=in_si), "response": row["response"]}
    for i, name in enumerate(masses):
        ends = () if lows is None else (lows[i], highs[i])
        cells[f"x{i + 1} − y ({name})"] = _between(ends, in_si=in_si)
    y = row["base_amplitude"]
    return {**cells, "y (base)": f"± {value_text(y, 'm') if in_si else format(y, '.6g')}"}


def _between(ends: Sequence[float], *, in_si: bool) -> str:
    return " to ".join(value_text(x, "m") if in_si else f"{x:.6g}" for x in ends) or "-"


def frequencies(row: Mapping[str, Any]) -> str:
    """The two frequencies of a quasi-periodic motion, and their ratio."""
    drive, second = row["frequencies"]
    in_hertz = row.get("frequencies_hz")
    if in_hertz is None:
        pair = f"ω {drive:.6g} of the drive and {second:.7g}"
    else:
        first, other = value_text(in_hertz[0], "Hz"), value_text(in_hertz[1], "Hz", 7)
        pair = f"{first} of the drive and {other}"
    return f"quasi-periodic with the frequencies {pair}, {second / drive:.7g} times the drive's"


def _reach(
    row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], masses: Sequence[str]
) -> dict[str, str]:
    """How far the masses go: the first one, or each of those that have names."""
    in_si = "frequency_hz" in rows[0]
    cells = {}
    for i, name in enumerate(masses):
        ends = () if row["x_max"] is None else (row["x_min"][i], row["x_max"][i])
        cells[f"x{i + 1} ({name})"] = _between(ends, in_si=in_si)
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


def _response_cells_in_si(
    row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]
) -> dict[str, str]:
    """The same cells for a model whose plain numbers are SI values, where it has any."""
    cells = response_cells(row, rows)
    if "mechanism" not in cells:
        return cells
    return {"frequency": cells["mechanism"], "expected": cells["expected"]}


def _share(counted: Mapping[str, Any]) -> str:
    """With its 95 % interval."""
    low, high = 100 * counted["low"], 100 * counted["high"]
    return f"{100 * counted['share']:.3g} % ({low:.3g} to {high:.3g})"
