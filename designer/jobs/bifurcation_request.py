"""What ``bifurcation`` is asked for, and the plan of the sweep, map or basins that this makes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.checks import at_least
from designer.base.errors import MISSING, InputError
from designer.base.manifest import StageName
from designer.base.schema import one_of
from designer.bifurcations import parameter_map, sweep
from designer.bifurcations.basins import BasinPlan
from designer.bifurcations.parameter_map import MapPlan
from designer.bifurcations.sweep import DOWN, UP, SweepPlan
from designer.circuit.swept_board import BoardSubject
from designer.dynamics.steady_state import Course
from designer.model.find_responses import check_omega
from designer.model.model_file import ModelFile
from designer.model.swept_model import ModelSubject

MOST_STEPS, MOST_STARTS, MOST_PERIODS = 100_000, 64, 1_000_000
MOST_CELLS = 4_000_000
"""Of a map or a basin."""
BASIN_STEPS = 200
"""Of each axis of a basin where nothing is said."""

Swept = ModelSubject | BoardSubject


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


def plan_of(request: Request, subject: Swept, modelfile: ModelFile) -> Plan:
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
            raise InputError(None, option, MISSING, f"a value of {over}")
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
        raise InputError(None, third, MISSING, "a whole number >= 2")
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


def _basin_plan(request: Request, subject: Swept, modelfile: ModelFile) -> BasinPlan:
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


def _changes(subject: Swept) -> dict[str, float]:
    if isinstance(subject, BoardSubject):
        assert subject.frequency is not None
        return {"frequency": subject.frequency}
    assert subject.omega is not None
    return {"omega": subject.omega}


def _at_frequency(
    request: Request, subject: Swept, modelfile: ModelFile, swept: list[str]
) -> Swept:
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
                None, "--omega", MISSING, "the drive's frequency: no response of the file has one"
            )
        omega = known[0]
    check_omega("--omega", omega)
    if isinstance(subject, BoardSubject):
        frequency = subject.design.errors.scales.frequency(omega)
        return BoardSubject(subject.design, frequency, subject.amplitude, subject.offset)
    return ModelSubject(subject.model, omega)
