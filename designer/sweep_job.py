"""The verb ``bifurcation``: what is asked, what is made, what is written and in which order."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from designer import __version__, basins, parameter_map, point_changes, sweep, sweep_points
from designer.basins import BasinPlan
from designer.catalog import load_catalog
from designer.design_files import load
from designer.errors import InputError
from designer.folder import Folder, StageName
from designer.job import source
from designer.jsonout import dumps, plain
from designer.modelfile import ModelFile, read_model_file
from designer.parameter_map import MapPlan
from designer.preconditions import at_least, cores
from designer.progress import Progress
from designer.provenance import provenance
from designer.responses import check_omega
from designer.schema import one_of
from designer.steady import Course
from designer.sweep import DOWN, UP, SweepPlan
from designer.sweep_store import GridStore, SweepStore, work_hash
from designer.sweep_subject import BoardSubject, ModelSubject, Subject
from designer.system import Array

FORMAT = 1
MOST_STEPS, MOST_STARTS, MOST_PERIODS = 100_000, 64, 1_000_000
MOST_CELLS = 4_000_000
"""Of a map or a basin."""
BASIN_STEPS = 200
"""Of each axis of a basin where nothing is said."""


@dataclass(frozen=True)
class Request:
    """The command line: numbers in the units that the swept parameter has.

    over : None for ω, the generator's frequency with ``circuit``, or x1 with ``basins``. low, high,
    steps : of it. second : (name, from, to, steps) of a map's or a basin's other axis. omega : the
    drive's frequency where it is not swept. periods : (left out, kept), None for the defaults.
    """

    over: str | None = None
    low: float | None = None
    high: float | None = None
    steps: int | None = None
    omega: float | None = None
    down: bool = False
    up: bool = False
    starts: int | None = None
    periods: int | None = None
    keep: int | None = None
    second: tuple[str, float, float, int] | None = None
    basins: bool = False
    circuit: bool = False
    points: bool = True
    jobs: int | None = None
    overwrite: bool = False
    resume: bool = False

    @property
    def kind(self) -> StageName:
        """Which of the three pictures is asked for."""
        return "basins" if self.basins else "map" if self.second is not None else "sweep"


Plan = SweepPlan | MapPlan | BasinPlan


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
    modelfile, subject = _subject(path, request)
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
        made, figure = _make(plan, request, modelfile.title, folder.path, said, progress)
        progress.stage("pictures")
        for name, content in _drawn(request.kind, figure()).items():
            folder.write(name, content)
        made["cost"]["seconds"] = time.perf_counter() - began
        folder.write(f"{request.kind}.json", dumps(made))
        folder.finish(request.kind)
    return folder.json(f"{request.kind}.json"), not todo


def plan_of(request: Request, subject: Subject, modelfile: ModelFile) -> Plan:
    """What is to be made.

    Raises
    ------
    InputError : an option is missing, is one too many, or has a value that cannot be.
    """
    _check_options(request)
    if request.basins:
        return _basin_plan(request, subject, modelfile)
    over = request.over or ("frequency" if request.circuit else "omega")
    for option, value in (("--from", request.low), ("--to", request.high)):
        if value is None:
            raise InputError(None, option, "nothing", f"a value of {over}")
        subject.check("--over" if over not in subject.parameters else option, over, value)
    low, high, steps = _axis("--from", "--to", "--steps", request.low, request.high, request.steps)
    swept = [over]
    if request.second is not None:
        name, start, stop, count = request.second
        if name == over:
            raise InputError(None, "--map", name, f"another parameter than --over {over}")
        for value in (start, stop):
            subject.check("--map", name, value)
        ys = np.linspace(*_axis("--map", "--map", "--map", start, stop, count))
        _check_cells(steps, count)
        swept.append(name)
    subject = _at_frequency(request, subject, modelfile, swept)
    values = np.linspace(low, high, steps)
    if request.second is not None:
        course = _course(request, parameter_map.COURSE)
        return MapPlan(subject, over, values, name, ys, course=course)
    if request.starts is not None:
        ends = [{over: low}, {over: high}]
        tracks = sweep.from_starts(subject, ends, request.starts)
    else:
        both = [d for d, asked in ((DOWN, request.down), (UP, request.up)) if asked]
        tracks = sweep.follow(*(both or [DOWN]))
    return SweepPlan(subject, over, values, course=_course(request, Course()), **tracks)


# ---------------------------------------------------------------------------------------------


def _check_options(request: Request) -> None:
    if request.starts is not None:
        at_least("--starts", request.starts, 1)
        if request.starts > MOST_STARTS:
            raise InputError(None, "--starts", request.starts, f"at most {MOST_STARTS}")
        if request.down or request.up:
            raise InputError(None, "--starts", request.starts, "without --down and --up")
    if request.kind != "sweep" and (request.starts is not None or request.down or request.up):
        raise InputError(
            None, "--down, --up or --starts", "given", "none with --map or --basins: every point "
            "has the same start"
        )  # fmt: skip
    if request.periods is not None:
        at_least("--periods", request.periods, 0)
    if request.keep is not None:
        at_least("--keep", request.keep, 1)
    for option, count in (("--periods", request.periods), ("--keep", request.keep)):
        if count is not None and count > MOST_PERIODS:
            raise InputError(None, option, count, f"at most {MOST_PERIODS}")
    if request.jobs is not None:
        at_least("--jobs", request.jobs, 1)


def _axis(
    first: str,
    second: str,
    third: str,
    low: float | None,
    high: float | None,
    steps: int | None,
) -> tuple[float, float, int]:
    assert low is not None
    assert high is not None
    if steps is None:
        raise InputError(None, third, "nothing", "a whole number >= 2")
    at_least(third, steps, 2)
    if steps > MOST_STEPS:
        raise InputError(None, third, steps, f"at most {MOST_STEPS}")
    for option, value in ((first, low), (second, high)):
        if not np.isfinite(value):
            raise InputError(None, option, value, "a finite number")
    if low == high:
        raise InputError(None, second, high, f"another value than {first} {low:g}")
    return min(low, high), max(low, high), steps


def _check_cells(columns: int, rows: int) -> None:
    if columns * rows > MOST_CELLS:
        found = f"{columns} x {rows} points"
        raise InputError(None, "--map", found, f"at most {MOST_CELLS} points in all")


def _course(request: Request, usual: Course) -> Course:
    settle = usual.settle if request.periods is None else request.periods
    keep = usual.keep if request.keep is None else request.keep
    return replace(usual, settle=settle, keep=keep)


def _basin_plan(request: Request, subject: Subject, modelfile: ModelFile) -> BasinPlan:
    states = subject.states
    name, start, stop, count = request.second or (states[1], None, None, None)
    over = request.over or states[0]
    for option, state in (("--over", over), ("--map", name)):
        if state not in states:
            raise InputError(None, option, state, one_of(state, states) + " with --basins")
    if name == over:
        raise InputError(None, "--map", name, f"another state than --over {over}")
    subject = _at_frequency(request, subject, modelfile, [])
    changes = _changes(subject)
    size = dict(zip(states, subject.scale([changes]), strict=True))

    def axis(state: str, option: str, low: Any, high: Any, steps: Any) -> Array:
        reach = float(size[state])
        return np.linspace(
            *_axis(
                "--from" if option == "--over" else option,
                "--to" if option == "--over" else option,
                "--steps" if option == "--over" else option,
                -reach if low is None else low,
                reach if high is None else high,
                BASIN_STEPS if steps is None else steps,
            )
        )

    xs = axis(over, "--over", request.low, request.high, request.steps)
    ys = axis(name, "--map", start, stop, count)
    _check_cells(len(xs), len(ys))
    return BasinPlan(
        subject,
        changes,
        over,
        xs,
        name,
        ys,
        np.zeros(len(states)),
        _course(request, parameter_map.COURSE),
    )


def _changes(subject: Subject) -> dict[str, float]:
    if isinstance(subject, BoardSubject):
        assert subject.frequency is not None
        return {"frequency": subject.frequency}
    assert subject.omega is not None
    return {"omega": subject.omega}


def _at_frequency(
    request: Request, subject: Subject, modelfile: ModelFile, swept: list[str]
) -> Subject:
    """With the drive's frequency fixed, where it is not swept: --omega, or the first response's."""
    if "omega" in swept or "frequency" in swept:
        if request.omega is not None:
            raise InputError(None, "--omega", request.omega, "nothing: the frequency is swept")
        if {"omega", "frequency"} <= set(swept):
            raise InputError(None, "--map", swept[1], "not the frequency a second time")
        return subject
    omega = request.omega
    if omega is None:
        known = [r.omega for r in modelfile.responses if r.omega is not None]
        if not known:
            raise InputError(
                None, "--omega", "nothing", "the drive's frequency: no response of the file has one"
            )
        omega = known[0]
    check_omega("--omega", omega)
    if isinstance(subject, BoardSubject):
        frequency = subject.design.errors.scales.frequency(omega)
        return BoardSubject(subject.design, frequency, subject.amplitude, subject.offset)
    return ModelSubject(subject.model, omega)


def _subject(path: Path, request: Request) -> tuple[ModelFile, Subject]:
    if path.is_dir():
        modelfile, _ = source(path, path)
        if request.circuit:
            made = load(Folder(path), modelfile, load_catalog())
            return modelfile, BoardSubject(made.design)
    else:
        modelfile = read_model_file(path)
        if request.circuit:
            raise InputError(
                path, "--circuit", "a model file", "a design folder (designer synthesise)"
            )
    return modelfile, ModelSubject(modelfile.model)


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
    root: Path | None,
    said: Mapping[str, Any],
    progress: Progress,
) -> tuple[dict[str, Any], Callable[[], Any]]:
    """The JSON object, and what draws the picture."""
    from designer import bifurcation_plots

    jobs = cores() if request.jobs is None else request.jobs
    work = work_hash(_decides(plan, request))
    head = {"format": FORMAT, "kind": request.kind}
    tail = {"provenance": said}
    if isinstance(plan, SweepPlan):
        store = None if root is None else SweepStore(root, plan.parameter, work, said)
        blocks = sum(len(plan.blocks(t)) for t in plan.tracks)
        made = sweep.run(plan, jobs, store, progress.stage(f"sweep over {plan.parameter}", blocks))
        points = []
        if request.points:
            count = len(sweep_points.windows(made))
            step = progress.stage("bifurcation points", count)
            points = sweep_points.locate(made, jobs, step)
        body = {
            "parameter": plan.parameter,
            "unit": plan.subject.units.get(plan.parameter, ""),
            "tracks": list(plan.tracks),
            "steps": len(plan.values),
            "windows": [w.as_dict() for w in made.windows],
            "points": [
                {
                    **p.as_dict(),
                    "changes": [c.as_dict() for c in point_changes.changes(made, p)],
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
    if root is not None:
        grid = GridStore(root, request.kind, plan.x, plan.xs, plan.y, plan.ys, work, said)
    step = progress.stage(f"{request.kind} over {plan.x} and {plan.y}", len(plan.ys))
    body = {
        "x": {"name": plan.x, "from": plan.xs[0], "to": plan.xs[-1], "steps": len(plan.xs)},
        "y": {"name": plan.y, "from": plan.ys[0], "to": plan.ys[-1], "steps": len(plan.ys)},
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


def _drawn(kind: StageName, figure: Any) -> dict[str, str | bytes]:
    from designer.plots import to_png, to_svg

    png = BytesIO()
    to_png(figure, png, 200.0)
    return {f"{kind}.png": png.getvalue(), f"{kind}.svg": to_svg(figure)}
