"""The pictures of reports/stability/."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
from matplotlib.figure import Figure

from benchmarks.stability_flow import SHOWN, Row, by_axis, ratio, trusted


def flow_picture(rows: Sequence[Row]) -> Figure:
    """Error over magnification along each axis, both kernels, with the bound that is stated."""
    axes_of = {k: v for k, v in by_axis(rows).items() if len(v) > 1}
    figure = Figure(figsize=(11.0, 3.0 * ((len(axes_of) + 2) // 3)), layout="constrained")
    grid = figure.subplots((len(axes_of) + 2) // 3, 3, squeeze=False, sharey=True).ravel()
    for ax, (axis, of) in zip(grid, axes_of.items(), strict=False):
        at = list(range(len(of)))
        for key, style, name in (
            ("general_error", "s:", "general kernel"),
            ("error", "o-", "kernel that is used"),
        ):
            shown = [(k, r) for k, row in zip(at, of, strict=True) if (r := ratio(row, key))]
            ax.plot(*zip(*shown, strict=True), style, label=name, ms=4.5)
        for k, row in zip(at, of, strict=True):
            if not trusted(row):
                ax.axvspan(k - 0.5, k + 0.5, color="#d62728", alpha=0.15, lw=0)
        ax.axhline(1.0, color="#555555", lw=0.8, ls="--")
        ax.set_yscale("log")
        ax.set_xticks(at, [f"{r['value']:.0e}" for r in of], fontsize=7, rotation=45)
        ax.set_title(SHOWN.get(axis, axis), fontsize=10)
        ax.grid(visible=True, axis="y", lw=0.4, alpha=0.6)
    for ax in grid[len(axes_of) :]:
        ax.set_axis_off()
    for ax in grid[::3]:
        ax.set_ylabel("error / (magnification · 2⁻⁵³)", fontsize=8)
    handles, names = grid[0].get_legend_handles_labels()
    patch = mpl.patches.Patch(color="#d62728", alpha=0.15)
    figure.legend(
        [*handles, patch],
        [*names, "not to be trusted here"],
        loc="outside upper center",
        ncols=3,
        frameon=False,
        fontsize=9,
    )
    return figure


def spice_picture(rows: Sequence[Row]) -> Figure:
    """Distance of ngspice from the exact circuit for each design and fidelity."""
    shown = [row for row in rows if "rungs" in row]
    figure = Figure(figsize=(9.0, 5.2), layout="constrained")
    ax = figure.subplots()
    marks = {"ideal": ("o", "#1f77b4"), "dynamic": ("s", "#ff7f0e"), "full": ("^", "#2ca02c")}
    for fidelity, (mark, color) in marks.items():
        for passed in (True, False):
            points = [
                (k, said["rms"])
                for k, row in enumerate(shown)
                for name, said in row["rungs"].items()
                if name == fidelity and said["passed"] is passed and said["rms"]
            ]
            if points:
                ax.plot(
                    *zip(*points, strict=True),
                    mark,
                    color=color,
                    mfc=color if passed else "none",
                    label=fidelity if passed else f"{fidelity}, not to be trusted",
                )
    # At the top what has no wave to compare: nothing repeats, or no run came to an end.
    for k, row in enumerate(shown):
        for place, (fidelity, (mark, color)) in enumerate(marks.items()):
            said = row["rungs"].get(fidelity)
            if said is not None and not said["rms"]:
                look = color if said["passed"] else "none"
                at, high = [k + 0.25 * (place - 1)], [0.97]
                ax.plot(at, high, mark, color=color, mfc=look, transform=ax.get_xaxis_transform())
    ax.axhline(2e-3, color="#555555", lw=0.8, ls="--", label="bound of the gate, ideal")
    ax.set_yscale("log")
    names = [f"{row['axis']} {row['value']:g}" for row in shown]
    ax.set_xticks(range(len(shown)), names, rotation=60, ha="right", fontsize=8)
    ax.set_ylabel(
        "ngspice less exact circuit, RMS over the peak\n(at the top: no period to compare)"
    )
    ax.grid(visible=True, axis="y", lw=0.4, alpha=0.6)
    figure.legend(loc="outside upper center", ncols=4, frameon=False, fontsize=8)
    return figure
