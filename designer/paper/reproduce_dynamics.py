"""The paper's Sections 3 and 4 measured: its Fig. 2 and Fig. 3 and its statements.

``reproduce`` writes one folder: README.md with the command at its top, pictures as PNG and SVG,
dynamics.json with windows, points, cascades, coexisting attractors and statements, and the followed
branches and the sweeps as Parquet. A folder that holds anything else is refused.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from designer.base.atomic_write import write
from designer.base.errors import InputError
from designer.base.figure_style import to_png, to_svg
from designer.base.progress import Progress
from designer.base.report_pieces import check_ours
from designer.bifurcations import sweep
from designer.bifurcations.branch_survey import Survey, survey
from designer.bifurcations.continuation import End
from designer.bifurcations.doubling_cascade import Cascade
from designer.bifurcations.point_captions import caption
from designer.bifurcations.store import write_sweep
from designer.bifurcations.windows import NOT_LOCATED, BranchWindow, all_windows, outside
from designer.catalog.catalog import load_catalog
from designer.circuit.paper_values import MODEL
from designer.dynamics.attractors import coexisting, settle, starts, twin
from designer.dynamics.orbit import Orbit
from designer.jobs import origin
from designer.model import swept_model
from designer.model.find_responses import scale_of
from designer.model.model_file import parse_model_file
from designer.model.swept_model import ModelSubject
from designer.paper import dynamics_pictures
from designer.paper.dynamics_pictures import Portrait
from designer.paper.response_order import gaps
from designer.paper.statements import (
    Statement,
    main_cascades,
    main_windows,
    statements,
    symmetric_mains,
)
from designer.report import bifurcation_plots

FORMAT = 1
COMMAND = "designer reproduce dynamics --out reports/paper-dynamics"
LOW, HIGH = 0.2, 1.8
"""Of ω: where branches are followed."""
FIRST = 1.55
"""ω at which the branch of symmetric orbits is set out from."""
DEPTH = 2
"""Branch switches in a row: to the twins, and to their doubled orbits."""
TITLE = "Soft-impacting system with two-sided stops"
"""Of the sweeps' pictures: the paper's case, as its model file calls it."""
DATA = "dynamics.json"
FIGURES = {"fig2a": (0.1, 1.8, 1801), "fig2b": (0.2, 0.6, 801), "fig2c": (1.25, 1.6, 701)}
"""ω from, to and steps of each picture of the paper's Fig. 2."""
SHARED = (1.55, 1.505, 1.43, 1.35, 0.85, 0.77, 0.54, 0.41, 0.25, 0.225)
"""ω at which coexisting attractors are looked for."""
STARTS = 64
"""Initial states tried at each of them."""
NAMES = frozenset(
    ["README.md", DATA, "branches.parquet", *(f"{name}.parquet" for name in FIGURES)]
    + [f"{name}.{kind}" for name in ("branches", "fig3", *FIGURES) for kind in ("png", "svg")]
)
"""Of the report's files."""
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
    shared: tuple[float, ...] = SHARED
    """ω at which coexisting attractors are looked for."""
    chatter: tuple[float, ...] = CHATTER
    """ω at which the impacts of the response from rest are counted."""


@dataclass(frozen=True)
class Dynamics:
    """Everything that was found."""

    found: Survey
    """The branches, with their bifurcation points."""
    windows: tuple[BranchWindow, ...]
    """The windows in which responses are stable."""
    cascades: Mapping[int, Cascade]
    """Period-doubling cascades by p of the main window."""
    after: Mapping[tuple[int, str], str]
    """Response right beyond an end of a main window, by its p and "S low", "S high", "AS low" or
    "AS high"."""
    shared: Mapping[float, tuple[str, ...]]
    """By ω, the coexisting responses."""
    chatter: tuple[tuple[float, Orbit], ...]
    """(ω, orbit) of the response from rest."""
    statements: tuple[Statement, ...]
    """What the paper says, and what was found."""


def reproduce(
    out: Path,
    *,
    jobs: int = 1,
    progress: Progress | None = None,
    extent: DynamicsExtent | None = None,
) -> Dynamics:
    """Write the report into a folder, which is made; an earlier report in it is replaced.

    jobs : threads of the sweeps. progress : is told the stages. extent : the report's by default.

    Raises
    ------
    InputError : the folder cannot be written, or holds files that are not an earlier report's.
        Nothing is written then.
    """
    extent = DynamicsExtent() if extent is None else extent
    said = Progress() if progress is None else progress
    try:
        out.mkdir(parents=True, exist_ok=True)
        check_ours(out, NAMES, DATA, COMMAND)
    except OSError as error:
        raise InputError(
            out, "--out", error.strerror or str(error), "a directory that can be written"
        ) from None
    dynamics = measure(extent, said)
    source = _provenance(extent)
    text = json.dumps(_plain(dynamics, extent, source), indent=1, sort_keys=True)
    write(out / DATA, text + "\n")  # first: it says whose folder this is
    _parquet(out / "branches.parquet", dynamics.found, source)
    pictures = _pictures(out, dynamics, extent, jobs, source, said)
    write(out / "README.md", _readme(dynamics, pictures))
    return dynamics


def _provenance(extent: DynamicsExtent) -> dict[str, Any]:
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


def measure(extent: DynamicsExtent, progress: Progress) -> Dynamics:
    """Branches, windows, what coexists, and the judgement of each statement."""
    over = swept_model.of_model(MODEL, FIRST, "omega")
    first = settle(over.flow(FIRST), np.zeros(4))
    step = progress.stage("Branches of periodic orbits")
    found = survey(
        over, [(FIRST, first)], extent.low, extent.high, depth=extent.depth, progress=step
    )
    windows = all_windows(found)
    after = {}
    for p in range(1, 9):
        for one in main_windows(windows, p):
            if one is None:
                continue
            kind = "S" if one.symmetric else "AS"
            low, high = outside(over, one.low, -1.0)[1], outside(over, one.high, 1.0)[1]
            after[p, kind + " low"], after[p, kind + " high"] = low.response, high.response
    step = progress.stage("Coexisting attractors", len(extent.shared))
    shared = {w: tuple(_coexisting(w, step)) for w in extent.shared}
    chatter = tuple((w, settle(over.flow(w), np.zeros(4))) for w in extent.chatter)
    mains = symmetric_mains(windows)
    between = gaps(MODEL, mains, progress=progress.stage("Between the windows", len(mains) - 1))
    said = statements(found, windows, between, chatter)
    return Dynamics(
        found, tuple(windows), main_cascades(windows), after, shared, chatter, tuple(said)
    )


def _coexisting(omega: float, progress: Callable[[], None]) -> list[str]:
    over = swept_model.of_model(MODEL, omega, "omega")
    met = coexisting(over.flow(omega), starts(scale_of(MODEL, omega), STARTS))
    progress()
    return [_named(orbit) for orbit in met]


def _named(orbit: Orbit) -> str:
    return orbit.response + (" (AS)" if orbit.symmetric is False and orbit.p == orbit.q else "")


def _pictures(
    out: Path,
    dynamics: Dynamics,
    extent: DynamicsExtent,
    jobs: int,
    source: Mapping[str, Any],
    progress: Progress,
) -> list[str]:
    """Draw everything; names of the pictures without their endings. Sweeps are written too."""
    drawn = {
        "branches": dynamics_pictures.branches(dynamics.found, extent.low, extent.high),
        "fig3": dynamics_pictures.portraits(_portraits(dynamics)),
    }
    for name in extent.figures:
        low, high, steps = FIGURES[name]
        plan = sweep.SweepPlan(
            ModelSubject(MODEL),
            "omega",
            np.linspace(low, high, steps),
            **sweep.follow("down", "up"),
        )
        made = sweep.run(plan, jobs, progress=progress.stage(f"Sweep for {name}"))
        write_sweep(out / f"{name}.parquet", made, source)
        marks = bifurcation_plots.marks(dynamics.found.points, low, high)
        shown = marks if name != "fig2a" else ()
        drawn[name] = bifurcation_plots.diagram(made, shown, TITLE)
    for name, figure in drawn.items():
        png = io.BytesIO()
        to_png(figure, png)
        write(out / f"{name}.png", png.getvalue())
        write(out / f"{name}.svg", to_svg(figure))
    return list(drawn)


def _portraits(dynamics: Dynamics) -> dict[int, list[Portrait]]:
    """For each p the symmetric response and the twins, in the middle of their main windows."""
    over = dynamics.found.branches[0].curve.family
    panels: dict[int, list[Portrait]] = {}
    for p in range(1, 9):
        for one in main_windows(dynamics.windows, p):
            if one is None:
                continue
            middle = 0.5 * (one.low.value + one.high.value)
            branch = dynamics.found.branches[one.branch]
            inside = [
                q
                for q in branch.points
                if q.stable and q.response == one.response
                and one.low.value <= q.value <= one.high.value
            ]  # fmt: skip
            if not inside:
                continue
            point = min(inside, key=lambda q: abs(q.value - middle))
            flow = over.flow(point.value)
            curve = flow.run(point.orbit.start, point.orbit.n, points=800).strobes[:, :2]
            other = None if one.symmetric else twin(flow, point.orbit)
            panels.setdefault(p, []).append(
                Portrait(
                    f"{one.response}{'' if one.symmetric else ' AS'}, ω = {point.value:.4f}",
                    MODEL.b,
                    curve,
                    None
                    if other is None
                    else flow.run(other.start, other.n, points=800).strobes[:, :2],
                )
            )
    return panels


def _plain(dynamics: Dynamics, extent: DynamicsExtent, said: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "command": COMMAND,
        "model": dict(MODEL.__dict__),
        "from": extent.low,
        "to": extent.high,
        "windows": [w.as_dict() for w in dynamics.windows],
        "points": [{**p.as_dict(), "caption": caption(p, "ω")} for p in dynamics.found.points],
        "cascades": {str(p): c.as_dict() for p, c in dynamics.cascades.items()},
        "coexisting": {f"{w:g}": list(names) for w, names in dynamics.shared.items()},
        "from_rest": {f"{w:g}": orbit.response for w, orbit in dynamics.chatter},
        "statements": [s.as_dict() for s in dynamics.statements],
        "provenance": dict(said),
    }


def _parquet(path: Path, found: Survey, said: Mapping[str, Any]) -> None:
    """Every followed orbit, one row each."""
    rows = [
        {
            "branch": number,
            "parent": found.parents[number],
            found.parameter: point.value,
            "response": point.response,
            "symmetric": branch.curve.symmetric,
            "stable": point.stable,
            "radius": point.orbit.radius,
            "x1_min": float(point.orbit.extremes[0, 0]),
            "x1_max": float(point.orbit.extremes[0, 1]),
            "start": [float(x) for x in point.orbit.start],
        }
        for number, branch in enumerate(found.branches)
        for point in branch.points
    ]
    table = pa.Table.from_pylist(rows)
    note = json.dumps({"format": FORMAT, "provenance": dict(said)}, sort_keys=True)
    content = io.BytesIO()
    pq.write_table(table.replace_schema_metadata({"designer": note}), content)
    write(path, content.getvalue())


def _readme(dynamics: Dynamics, pictures: Sequence[str]) -> str:
    lines = [
        "# The paper's Sections 3 and 4, measured",
        "",
        f"Made by `{COMMAND}`; the data are in `dynamics.json` and `branches.parquet`.",
        "",
        "The model is the corrected Eq. (4) with the paper's parameters; ω falls from right to "
        "left. Points and ends of windows are located on the exact flow, to 1e-8 or better; five "
        "digits are shown. S is symmetric, AS stands for the two asymmetric twins.",
        "",
        "## What the paper says, and what is found",
        "",
        "| paper | found | verdict | shown by |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {s.paper} | {s.found} | **{s.verdict}** | `{s.command}` |" for s in dynamics.statements
    ]
    lines += ["", "## Windows of 1-p-p", ""]
    lines += [
        "The widest window of each kind on the branches followed: the symmetric branch through "
        f"1-1-1 at ω = {FIRST}, and what leaves it. Responses that these do not lead to are not "
        "looked for here; *What coexists* shows some. What lies outside is what the last orbit "
        "settles to 5e-4 (relative) past the end.",
        "",
        "| p | kind | from ω | ended by | outside | to ω | ended by | outside |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for p in range(1, 9):
        for one, kind in zip(main_windows(dynamics.windows, p), ("S", "AS"), strict=True):
            if one is None:
                lines.append(f"| {p} | {kind} | none on the branches followed | | | | | |")
                continue
            low, high = dynamics.after[p, f"{kind} low"], dynamics.after[p, f"{kind} high"]
            lines.append(
                f"| {p} | {kind} | {one.low.value:.5f} | {one.low.why} | {low} | "
                f"{one.high.value:.5f} | {one.high.why} | {high} |"
            )
    lines += ["", "## Cascades", "", "From the main symmetric window of each p, as ω falls:", ""]
    lines += [f"- {c.describe()}" for c in dynamics.cascades.values()]
    lines += ["", "## What coexists", ""]
    lines += [
        f"From {STARTS} starts at each ω (mirror twins count as one, aperiodic motions are not "
        "told apart):",
        "",
        "| ω | attractors |",
        "|---|---|",
    ]
    lines += [f"| {w:g} | {', '.join(names)} |" for w, names in dynamics.shared.items()]
    lines += ["", "## Narrower windows of 1-p-p and other responses of period 1", ""]
    lines += ["| response | from ω | ended by | to ω | ended by |", "|---|---|---|---|---|"]
    main = [w for p in range(1, 9) for w in main_windows(dynamics.windows, p)]
    for w in dynamics.windows:
        if w not in main and w.response.startswith("1-"):
            lines.append(
                f"| {w.response} {'S' if w.symmetric else 'AS'} | {w.low.value:.6f} | {w.low.why} "
                f"| {w.high.value:.6f} | {w.high.why} |"
            )
    lost = sum(b.ends.count(End.LOST) for b in dynamics.found.branches)
    unseen = [w for w in dynamics.windows if NOT_LOCATED in (w.low.why, w.high.why)]
    lines += ["", "## Pictures", ""]
    lines.append(
        f"{len(dynamics.found.branches)} branches were followed, {sum(_lengths(dynamics))} orbits "
        f"in all; {lost} of their ends are for want of convergence. {len(unseen)} of the "
        f"{len(dynamics.windows)} windows, those of longer periods included, end where no "
        f"bifurcation was located{_named_windows(unseen)}.\n"
    )
    lines += [f"![{_CAPTIONS[name]}]({name}.png)\n\n{_CAPTIONS[name]}\n" for name in pictures]
    return "\n".join(lines).rstrip() + "\n"


def _named_windows(windows: Sequence[BranchWindow]) -> str:
    if not windows:
        return ""
    names = [f"{w.response} from ω = {w.low.value:.6f} to {w.high.value:.6f}" for w in windows]
    return f" ({'; '.join(names)})"


def _lengths(dynamics: Dynamics) -> list[int]:
    return [len(branch.points) for branch in dynamics.found.branches]


_CAPTIONS = {
    "branches": "Followed branches: least x1 of each orbit over ω; solid where stable.",
    "fig3": "Fig. 3: phase portraits of 1-p-p, symmetric and as twins in black and red; shaded: "
    "contact.",
    "fig2a": "Fig. 2(a): ω from 0.1 to 1.8, attractor followed down and up.",
    "fig2b": "Fig. 2(b): the windows at low ω.",
    "fig2c": "Fig. 2(c): around the pitchfork of 1-1-1.",
}
