"""``designer reproduce dynamics``: the paper's Sections 3 and 4, Fig. 2 and Fig. 3, measured.

The folder holds README.md with the command at its top, pictures as PNG and SVG, dynamics.json with
windows, points, cascades, coexisting attractors and statements, and the followed branches and the
sweeps as Parquet. A folder that holds anything else is refused.

Both ends of each main window at the paper's parameters are continued over b and over k0: pitchfork
below, fold or grazing above.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from matplotlib.figure import Figure

from designer.base import progress
from designer.base.atomic_write import write
from designer.base.errors import InputError
from designer.base.report_pieces import check_report_folder
from designer.bifurcations import border_curves, sweep
from designer.bifurcations.border_curve import BorderCurve
from designer.bifurcations.border_curves import CurvePlan
from designer.bifurcations.branch_survey import Survey, survey
from designer.bifurcations.plane_curves import PlaneWindow
from designer.bifurcations.windows import BranchWindow, all_windows, outside
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.paper_values import MODEL
from designer.dynamics.attractors import settle, starts, twin
from designer.dynamics.coexisting_attractors import coexisting
from designer.dynamics.orbit import Orbit
from designer.folders import origin
from designer.folders.sweep_store import write_sweep
from designer.folders.sweep_tables import curves_csv
from designer.model import swept_model
from designer.model.find_responses import scale_of
from designer.model.model_file import parse_model_file
from designer.model.swept_model import ModelSubject
from designer.paper.dynamics_page import (
    KINDS,
    Dynamics,
    Portrait,
    branch_chart,
    dynamics_page,
    portrait_sheet,
)
from designer.paper.report_files import README, write_files
from designer.paper.statements import gaps, main_cascades, main_windows, statements, symmetric_mains
from designer.plots import bifurcation_plots, curve_plots
from designer.plots.point_captions import caption

if TYPE_CHECKING:
    from designer.answers.shared_rows import ProvenanceRow

OMEGA = (0.15, 1.8)
"""The range of ω in which borders are followed."""
SECOND = {"b": (0.15, 0.35), "k0": (0.85, 0.99)}
"""Second parameters, with where borders are followed over them."""


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
    windows: Sequence[BranchWindow], second: str, jobs: int = 1
) -> ResponseBorders:
    """The borders that pass the ends of these windows over ω.

    second : a key of ``SECOND``.
    """
    plane_window = PlaneWindow(OMEGA, SECOND[second])
    at = MODEL.parameter(second)
    plan = CurvePlan(ModelSubject(MODEL), "omega", second, at, plane_window)
    points = [end.point for w in windows for end in (w.low, w.high) if end.point is not None]
    step = progress.stage(f"Borders over ω and {second}", border_curves.BLOCKS * (1 + plan.depth))
    curves = border_curves.run(plan, points, jobs, progress=step)
    named = tuple((w.response, w.low.value, w.high.value) for w in windows)
    return ResponseBorders(plan, tuple(curves), named)


FORMAT = 1
COMMAND = "designer reproduce dynamics --out reports/paper-dynamics"
LOW, HIGH = 0.2, 1.8
"""Of ω: where branches are followed."""
FIRST = 1.55
"""ω at which the branch of symmetric orbits is set out from."""
DEPTH = 2
"""Branch switches in a row: to the twins, and to their doubled orbits."""
TITLE = "Soft-impacting system with two-sided stops"
"""Title of the sweeps' pictures: the paper's case, as its model file calls it."""
DATA = "dynamics.json"
FIGURES = {"fig2a": (0.1, 1.8, 1801), "fig2b": (0.2, 0.6, 801), "fig2c": (1.25, 1.6, 701)}
"""ω from, to and steps of each picture of the paper's Fig. 2."""
SHARED = (1.55, 1.505, 1.43, 1.35, 0.85, 0.77, 0.54, 0.41, 0.25, 0.225)
"""ω at which coexisting attractors are looked for."""
STARTS = 64
"""Initial states tried at each of them."""
NAMES = frozenset(
    [README, DATA, "branches.parquet", *(f"{name}.parquet" for name in FIGURES)]
    + [f"{name}.{kind}" for name in ("branches", "fig3", *FIGURES) for kind in ("png", "svg")]
    + [f"borders-{name}.{kind}" for name in SECOND for kind in ("png", "svg", "csv")]
)
"""Names of the report's files."""
CHATTER = (0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.02)
"""ω at which the impacts of the response from rest are counted."""


@dataclass(frozen=True)
class DynamicsExtent:
    """How much is done; the defaults are the report's."""

    low: float = LOW
    """Least ω to which branches are followed."""
    high: float = HIGH
    """Largest ω to which branches are followed."""
    depth: int = DEPTH
    """Branch switches in a row."""
    figures: tuple[str, ...] = tuple(FIGURES)
    """Names of those of ``FIGURES`` that are drawn."""
    borders: tuple[str, ...] = tuple(SECOND)
    """Second parameters over which the borders of the symmetric windows are followed."""
    shared: tuple[float, ...] = SHARED
    """ω at which coexisting attractors are looked for."""
    chatter: tuple[float, ...] = CHATTER
    """ω at which the impacts of the response from rest are counted."""


def reproduce(
    out: Path,
    *,
    jobs: int = 1,
    extent: DynamicsExtent | None = None,
) -> Dynamics:
    """Write the report into a folder, which is result; an earlier report in it is replaced.

    jobs : threads of the sweeps. progress : is told the stages. extent : the report's by default.

    Raises
    ------
    InputError : the folder cannot be written, or holds files that are not an earlier report's.
        Nothing is written then.
    """
    extent = DynamicsExtent() if extent is None else extent
    try:
        out.mkdir(parents=True, exist_ok=True)
        check_report_folder(out, NAMES, DATA, COMMAND)
    except OSError as error:
        raise InputError(
            out, "--out", error.strerror or str(error), "a directory that can be written"
        ) from None
    dynamics = measure(extent)
    source = _provenance(extent)
    sweeps = {name: _sweep(name, jobs) for name in extent.figures}
    mains = [w for _, w in symmetric_mains(dynamics.windows)]
    borders = [response_borders(mains, name, jobs) for name in extent.borders]
    figures = _figures(dynamics, extent, sweeps) | {b.name: b.figure() for b in borders}
    page = dynamics_page(dynamics, figures, COMMAND, first=FIRST, starts=STARTS)
    write_files(out, (DATA, _document(dynamics, extent, source)), page, figures, ("png", "svg"))
    _parquet(out / "branches.parquet", dynamics.survey, source)
    for each in borders:
        write(out / f"{each.name}.csv", each.table())
    for name, result in sweeps.items():
        write_sweep(out / f"{name}.parquet", result, source)
    return dynamics


def _provenance(extent: DynamicsExtent) -> ProvenanceRow:
    text = "format = 1\n[model]\n" + "".join(
        f"{name} = {json.dumps(value)}\n" for name, value in MODEL.__dict__.items()
    )
    settings = {
        **asdict(extent),
        "figures": {name: list(FIGURES[name]) for name in extent.figures},
        "first": FIRST,
        "starts": STARTS,
    }
    return origin.provenance(
        parse_model_file(text), load_catalog().hash, seed=0, settings={"dynamics": settings}
    )


def measure(extent: DynamicsExtent) -> Dynamics:
    """Branches, windows, what coexists, and the judgement of each statement."""
    over = swept_model.of_model(MODEL, FIRST, "omega")
    first = settle(over.flow(FIRST), np.zeros(4))
    step = progress.stage("Branches of periodic orbits")
    branches = survey(
        over, [(FIRST, first)], extent.low, extent.high, depth=extent.depth, progress=step
    )
    windows = all_windows(branches)
    after = {}
    for p in range(1, 9):
        for one, kind in zip(main_windows(windows, p), KINDS, strict=True):
            if one is not None:
                after[p, f"{kind} low"] = outside(over, one.low, -1.0)[1].response
                after[p, f"{kind} high"] = outside(over, one.high, 1.0)[1].response
    step = progress.stage("Coexisting attractors", len(extent.shared))
    shared = {}
    for omega in extent.shared:
        shared[omega] = _coexisting(omega)
        step()
    chatter = tuple((w, settle(over.flow(w), np.zeros(4))) for w in extent.chatter)
    mains = symmetric_mains(windows)
    between = gaps(MODEL, mains, progress=progress.stage("Between the windows", len(mains) - 1))
    return Dynamics(
        branches,
        tuple(windows),
        main_cascades(windows),
        after,
        shared,
        chatter,
        tuple(statements(branches, windows, between, chatter)),
    )


def _coexisting(omega: float) -> tuple[str, ...]:
    flow = swept_model.of_model(MODEL, omega, "omega").flow(omega)
    return tuple(map(_named, coexisting(flow, starts(scale_of(MODEL, omega), STARTS))))


def _named(orbit: Orbit) -> str:
    return orbit.response + (" (AS)" if orbit.symmetric is False and orbit.p == orbit.q else "")


def _sweep(name: str, jobs: int) -> sweep.Sweep:
    low, high, steps = FIGURES[name]
    values = np.linspace(low, high, steps)
    plan = sweep.SweepPlan(ModelSubject(MODEL), "omega", values, **sweep.follow("down", "up"))
    return sweep.run(plan, jobs, progress=progress.stage(f"Sweep for {name}"))


def _figures(
    dynamics: Dynamics, extent: DynamicsExtent, sweeps: Mapping[str, sweep.Sweep]
) -> dict[str, Figure]:
    figures = {
        "branches": branch_chart(dynamics.survey, extent.low, extent.high),
        "fig3": portrait_sheet(_portraits(dynamics)),
    }
    for name, result in sweeps.items():
        marks = bifurcation_plots.marks(dynamics.survey.points, *FIGURES[name][:2])
        shown = marks if name != "fig2a" else ()
        figures[name] = bifurcation_plots.diagram(result, shown, TITLE)
    return figures


def _portraits(dynamics: Dynamics) -> dict[int, list[Portrait]]:
    """For each p the symmetric response and the twins, in the middle of their main windows."""
    over = dynamics.survey.branches[0].curve.family
    panels: dict[int, list[Portrait]] = {}
    for p in range(1, 9):
        for one, kind in zip(main_windows(dynamics.windows, p), ("", " AS"), strict=True):
            if one is None:
                continue
            low, high = one.low.value, one.high.value
            inside = [
                q
                for q in dynamics.survey.branches[one.branch].points
                if q.stable and q.response == one.response and low <= q.value <= high
            ]
            if not inside:
                continue
            point = min(inside, key=lambda q: abs(q.value - 0.5 * (low + high)))
            flow = over.flow(point.value)
            orbits = [point.orbit, None if one.symmetric else twin(flow, point.orbit)]
            curves = [
                flow.run(orbit.start, orbit.n, points=800).strobes[:, :2]
                for orbit in orbits
                if orbit is not None
            ]
            title = f"{one.response}{kind}, ω = {point.value:.4f}"
            panels.setdefault(p, []).append(Portrait(title, MODEL.b, tuple(curves)))
    return panels


def _document(
    dynamics: Dynamics, extent: DynamicsExtent, source: Mapping[str, Any]
) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "command": COMMAND,
        "model": dict(MODEL.__dict__),
        "from": extent.low,
        "to": extent.high,
        "windows": [w.as_dict() for w in dynamics.windows],
        "points": [{**p.as_dict(), "caption": caption(p, "ω")} for p in dynamics.survey.points],
        "cascades": {str(p): c.as_dict() for p, c in dynamics.cascades.items()},
        "coexisting": {f"{w:g}": names for w, names in dynamics.shared.items()},
        "from_rest": {f"{w:g}": orbit.response for w, orbit in dynamics.chatter},
        "statements": [asdict(s) for s in dynamics.statements],
        "provenance": dict(source),
    }


def _parquet(path: Path, branches: Survey, source: Mapping[str, Any]) -> None:
    """Every followed orbit, one row each."""
    rows = [
        {
            "branch": number,
            "parent": branches.parents[number],
            branches.parameter: point.value,
            "response": point.response,
            "symmetric": branch.curve.symmetric,
            "stable": point.stable,
            "radius": point.orbit.radius,
            "x1_min": float(point.orbit.extremes[0, 0]),
            "x1_max": float(point.orbit.extremes[0, 1]),
            "start": [float(x) for x in point.orbit.start],
        }
        for number, branch in enumerate(branches.branches)
        for point in branch.points
    ]
    note = json.dumps({"format": FORMAT, "provenance": dict(source)}, sort_keys=True)
    content = io.BytesIO()
    table = pa.Table.from_pylist(rows).replace_schema_metadata({"designer": note})
    pq.write_table(table, content)
    write(path, content.getvalue())
