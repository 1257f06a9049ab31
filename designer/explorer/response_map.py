"""The map of n-p-q over two parameters around a place, coarse at first, and the borders on it.

A long call hands the turn back at each report of its progress: ``stepped`` makes pieces for
``work_queue`` of a call that knows nothing of it: the call runs in a thread of its own, but only
while somebody waits for the next piece.
"""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from designer.base.errors import InputError
from designer.base.schema import one_of
from designer.bifurcations import border_curves, parameter_map
from designer.bifurcations.border_curve import BorderCurve
from designer.bifurcations.border_curves import CurvePlan
from designer.bifurcations.parameter_map import MapCell, MapPlan
from designer.bifurcations.plane_curves import PlaneWindow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.explorer.controls import Control, controls
from designer.explorer.place import OMEGA, ModelPlace, number_of
from designer.explorer.response_view import reached, summary
from designer.explorer.wire import Message, columns
from designer.model.model import SiScales
from designer.model.model_file import ModelFile
from designer.model.swept_model import ModelSubject
from designer.plots.response_colours import MARKS, palette_legend, response_palette
from designer.plots.titles import title

Result = TypeVar("Result")


class _AbandonedError(BaseException):
    """Nobody wants the result any more."""


class _Call:
    """The thread of one call."""

    def __init__(self, call: Callable[[Callable[[], None]], object]) -> None:
        self.result: object = None
        self.error: BaseException | None = None
        self.done = False
        self._abandoned = False
        self._call = call
        self._ours, self._theirs = threading.Semaphore(0), threading.Semaphore(0)
        self._thread = threading.Thread(target=self._run, name="stepped call", daemon=True)
        self._thread.start()

    def step(self) -> None:
        """Let it run until it reports its progress, or ends."""
        self._ours.release()
        self._theirs.acquire()

    def abandon(self) -> None:
        """End it where it is."""
        self._abandoned = True
        self._ours.release()
        self._thread.join()

    def _progress(self) -> None:
        self._theirs.release()
        self._ours.acquire()
        if self._abandoned:
            raise _AbandonedError

    def _run(self) -> None:
        self._ours.acquire()
        try:
            if not self._abandoned:
                self.result = self._call(self._progress)
        except _AbandonedError:
            pass
        except BaseException as error:
            self.error = error
        finally:
            self.done = True
            self._theirs.release()


def stepped(call: Callable[[Callable[[], None]], Result]) -> Generator[None, None, Result]:
    """The result of a call, which is given a function that it calls at each bit of progress; an
    item for each of these. What the call raises is raised; where the generator is closed, it ends.
    """
    running = _Call(call)
    try:
        running.step()
        while not running.done:
            yield
            running.step()
    finally:
        if not running.done:
            running.abandon()
    if running.error is not None:
        raise running.error
    return running.result  # type: ignore[return-value]


COLUMNS, ROWS = 65, 49
"""Points of the finest grid, its ends included."""
STRIDES = (8, 4, 2, 1)
"""The strides over the grid's points: every eighth one first, and so on; none is computed twice."""
REACH = 0.2
"""How far a map reaches to each side where nobody says: of the value, within the slider's ends."""
STEPS = 200_000
"""The most steps of a point that the compiled engine does not name: some 50 ms. A picture may take
more."""
PIECE = 0.03
"""Seconds after which a piece ends."""


@dataclass(frozen=True)
class MapSide:
    """One parameter of a map, and how far the map reaches over it."""

    control: Control
    """The parameter's slider."""
    low: float
    """Least value."""
    high: float
    """Greatest value."""

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return self.control.name

    def message(self) -> Message:
        """What the page writes of it."""
        unit = f" [{self.control.unit}]" if self.control.unit else ""
        ends = {"low": f"{self.low:.9g}", "high": f"{self.high:.9g}"}
        return {"name": self.name, "label": f"{self.control.label}{unit}", **ends}


@dataclass(frozen=True)
class MapRequest:
    """A map that a page asks for."""

    place: ModelPlace
    """Where the other parameters stay."""
    x: MapSide
    """The side from left to right."""
    y: MapSide
    """The side from bottom to top."""

    @property
    def subject(self) -> ModelSubject:
        """The model at the place."""
        scales = SiScales() if self.place.in_si else None
        return ModelSubject(self.place.model, self.place.omega, scales=scales)

    @property
    def plan(self) -> MapPlan:
        """The finest grid, from rest."""
        xs = np.linspace(self.x.low, self.x.high, COLUMNS)
        ys = np.linspace(self.y.low, self.y.high, ROWS)
        return MapPlan(self.subject, self.x.name, xs, self.y.name, ys)

    @property
    def at(self) -> tuple[float, float]:
        """Values of both parameters at the place."""
        return _value(self.place, self.x.name), _value(self.place, self.y.name)

    @property
    def window(self) -> PlaneWindow:
        """The rectangle of the map."""
        return PlaneWindow((self.x.low, self.x.high), (self.y.low, self.y.high))


def read_map(modelfile: ModelFile, place: ModelPlace, words: object) -> MapRequest:
    """The map that these words ask for.

    words : "x" and "y", names of parameters; "x_low", "x_high", "y_low" and "y_high", each a number
    or a text with a unit, or "" for an end that is chosen around the place.

    Raises
    ------
    InputError : a parameter that is not there, or twice; an end outside its domain, or reversed.
    """
    if not isinstance(words, Mapping):
        raise InputError(None, "map", repr(words), "two parameters and their ends")
    x, y = (_side(modelfile, place, key, words) for key in ("x", "y"))
    if x.name == y.name:
        raise InputError(None, "map.y", y.name, "another parameter than map.x")
    return MapRequest(place, x, y)


def mapped(request: MapRequest) -> Iterator[Message]:
    """What the map is of, then its cells in pieces, level after level.

    A piece has the row, column and response of each of its cells, how wide they are in points of
    the grid, and the colours in words. Colours change at the end of a level only, past the first.
    """
    plan = request.plan
    yield {
        "kind": "map",
        "x": request.x.message(),
        "y": request.y.message(),
        "columns": COLUMNS,
        "rows": ROWS,
        "words": title("", plan, 1000).replace("\n", "; "),
    }
    counts: Counter[str] = Counter()
    looks: dict[str, str] = {}
    for level, stride in enumerate(STRIDES):
        for piece in _pieces(plan, level):
            counts.update(cell.response for cell in piece)
            if level == 0 or counts.total() == _whole(stride):
                looks = response_palette(counts)
            yield _cells_message(piece, stride, counts, looks)


def borders(request: MapRequest) -> Iterator[Message]:
    """The curves that bound the response at the place, within the map: those through the ends of
    its windows over either parameter. A message a point, so that none takes long."""
    _, orbit = reached(request.place)
    hindrance = _hindrance(request, orbit)
    if hindrance:
        yield _borders_message([], hindrance, done=True)
        return
    (x, y), title = request.at, f"Borders of {summary(orbit)}"
    plan = CurvePlan(request.subject, request.x.name, request.y.name, y, request.window)
    curves: list[BorderCurve] = []

    def follow(step: Callable[[], None]) -> None:
        curves.extend(border_curves.around(plan, orbit, x, step))

    for points, _ in enumerate(stepped(follow)):
        yield _borders_message(curves, f"{title}: being followed, {points} points so far")
    words = title if curves else f"{title}: none was found within the map"
    yield _borders_message(curves, words, done=True)


def _side(
    modelfile: ModelFile, place: ModelPlace, key: str, words: Mapping[str, object]
) -> MapSide:
    """What the words say of one parameter. key : "x" or "y"."""
    name = str(words.get(key))
    every = {each.name: each for each in controls(modelfile, [name])}
    field = f"map.{key}"
    if name not in every:
        raise InputError(None, field, name, one_of(name, every))
    control = every[name]
    low, high = _around(control, _value(place, control.name))
    subject = ModelSubject(place.model, place.omega)
    ends = []
    for end, usual in (("low", low), ("high", high)):
        given = words.get(f"{key}_{end}", "")
        value = usual if given == "" else number_of(modelfile, field, control.name, given)
        subject.check(field, control.name, value)
        ends.append(value)
    if ends[0] >= ends[1]:
        found = f"{ends[0]:.6g} to {ends[1]:.6g}"
        raise InputError(None, field, found, f"{control.name} from a lower to a greater value")
    return MapSide(control, *ends)


def _around(control: Control, value: float) -> tuple[float, float]:
    """The ends around a value where nobody says, with the digits that a page shows."""
    reach = REACH * abs(value) or 0.5 * REACH * (control.high - control.low)
    low, high = min(control.low, value), max(control.high, value)
    return max(low, control.rounded(value - reach, 4)), min(high, control.rounded(value + reach, 4))


def _value(place: ModelPlace, name: str) -> float:
    return place.omega if name == OMEGA else place.model.parameter(name)


def _pieces(plan: MapPlan, level: int) -> Iterator[list[MapCell]]:
    """The cells of a level that no level before it had."""
    piece: list[MapCell] = []
    begun = time.monotonic()
    for row in _rows(level):
        for cell in parameter_map.cells_at(plan, row, STEPS):
            piece.append(cell)
            if time.monotonic() - begun > PIECE:
                yield piece
                piece, begun = [], time.monotonic()
    if piece:
        yield piece


def _rows(level: int) -> Iterator[list[tuple[int, int]]]:
    """(row, column) of the cells that are new on a level, row by row."""
    stride, before = STRIDES[level], STRIDES[level - 1] if level else 0
    for i in range(0, ROWS, stride):
        row = [(i, j) for j in range(0, COLUMNS, stride)]
        yield [(i, j) for i, j in row if not before or i % before or j % before]


def _whole(stride: int) -> int:
    """How many cells a map has that is whole down to this stride."""
    return len(range(0, ROWS, stride)) * len(range(0, COLUMNS, stride))


def _cells_message(
    piece: list[MapCell], stride: int, counts: Counter[str], looks: dict[str, str]
) -> Message:
    legend = palette_legend(counts, looks)
    return {
        "kind": "cells",
        "stride": stride,
        "cells": [[cell.i, cell.j, cell.response] for cell in piece],
        "looks": looks,
        "legend": [[colour, f"{text}: {share:.1%}"] for colour, text, share in legend],
        "done": counts.total(),
        "of": ROWS * COLUMNS,
    }


def _hindrance(request: MapRequest, orbit: Orbit) -> str:
    """Why no borders are looked for; "" where they are."""
    if orbit.status is not OrbitStatus.PERIODIC:
        return f"No borders are looked for: the motion here is {orbit.response}"
    if not request.window.holds(*request.at):
        return "No borders are looked for: the present place lies outside the map"
    return ""


def _borders_message(curves: list[BorderCurve], words: str, *, done: bool = False) -> Message:
    """The stretches of the curves beside which a stable orbit lives. done : whether these are
    all."""
    kinds = dict.fromkeys(curve.kind for curve in curves)
    return {
        "kind": "borders",
        "words": words,
        "done": done,
        "curves": [_line(curve) for curve in curves],
        "legend": [[_colour(kind), kind] for kind in kinds],
    }


def _line(curve: BorderCurve) -> Message:
    points = curve.points.copy()
    points[~np.array(curve.stable)] = np.nan
    return {"colour": _colour(curve.kind), "data": columns({"x": points[:, 0], "y": points[:, 1]})}


def _colour(kind: str) -> str:
    return MARKS[kind][1]
