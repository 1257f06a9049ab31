"""What is made of a request for a diagram, a map or basins, what is written and in which order."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

import numpy as np

from designer.base import progress
from designer.base.arrays import Array
from designer.base.design_folder import Folder
from designer.base.errors import MISSING, InputError
from designer.base.frames import frame, table_html
from designer.base.manifest import StageName, Stages
from designer.base.plain_json import dumps, plain
from designer.base.si_unit import Unit
from designer.base.version import __version__
from designer.bifurcations import (
    basin_shares,
    basins,
    border_curves,
    parameter_map,
    response_region,
    sweep,
    window_ends,
)
from designer.bifurcations.basin_shares import BasinShares, SharePlan
from designer.bifurcations.basins import BasinPlan, Basins
from designer.bifurcations.block_store import KeptBlocks
from designer.bifurcations.border_curve import BorderCurve
from designer.bifurcations.border_curves import CurvePlan
from designer.bifurcations.parameter_map import MapPlan, ParameterMap
from designer.bifurcations.points import SIDES, Bifurcation
from designer.bifurcations.response_region import ResponseRegion, SpreadBox
from designer.bifurcations.subject import Subject
from designer.bifurcations.sweep import Sweep, SweepPlan, Window
from designer.bifurcations.window_ends import SweptEnd, WindowEnds
from designer.catalog.parts_catalog import load_catalog
from designer.check.curved_laws import LawMisfit, curved_laws, law_misfits, misfits_json
from designer.circuit.swept_board import BoardSubject
from designer.dynamics.attractors import settle
from designer.dynamics.counts import period_of
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.steady_state import SteadyMotion
from designer.folders.model_source import model_of
from designer.folders.origin import provenance
from designer.folders.sweep_store import (
    Blocks,
    WorkFiles,
    curve_blocks,
    grid_blocks,
    share_blocks,
    sweep_blocks,
    work_hash,
)
from designer.folders.sweep_tables import curves_csv, points_csv, shares_csv, windows_csv
from designer.jobs.bifurcation_request import (
    Plan,
    Request,
    Swept,
    curve_plan,
    plan_of,
    region_at,
    share_plan,
)
from designer.jobs.options import Options
from designer.model.model_file import ModelFile
from designer.model.swept_model import ModelSubject
from designer.plots import captions, point_captions, titles
from designer.spread.part_rules import spread_of
from designer.spread.spread import Spread, draw_many

if TYPE_CHECKING:
    import pandas as pd

    from designer.answers.bifurcation_answer import (
        AxisRow,
        BasinsBody,
        BifurcationAnswer,
        CurveRow,
        EndsInSi,
        GridBody,
        MapBody,
        PointRow,
        SiUnitKeys,
        SweepAnswer,
        SweepBody,
        SweepExtras,
        ValueInSi,
        WindowRow,
    )
Files = dict[str, str | bytes]
"""Contents of files by name."""
Made: TypeAlias = "tuple[SweepBody | MapBody | BasinsBody, dict[str, Any], Callable[[], Files]]"
"""What is in the JSON object, what it cost, and what makes the pictures and tables."""
Kept = TypeVar("Kept")
PlanOf = TypeVar("PlanOf")
Computed = Sweep | ParameterMap | Basins
"""What a plan makes."""


def _blocks(plan: Plan, files: WorkFiles) -> Blocks[Any]:
    """Where the blocks of a plan's work are kept, to write them and to read them."""
    return sweep_blocks(plan, files) if isinstance(plan, SweepPlan) else grid_blocks(plan, files)


def _computed(
    plan: Plan,
    jobs: int,
    store: KeptBlocks[Any] | None,
    step: Callable[[], None] = lambda: None,
) -> Computed:
    """What a plan makes, or what of it the store has not."""
    if isinstance(plan, SweepPlan):
        return sweep.run(plan, jobs, store, step)
    if isinstance(plan, MapPlan):
        return parameter_map.run(plan, jobs, store, step)
    return basins.run(plan, jobs, store, step)


class BifurcationWork:
    """What is to be computed, and what decides it."""

    def __init__(self, request: Request, plan: Plan, modelfile: ModelFile, jobs: int) -> None:
        self.request, self.plan, self.jobs = request, plan, jobs
        self.title = modelfile.title
        self.made: Computed | None = None
        self.folder: Folder | None = None
        self.curves: CurvePlan | None = None
        self.region: float | None = None
        self.spread: Spread | None = None
        self.shares: SharePlan | None = None
        more: dict[str, Any] = {}
        if isinstance(plan, SweepPlan):
            self.curves = curve_plan(request, plan, modelfile)
            more = {"points": request.points}
            if request.points and isinstance(plan.subject, BoardSubject):
                # A word of its own: earlier versions found none on boards.
                corners = [str(guard.corner) for guard in plan.subject.system.corners]
                more |= {"corners": corners} if corners else {}
            more |= {} if self.curves is None else {"and": self.curves.as_dict()}
            self.region = region_at(request, plan, modelfile)
            more |= {} if self.region is None else {"region": self.region}
            if self.region is not None and isinstance(plan.subject, BoardSubject):
                circuit = plan.subject.design.circuit
                self.spread = spread_of(modelfile, circuit, load_catalog())
                more |= {"spread": self.spread.as_dict(), "seed": request.seed}
            self.shares = share_plan(request, plan, modelfile)
            more |= {} if self.shares is None else {"shares": self.shares.as_dict()}
        self.decides = {"kind": request.kind, **plan.as_dict(), **more}
        self.hash = work_hash(self.decides)
        self.provenance = provenance(
            modelfile,
            load_catalog().hash,
            seed=self._seed,
            settings={"bifurcation": self.decides},
        )

    def computed(self) -> Computed:
        """The sweep, the map or the basins, or what of them the folder has not."""
        plan = self.plan
        if isinstance(plan, SweepPlan):
            over = titles.taken(plan.subject, plan.parameter, plan.values)
            blocks = sum(len(plan.blocks(track)) for track in plan.tracks)
        else:
            over = titles.taken(plan.subject, plan.x, plan.xs)
            over += f" and {titles.taken(plan.subject, plan.y, plan.ys)}"
            blocks = len(plan.ys)
        step = progress.stage(f"{self.request.kind} over {over}", blocks)
        self.made = _computed(plan, self.jobs, self.store(_blocks, plan), step)
        return self.made

    @property
    def _seed(self) -> int | None:
        """Seed of the random starts; those of ``--starts`` are always the same."""
        if self.shares is not None:
            return self.shares.seed
        return None if self.request.starts is None else 0

    def store(
        self, blocks: Callable[[PlanOf, WorkFiles], Blocks[Kept]], plan: PlanOf
    ) -> Blocks[Kept] | None:
        """Where the finished blocks of a plan lie in the folder, if there is one."""
        if self.folder is None:
            return None
        path, vouches = self.folder.path, self.folder.vouches
        files = WorkFiles(path, self.hash, self.provenance, progress.note, vouches)
        return blocks(plan, files)


def _value_in_si(value: float | None, unit: Unit | None) -> ValueInSi:
    """A value of the swept quantity in its SI unit, if it has one."""
    if unit is None or value is None:
        return {}
    return cast("ValueInSi", {f"value_{unit.suffix}": value * unit.scale})


def _ends_in_si(low: float, high: float, unit: Unit | None) -> EndsInSi:
    """The ends of a range likewise."""
    if unit is None:
        return {}
    ends = {"from": low, "to": high}.items()
    return cast("EndsInSi", {f"{key}_{unit.suffix}": end * unit.scale for key, end in ends})


def _si_keys(unit: Unit | None) -> SiUnitKeys:
    return {} if unit is None else {"si_unit": unit.name, "si_scale": unit.scale}


def image_files(kind: str, figure: Any) -> Files:
    from designer.base.figure_style import to_png, to_svg

    return {f"{kind}.png": to_png(figure, 200.0), f"{kind}.svg": to_svg(figure)}


SPREAD_BOARDS = 200
"""Boards that are drawn for the box of spread."""
CURVE_FILES = ("curves.csv", "curves.png", "curves.svg")
"""Tables and pictures of bifurcation curves."""
TABLES = ("windows.csv", "points.csv")
"""Tables of the sweep itself."""


def _sweep(work: BifurcationWork, plan: SweepPlan) -> Made:
    """The sweep, its points, and what else was asked for along it."""
    jobs, name = work.jobs, plan.parameter
    swept, found = work.computed(), None
    assert isinstance(swept, Sweep)
    if work.request.points:
        step = progress.stage("bifurcation points", len(window_ends.windows(swept)))
        found = window_ends.find(swept, jobs, step)
    points = () if found is None else found.points
    si, unit = plan.subject.si.get(name), plan.subject.units.get(name, "")
    symbol = titles.NAMES.get(name, name)
    rows: list[PointRow] = [
        {
            **p.as_dict(),
            **_value_in_si(p.value, si),
            "caption": point_captions.caption(p, symbol, unit),
            "changes": [c.as_dict() for c in captions.changes(swept, p)],
        }
        for p in points
    ]
    for end in () if found is None else found.missing:
        caption = captions.missing(end, symbol, unit)
        row = _missing(name, end)
        rows.append({**row, **_value_in_si(row["value"], si), "caption": caption})
    rows.sort(key=lambda row: row["value"])
    windows, shares = _windows(swept, found, si), _shares(work)
    extras: SweepExtras = {}
    suffix = "" if si is None else si.suffix
    tables = (windows_csv(windows, suffix), points_csv(rows, suffix))
    pictures: list[Callable[[], Files]] = [
        lambda: _diagram(work, swept, points, shares),
        lambda: dict(zip(TABLES, tables, strict=True)),
    ]
    if shares is not None:
        extras["shares"] = shares.as_dict()
        pictures.append(lambda: {"shares.csv": shares_csv(shares)})
    if work.curves is not None:
        curves = _curves(work, work.curves, points)
        second = plan.subject.si.get(work.curves.second)
        axis = work.curves.as_dict()
        extras["and"] = {
            **axis,
            "at": work.curves.at,
            **_ends_in_si(axis["from"], axis["to"], second),
            "unit": plan.subject.units.get(work.curves.second, ""),
            **_si_keys(second),
        }
        extras["curves"] = [curve.as_dict() for curve in curves]
        region = _region(work, work.curves, swept)
        if region is not None:
            extras["region"] = region.as_dict()
        pictures.append(lambda: _curve_files(work, swept, curves, region))

    def files() -> Files:
        return {name: content for each in pictures for name, content in each().items()}

    body: SweepBody = {
        "parameter": name,
        "unit": unit,
        "from": float(plan.values.min()),
        "to": float(plan.values.max()),
        **_si_keys(si),
        "tracks": plan.tracks,
        "steps": len(plan.values),
        "windows": windows,
        "points": rows,
        **extras,
    }
    return body, {"periods": swept.periods}, files


def _windows(swept: Sweep, found: WindowEnds | None, unit: Unit | None) -> list[WindowRow]:
    """The windows of a sweep; where they were looked for, families and ends of periodic ones."""
    out = []
    for number, window in enumerate(swept.windows):
        row: WindowRow = {
            **window.as_dict(),
            **_ends_in_si(window.low, window.high, unit),
            **misfits_json(_misfits(swept, window)),
        }
        ends = None if found is None else found.ends[number]
        if found is not None:
            row["family"] = found.families[number]
        if ends is not None:
            low, high = ends
            row["from_end"] = {**low.as_dict(), **_value_in_si(low.value, unit)}
            row["to_end"] = {**high.as_dict(), **_value_in_si(high.value, unit)}
        out.append(row)
    return out


def _misfits(swept: Sweep, window: Window) -> list[LawMisfit]:
    """Where the first, the middle or the last step of a window draws a curved law beyond its span,
    or over few of its pieces: of each law the largest error."""
    plan, subject = swept.plan, swept.plan.subject
    assert isinstance(subject, ModelSubject | BoardSubject)
    if not curved_laws(subject.drawn({plan.parameter: window.low})[0]):
        return []
    family, values = subject.family(plan.parameter), plan.values.tolist()
    first, last = values.index(window.low), values.index(window.high)
    tracks = (window.track,) if window.track in plan.tracks else plan.tracks
    worst: dict[tuple[str, ...], LawMisfit] = {}
    for k in {first, (first + last) // 2, last}:
        model, units = subject.drawn({plan.parameter: values[k]})
        for step in (swept.steps[track][k] for track in tracks):
            if (step.response, step.symmetric) != (window.response, window.symmetric):
                continue
            orbit = Orbit(step.status, step.n, step.p, step.q, step.start)
            for misfit in law_misfits(model, family.flow(values[k]), orbit, units):
                known = worst.get(misfit.where)
                if known is None or (misfit.beyond, misfit.error) > (known.beyond, known.error):
                    worst[misfit.where] = misfit
    return list(worst.values())


def _missing(parameter: str, end: SweptEnd) -> PointRow:
    """A row among the points, by the keys of a point, for an end that was not located."""
    response, symmetric = end.window.response, end.window.symmetric
    assert end.value is not None
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
    labels = [(w.response, w.low, w.high) for w in swept.windows if period_of(w.response)]
    picture = curve_plots.curves(curves, work.curves, work.title, labels, region)
    table = curves_csv(curves, work.curves.first, work.curves.second, swept.plan.subject.si)
    return {"curves.csv": table, **image_files("curves", picture)}


def _shares(work: BifurcationWork) -> BasinShares | None:
    """The counted basins along the sweep, if they were asked for."""
    plan = work.shares
    if plan is None:
        return None
    step = progress.stage(f"{len(plan.numbers)} starts at each value", len(plan.values))
    return basin_shares.run(plan, work.jobs, work.store(share_blocks, plan), step)


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
    orbit = settle(flows.flow(*at), next(iter(swept.steps.values()))[k].start)
    if orbit.status is not OrbitStatus.PERIODIC:
        expected = f"a value with a periodic response ({orbit.response} there)"
        raise InputError(None, "--region", work.region, expected)
    step = progress.stage(f"region of {orbit.response}", response_region.RAYS)
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
    work: BifurcationWork, plan: CurvePlan, points: Sequence[Bifurcation]
) -> list[BorderCurve]:
    """The curves through the sweep's points, or what of them the folder has not."""
    over = f"bifurcation curves over {plan.first} and {plan.second}"
    step = progress.stage(over, border_curves.BLOCKS * (1 + plan.depth))
    return border_curves.run(plan, points, work.jobs, work.store(curve_blocks, plan), step)


class _Finished:
    """The blocks of a finished work, which are only read."""

    def __init__(self, store: Blocks[Any]) -> None:
        self.store = store

    def read(self, *place: Any) -> Any:
        found = self.store.read(*place)
        if found is None:
            raise self._gone(MISSING, self.store.name(*place))
        return found

    def write(self, *_: Any) -> None:
        """Asked for where a block's values cannot be those of the work."""
        raise self._gone("values of another work", "a block")

    def _gone(self, found: object, name: str) -> InputError:
        expected = "every block of the finished work: --overwrite makes it anew"
        return InputError(self.store.files.root, name, found, expected)


@dataclass(frozen=True)
class PictureData:
    """What the pictures of a work show: in memory, or in the blocks of its folder."""

    plan: Plan
    """What was asked for."""
    made: Computed | None
    """What was made now; None where the folder had all."""
    kept: WorkFiles | None
    """The blocks in the folder, if there is one."""

    def read(self) -> Computed:
        """The data.

        Raises
        ------
        InputError : the folder's blocks are gone, or not those of this work.
        """
        if self.made is not None:
            return self.made
        assert self.kept is not None
        return _computed(self.plan, 1, _Finished(_blocks(self.plan, self.kept)))


@dataclass(frozen=True)
class BifurcationResult:
    """What the verb ``bifurcation`` answers."""

    answer: BifurcationAnswer = field(repr=False)
    """The JSON object (docs/contract.md)."""
    reused: bool
    """Whether the folder held the answer already."""
    folder: Path | None
    """The folder that it is in, if any."""
    ends: tuple[str, str]
    """Of the sweep, as they were asked for: they say the unit that comes first."""
    data: PictureData = field(repr=False)
    """The data of its pictures."""

    def steps(self) -> pd.DataFrame:
        """What a sweep shows at each value on each track, a row each: the response with its
        exponent, and of a periodic one the largest multiplier; empty of a map and of basins."""
        names = "response", "symmetric", "lyapunov", "lyapunov_error"
        rows = (
            {
                **place,
                **{name: getattr(step, name) for name in names},
                "largest_multiplier": step.radius,
            }
            for place, step in self._steps()
        )
        return frame(rows, ("track", *names, "largest_multiplier"))

    def diagram(self) -> pd.DataFrame:
        """The dots of a sweep's picture, a row each: the least displacement in each period that was
        kept, and the velocity of each impact on a stop that is shown; empty of a map and of
        basins."""
        rows = list[dict[str, Any]]()
        for place, step in self._steps():
            stops = [stop.name for stop in self.data.plan.subject.stops]
            clouds = {"least displacement": step.minima}
            every = (step.velocities, *step.further)
            clouds |= {f"impact velocity on {n}": v for n, v in zip(stops, every, strict=False)}
            rows += [
                {**place, "quantity": quantity, "value": float(value)}
                for quantity, values in clouds.items()
                for value in values
            ]
        return frame(rows, ("track", "quantity", "value"))

    def cells(self) -> pd.DataFrame:
        """The points of a map or of basins, a row each: both coordinates, the response there, and
        of basins the number of the attractor; empty of a sweep."""
        made = self.data.read()
        if isinstance(made, Sweep):
            return frame((), ("response",))
        plan = made.plan
        places = ((x, y) for y in plan.ys.tolist() for x in plan.xs.tolist())
        return frame(
            {
                plan.x: x,
                plan.y: y,
                "response": cell.response,
                **({"attractor": cell.attractor} if isinstance(made, Basins) else {}),
            }
            for (x, y), cell in zip(places, made.cells, strict=True)
        )

    def _steps(self) -> Iterator[tuple[dict[str, Any], SteadyMotion]]:
        """Every step of a sweep, with its track and its value."""
        made = self.data.read()
        if isinstance(made, Sweep):
            for track, steps in made.steps.items():
                for value, step in zip(made.plan.values.tolist(), steps, strict=True):
                    yield {"track": track, made.plan.parameter: value}, step

    def windows(self) -> pd.DataFrame:
        """The windows of a sweep, a row each; empty of a map and of basins."""
        return frame(() if self._sweep is None else self._sweep["windows"])

    def curves(self) -> pd.DataFrame:
        """The curves over two parameters, a row each; empty where none were asked for."""
        return frame(self._curves)

    def curve_points(self) -> pd.DataFrame:
        """The points of these curves, a row each: the curve's number from 1, both parameters, and
        whether the orbit is stable on one side; empty where none were asked for."""
        second = None if self._sweep is None else self._sweep.get("and")
        names = (self._over, "" if second is None else second["name"])
        return frame(
            {"curve": number, **dict(zip(names, point, strict=True)), "stable": stable}
            for number, curve in enumerate(self._curves, 1)
            for point, stable in zip(curve["points"], curve["stable"], strict=True)
        )

    def shares(self) -> pd.DataFrame:
        """The counted basins of a sweep, a row for each attractor at each value; empty where none
        were asked for."""
        counted = None if self._sweep is None else self._sweep.get("shares")
        attractors = () if counted is None else counted["attractors"]
        return frame([{"attractor": a["number"], **s} for a in attractors for s in a["steps"]])

    def points(self) -> pd.DataFrame:
        """The bifurcation points of a sweep, a row each; empty of a map and of basins."""
        columns = "parameter", "kind", "value", "before", "after", "response"
        return frame(() if self._sweep is None else self._sweep["points"], columns)

    def _repr_html_(self) -> str:
        names = ("from", "to", "response", "symmetric")
        windows = () if self._sweep is None else self._sweep["windows"]
        rows = [{n: w.get(n) for n in names} for w in windows]
        return table_html(f"{self.answer['kind']} over {self._over}", rows)

    @property
    def _sweep(self) -> SweepAnswer | None:
        return self.answer if self.answer["kind"] == "sweep" else None

    @property
    def _curves(self) -> Sequence[CurveRow]:
        return () if self._sweep is None else self._sweep.get("curves", ())

    @property
    def _over(self) -> str:
        if self.answer["kind"] == "sweep":
            return self.answer["parameter"]
        return f"{self.answer['x']['name']} and {self.answer['y']['name']}"


def requested(
    model: Path | str | ModelFile,
    request: Request,
    out: Path | None,
    options: Options,
) -> BifurcationResult:
    """What is asked for of a model file or a design folder. Nothing is written where the request is
    refused, or ``out`` is None.

    Raises
    ------
    InputError : the words do not fit together, or a value lies outside its domain.
    """
    options.check()
    began = time.perf_counter()
    modelfile, subject = _subject(model, request)
    plan = plan_of(request, subject, modelfile)
    work = BifurcationWork(request, plan, modelfile, options.workers)
    if out is None:
        answer, _ = _make(work)
        answer["cost"]["seconds"] = time.perf_counter() - began
        data = PictureData(plan, work.made, None)
        return BifurcationResult(answer, False, None, request.ends, data)
    folder, kind = Folder(out), request.kind
    work.folder = folder
    inputs = {
        "model": _model_hash(modelfile, folder, kind),
        "version": __version__,
        "subject": "circuit" if request.circuit else "model",
        "work": work.hash,
    }
    if request.circuit:
        inputs["catalogue"] = load_catalog().hash
    stages: Stages = {kind: (inputs, _names(work))}
    asked = {"model": modelfile.text, "work": work.decides}
    todo = folder.decide(stages, overwrite=options.overwrite, resume=options.resume, asked=asked)
    if todo:
        before = None if folder.manifest is None else folder.manifest.provenance
        with folder.working(stages, before or work.provenance):
            answer, figure = _make(work)
            progress.stage("pictures")
            for name, content in figure().items():
                folder.write(name, content)
            answer["cost"]["seconds"] = time.perf_counter() - began
            folder.write(f"{kind}.json", dumps(answer))
    data = PictureData(plan, work.made, WorkFiles(folder.path, work.hash, work.provenance))
    return BifurcationResult(folder.json(f"{kind}.json"), not todo, out, request.ends, data)


# ---------------------------------------------------------------------------------------------


def _model_hash(modelfile: ModelFile, folder: Folder, kind: StageName) -> str:
    """What says of the model file which work a folder has: no motion depends on what is expected
    of one. Folders of earlier versions say it by the file's text."""
    stages = {} if folder.manifest is None else folder.manifest.stages
    said = stages[kind].inputs.get("model") if kind in stages else None
    return modelfile.sha256 if said == modelfile.sha256 else modelfile.motions_sha256


def _subject(model: Path | str | ModelFile, request: Request) -> tuple[ModelFile, Swept]:
    if request.circuit and not isinstance(model, ModelFile) and Path(model).is_dir():
        from designer.folders.design_source import read_design

        synthesis = read_design(model, progress=progress.watched())
        return synthesis.modelfile, BoardSubject(synthesis.design)
    modelfile = model_of(model)
    if request.circuit:
        expected = "a design folder (designer synthesise)"
        raise InputError(modelfile.source, "--circuit", "a model file", expected)
    return modelfile, ModelSubject(modelfile.model, scales=modelfile.si)


def _names(work: BifurcationWork) -> list[str]:
    """Files of a stage."""
    stores: list[tuple[Blocks[Any] | None, tuple[str, ...]]]
    stores = [(work.store(_blocks, work.plan), TABLES if isinstance(work.plan, SweepPlan) else ())]
    if work.shares is not None:
        stores.append((work.store(share_blocks, work.shares), ("shares.csv",)))
    if work.curves is not None:
        stores.append((work.store(curve_blocks, work.curves), CURVE_FILES))
    names = [name for store, more in stores if store for name in (*store.names, *more)]
    return [*names, *(f"{work.request.kind}.{ending}" for ending in ("json", "png", "svg"))]


def _make(work: BifurcationWork) -> tuple[BifurcationAnswer, Callable[[], Files]]:
    """The JSON object, and what makes the pictures and tables."""
    plan = work.plan
    body, cost, draw = _sweep(work, plan) if isinstance(plan, SweepPlan) else _grid(work, plan)
    head = {"format": 1, "kind": work.request.kind}
    return plain({**head, **body, "provenance": work.provenance, "cost": cost}), draw


def _grid(work: BifurcationWork, plan: MapPlan | BasinPlan) -> Made:
    from designer.plots import bifurcation_plots

    kind, made = work.request.kind, work.computed()
    axes: GridBody = {
        "x": _grid_axis(plan.subject, plan.x, plan.xs),
        "y": _grid_axis(plan.subject, plan.y, plan.ys),
    }
    if isinstance(made, ParameterMap):
        draw = partial(bifurcation_plots.parameter_map, made, work.title)
        counted: MapBody = {**axes, "counts": made.counts}
        return counted, {}, lambda: image_files(kind, draw())
    assert isinstance(made, Basins)
    body: BasinsBody = {
        **axes,
        "at": made.plan.changes,
        "attractors": plain(made.attractors),
        "cells": [c.attractor for c in made.cells],
    }
    return body, {}, lambda: image_files(kind, bifurcation_plots.basins(made, work.title))


def _grid_axis(subject: Subject, name: str, values: Array) -> AxisRow:
    low, high = float(values[0]), float(values[-1])
    return {
        "name": name,
        "from": low,
        "to": high,
        "steps": len(values),
        **_ends_in_si(low, high, subject.si.get(name)),
    }
