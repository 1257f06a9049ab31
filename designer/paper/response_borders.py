"""The borders of the paper's symmetric responses 1-1-1 to 1-8-8 over ω and a second parameter.

Both ends of each main window at the paper's parameters are continued over b and over k0: pitchfork
below, fold or grazing above. ``python -m designer.paper.response_borders FOLDER`` makes these
pictures and tables of the report on the dynamics alone, and shows them on its page if there is one.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from designer.base.atomic_write import write
from designer.base.figure_style import picture
from designer.base.page import paragraphs
from designer.base.progress import Progress
from designer.bifurcations import border_curves
from designer.bifurcations.border_curve import BorderCurve
from designer.bifurcations.border_curves import CurvePlan
from designer.bifurcations.plane_curves import PlaneWindow
from designer.bifurcations.windows import BranchWindow, window
from designer.circuit.paper_values import MODEL
from designer.dynamics.attractors import settle
from designer.folders.sweep_tables import curves_csv
from designer.model.swept_model import ModelSubject
from designer.paper.dynamics_page import shown
from designer.paper.report_files import README, make_report
from designer.plots import curve_plots

OMEGA = (0.15, 1.8)
"""The range of ω in which borders are followed."""
SECOND = {"b": (0.15, 0.35), "k0": (0.85, 0.99)}
"""Second parameters, with where borders are followed over them."""
INSIDE = (1.55, 0.85, 0.54, 0.41, 0.337, 0.284, 0.24, 0.215)
"""ω inside the windows of 1-1-1 to 1-8-8, at which rest leads to them."""
TITLE = "Soft-impacting system with two-sided stops"


@dataclass(frozen=True)
class ResponseBorders:
    """The borders over ω and one other parameter."""

    plan: CurvePlan
    """What was followed, and where."""
    curves: tuple[BorderCurve, ...]
    windows: tuple[tuple[str, float, float], ...]
    """(response, from, to) of each window along ω."""

    @property
    def name(self) -> str:
        """The name of the files: "borders-b"."""
        return f"borders-{self.plan.second}"

    def figure(self) -> Figure:
        """The borders in the plane."""
        return curve_plots.curves(self.curves, self.plan, TITLE, self.windows)

    def table(self) -> str:
        """CSV, a row a point."""
        return curves_csv(self.curves, self.plan.first, self.plan.second)


def response_borders(
    windows: Sequence[BranchWindow], second: str, jobs: int = 1, progress: Progress | None = None
) -> ResponseBorders:
    """The borders that pass the ends of these windows over ω.

    second : a key of ``SECOND``.
    """
    progress = Progress() if progress is None else progress
    plane_window = PlaneWindow(OMEGA, SECOND[second])
    at = MODEL.parameter(second)
    plan = CurvePlan(ModelSubject(MODEL), "omega", second, at, plane_window)
    points = [end.point for w in windows for end in (w.low, w.high) if end.point is not None]
    step = progress.stage(f"Borders over ω and {second}", border_curves.BLOCKS * (1 + plan.depth))
    curves = border_curves.run(plan, points, jobs, progress=step)
    named = tuple((w.response, w.low.value, w.high.value) for w in windows)
    return ResponseBorders(plan, tuple(curves), named)


def main_windows_of_rest(progress: Progress) -> list[BranchWindow]:
    """The window of each symmetric response that rest leads to at ``INSIDE``."""
    step = progress.stage("Windows of 1-p-p", len(INSIDE))
    windows = []
    for omega in INSIDE:
        over = ModelSubject(MODEL, omega).family("omega")
        windows.append(window(over, settle(over.flow(omega), np.zeros(4)), omega, *OMEGA))
        step()
    return windows


def report(*, out: Path, jobs: int, progress: Progress) -> Mapping[str, ResponseBorders]:
    """Write the pictures and tables into a folder that exists."""
    windows = main_windows_of_rest(progress)
    borders_of = {name: response_borders(windows, name, jobs, progress) for name in SECOND}
    for borders in borders_of.values():
        figure = borders.figure()
        for file_format in ("png", "svg"):
            write(out / f"{borders.name}.{file_format}", picture(figure, file_format, 160.0))
        write(out / f"{borders.name}.csv", borders.table())
    if (out / README).is_file():
        write(out / README, _with_pictures((out / README).read_text("utf-8"), borders_of.values()))
    return borders_of


def _with_pictures(page: str, borders: Iterable[ResponseBorders]) -> str:
    """The report's page, with those pictures at its end that it does not show."""
    missing = [b.name for b in borders if f"({b.name}.png)" not in page]
    return f"{page}\n{paragraphs([shown(name) for name in missing])}" if missing else page


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m designer.paper.response_borders")
    parser.add_argument("out", type=Path)
    parser.add_argument("--jobs", type=int, default=2)
    return make_report(report, parser, arguments)


if __name__ == "__main__":
    sys.exit(main())
