"""README.md of the report on the paper's circuit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from designer.base.page import Block, Items, Page, PageSection, Picture, SmallPrint, bullets, table
from designer.circuit.coefficients import EXACT
from designer.paper.circuit_clock import BASE, CLAIM, PERIODS
from designer.paper.circuits import TITLES

Piece = Mapping[str, Any]
CIRCUIT = "ngspice, ideal op-amps"
"""The paper's circuit as the claim is tested on it, at the settings that pass the gate."""
BASES = (BASE, "Runge-Kutta, plain Python", "Runge-Kutta, numba", "SciPy RK45")
NONE = "–"


def circuit_page(pieces: Mapping[str, Piece], command: str) -> Page:
    """From the pieces by name, as ``reproduce_circuit`` keeps them."""
    circuits = [p for name, p in pieces.items() if name.startswith("circuit-")]
    offsets = [p for name, p in pieces.items() if name.startswith("offsets-")]
    clock, misprints = pieces["clock"], pieces["misprints"]["misprints"]
    head = [
        Markup(f"Made by `{command}`; the data are in `circuit.json`, its pieces in `cases/`."),
        "Four circuits of the paper's model: its values as printed, the same corrected "
        "(docs/errata.md), and this tool's designs with the paper's saturating stage and with the "
        "rectifier stage, both of E96 and E12 parts on the op-amps' full range. Each is started on "
        "the model's own orbit. Errors are the RMS difference of x₁ from the model's over a drive "
        "period, in per cent of its peak.",
    ]
    sections = [
        PageSection("In short", [_short(circuits, misprints, offsets, clock)]),
        PageSection("Fig. 7: the nonlinear stage", _dc(circuits)),
        PageSection("Fig. 8: phase portraits", _portraits(circuits)),
        PageSection("What each misprint would have cost", _misprints(misprints)),
        PageSection("What offsets do", _offsets(offsets)),
        PageSection("A third of the time?", _times(clock)),
    ]
    return Page("The paper's Section 5, measured", head, sections)


def _short(
    circuits: Sequence[Piece], misprints: Sequence[Piece], offsets: Sequence[Piece], clock: Piece
) -> Items:
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
    run = [m for m in misprints if m.get("responses")]
    lost = [m["where"] for m in run if not all(r["kept"] for r in m["responses"])]
    out.append(
        f"Of {len(run)} misprints that were put into the circuit alone, {len(lost)} change an "
        f"n-p-q: {'; '.join(lost) or 'none'}."
    )
    for one in offsets:
        rates = [_share(r["counted"]) for r in one["sizes"]["typical"] if r["there"]]
        if rates:
            out.append(
                f"{one['title']}, typical offsets: responses survive "
                f"{_percent(min(rates))} to {_percent(max(rates))} of the sign patterns."
            )
    for base in BASES:
        ratios = [f"{_ratio(row, base)} at p = {row['p']}" for row in clock["responses"]]
        out.append(f"{CIRCUIT} over {base}: {', '.join(ratios)} (claimed: {CLAIM:.2g}).")
    return bullets(out)


def _dc(circuits: Sequence[Piece]) -> list[Block]:
    rows = []
    for one in circuits:
        dc = one["dc"]
        inside = f"{100.0 * dc['slope_inside'] / dc['slope_contact']:.3g} %"
        threshold, slope = f"{1e3 * one['threshold']:.4g} mV", f"{dc['slope_contact']:.5g}"
        rows.append((one["title"], threshold, slope, inside, f"{dc['difference']:.1e} V"))
    return [
        Picture(
            "DC curves of the nonlinear stages",
            "Upper row: output over v₁. Lower row: what differs from Eq. (20), of the output at "
            "twice the threshold.",
            "fig7.png",
        ),
        table(
            ("circuit", "threshold", "slope in contact", "inside / in contact",
             "ngspice less exact"), rows
        ),
    ]  # fmt: skip


def _portraits(circuits: Sequence[Piece]) -> list[Block]:
    rows = [
        (f"{row[0]['omega']:g}", row[0]["expected"], *map(_compared, row))
        for row in zip(*(one["responses"] for one in circuits), strict=True)
    ]
    return [
        "The exact circuit's n-p-q and error, then ngspice's with the steps of a period that "
        "passed the gate.",
        table(("ω", "wanted", *(one["title"] for one in circuits)), rows),
        *(Picture(one["title"], file=f"fig8-{one['circuit']}.png") for one in circuits),
    ]


def _compared(r: Piece) -> str:
    gate = "" if r["ngspice_passed"] else ", gate not passed"
    return (
        f"{r['circuit']}, {_percent(r['error'])}; {r['ngspice'] or 'not run'}, "
        f"{_percent(r['ngspice_error'])} ({r['steps_a_period']}{gate})"
    )


def _misprints(misprints: Sequence[Piece]) -> list[Block]:
    rows = []
    for m in misprints:
        error, worst, kept = "", "", "reaches no part"
        if m["reaches"]:
            error = "a wrong sign" if m["max_error"] is None else _percent(m["max_error"])
            worst, shown = m["worst"], [r["kept"] for r in m["responses"]]
            kept = f"{sum(shown)} of {len(shown)}" if shown else "not run"
        rows.append((m["where"], m["printed"], m["right"], m["note"], error, worst, kept))
    columns = (
        "where", "printed", "must read", "read as", "coefficient error", "in", "responses kept",
    )  # fmt: skip
    return [
        "Each alone in the corrected circuit, at the ω of Fig. 8; under an n-p-q that is kept "
        "stands its error. The coefficient error is the largest |ln(realised/wanted)| at the best "
        "scales; the generator's amplitude and frequency do not enter it.",
        Picture("n-p-q with each misprint", file="misprints.png"),
        table(columns, rows),
    ]


def _offsets(offsets: Sequence[Piece]) -> list[Block]:
    sizes = [(one["circuit"], size) for one in offsets for size in one["sizes"].values()]
    most = max(sum(r["counted"].values()) for _, size in sizes for r in size)
    rows = [
        (
            TITLES[circuit],
            f"{1e3 * size[0]['size']:g} mV",
            *(", ".join(f"{name} {n}" for name, n in r["to"][:3]) or NONE for r in size),
        )
        for circuit, size in sizes
    ]
    return [
        "Every op-amp section at ± the same offset, all other parts exact, each response from the "
        "nominal circuit's orbit: the share of sign patterns that keep it, of "
        f"{most} each, drawn where there are more. 95 % Wilson intervals stand in circuit.json.",
        Picture("Share of sign patterns that keep each response", file="offsets.png"),
        "What the others show, the most frequent first:",
        table(("circuit", "offset", *(r["expected"] for r in sizes[0][1])), rows),
    ]


def _times(clock: Piece) -> list[Block]:
    out: list[Block] = [
        "CPU time of a drive period on one core, all methods taking turns in "
        f"{clock['rounds']} rounds; ratios are taken within a round and their median is shown. "
        "The machine may have been busy: ratios hold better than times. Errors are against the "
        f"exact flow of the same equations after {PERIODS} drive periods; for the full op-amps "
        "that is what ideal ones leave out.",
        Picture("Error over time", file="times.png"),
    ]
    for row in clock["responses"]:
        rows = [
            (
                m["name"],
                m["setting"],
                _two_figures(m["seconds"]),
                _two_figures(m["ratio"]),
                "exact" if m["error"] == 0.0 else _two_figures(m["error"]),
            )
            for m in row["methods"]
        ]
        out.append(SmallPrint(f"ω = {row['omega']:g}, 1-{row['p']}-{row['p']}:"))
        out.append(table(("method", "setting", "seconds", f"over {BASE}", "RMS error"), rows))
    return out


def _ratio(row: Piece, base: str) -> str:
    """Time of the circuit over another method's, to two figures and without an exponent; both were
    put over the same in each round."""
    ratio = {m["name"]: m["ratio"] for m in row["methods"]}
    if None in (ratio[CIRCUIT], ratio[base]):
        return "nan"
    return f"{float(f'{ratio[CIRCUIT] / ratio[base]:.2g}'):.10g}"


def _two_figures(value: float | None) -> str:
    return NONE if value is None else f"{value:.2g}"


def _share(counted: Piece) -> float:
    decided = sum(counted.values()) - counted["failed"]
    return float(counted["ok"] / decided) if decided else 0.0


def _percent(value: float | None) -> str:
    if value is None:
        return NONE
    return "0" if abs(value) <= EXACT else f"{100.0 * value:.3g} %"
