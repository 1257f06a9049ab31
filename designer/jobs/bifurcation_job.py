"""The verb ``bifurcation``: what is made of a request, what is written and in which order."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from designer.base.arrays import Array
from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.base.frames import frame, table_html
from designer.base.manifest import StageName, Stages
from designer.base.plain_json import dumps, plain
from designer.base.progress import Progress
from designer.base.si_unit import Unit
from designer.base.version import __version__
from designer.bifurcations import (
    basins,
    border_curves,
    captions,
    parameter_map,
    point_captions,
    response_region,
    sweep,
    titles,
    window_ends,
)
from designer.bifurcations.basins import BasinPlan
from designer.bifurcations.border_curves import BorderCurve, CurvePlan
from designer.bifurcations.curve_store import CurveBlocks, curves_csv
from designer.bifurcations.parameter_map import MapPlan
from designer.bifurcations.points import Bifurcation
from designer.bifurcations.response_region import ResponseRegion
from designer.bifurcations.store import GridStore, SweepStore, work_hash
from designer.bifurcations.subject import Subject
from designer.bifurcations.sweep import Sweep, SweepPlan
from designer.catalog.catalog import load_catalog
from designer.circuit.swept_board import BoardSubject
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import OrbitStatus
from designer.jobs.bifurcation_request import (
    Plan,
    Request,
    Swept,
    curve_plan,
    plan_of,
    region_at,
)
from designer.jobs.design_source import read_design, source
from designer.jobs.options import Options
from designer.jobs.origin import provenance
from designer.model.model_file import ModelFile, read_model_file
from designer.model.swept_model import ModelSubject

if TYPE_CHECKING:
    import pandas as pd

Files = dict[str, str | bytes]
"""Contents of files by name."""
_Made = tuple[dict[str, Any], dict[str, Any], Callable[[], Files]]
"""What is in the JSON object, what it cost, and what makes the pictures and tables."""
CURVE_FILES = ("curves.csv", "curves.png", "curves.svg")
"""Tables and pictures of bifurcation curves."""


@dataclass(frozen=True)
class BifurcationResult:
    """What the verb ``bifurcation`` answers."""

    answer: dict[str, Any]
    """The JSON object (docs/contract.md)."""
    reused: bool
    """Whether the folder held the answer already."""

    def windows(self) -> pd.DataFrame:
        """The windows of a sweep, a row each; empty of a map and of basins."""
        return frame(self.answer.get("windows", ()))

    def curves(self) -> pd.DataFrame:
        """The curves over two parameters, a row each; empty where none were asked for."""
        return frame(self.answer.get("curves", ()))

    def points(self) -> pd.DataFrame:
        """The bifurcation points of a sweep, a row each; empty of a map and of basins."""
        return frame(self.answer.get("points", ()))

    def _repr_html_(self) -> str:
        names = ("from", "to", "response", "symmetric")
        rows = [{n: w.get(n) for n in names} for w in self.answer.get("windows", ())]
        return table_html(f"{self.answer['kind']} over {self._over}", rows)

    @property
    def _over(self) -> str:
        if "parameter" in self.answer:
            return str(self.answer["parameter"])
        return f"{self.answer['x']['name']} and {self.answer['y']['name']}"


def bifurcation(
    model: Path | str | ModelFile,
    *,
    over: str | None = None,
    from_: float | str | None = None,
    to: float | str | None = None,
    steps: int | None = None,
    omega: float | None = None,
    frequency: str | None = None,
    down: bool = False,
    up: bool = False,
    starts: int | None = None,
    periods: int | None = None,
    keep: int | None = None,
    map_: tuple[str, float | str, float | str, int] | None = None,
    and_: tuple[str, float | str, float | str] | None = None,
    region: float | str | None = None,
    basins: bool = False,
    circuit: bool = False,
    points: bool = True,
    out: Path | str | None = None,
    jobs: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
) -> BifurcationResult:
    """The verb ``bifurcation``: a diagram, a map of two parameters, or basins of attraction.

    model : a model file or a design folder. ``from_``, to : the ends of the sweep, as numbers or as
    texts with a unit. ``map_`` : (name, from, to, steps) of the other axis. ``and_`` : (name,
    from, to) of a second parameter, over which the sweep's points are continued as curves. region :
    a value of the swept parameter: the region in both parameters of the response there. out : a
    folder to write into; without one nothing is written. The other words are those of the command
    line (docs/bifurcations.md).

    Raises
    ------
    InputError : the words do not fit together, or a value lies outside its domain.
    """
    request = Request(
        over=over,
        low=from_,
        high=to,
        steps=steps,
        omega=omega,
        frequency=frequency,
        down=down,
        up=up,
        starts=starts,
        periods=periods,
        keep=keep,
        second=map_,
        and_=and_,
        region=region,
        basins=basins,
        circuit=circuit,
        points=points,
    )
    options = Options(jobs=jobs, overwrite=overwrite, resume=resume)
    options.check()
    progress = Progress() if progress is None else progress
    return _answer(model, request, None if out is None else Path(out), options, progress)


def _answer(
    model: Path | str | ModelFile,
    request: Request,
    out: Path | None,
    options: Options,
    progress: Progress,
) -> BifurcationResult:
    """Nothing is written where the request is refused, or ``out`` is None."""
    began = time.perf_counter()
    modelfile, subject = _subject(model, request, progress)
    plan = plan_of(request, subject, modelfile)
    work = _Work(request, plan, modelfile, options.workers, progress)
    if out is None:
        answer, _ = _make(work, None)
        answer["cost"]["seconds"] = time.perf_counter() - began
        return BifurcationResult(answer, False)
    folder = Folder(out)
    inputs = {
        "model": modelfile.sha256,
        "version": __version__,
        "subject": "circuit" if request.circuit else "model",
        "work": work.hash,
    }
    if request.circuit:
        inputs["catalogue"] = load_catalog().hash
    kind = request.kind
    stages: Stages = {kind: (inputs, _names(kind, work))}
    todo = folder.decide(stages, overwrite=options.overwrite, resume=options.resume)
    if todo:
        before = None if folder.manifest is None else folder.manifest.provenance
        with folder.working(stages, before or work.provenance):
            answer, figure = _make(work, folder)
            progress.stage("pictures")
            for name, content in figure().items():
                folder.write(name, content)
            answer["cost"]["seconds"] = time.perf_counter() - began
            folder.write(f"{kind}.json", dumps(answer))
    return BifurcationResult(folder.json(f"{kind}.json"), not todo)


# ---------------------------------------------------------------------------------------------


def _subject(
    model: Path | str | ModelFile, request: Request, progress: Progress
) -> tuple[ModelFile, Swept]:
    if not isinstance(model, ModelFile) and Path(model).is_dir():
        if request.circuit:
            synthesis = read_design(model, progress=progress)
            return synthesis.modelfile, BoardSubject(synthesis.design)
        modelfile, _ = source(model, model)
    else:
        modelfile = model if isinstance(model, ModelFile) else read_model_file(Path(model))
        if request.circuit:
            expected = "a design folder (designer synthesise)"
            raise InputError(modelfile.source, "--circuit", "a model file", expected)
    return modelfile, ModelSubject(modelfile.model, scales=modelfile.si)


class _Work:
    """What is to be computed, and what decides it."""

    def __init__(
        self, request: Request, plan: Plan, modelfile: ModelFile, jobs: int, progress: Progress
    ) -> None:
        self.request, self.plan, self.jobs, self.progress = request, plan, jobs, progress
        self.title = modelfile.title
        self.curves: CurvePlan | None = None
        self.region: float | None = None
        more: dict[str, Any] = {}
        if isinstance(plan, SweepPlan):
            self.curves = curve_plan(request, plan, modelfile)
            more = {"points": request.points}
            more |= {} if self.curves is None else {"and": self.curves.as_dict()}
            self.region = region_at(request, plan, modelfile)
            more |= {} if self.region is None else {"region": self.region}
        decides = {"kind": request.kind, **plan.as_dict(), **more}
        self.hash = work_hash(decides)
        self.provenance = provenance(
            modelfile,
            load_catalog().hash,
            seed=0 if request.starts is not None else None,
            settings={"bifurcation": decides},
        )


def _names(kind: StageName, work: _Work) -> list[str]:
    """Files of a stage."""
    plan = work.plan
    if isinstance(plan, SweepPlan):
        blocks = [
            SweepStore.name(track, k)
            for track in plan.tracks
            for k in range(len(plan.blocks(track)))
        ]
    else:
        blocks = [GridStore.name(kind, row) for row in range(len(plan.ys))]
    if work.curves is not None:
        blocks += [*CurveBlocks.names(), *CURVE_FILES]
    return [*blocks, f"{kind}.json", f"{kind}.png", f"{kind}.svg"]


def _make(work: _Work, folder: Folder | None) -> tuple[dict[str, Any], Callable[[], Files]]:
    """The JSON object, and what makes the pictures and tables."""
    plan = work.plan
    if isinstance(plan, SweepPlan):
        body, cost, draw = _sweep(work, plan, folder)
    else:
        body, cost, draw = _grid(work, plan, folder)
    head = {"format": 1, "kind": work.request.kind}
    return plain({**head, **body, "provenance": work.provenance, "cost": cost}), draw


def _sweep(work: _Work, plan: SweepPlan, folder: Folder | None) -> _Made:
    from designer.report import bifurcation_plots, curve_plots

    progress, jobs, name = work.progress, work.jobs, plan.parameter
    store = None
    if folder is not None:
        store = SweepStore(
            folder.path, name, work.hash, work.provenance, progress.note, folder.vouches
        )
    blocks = sum(len(plan.blocks(track)) for track in plan.tracks)
    swept = sweep.run(plan, jobs, store, progress.stage(f"sweep over {name}", blocks))
    points = []
    if work.request.points:
        step = progress.stage("bifurcation points", len(window_ends.windows(swept)))
        points = window_ends.locate(swept, jobs, step)
    si, unit = plan.subject.si.get(name), plan.subject.units.get(name, "")
    symbol = titles.NAMES.get(name, name)
    body = {
        "parameter": name,
        "unit": unit,
        **({} if si is None else {"si_unit": si.name}),
        "tracks": list(plan.tracks),
        "steps": len(plan.values),
        "windows": [_with_si(w.as_dict(), si) for w in swept.windows],
        "points": [
            {
                **_with_si(p.as_dict(), si),
                "caption": point_captions.caption(p, symbol, unit),
                "changes": [c.as_dict() for c in captions.changes(swept, p)],
            }
            for p in points
        ],
    }
    marks = bifurcation_plots.marks(points, float(plan.values[0]), float(plan.values[-1]))
    cost = {"periods": swept.periods}

    def files() -> Files:
        return _image_files("sweep", bifurcation_plots.diagram(swept, marks, work.title))

    if work.curves is None:
        return body, cost, files
    curves = _curves(work, work.curves, points, folder)
    body["and"] = _with_si(
        {**work.curves.as_dict(), "at": work.curves.at},
        plan.subject.si.get(work.curves.second),
    )
    body["curves"] = [curve.as_dict() for curve in curves]
    region = _region(work, work.curves, swept)
    if region is not None:
        body["region"] = region.as_dict()
    labels = [(w.response, w.low, w.high) for w in swept.windows if window_ends.period(w)]

    def all_files() -> Files:
        assert work.curves is not None
        picture = curve_plots.curves(curves, work.curves, work.title, labels, region)
        table = curves_csv(curves, work.curves.first, work.curves.second)
        return {**files(), "curves.csv": table, **_image_files("curves", picture)}

    return body, cost, all_files


def _region(work: _Work, plan: CurvePlan, swept: Sweep) -> ResponseRegion | None:
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
    return response_region.region(flows, orbit, at, plan.window, jobs=work.jobs, progress=step)


def _curves(
    work: _Work, plan: CurvePlan, points: Sequence[Bifurcation], folder: Folder | None
) -> list[BorderCurve]:
    """The curves through the sweep's points, or what of them the folder has not."""
    store = None
    if folder is not None:
        store = CurveBlocks(
            folder.path, work.hash, work.provenance, work.progress.note, folder.vouches
        )
    over = f"bifurcation curves over {plan.first} and {plan.second}"
    step = work.progress.stage(over, border_curves.BLOCKS)
    return border_curves.run(plan, points, work.jobs, store, step)


def _grid(work: _Work, plan: MapPlan | BasinPlan, folder: Folder | None) -> _Made:
    from designer.report import bifurcation_plots

    kind, progress, jobs = work.request.kind, work.progress, work.jobs
    store = None
    if folder is not None:
        axes = (kind, plan.x, plan.xs, plan.y, plan.ys)
        store = GridStore(
            folder.path, *axes, work.hash, work.provenance, progress.note, folder.vouches
        )
    step = progress.stage(f"{kind} over {plan.x} and {plan.y}", len(plan.ys))
    body: dict[str, Any] = {
        "x": _grid_axis(plan.subject, plan.x, plan.xs),
        "y": _grid_axis(plan.subject, plan.y, plan.ys),
    }
    if isinstance(plan, MapPlan):
        mapped = parameter_map.run(plan, jobs, store, step)
        body["counts"] = mapped.counts
        return (
            body,
            {},
            lambda: _image_files(kind, bifurcation_plots.parameter_map(mapped, work.title)),
        )
    plane = basins.run(plan, jobs, store, step)
    body |= {
        "at": plan.changes,
        "attractors": [dict(a.__dict__) for a in plane.attractors],
        "cells": [c.attractor for c in plane.cells],
    }
    return body, {}, lambda: _image_files(kind, bifurcation_plots.basins(plane, work.title))


def _grid_axis(subject: Subject, name: str, values: Array) -> dict[str, Any]:
    axis = {"name": name, "from": values[0], "to": values[-1], "steps": len(values)}
    return _with_si(axis, subject.si.get(name))


def _with_si(row: dict[str, Any], unit: Unit | None) -> dict[str, Any]:
    """The row, and the values of the swept quantity in its SI unit too, if it has one."""
    if unit is None:
        return row
    keys = [key for key in ("from", "to", "value") if key in row]
    return {**row, **{f"{key}_{unit.suffix}": row[key] * unit.scale for key in keys}}


def _image_files(kind: str, figure: Any) -> Files:
    from designer.base.figure_style import to_png, to_svg

    return {f"{kind}.png": to_png(figure, 200.0), f"{kind}.svg": to_svg(figure)}
