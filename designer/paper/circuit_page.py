"""README.md of the report on the paper's circuit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from designer.circuit.coefficients import EXACT
from designer.paper.circuit_clock import BASE, CLAIM, PERIODS
from designer.paper.circuits import TITLES

Piece = Mapping[str, Any]
CIRCUIT = "ngspice, ideal op-amps"
"""What the paper's circuit is taken for in the claim, at the settings that pass the gate."""
BASES = (BASE, "Runge-Kutta, plain Python", "Runge-Kutta, numba", "SciPy RK45")


def readme(pieces: Mapping[str, Piece], command: str) -> str:
    """From the pieces by name, as ``reproduce_circuit`` keeps them."""
    circuits = [p for name, p in pieces.items() if name.startswith("circuit-")]
    offsets = [p for name, p in pieces.items() if name.startswith("offsets-")]
    clock, misprints = pieces["clock"], pieces["misprints"]["misprints"]
    lines = [
        "# The paper's Section 5, measured",
        "",
        f"Made by `{command}`; the data are in `circuit.json`, its pieces in `cases/`.",
        "",
        "Four circuits of the paper's model: its values as printed, the same corrected "
        "(docs/errata.md), and this tool's designs with the paper's saturating stage and with the "
        "rectifier stage, both of E96 and E12 parts on the op-amps' full range. Each is started on "
        "the model's own orbit. Errors are the RMS difference of x₁ from the model's over a drive "
        "period, in per cent of its peak.",
        "",
        "## In short",
        "",
        *(f"- {line}" for line in _short(circuits, misprints, offsets, clock)),
        "",
        "## Fig. 7: the nonlinear stage",
        "",
        "![DC curves of the nonlinear stages](fig7.png)",
        "",
        "Upper row: output over v₁. Lower row: what differs from Eq. (20), of the output at twice "
        "the threshold.",
        "",
        *_dc(circuits),
        "",
        "## Fig. 8: phase portraits",
        "",
        *_portraits(circuits),
        "",
    ]
    for one in circuits:
        lines += [f"![{one['title']}](fig8-{one['circuit']}.png)", ""]
    lines += [
        "## What each misprint would have cost",
        "",
        "Each alone in the corrected circuit, at the ω of Fig. 8; under an n-p-q that is kept "
        "stands its error. The coefficient error is the largest |ln(realised/wanted)| at the best "
        "scales; the generator's amplitude and frequency do not enter it.",
        "",
        "![n-p-q with each misprint](misprints.png)",
        "",
        *_misprints(misprints),
        "",
        "## What offsets do",
        "",
        "Every op-amp section at ± the same offset, all other parts exact, each response from the "
        f"nominal circuit's orbit: the share of sign patterns that keep it, of {_patterns(offsets)}"
        ". 95 % Wilson intervals stand in `circuit.json`.",
        "",
        "![Share of sign patterns that keep each response](offsets.png)",
        "",
        *_offsets(offsets),
        "",
        "## A third of the time?",
        "",
        "CPU time of a drive period on one core, all methods taking turns in "
        f"{clock['rounds']} rounds; ratios are taken within a round and their median is shown. "
        "The machine may have been busy: ratios hold better than times. Errors are against the "
        f"exact flow of the same equations after {PERIODS} drive periods; for the full op-amps "
        "that is what ideal ones leave out.",
        "",
        "![Error over time](times.png)",
        "",
        *_times(clock),
    ]
    return "\n".join(lines).rstrip() + "\n"


def _short(
    circuits: Sequence[Piece], misprints: Sequence[Piece], offsets: Sequence[Piece], clock: Piece
) -> list[str]:
    out = []
    for one in circuits:
        rows = one["responses"]
        kept = sum(r["kept"] for r in rows)
        spice = sum(r["ngspice_passed"] and r["ngspice"] == r["expected"] for r in rows)
        worst = max((r["error"] for r in rows if r["error"] is not None), default=None)
        out.append(
            f"{one['title']}: {kept} of {len(rows)} responses on the exact circuit, {spice} in "
            f"ngspice behind the gate; largest error {_percent(worst)}, largest coefficient error "
            f"{_percent(one['max_error'])}."
        )
    lost = [m["where"] for m in misprints if m.get("responses") and not all(_kept(m))]
    asked = sum(bool(m.get("responses")) for m in misprints)
    out.append(
        f"Of {asked} misprints that were put into the circuit alone, {len(lost)} change an n-p-q: "
        f"{'; '.join(lost) or 'none'}."
    )
    for one in offsets:
        rates = [_share(r["counted"]) for r in one["sizes"]["typical"] if r["there"]]
        if rates:
            out.append(
                f"{one['title']}, typical offsets: responses survive "
                f"{_percent(min(rates))} to {_percent(max(rates))} of the sign patterns."
            )
    bases = [m["name"] for m in clock["responses"][0]["methods"] if m["name"] in BASES]
    for base in bases:
        ratios = [f"{_two(_over(row, base))} at p = {row['p']}" for row in clock["responses"]]
        out.append(f"{CIRCUIT} over {base}: {', '.join(ratios)} (claimed: {CLAIM:.2g}).")
    return out


def _dc(circuits: Sequence[Piece]) -> list[str]:
    lines = [
        "| circuit | threshold | slope in contact | inside / in contact | ngspice less exact |",
        "|---|---|---|---|---|",
    ]
    for one in circuits:
        dc = one["dc"]
        lines.append(
            f"| {one['title']} | {1e3 * one['threshold']:.4g} mV | {dc['slope_contact']:.5g} | "
            f"{100.0 * dc['slope_inside'] / dc['slope_contact']:.3g} % | {dc['difference']:.1e} V |"
        )
    return lines


def _portraits(circuits: Sequence[Piece]) -> list[str]:
    lines = [
        "The exact circuit's n-p-q and error, then ngspice's with the steps of a period that "
        "passed the gate.",
        "",
        "| ω | wanted | " + " | ".join(one["title"] for one in circuits) + " |",
        "|---|---|" + "---|" * len(circuits),
    ]
    for rows in zip(*(one["responses"] for one in circuits), strict=True):
        cells = [
            f"{r['circuit']}, {_percent(r['error'])}; {r['ngspice'] or 'not run'}, "
            f"{_percent(r['ngspice_error'])} ({r['steps_a_period']}"
            + ("" if r["ngspice_passed"] else ", gate not passed")
            + ")"
            for r in rows
        ]
        lines.append(f"| {rows[0]['omega']:g} | {rows[0]['expected']} | {' | '.join(cells)} |")
    return lines


def _misprints(rows: Sequence[Piece]) -> list[str]:
    lines = [
        "| where | printed | must read | read as | coefficient error | in | responses kept |",
        "|---|---|---|---|---|---|---|",
    ]
    for m in rows:
        error, worst, kept = "", "", "reaches no part"
        if m["reaches"]:
            error = "a wrong sign" if m["max_error"] is None else _percent(m["max_error"])
            worst = m["worst"]
            kept = f"{sum(_kept(m))} of {len(_kept(m))}" if m["responses"] else "not run"
        cells = [m["where"], m["printed"], m["right"], m["note"], error, worst, kept]
        lines.append("| " + " | ".join(c.replace("|", "/") for c in cells) + " |")
    return lines


def _offsets(pieces: Sequence[Piece]) -> list[str]:
    first = next(iter(pieces[0]["sizes"].values()))
    lines = [
        "What the others show, the most frequent first:",
        "",
        "| circuit | offset | " + " | ".join(r["expected"] for r in first) + " |",
        "|---|---|" + "---|" * len(first),
    ]
    for one in pieces:
        for size in one["sizes"].values():
            cells = [
                ", ".join(f"{name} {count}" for name, count in r["to"][:3]) or "–" for r in size
            ]
            lines.append(
                f"| {TITLES[one['circuit']]} | {1e3 * size[0]['size']:g} mV | "
                + " | ".join(cells)
                + " |"
            )
    return lines


def _times(clock: Piece) -> list[str]:
    lines = []
    for row in clock["responses"]:
        lines += [
            f"ω = {row['omega']:g}, 1-{row['p']}-{row['p']}:",
            "",
            f"| method | setting | seconds | over {BASE} | RMS error |",
            "|---|---|---|---|---|",
        ]
        for m in row["methods"]:
            seconds, ratio, error = (
                "–" if m[k] is None else f"{m[k]:.2g}" for k in ("seconds", "ratio", "error")
            )
            error = "exact" if m["error"] == 0.0 else error
            lines.append(f"| {m['name']} | {m['setting']} | {seconds} | {ratio} | {error} |")
        lines.append("")
    return lines


def _over(row: Piece, base: str) -> float:
    """Time of the circuit over another method's; both were put over the same in each round."""
    ratio = {m["name"]: m["ratio"] for m in row["methods"]}
    return float("nan") if None in (ratio[CIRCUIT], ratio[base]) else ratio[CIRCUIT] / ratio[base]


def _two(value: float) -> str:
    """To two figures, without an exponent."""
    return f"{float(f'{value:.2g}'):.10g}"


def _kept(misprint: Piece) -> list[bool]:
    return [bool(r["kept"]) for r in misprint["responses"]]


def _share(counted: Piece) -> float:
    decided = sum(counted.values()) - counted["failed"]
    return float(counted["ok"] / decided) if decided else 0.0


def _patterns(pieces: Sequence[Piece]) -> str:
    most = max(
        sum(r["counted"].values()) for one in pieces for size in one["sizes"].values() for r in size
    )
    return f"{most} each, drawn where there are more"


def _percent(value: float | None) -> str:
    if value is None:
        return "–"
    return "0" if abs(value) <= EXACT else f"{100.0 * value:.3g} %"
