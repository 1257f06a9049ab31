"""Every board of a study in few bytes, for a page that calls each of them up.

A column of numbers is 255 or 65535 equal steps between its ends; the largest code stands for "not
known". Orbits are those of some boards alone: of each response so many, every way of losing it
before a second of the same.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array
from designer.circuit.design import Design
from designer.circuit.ensemble import Ensemble
from designer.circuit.nominal import Trace
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.report import words
from designer.report.data import ReportData, portrait_name
from designer.spread.board_quantities import column, quantities
from designer.verdicts.verdict import Answer, Verdict

MOST_ORBITS = 90
"""The most orbits that a page has, over all responses."""
POINTS = 256
"""Points of a stored motion."""
MANY_IMPACTS = 8
"""A motion of more impacts has twice the points."""
LEAST_POINTS = 64
"""The fewest points of one of its drive periods."""
PERIODS = 8
"""Drive periods of a stored motion, at most."""
UNITS = {"offset": "V", "low": "V", "high": "V", "bias": "A", "reference": "V", "supply": "V"}
"""Units of the quantities by their group; a part's value has its own."""


def boards_json(data: ReportData) -> str:
    """The boards of a study as JSON; "" where there are none."""
    if not data.study.answers:
        return ""
    plan = data.plan
    document = {
        "samples": plan.samples,
        "labels": [plan.label(k) for k in range(plan.samples)] if plan.labels else None,
        "responses": [_response(data, i) for i in range(len(data.checked))],
        "quantities": list(_quantities(data)),
        "orbits": list(_orbits(data)),
    }
    return json.dumps(document, allow_nan=False, separators=(",", ":"), ensure_ascii=False)


def _response(data: ReportData, index: int) -> dict[str, Any]:
    """What became of every board for one response. ``kinds``: the different answers; ``kind``: of
    each board, the number of its own."""
    answers = {a.sample: a for a in data.study.answers_to(index)}
    rows = [answers.get(k) for k in range(data.plan.samples)]
    kinds: dict[tuple[str, str, str], int] = {}
    codes = [
        65535 if a is None else kinds.setdefault((str(a.verdict), a.response, a.reason), len(kinds))
        for a in rows
    ]
    margins = [_log(math.nan if a is None else min(a.penetration, a.miss)) for a in rows]
    return {
        "name": words.name(data.checked[index]),
        "plots": [portrait_name(index, k) for k in range(len(data.motions(index)))],
        "kinds": list(kinds),
        "kind": _bytes(np.array(codes, dtype="<u2")),
        "radius": _packed([math.nan if a is None else a.radius for a in rows], 65535),
        "margin": _packed(margins, 65535),
    }


def _log(value: float) -> float:
    return math.log(value) if math.isfinite(value) and value > 0.0 else math.nan


def _quantities(data: ReportData) -> Iterator[dict[str, Any]]:
    """What was drawn for every board, quantity by quantity."""
    boards = data.plan.boards(range(data.plan.samples))
    for quantity in quantities(data.plan.circuit, boards):
        unit = UNITS.get(quantity.group, "F" if quantity.part.startswith("C") else "Ω")
        yield {
            "name": quantity.name,
            "unit": unit,
            "nominal": quantity.nominal,
            "sigma": quantity.sigma,
            **_packed(column(boards, quantity), 255),
        }


def _packed(values: Sequence[float] | Array, steps: int) -> dict[str, Any]:
    """A column of numbers: value = low + (high - low) · code/(steps - 1); nan is ``steps``."""
    numbers = np.asarray(values, dtype=float)
    known = np.isfinite(numbers)
    low, high = (float(f(numbers[known])) for f in (np.min, np.max)) if known.any() else (0.0, 0.0)
    share = (np.where(known, numbers, low) - low) / ((high - low) or 1.0)
    codes = np.where(known, np.rint(share * (steps - 1)), steps)
    kind = "<u2" if steps > 255 else "u1"
    return {"low": low, "high": high, "steps": steps, "codes": _bytes(codes.astype(kind))}


def _bytes(codes: NDArray[Any]) -> str:
    return base64.b64encode(codes.tobytes()).decode()


def shown_boards(data: ReportData) -> list[Answer]:
    """The answers whose orbits a page has: lost boards first, every way of losing a response
    before a second of the same, then those near the edge of a response that none has lost."""
    each = max(1, MOST_ORBITS // max(1, len(data.checked)))
    chosen: list[Answer] = []
    for index in range(len(data.checked)):
        by_kind: dict[tuple[bool, str], list[Answer]] = {}
        for answer in data.study.answers_to(index):
            if answer.verdict is not Verdict.FAILED:
                by_kind.setdefault((answer.verdict is Verdict.OK, answer.response), []).append(
                    answer
                )
        ranked = [by_kind[key] for key in sorted(by_kind)]
        turns = [a for turn in zip_longest(*ranked) for a in turn if a is not None]
        chosen += turns[:each]
    return chosen


def _orbits(data: ReportData) -> Iterator[dict[str, Any]]:
    """The motions of ``shown_boards`` in the units of its portraits, clearance by
    clearance."""
    shown = shown_boards(data)
    samples = sorted({a.sample for a in shown})
    boards = data.plan.boards(range(data.plan.samples)).take(samples)
    ensemble = Ensemble(boards)
    places = [samples.index(a.sample) for a in shown]
    questions = [data.plan.questions[a.question] for a in shown]
    drives = [q.excitation.drive for q in questions]
    orbits = ensemble.settle(places, drives, np.array([q.start.start for q in questions]))
    for answer, place, drive, orbit in zip(shown, places, drives, orbits, strict=True):
        index = data.study.response_indices[answer.question]
        checked = data.checked[index]
        flow = Flow(ensemble.reduction(place).system(), drive)
        trace = _trace(flow, orbit, data.design, checked.model.b)
        omega = checked.model.omega
        moved = [m.of(trace.time, trace.states, omega) for m in data.motions(index)]
        yield {
            "sample": answer.sample,
            "response": index,
            "periods": float(trace.time[-1] * omega / (2.0 * np.pi)),
            "clearances": [
                {name: _packed(xv[:, k], 65535) for k, name in enumerate("xv")} for xv in moved
            ],
        }


def _trace(flow: Flow, orbit: Orbit, design: Design, b: float) -> Trace:
    """The first periods of a motion in model units, with so few points as show it."""
    periods = min(orbit.n, PERIODS) if orbit.status is OrbitStatus.PERIODIC else PERIODS
    wanted = POINTS if orbit.counts.total <= MANY_IMPACTS else 2 * POINTS
    points = max(wanted // periods, LEAST_POINTS)
    start = orbit.start if len(orbit.start) else np.zeros(flow.system.size)
    volts = design.volts(b)
    run = flow.run(start, periods, mode=orbit.mode or None, points=points)
    states = run.strobes[:, : len(volts)]  # behind them what op-amps that lag have for states
    finite = np.isfinite(states).all(axis=1)
    time = np.arange(len(states)) * flow.drive.period / points
    seconds = design.errors.scales.seconds
    return Trace(time[finite] / seconds, states[finite] / volts)
