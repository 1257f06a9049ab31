"""What is made of a request for a diagram, a map or basins, what is written and in which order."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.arrays import Array
from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.base.frames import frame, table_html
from designer.base.manifest import StageName, Stages
from designer.base.plain_json import dumps, plain
from designer.base.progress import Progress
from designer.base.version import __version__
from designer.bifurcations import basins, parameter_map
from designer.bifurcations.basins import BasinPlan
from designer.bifurcations.parameter_map import MapPlan
from designer.bifurcations.subject import Subject
from designer.bifurcations.sweep import SweepPlan
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.swept_board import BoardSubject
from designer.folders.model_source import source
from designer.folders.sweep_store import GridStore
from designer.jobs.bifurcation_request import Request, Swept, plan_of
from designer.jobs.bifurcation_work import BifurcationWork, Files, Made, image_files, with_si
from designer.jobs.options import Options
from designer.jobs.sweep_answer import sweep_answer, sweep_files
from designer.model.model_file import ModelFile, read_model_file
from designer.model.swept_model import ModelSubject

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class BifurcationResult:
    """What the verb ``bifurcation`` answers."""

    answer: dict[str, Any]
    """The JSON object (docs/contract.md)."""
    reused: bool
    """Whether the folder held the answer already."""
    folder: Path | None
    """The folder that it is in, if any."""
    ends: tuple[str, str]
    """Of the sweep, as they were asked for: they say the unit that comes first."""

    def windows(self) -> pd.DataFrame:
        """The windows of a sweep, a row each; empty of a map and of basins."""
        return frame(self.answer.get("windows", ()))

    def curves(self) -> pd.DataFrame:
        """The curves over two parameters, a row each; empty where none were asked for."""
        return frame(self.answer.get("curves", ()))

    def shares(self) -> pd.DataFrame:
        """The counted basins of a sweep, a row for each attractor at each value; empty where none
        were asked for."""
        attractors = self.answer.get("shares", {}).get("attractors", ())
        return frame([{"attractor": a["number"], **s} for a in attractors for s in a["steps"]])

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


def requested(
    model: Path | str | ModelFile,
    request: Request,
    out: Path | None,
    options: Options,
    progress: Progress,
) -> BifurcationResult:
    """What is asked for of a model file or a design folder. Nothing is written where the request is
    refused, or ``out`` is None.

    Raises
    ------
    InputError : the words do not fit together, or a value lies outside its domain.
    """
    options.check()
    began = time.perf_counter()
    modelfile, subject = _subject(model, request, progress)
    plan = plan_of(request, subject, modelfile)
    work = BifurcationWork(request, plan, modelfile, options.workers, progress)
    if out is None:
        answer, _ = _make(work, None)
        answer["cost"]["seconds"] = time.perf_counter() - began
        return BifurcationResult(answer, False, None, request.ends)
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
    asked = {"model": modelfile.text, "work": work.decides}
    todo = folder.decide(stages, overwrite=options.overwrite, resume=options.resume, asked=asked)
    if todo:
        before = None if folder.manifest is None else folder.manifest.provenance
        with folder.working(stages, before or work.provenance):
            answer, figure = _make(work, folder)
            progress.stage("pictures")
            for name, content in figure().items():
                folder.write(name, content)
            answer["cost"]["seconds"] = time.perf_counter() - began
            folder.write(f"{kind}.json", dumps(answer))
    return BifurcationResult(folder.json(f"{kind}.json"), not todo, out, request.ends)


# ---------------------------------------------------------------------------------------------


def _subject(
    model: Path | str | ModelFile, request: Request, progress: Progress
) -> tuple[ModelFile, Swept]:
    if not isinstance(model, ModelFile) and Path(model).is_dir():
        if request.circuit:
            from designer.folders.design_source import read_design

            synthesis = read_design(model, progress=progress)
            return synthesis.modelfile, BoardSubject(synthesis.design)
        modelfile, _ = source(model, model)
    else:
        modelfile = model if isinstance(model, ModelFile) else read_model_file(Path(model))
        if request.circuit:
            expected = "a design folder (designer synthesise)"
            raise InputError(modelfile.source, "--circuit", "a model file", expected)
    return modelfile, ModelSubject(modelfile.model, scales=modelfile.si)


def _names(kind: StageName, work: BifurcationWork) -> list[str]:
    """Files of a stage."""
    plan = work.plan
    if isinstance(plan, SweepPlan):
        blocks = sweep_files(work, plan)
    else:
        blocks = [GridStore.name(kind, row) for row in range(len(plan.ys))]
    return [*blocks, f"{kind}.json", f"{kind}.png", f"{kind}.svg"]


def _make(
    work: BifurcationWork, folder: Folder | None
) -> tuple[dict[str, Any], Callable[[], Files]]:
    """The JSON object, and what makes the pictures and tables."""
    plan = work.plan
    if isinstance(plan, SweepPlan):
        body, cost, draw = sweep_answer(work, plan, folder)
    else:
        body, cost, draw = _grid(work, plan, folder)
    head = {"format": 1, "kind": work.request.kind}
    return plain({**head, **body, "provenance": work.provenance, "cost": cost}), draw


def _grid(work: BifurcationWork, plan: MapPlan | BasinPlan, folder: Folder | None) -> Made:
    from designer.plots import bifurcation_plots

    kind, progress, jobs = work.request.kind, work.progress, work.jobs
    store = None
    if folder is not None:
        store = GridStore(work.files(folder), kind, plan.x, plan.xs, plan.y, plan.ys)
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
            lambda: image_files(kind, bifurcation_plots.parameter_map(mapped, work.title)),
        )
    plane = basins.run(plan, jobs, store, step)
    body |= {
        "at": plan.changes,
        "attractors": [dict(a.__dict__) for a in plane.attractors],
        "cells": [c.attractor for c in plane.cells],
    }
    return body, {}, lambda: image_files(kind, bifurcation_plots.basins(plane, work.title))


def _grid_axis(subject: Subject, name: str, values: Array) -> dict[str, Any]:
    axis = {"name": name, "from": values[0], "to": values[-1], "steps": len(values)}
    return with_si(axis, subject.si.get(name))
