"""What ``bifurcation`` is asked for, and the plan of the sweep, map or basins that this makes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.defaults import CURVE_DEPTH, SEED, check_count
from designer.base.errors import MISSING, InputError
from designer.base.manifest import StageName
from designer.base.schema import one_of
from designer.bifurcations import parameter_map, sweep
from designer.bifurcations.basin_shares import SharePlan
from designer.bifurcations.basins import BasinPlan
from designer.bifurcations.border_curves import CurvePlan
from designer.bifurcations.parameter_map import MapPlan
from designer.bifurcations.plane_curves import PlaneWindow
from designer.bifurcations.sweep import DOWN, UP, SweepPlan
from designer.circuit.swept_board import BoardSubject
from designer.dynamics.steady_state import TransientSettings
from designer.model.mechanics import check_omega
from designer.model.model_file import ModelFile
from designer.model.si_units import Reader
from designer.model.swept_model import ModelSubject
from designer.spread import random_streams

MOST_STEPS, MOST_STARTS, MOST_PERIODS = 100_000, 64, 1_000_000
MOST_DEPTH = 100
"""Of curves that are begun at points of codimension two of others."""
MOST_CELLS = 4_000_000
"""Of a map or a basin."""
BASIN_STEPS = 200
"""Of each axis of a basin where nothing is said."""

Swept = ModelSubject | BoardSubject


@dataclass(frozen=True)
class Request:
    """What the verb is asked, by the names of its parameters, which say what each is. Numbers are
    in the units that the swept parameter has, texts have a unit; None stands for the usual."""

    over: str | None = None
    from_: float | str | None = None
    to: float | str | None = None
    steps: int | None = None
    omega: float | None = None
    frequency: str | None = None
    down: bool = False
    up: bool = False
    starts: int | None = None
    periods: int | None = None
    keep: int | None = None
    map_: tuple[str, float | str, float | str, int] | None = None
    and_: tuple[str, float | str, float | str] | None = None
    depth: int | None = None
    region: float | str | None = None
    basins: bool = False
    circuit: bool = False
    points: bool = True
    shares: int | None = None
    box: tuple[tuple[str, float | str, float | str], ...] = ()
    seed: int = SEED

    @property
    def ends(self) -> tuple[str, str]:
        """Least and largest value of the swept parameter as they are asked for; "" for the
        usual."""
        low, high = ("" if end is None else str(end) for end in (self.from_, self.to))
        return low, high

    @property
    def kind(self) -> StageName:
        """Which of the three pictures is asked for."""
        return "basins" if self.basins else "map" if self.map_ is not None else "sweep"


Plan = SweepPlan | MapPlan | BasinPlan


def plan_of(request: Request, subject: Swept, modelfile: ModelFile) -> Plan:
    """The sweep, map or basins that a request asks for.

    Raises
    ------
    InputError : an option is missing, is one too many, or has a value that cannot be.
    """
    _check_options(request)
    if request.basins:
        return _basin_plan(request, subject, modelfile)
    over = request.over or ("frequency" if request.circuit else "omega")
    read = _reader(subject, modelfile)
    first = _read(read, subject, "--from", over, request.from_)
    last = _read(read, subject, "--to", over, request.to)
    ends = {over: (("--from", first), ("--to", last))}
    if request.map_ is not None:
        name, *limits, count = request.map_
        if name == over:
            raise InputError(None, "--map", name, f"another parameter than --over {over}")
        start, stop = (_read(read, subject, "--map", name, value) for value in limits)
        ends[name] = ("--map", start), ("--map", stop)
    _check_ends(subject, ends)
    low, high, steps = _axis("--from", "--to", "--steps", first, last, request.steps)
    if request.map_ is not None:
        ys = np.linspace(*_axis("--map", "--map", "--map", start, stop, count))
        _check_cells(steps, count)
    subject = _at_frequency(request, subject, modelfile, list(ends))
    values = np.linspace(low, high, steps)
    if request.map_ is not None:
        course = _course(request, parameter_map.COURSE)
        return MapPlan(subject, over, values, name, ys, course=course)
    if request.starts is not None:
        both_ends = [{over: low}, {over: high}]
        tracks = sweep.from_starts(subject, both_ends, request.starts)
    else:
        both = [d for d, wanted in ((DOWN, request.down), (UP, request.up)) if wanted]
        tracks = sweep.follow(*(both or [DOWN]))
    return SweepPlan(subject, over, values, course=_course(request, TransientSettings()), **tracks)


def curve_plan(request: Request, plan: SweepPlan, modelfile: ModelFile) -> CurvePlan | None:
    """The bifurcation curves that a request asks for through the points of its sweep, if any.

    Raises
    ------
    InputError : the second parameter cannot be swept, is the first one, or its value along the
        sweep lies outside the ends.
    """
    if request.and_ is None:
        return None
    name, *ends = request.and_
    subject = plan.subject
    assert isinstance(subject, ModelSubject | BoardSubject)
    if name == plan.parameter:
        raise InputError(None, "--and", name, f"another parameter than --over {name}")
    read = _reader(subject, modelfile)
    one, other = (_read(read, subject, "--and", name, value) for value in ends)
    held = subject.fixed({plan.parameter: None, name: None})
    at = held.get(name)
    if at is None:
        names = [n for n, value in held.items() if value is not None and n != plan.parameter]
        raise InputError(None, "--and", name, one_of(name, names))
    low, high = min(one, other), max(one, other)
    if not low < high or not low <= at <= high:
        expected = f"two ends about {at:.6g}, the value along the sweep"
        raise InputError(None, "--and", f"{name} from {low:g} to {high:g}", expected)
    window = PlaneWindow((float(plan.values[0]), float(plan.values[-1])), (low, high))
    over = (("--from", window.first[0]), ("--to", window.first[1]))
    _check_ends(subject, {plan.parameter: over, name: (("--and", low), ("--and", high))})
    depth = CURVE_DEPTH if request.depth is None else request.depth
    return CurvePlan(subject, plan.parameter, name, float(at), window, depth)


def region_at(request: Request, plan: SweepPlan, modelfile: ModelFile) -> float | None:
    """The value of the swept parameter at which a response's region is asked for, if any.

    Raises
    ------
    InputError : it lies outside the sweep.
    """
    if request.region is None:
        return None
    assert isinstance(plan.subject, ModelSubject | BoardSubject)
    read = _reader(plan.subject, modelfile)
    value = _read(read, plan.subject, "--region", plan.parameter, request.region)
    low, high = float(plan.values[0]), float(plan.values[-1])
    if not low < value < high:
        raise InputError(None, "--region", value, f"a value between {low:g} and {high:g}")
    return value


def share_plan(request: Request, plan: SweepPlan, modelfile: ModelFile) -> SharePlan | None:
    """The starts that a request counts along its sweep, if any: of a model drawn from the box of
    ``from_starts``, of a board switched on with discharged capacitors, at any phase of the drive.

    Raises
    ------
    InputError : too many of them, a state that is none, or a box without a width below 0.
    """
    if request.shares is None:
        return None
    subject = plan.subject
    assert isinstance(subject, ModelSubject | BoardSubject)
    check_count("--shares", request.shares, 1)
    if request.shares * len(plan.values) > MOST_CELLS:
        text = f"{request.shares} starts at {len(plan.values)} values"
        raise InputError(None, "--shares", text, f"at most {MOST_CELLS} starts in all")
    ends = [{plan.parameter: float(plan.values[k])} for k in (0, -1)]
    scale = subject.scale(ends) * (0.0 if isinstance(subject, BoardSubject) else 1.0)
    box = np.stack([-scale, scale], axis=1)
    read = _reader(subject, modelfile)
    for state, *limits in request.box:
        if state not in subject.states:
            raise InputError(None, "--box", state, one_of(state, subject.states))
        low, high = (read.value("--box", state, limit) for limit in limits)
        if not -np.inf < low <= high < np.inf:
            raise InputError(None, "--box", f"{state} from {low:g} to {high:g}", "two finite ends")
        box[subject.states.index(state)] = low, high
    names = [f"start {name}" for name in (*subject.states, "phase")]
    numbers = random_streams.cube(request.seed, names, range(request.shares))
    return SharePlan(subject, plan.parameter, plan.values, box, numbers, request.seed)


# ---------------------------------------------------------------------------------------------


def _reader(subject: Swept, modelfile: ModelFile) -> Reader:
    """What reads the values of options: with the generator's units for a board."""
    units: dict[str, str] = {}
    if isinstance(subject, BoardSubject):
        units = {**subject.units, **dict.fromkeys(subject.states, "V")}
    return Reader(modelfile.model, modelfile.si, units)


def _read(read: Reader, subject: Swept, option: str, name: str, value: float | str | None) -> float:
    """A value of what can be swept, in the model's units."""
    if value is None:
        raise InputError(None, option, MISSING, f"a value of {name}")
    if name not in subject.parameters:
        over = option if option in ("--map", "--and") else "--over"
        hint = ""
        if name in ("frequency", "Omega") and "omega" in subject.parameters:
            hint = 'omega, of which an end may be in hertz, such as "10 Hz"; or '
        raise InputError(None, over, name, hint + one_of(name, subject.parameters))
    return read.value(option, name, value)


Ends = tuple[tuple[str, float], tuple[str, float]]
"""Both ends of a parameter, each behind the option that gives it."""


def _check_ends(subject: Swept, ends: Mapping[str, Ends]) -> None:
    """InputError unless one parameter may have its ends, or two theirs at once: of two that bound
    each other it does not count what the file has."""
    if len(ends) == 1 or isinstance(subject, BoardSubject) or "omega" in ends:
        for name, both in ends.items():
            for option, value in both:
                subject.check(option, name, value)
    if len(ends) == 1 or isinstance(subject, BoardSubject):
        return
    for pair in product(*ends.values()):
        change = {name: value for name, (_, value) in zip(ends, pair, strict=True)}
        try:
            subject.drawn(change)
        except InputError as error:
            for name, (option, value) in zip(ends, pair, strict=True):
                if error.field in (name, f"model.{name}"):  # whatever the other is
                    subject.check(option, name, value)
            found = " with ".join(f"{name} = {value:g}" for name, value in change.items())
            raise InputError(None, pair[-1][0], found, error.expected) from None


def _check_options(request: Request) -> None:
    check_count("--starts", request.starts, 1, MOST_STARTS)
    if request.starts is not None and (request.down or request.up):
        raise InputError(None, "--starts", request.starts, "without --down and --up")
    if request.kind != "sweep" and (request.starts is not None or request.down or request.up):
        raise InputError(
            None, "--down, --up or --starts", "given", "none with --map or --basins: every point "
            "has the same start"
        )  # fmt: skip
    if request.and_ is not None and (request.kind != "sweep" or not request.points):
        expected = "a sweep with its points: none of --map, --basins and --no-points"
        raise InputError(None, "--and", request.and_[0], expected)
    if request.shares is not None and request.kind != "sweep":
        raise InputError(None, "--shares", request.shares, "a sweep: none of --map and --basins")
    if request.box and request.shares is None:
        raise InputError(None, "--box", request.box[0][0], "a number of starts too: --shares")
    check_count("--depth", request.depth, 0, MOST_DEPTH)
    if request.depth is not None and request.and_ is None:
        raise InputError(None, "--depth", request.depth, "a second parameter too: --and")
    if request.region is not None and request.and_ is None:
        raise InputError(None, "--region", request.region, "a second parameter too: --and")
    check_count("--periods", request.periods, 0, MOST_PERIODS)
    check_count("--keep", request.keep, 1, MOST_PERIODS)


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
    check_count(third, steps, 2, MOST_STEPS)
    for option, value in ((first, low), (second, high)):
        if not np.isfinite(value):
            raise InputError(None, option, value, "a finite number")
    if low == high:
        raise InputError(None, second, high, f"another value than {first} {low:g}")
    return min(low, high), max(low, high), steps


def _check_cells(columns: int, rows: int) -> None:
    if columns * rows > MOST_CELLS:
        text = f"{columns} x {rows} points"
        raise InputError(None, "--map", text, f"at most {MOST_CELLS} points in all")


def _course(request: Request, usual: TransientSettings) -> TransientSettings:
    settle = usual.settle if request.periods is None else request.periods
    keep = usual.keep if request.keep is None else request.keep
    return replace(usual, settle=settle, keep=keep)


def _basin_plan(request: Request, subject: Swept, modelfile: ModelFile) -> BasinPlan:
    states = subject.states
    read = _reader(subject, modelfile)
    name, start, stop, count = request.map_ or (states[1], None, None, None)
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
                _end(option, "--from"),
                _end(option, "--to"),
                _end(option, "--steps"),
                -reach if low is None else read.value(_end(option, "--from"), state, low),
                reach if high is None else read.value(_end(option, "--to"), state, high),
                BASIN_STEPS if steps is None else steps,
            )
        )

    xs = axis(over, "--over", request.from_, request.to, request.steps)
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


def _end(axis: str, option: str) -> str:
    """The option that gives an axis of basins its ends or steps: --map has them all."""
    return option if axis == "--over" else axis


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
    option = "--omega"
    stated: float | str | None = request.omega
    if request.frequency is not None:
        if stated is not None:
            raise InputError(None, "--frequency", request.frequency, "nothing beside --omega")
        option, stated = "--frequency", request.frequency
    if "omega" in swept or "frequency" in swept:
        if stated is not None:
            raise InputError(None, option, stated, "nothing: the frequency is swept")
        if {"omega", "frequency"} <= set(swept):
            raise InputError(None, "--map", swept[1], "not the frequency a second time")
        return subject
    read = _reader(subject, modelfile)
    if not isinstance(subject, BoardSubject):
        omega = _omega(option, stated, read, modelfile)
        return ModelSubject(subject.model, omega, scales=subject.scales)
    if isinstance(stated, str):
        hertz = read.value(option, "frequency", stated)
        subject.check(option, "frequency", hertz)
    else:
        hertz = subject.design.errors.scales.frequency(_omega(option, stated, read, modelfile))
    return BoardSubject(subject.design, hertz, subject.amplitude, subject.offset)


def _omega(option: str, stated: float | str | None, read: Reader, modelfile: ModelFile) -> float:
    """The drive's dimensionless frequency: the option's, or that of the file's first response."""
    if stated is None:
        omegas = [r.omega for r in modelfile.responses if r.omega is not None]
        if not omegas:
            raise InputError(
                None, "--omega", MISSING, "the drive's frequency: no response of the file has one"
            )
        omega = omegas[0]
    elif isinstance(stated, str):
        omega = read.frequency(option, stated)
    else:
        omega = read.value(option, "omega", stated)
    check_omega(option, omega, modelfile.model)
    return omega
