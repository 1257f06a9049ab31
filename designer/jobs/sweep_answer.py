"""A sweep of the verb ``bifurcation``: its points, counted basins, curves and regions, as JSON,
tables and pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.base.si_unit import Unit
from designer.bifurcations import (
    basin_shares,
    border_curves,
    response_region,
    sweep,
    window_ends,
)
from designer.bifurcations.basin_shares import BasinShares
from designer.bifurcations.border_curve import BorderCurve
from designer.bifurcations.border_curves import CurvePlan
from designer.bifurcations.points import SIDES, Bifurcation
from designer.bifurcations.response_region import ResponseRegion, SpreadBox
from designer.bifurcations.sweep import Sweep, SweepPlan
from designer.bifurcations.window_ends import SweptEnd, WindowEnds
from designer.circuit.swept_board import BoardSubject
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import OrbitStatus
from designer.folders.curve_store import CurveBlocks, curves_csv
from designer.folders.share_store import ShareBlocks, shares_csv
from designer.folders.sweep_store import SweepStore
from designer.folders.sweep_tables import points_csv, windows_csv
from designer.jobs.bifurcation_work import BifurcationWork, Files, Made, image_files, with_si
from designer.plots import captions, point_captions, titles
from designer.spread.spread import draw_many

SPREAD_BOARDS = 200
"""Boards that are drawn for the box of spread."""
CURVE_FILES = ("curves.csv", "curves.png", "curves.svg")
"""Tables and pictures of bifurcation curves."""
TABLES = ("windows.csv", "points.csv")
"""Tables of the sweep itself."""


def sweep_files(work: BifurcationWork, plan: SweepPlan) -> list[str]:
    """Names of the files beside ``sweep.json`` and its pictures."""
    names = [
        SweepStore.name(track, k) for track in plan.tracks for k in range(len(plan.blocks(track)))
    ]
    names += TABLES
    if work.shares is not None:
        names += [*ShareBlocks.names(work.shares), "shares.csv"]
    if work.curves is not None:
        names += [*CurveBlocks.names(work.curves.depth), *CURVE_FILES]
    return names


def sweep_answer(work: BifurcationWork, plan: SweepPlan, folder: Folder | None) -> Made:
    """The sweep, its points, and what else was asked for along it."""
    progress, jobs, name = work.progress, work.jobs, plan.parameter
    store = None
    if folder is not None:
        store = SweepStore(work.files(folder), name)
    blocks = sum(len(plan.blocks(track)) for track in plan.tracks)
    swept = sweep.run(plan, jobs, store, progress.stage(f"sweep over {name}", blocks))
    found = None
    if work.request.points:
        step = progress.stage("bifurcation points", len(window_ends.windows(swept)))
        found = window_ends.find(swept, jobs, step)
    points = () if found is None else found.points
    si, unit = plan.subject.si.get(name), plan.subject.units.get(name, "")
    symbol = titles.NAMES.get(name, name)
    body: dict[str, Any] = {
        "parameter": name,
        "unit": unit,
        **({} if si is None else {"si_unit": si.name, "si_scale": si.scale}),
        "tracks": list(plan.tracks),
        "steps": len(plan.values),
        "windows": _windows(swept, found, si),
        "points": [
            {
                **with_si(p.as_dict(), si),
                "caption": point_captions.caption(p, symbol, unit),
                "changes": [c.as_dict() for c in captions.changes(swept, p)],
            }
            for p in points
        ],
    }
    if found is not None:
        missing = (
            {**with_si(_missing(name, end), si), "caption": captions.missing(end, symbol, unit)}
            for end in found.missing
        )
        body["points"] = sorted([*body["points"], *missing], key=lambda row: float(row["value"]))
    shares = _shares(work, folder)
    suffix = "" if si is None else si.suffix
    tables = (windows_csv(body["windows"], suffix), points_csv(body["points"], suffix))
    pictures: list[Callable[[], Files]] = [
        lambda: _diagram(work, swept, points, shares),
        lambda: dict(zip(TABLES, tables, strict=True)),
    ]
    if shares is not None:
        body["shares"] = shares.as_dict()
        pictures.append(lambda: {"shares.csv": shares_csv(shares)})
    if work.curves is not None:
        curves = _curves(work, work.curves, points, folder)
        second = plan.subject.si.get(work.curves.second)
        body["and"] = {
            **with_si({**work.curves.as_dict(), "at": work.curves.at}, second),
            "unit": plan.subject.units.get(work.curves.second, ""),
            **({} if second is None else {"si_unit": second.name, "si_scale": second.scale}),
        }
        body["curves"] = [curve.as_dict() for curve in curves]
        region = _region(work, work.curves, swept)
        if region is not None:
            body["region"] = region.as_dict()
        pictures.append(lambda: _curve_files(work, swept, curves, region))

    def files() -> Files:
        return {name: content for each in pictures for name, content in each().items()}

    return body, {"periods": swept.periods}, files


def _windows(swept: Sweep, found: WindowEnds | None, unit: Unit | None) -> list[dict[str, object]]:
    """The windows of a sweep, and the ends of the periodic ones where these were looked for."""
    out = []
    for number, window in enumerate(swept.windows):
        row = with_si(window.as_dict(), unit)
        ends = None if found is None else found.ends[number]
        if ends is not None:
            keys = zip(("from_end", "to_end"), ends, strict=True)
            row |= {key: with_si(end.as_dict(), unit) for key, end in keys}
        out.append(row)
    return out


def _missing(parameter: str, end: SweptEnd) -> dict[str, Any]:
    """A row among the points, by the keys of a point, for an end that was not located."""
    response, symmetric = end.window.response, end.window.symmetric
    return {
        "parameter": parameter,
        "kind": end.kind,
        "value": end.value,
        "error": end.error,
        "before": response,
        "after": "",
        "stable_before": True,
        "stable_after": None,
        "direction": end.side,
        "branch": None,
        "response": response,
        "symmetric": symmetric,
        "stable_above": True if end.side < 0 else None,
        "stable_below": True if end.side > 0 else None,
        "side": SIDES[-end.side],
        "born": None,
        "reason": end.reason,
        "changes": [],
    }


def _diagram(
    work: BifurcationWork,
    swept: Sweep,
    points: Sequence[Bifurcation],
    shares: BasinShares | None,
) -> Files:
    """Pictures of the sweep."""
    from designer.plots import bifurcation_plots

    values = swept.plan.values
    marks = bifurcation_plots.marks(points, float(values[0]), float(values[-1]))
    return image_files("sweep", bifurcation_plots.diagram(swept, marks, work.title, shares))


def _curve_files(
    work: BifurcationWork,
    swept: Sweep,
    curves: Sequence[BorderCurve],
    region: ResponseRegion | None,
) -> Files:
    """Table and pictures of the curves."""
    from designer.plots import curve_plots

    assert work.curves is not None
    labels = [(w.response, w.low, w.high) for w in swept.windows if window_ends.period(w)]
    picture = curve_plots.curves(curves, work.curves, work.title, labels, region)
    table = curves_csv(curves, work.curves.first, work.curves.second, swept.plan.subject.si)
    return {"curves.csv": table, **image_files("curves", picture)}


def _shares(work: BifurcationWork, folder: Folder | None) -> BasinShares | None:
    """The counted basins along the sweep, if they were asked for."""
    plan, store = work.shares, None
    if plan is None:
        return None
    if folder is not None:
        store = ShareBlocks(work.files(folder), plan.parameter)
    step = work.progress.stage(f"{len(plan.numbers)} starts at each value", len(plan.values))
    return basin_shares.run(plan, work.jobs, store, step)


def _region(work: BifurcationWork, plan: CurvePlan, swept: Sweep) -> ResponseRegion | None:
    """The region of the response at the value that was asked for, if one was.

    Raises
    ------
    InputError : the sweep shows no periodic response there.
    """
    if work.region is None:
        return None
    k = int(np.argmin(np.abs(swept.plan.values - work.region)))
    at = (work.region, plan.at)
    flows = plan.subject.plane(plan.first, plan.second)
    orbit = settle(flows.build(*at), next(iter(swept.steps.values()))[k].start)
    if orbit.status is not OrbitStatus.PERIODIC:
        expected = f"a value with a periodic response ({orbit.response} there)"
        raise InputError(None, "--region", work.region, expected)
    step = work.progress.stage(f"region of {orbit.response}", response_region.RAYS)
    found = response_region.region(flows, orbit, at, plan.window, jobs=work.jobs, progress=step)
    return replace(found, spread=_spread_box(work, plan, found))


def _spread_box(work: BifurcationWork, plan: CurvePlan, found: ResponseRegion) -> SpreadBox | None:
    """How far boards lie from the nominal one, over settings that their parts act like."""
    subject = plan.subject
    if work.spread is None or not isinstance(subject, BoardSubject):
        return None
    circuit, seed = subject.design.circuit, work.request.seed
    drawn = draw_many(circuit, work.spread, seed, range(SPREAD_BOARDS))
    ratios = subject.setting_ratios(drawn.board(k) for k in range(SPREAD_BOARDS))
    if not {plan.first, plan.second} <= ratios.keys():
        return None
    both = np.column_stack([ratios[plan.first], ratios[plan.second]])
    return SpreadBox.about(found.at, both, found.border)


def _curves(
    work: BifurcationWork, plan: CurvePlan, points: Sequence[Bifurcation], folder: Folder | None
) -> list[BorderCurve]:
    """The curves through the sweep's points, or what of them the folder has not."""
    store = None
    if folder is not None:
        store = CurveBlocks(work.files(folder))
    over = f"bifurcation curves over {plan.first} and {plan.second}"
    step = work.progress.stage(over, border_curves.BLOCKS * (1 + plan.depth))
    return border_curves.run(plan, points, work.jobs, store, step)
