"""The verb ``bifurcation``: what is made of a request, what is written and in which order."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.arrays import Array
from designer.base.defaults import cores
from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.base.frames import frame, table_html
from designer.base.manifest import StageName
from designer.base.plain_json import dumps, plain
from designer.base.progress import Progress
from designer.base.si_unit import Unit
from designer.base.version import __version__
from designer.bifurcations import (
    basins,
    captions,
    parameter_map,
    point_captions,
    sweep,
    titles,
    window_ends,
)
from designer.bifurcations.parameter_map import MapPlan
from designer.bifurcations.store import GridStore, SweepStore, work_hash
from designer.bifurcations.subject import Subject
from designer.bifurcations.sweep import SweepPlan
from designer.catalog.catalog import load_catalog
from designer.circuit.swept_board import BoardSubject
from designer.jobs.bifurcation_request import Plan, Request, Swept, plan_of
from designer.jobs.origin import provenance
from designer.jobs.synthesise_job import read_design, source
from designer.model.model_file import ModelFile, read_model_file
from designer.model.swept_model import ModelSubject

if TYPE_CHECKING:
    import pandas as pd

FORMAT = 1


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
    model: Path | str,
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

    model : a model file or a design folder. from_, to : the ends of the sweep, as numbers or as
    texts with a unit. map_ : (name, from, to, steps) of the other axis. out : a folder to write
    into; without one nothing is written. The other words are those of the command line
    (docs/bifurcations.md).

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
        basins=basins,
        circuit=circuit,
        points=points,
        jobs=jobs,
        overwrite=overwrite,
        resume=resume,
    )
    said = Progress() if progress is None else progress
    return BifurcationResult(
        *answer(Path(model), request, None if out is None else Path(out), said)
    )


def answer(
    path: Path, request: Request, out: Path | None, progress: Progress
) -> tuple[dict[str, Any], bool]:
    """The JSON object of the verb, and whether it was there already.

    Raises
    ------
    InputError : the options do not fit together, a value lies outside its domain, or a file stands
        in the way. Nothing is written then.
    """
    began = time.perf_counter()
    modelfile, subject = _subject(path, request, progress)
    plan = plan_of(request, subject, modelfile)
    said = _provenance(modelfile, request, plan)
    if out is None:
        made, _ = _make(plan, request, modelfile.title, None, said, progress)
        return {**made, "cost": {**made["cost"], "seconds": time.perf_counter() - began}}, False
    folder = Folder(out)
    inputs = {
        "model": modelfile.sha256,
        "version": __version__,
        "subject": "circuit" if request.circuit else "model",
        "work": work_hash(_decides(plan, request)),
    }
    if request.circuit:
        inputs["catalogue"] = load_catalog().hash
    wanted: dict[StageName, Any] = {request.kind: (inputs, _names(request.kind, plan))}
    todo = folder.decide(wanted, overwrite=request.overwrite, resume=request.resume)
    if todo:
        kept = None if folder.manifest is None else folder.manifest.provenance
        folder.begin(wanted, kept or said)
        made, figure = _make(plan, request, modelfile.title, folder, said, progress)
        progress.stage("pictures")
        for name, content in _drawn(request.kind, figure()).items():
            folder.write(name, content)
        made["cost"]["seconds"] = time.perf_counter() - began
        folder.write(f"{request.kind}.json", dumps(made))
        folder.finish(request.kind)
    return folder.json(f"{request.kind}.json"), not todo


# ---------------------------------------------------------------------------------------------


def _subject(path: Path, request: Request, progress: Progress) -> tuple[ModelFile, Swept]:
    if path.is_dir():
        if request.circuit:
            made = read_design(path, progress=progress)
            return made.modelfile, BoardSubject(made.design)
        modelfile, _ = source(path, path)
    else:
        modelfile = read_model_file(path)
        if request.circuit:
            raise InputError(
                path, "--circuit", "a model file", "a design folder (designer synthesise)"
            )
    return modelfile, ModelSubject(modelfile.model, mechanical=modelfile.mechanical)


def _decides(plan: Plan, request: Request) -> dict[str, Any]:
    asked = {"points": request.points} if request.kind == "sweep" else {}
    return {"kind": request.kind, **plan.as_dict(), **asked}


def _provenance(modelfile: ModelFile, request: Request, plan: Plan) -> dict[str, Any]:
    settings = {"bifurcation": _decides(plan, request)}
    seed = 0 if request.starts is not None else None
    return provenance(modelfile, load_catalog().hash, seed=seed, settings=settings)


def _names(kind: StageName, plan: Plan) -> list[str]:
    """Files of a stage."""
    if isinstance(plan, SweepPlan):
        blocks = [
            SweepStore.name(track, k)
            for track in plan.tracks
            for k in range(len(plan.blocks(track)))
        ]
    else:
        blocks = [GridStore.name(kind, row) for row in range(len(plan.ys))]
    return [*blocks, f"{kind}.json", f"{kind}.png", f"{kind}.svg"]


def _make(
    plan: Plan,
    request: Request,
    name: str,
    folder: Folder | None,
    said: Mapping[str, Any],
    progress: Progress,
) -> tuple[dict[str, Any], Callable[[], Any]]:
    """The JSON object, and what draws the picture."""
    from designer.report import bifurcation_plots

    jobs = cores() if request.jobs is None else request.jobs
    work = work_hash(_decides(plan, request))
    head = {"format": FORMAT, "kind": request.kind}
    tail = {"provenance": said}
    if isinstance(plan, SweepPlan):
        store = None
        if folder is not None:
            vouch = folder.vouches
            store = SweepStore(folder.path, plan.parameter, work, said, progress.note, vouch)
        blocks = sum(len(plan.blocks(t)) for t in plan.tracks)
        made = sweep.run(plan, jobs, store, progress.stage(f"sweep over {plan.parameter}", blocks))
        si = plan.subject.si.get(plan.parameter)
        points = []
        if request.points:
            count = len(window_ends.windows(made))
            step = progress.stage("bifurcation points", count)
            points = window_ends.locate(made, jobs, step)
        unit = plan.subject.units.get(plan.parameter, "")
        symbol = titles.NAMES.get(plan.parameter, plan.parameter)
        body = {
            "parameter": plan.parameter,
            "unit": unit,
            **({} if si is None else {"si_unit": si.name}),
            "tracks": list(plan.tracks),
            "steps": len(plan.values),
            "windows": [_with_si(w.as_dict(), si) for w in made.windows],
            "points": [
                {
                    **_with_si(p.as_dict(), si),
                    "caption": point_captions.caption(p, symbol, unit),
                    "changes": [c.as_dict() for c in captions.changes(made, p)],
                }
                for p in points
            ],
        }
        cost = {"periods": made.periods}
        marks = bifurcation_plots.marks(points, float(plan.values[0]), float(plan.values[-1]))
        return plain({**head, **body, **tail, "cost": cost}), lambda: bifurcation_plots.diagram(
            made, marks, name
        )
    grid = None
    if folder is not None:
        axes = (request.kind, plan.x, plan.xs, plan.y, plan.ys)
        grid = GridStore(folder.path, *axes, work, said, progress.note, folder.vouches)
    step = progress.stage(f"{request.kind} over {plan.x} and {plan.y}", len(plan.ys))
    body = {
        "x": _grid_axis(plan.subject, plan.x, plan.xs),
        "y": _grid_axis(plan.subject, plan.y, plan.ys),
    }
    if isinstance(plan, MapPlan):
        mapped = parameter_map.run(plan, jobs, grid, step)
        body["counts"] = mapped.counts
        return plain({**head, **body, **tail, "cost": {}}), lambda: bifurcation_plots.parameter_map(
            mapped, name
        )
    found = basins.run(plan, jobs, grid, step)
    body |= {
        "at": plan.changes,
        "attractors": [dict(a.__dict__) for a in found.attractors],
        "cells": [c.attractor for c in found.cells],
    }
    return plain({**head, **body, **tail, "cost": {}}), lambda: bifurcation_plots.basins(
        found, name
    )


def _grid_axis(subject: Subject, name: str, values: Array) -> dict[str, Any]:
    axis = {"name": name, "from": values[0], "to": values[-1], "steps": len(values)}
    return _with_si(axis, subject.si.get(name))


def _with_si(row: dict[str, Any], unit: Unit | None) -> dict[str, Any]:
    """The row, and the values of the swept quantity in its SI unit too, if it has one."""
    if unit is None:
        return row
    keys = [key for key in ("from", "to", "value") if key in row]
    return {**row, **{f"{key}_{unit.suffix}": row[key] * unit.scale for key in keys}}


def _drawn(kind: StageName, figure: Any) -> dict[str, str | bytes]:
    from designer.base.figure_style import to_png, to_svg

    return {f"{kind}.png": to_png(figure, 200.0), f"{kind}.svg": to_svg(figure)}
