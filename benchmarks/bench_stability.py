"""Until it breaks, and what the user is told there: writes reports/stability/.

The exact flow along each axis of the model against 40-digit arithmetic, ngspice on the tool's own
designs at the ends of the domain, and synthesis at the ends of the catalogue. Each piece is kept as
soon as it is done; a run that was interrupted goes on.
"""

from __future__ import annotations

import math
import os
import textwrap
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

from benchmarks import stability_flow, stability_spice
from benchmarks.bench_flow import commit, machine, table
from benchmarks.stability_flow import SHOWN, by_axis, ratio, trusted
from benchmarks.stability_pictures import flow_picture, spice_picture
from designer.base.plain_json import dumps, plain
from designer.base.report_pieces import CaseStore
from designer.dynamics.orbit import OrbitStatus
from designer.spice.pool import SpicePool

ROOT = Path(__file__).parent.parent
REPORT = ROOT / "reports" / "stability"
FILES = ("README.md", "stability.json", "flow.png", "flow.svg", "ngspice.png", "ngspice.svg")
KEY = "2"
"""Of the pieces: another one where scenes or measures change."""
Row = Mapping[str, Any]


def measure(folder: Path) -> dict[str, list[dict[str, Any]]]:
    """All pieces; those that are in the folder already are taken as they are."""
    begun = (folder / "cases").is_dir()
    store = CaseStore(folder, FILES, resume=begun, place="the folder", note=print)
    store.expect(KEY)
    flow = [
        store.piece(s.name, lambda s=s: plain(stability_flow.measure(s)))  # type: ignore[misc]
        for s in stability_flow.scenes()
    ]
    with SpicePool(1) as pool:
        spice = [
            store.piece(c.name, lambda c=c: plain(stability_spice.measure(c, pool)))  # type: ignore[misc]
            for c in stability_spice.cases()
        ]
    edges = [
        store.piece(c.name, lambda c=c: plain(stability_spice.synthesis_only(c)))  # type: ignore[misc]
        for c in stability_spice.edges()
    ]
    return {"flow": flow, "spice": spice, "edges": edges}


# ---------------------------------------------------------------------------------------------
# The exact flow


def flow_summary(rows: Sequence[Row]) -> Iterator[list[str]]:
    """A line of the first table for each axis."""
    for axis, of in by_axis(rows).items():
        fine = []
        for row in of:
            if not trusted(row):
                break
            fine.append(row)
        first = next((r for r in of if not trusted(r)), None)
        largest = max((r["error"] for r in fine if r.get("error") is not None), default=None)
        yield [
            f"exact flow, {SHOWN.get(axis, axis)}",
            f"{fine[-1]['value']:.1g}" if fine else "nowhere",
            "the end of what was tried"
            if first is None
            else f"{first['value']:.1g}: {_short(first.get('trust') or first['said'])}",
            "–" if largest is None else f"state right to {_up(largest)}",
        ]


def flow_table(rows: Sequence[Row]) -> list[str]:
    header = ["axis", "value", "kernel", "impacts", "magnification", "error", "of rounding"]
    header += ["general kernel", "bound / error, 1 period", "from rest", "trusted"]
    body = []
    for row in rows:
        own, general = ratio(row), ratio(row, "general_error")
        known = row.get("first_error") and row["bound"]
        body.append(
            [
                SHOWN.get(row["axis"], row["axis"]),
                f"{row['value']:.2g}",
                row["kernel"],
                _text(row.get("impacts"), "d"),
                _text(row.get("magnification"), ".1e"),
                _text(row.get("error"), ".1e"),
                _text(own, ".2g"),
                _text(general, ".2g"),
                _text(row["bound"] / row["first_error"] if known else None, ".2g"),
                row.get("response", "not asked"),
                _trusted(row),
            ]
        )
    return table(header, body)


# ---------------------------------------------------------------------------------------------
# ngspice and synthesis


def spice_summary(rows: Sequence[Row]) -> Iterator[list[str]]:
    for axis, of in by_axis(rows).items():
        for fidelity in dict.fromkeys(r for row in of for r in row.get("rungs", {})):
            asked = [row for row in of if fidelity in row.get("rungs", {})]
            fine = [row for row in asked if row["rungs"][fidelity]["passed"]]
            bad = [row for row in asked if not row["rungs"][fidelity]["passed"]]
            waves = [row["rungs"][fidelity]["rms"] for row in fine]
            worst = max((wave for wave in waves if wave is not None), default=None)
            yield [
                f"ngspice {fidelity}, {axis}",
                ", ".join(f"{row['value']:g}" for row in fine) or "nowhere",
                "; ".join(f"{r['value']:g}: {r['rungs'][fidelity]['why']}" for r in bad)
                or "nothing",
                "–" if worst is None else f"wave right to {_up(worst)} of the peak (RMS)",
            ]


def edge_summary(rows: Sequence[Row]) -> Iterator[list[str]]:
    for axis, of in by_axis(rows).items():
        fine = [row for row in of if "refused" not in row]
        worst = max((row["max_error"] for row in fine), default=None)
        yield [
            f"synthesis, {axis.removeprefix('edge ')}",
            ", ".join(f"{row['value']:g}" for row in fine) or "nowhere",
            ", ".join(f"{row['value']:g}" for row in of if "refused" in row) or "nothing",
            "–" if worst is None else f"coefficients right to {100 * worst:.2g} %",
        ]


def spice_table(rows: Sequence[Row]) -> list[str]:
    header = ["design", "threshold", "model", "exact circuit", "rung", "ngspice", "gate"]
    header += ["steps a period", "remedies", "strobes differ", "RMS", "equation"]
    body = []
    for row in rows:
        if "refused" in row:
            body.append([f"{row['axis']} {row['value']:g}", *["–"] * 10, "refused"])
            continue
        for fidelity, said in row["rungs"].items():
            equation = row["equation"]
            body.append(
                [
                    f"{row['axis']} {row['value']:g}",
                    _text(row["threshold"], ".3g") + " V",
                    row["model"],
                    row["circuit"],
                    fidelity,
                    said["response"],
                    "passed" if said["passed"] else "not passed",
                    _text(said["steps_a_period"], "d"),
                    ", ".join(said["remedies"]) or "none",
                    _text(said["difference"], ".1e"),
                    _text(said["rms"], ".1e"),
                    "yes" if equation["passed"] else equation["worst"],
                ]
            )
    return table(header, body)


def board_lines(rows: Sequence[Row]) -> list[str]:
    out = []
    for row in rows:
        boards = row.get("boards")
        if boards is None:
            continue
        same = sum(a == b for a, b in zip(boards["asked"], boards["ngspice"], strict=True))
        rms = f"; RMS of the wave at most {_up(boards['rms'][-1])}" if boards["rms"] else ""
        shown = ", ".join(f"{r} ({n})" for r, n in Counter(boards["exact"]).most_common())
        out.append(
            f"- {100 * row['value']:g} %: {len(boards['exact'])} boards show "
            f"{shown} on the exact circuit; of the {len(boards['asked'])} "
            f"with a period ngspice calls {same} the same{rms}; remedies: "
            f"{', '.join(boards['remedies']) or 'none'}."
        )
    return out


def edge_table(rows: Sequence[Row]) -> list[str]:
    header = ["coefficient or range", "largest error", "certificate", "costs", "CPU", "or refused"]
    body = [
        [
            f"{row['axis'].removeprefix('edge ')} {row['value']:g}",
            "–" if "refused" in row else f"{100 * row['max_error']:.2g} %",
            row.get("certificate", "–"),
            ", ".join(row.get("binding", {})) or "–",
            f"{row['cost']['seconds']:.1f} s",
            row.get("refused", "").replace("|", "/") or "–",
        ]
        for row in rows
    ]
    return table(header, body)


# ---------------------------------------------------------------------------------------------


def report(pieces: Mapping[str, Sequence[Row]], seconds: float) -> str:
    """README.md."""
    flow, spice, edges = (pieces[k] for k in ("flow", "spice", "edges"))
    first = [*flow_summary(flow), *spice_summary(spice), *edge_summary(edges)]
    ratios = sorted(r for row in flow if (r := ratio(row)))
    bounds = [row["bound"] / row["first_error"] for row in flow if row.get("first_error")]
    wrong = [r for r in flow if r.get("counts_agree") is False]
    doubted = [r for r in flow if not trusted(r)]
    agree = sum(r.get("counts_agree") is True for r in flow)
    lines = [
        "# Until it breaks, and what the user is told there",
        "",
        _filled(
            "Made by `python -m benchmarks stability`; pieces that stand in `cases/` are taken as "
            "they are, so take the folder away to measure anew. What *not to be trusted here* "
            "means, and how it is found out, is in [docs/stability.md](../../docs/stability.md)."
        ),
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}",
        f"- Took {seconds:.0f} s, at a load of {os.getloadavg()[2]:.1f} in the last 15 minutes.",
        "",
        "## What breaks where",
        "",
        _filled(
            "Each axis goes outwards from the paper's case. *Trusted* is, for the exact flow, the "
            "last value before the tool says that its answer is not to be trusted; for ngspice and "
            "synthesis, the values with an answer."
        ),
        "",
        *table(["what", "trusted", "what breaks, and where", "how good until then"], first),
        "",
        "## The exact flow",
        "",
        _filled(
            f"The state after {stability_flow.PERIODS} periods (one at low ω, 20 at high) from a "
            "start in the open zone, against 40-digit arithmetic. *Magnification* is the largest "
            "factor by which the flow enlarges a rounding error between two moments of the run; "
            "*of rounding* is the error over that and 2⁻⁵³: near 1 the state is as good as double "
            f"precision allows. In the median it is {ratios[len(ratios) // 2]:.1f}, at most "
            f"{ratios[-1]:.0f}. Impacts are counted as in 40 digits in {agree} of "
            f"{sum('counts_agree' in r for r in flow)} scenes. The bound that the tool states is "
            f"{min(bounds):.2g} to {max(bounds):.2g} times the true error of the first period. "
            f"{len(doubted)} of {len(flow)} scenes are called not to be trusted. Where there is no "
            f"error the reference gave up after {stability_flow.MOST} mode changes. *From rest* is "
            "what the start from rest leads to; it is not asked where that takes minutes. Where it "
            "has not settled there is no answer to trust, but *a period* from the given start is."
        ),
        "",
        *(f"Wrong counts at {r['axis']} {r['value']:g}." for r in wrong),
        "",
        "![Error over magnification](flow.png)",
        "",
        *flow_table(flow),
        "",
        *(
            f"- {SHOWN.get(r['axis'], r['axis'])} {r['value']:.2g}: {r.get('trust') or r['said']}"
            for r in doubted
        ),
        "",
        "## ngspice",
        "",
        _filled(
            "Designs of the tool itself, E12 resistors and E6 capacitors; side conditions of swing "
            "and load, with resistors up to 10 kΩ of swing alone, with the large clearance of "
            "swing and level. One response each on the nominal board, from the exact circuit's "
            f"orbit, behind the numerics gate (at most {stability_spice.LEVELS} of its step sizes "
            "above the rung `ideal`). The axis k0 has one stop, ζ = 0.2, b = 0.5 and ω = 0.9, "
            "where every stiffness shows 1-1-0; the largest clearance has k0 = 0.99 and ω = 0.72. "
            "*Strobes differ* and *RMS* are of the peak of each "
            "state, RMS against the exact circuit; on `dynamic` and `full` part of it is the "
            "op-amps' bandwidth, which the exact circuit does not have."
        ),
        "",
        "![Distance from the exact circuit](ngspice.png)",
        "",
        *spice_table(spice),
        "",
        *(f"- {r['axis']} {r['value']:g}: {r['refused']}" for r in spice if "refused" in r),
        *(f"- {r['axis']} {r['value']:g}: {d}" for r in spice if (d := r.get("circuit_trust"))),
        "",
        "Boards of a wide spread, each from its own orbit:",
        "",
        *board_lines(spice),
        "",
        "## Synthesis at the edges",
        "",
        _filled(
            "Of the paper's case one figure at a time, side conditions of swing and load. *Costs* "
            "names those without which the match would be better."
        ),
        "",
        *edge_table(edges),
    ]
    return "\n".join(lines) + "\n"


def _trusted(row: Row) -> str:
    """From rest there may be no answer to trust, where a period of its own start has one."""
    open_ = row.get("response") in (OrbitStatus.NOT_SETTLED, OrbitStatus.DIVERGED)
    return ("a period" if open_ else "yes") if trusted(row) else "no"


def _short(reason: str) -> str:
    """Its first clause."""
    return reason.removeprefix("not to be trusted here: ").split(",")[0]


def _up(value: float) -> str:
    """To one figure, never less than it is."""
    if value == 0.0:
        return "0"
    power = math.floor(math.log10(value))
    return f"{math.ceil(value / 10.0**power - 1e-9) * 10.0**power:.1g}"


def _filled(text: str) -> str:
    return textwrap.fill(text, 100, break_long_words=False, break_on_hyphens=False)


def write(folder: Path, pieces: Mapping[str, Sequence[Row]], seconds: float) -> None:
    """README.md, stability.json and the pictures in a folder."""
    text = report(pieces, seconds)
    (folder / "README.md").write_text(text, encoding="utf-8")
    data = {"format": 1, "commit": commit(), "machine": machine(), **pieces}
    data["cost"] = {"seconds": seconds}
    (folder / "stability.json").write_text(dumps(data), encoding="utf-8")
    pictures = {"flow": flow_picture(pieces["flow"]), "ngspice": spice_picture(pieces["spice"])}
    for name, figure in pictures.items():
        with mpl.rc_context({"svg.hashsalt": "stability", "svg.fonttype": "none"}):
            figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
        figure.savefig(folder / f"{name}.png", dpi=110)


def main() -> str:
    """Measure what is missing, write reports/stability/; returns a line of figures."""
    began = time.perf_counter()
    pieces = measure(REPORT)
    write(REPORT, pieces, time.perf_counter() - began)
    doubted = sum(not trusted(row) for row in pieces["flow"])
    return f"{doubted} of {len(pieces['flow'])} scenes of the exact flow are not to be trusted"


def _text(value: float | int | None, form: str) -> str:
    return "–" if value is None else format(value, form)


if __name__ == "__main__":
    print(main())
