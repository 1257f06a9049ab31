"""Blocks that a stranger wrote, with a seal that is right: what cannot be is computed again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pyarrow.parquet as pq
import pytest

from designer.bifurcations import basin_shares, border_curves, parameter_map, sweep
from designer.bifurcations.basin_shares import SharePlan
from designer.bifurcations.border_curve import BorderCurve, CurveMeeting, read_curve
from designer.bifurcations.border_curves import CurvePlan
from designer.bifurcations.curve_switch import OtherCurve
from designer.bifurcations.grazing_contact import GrazingContact
from designer.bifurcations.parameter_map import MapCell, MapPlan
from designer.bifurcations.plane_curves import PlaneWindow
from designer.bifurcations.points import PointKind
from designer.bifurcations.sweep import SweepPlan
from designer.circuit.swept_board import BoardSubject
from designer.design_rules.rule_subject import RuleSubject
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import SteadyMotion, TransientSettings
from designer.folders import sweep_store
from designer.folders.sweep_store import (
    Blocks,
    WorkFiles,
    curve_blocks,
    grid_blocks,
    share_blocks,
    sweep_blocks,
)
from designer.jobs.bifurcation_job import BifurcationWork
from designer.jobs.bifurcation_request import Request, plan_of
from designer.model.swept_model import ModelSubject
from tests.dynamics.test_modal_tables import PAPER
from tests.shared.resealed import Change, reseal, with_value
from tests.shared.rule_cases import base, bent

SUBJECT = ModelSubject(PAPER)
QUICK = TransientSettings(40, 16, 400)
VALUES = np.linspace(1.4, 1.5, 3)
SWEEP = SweepPlan(SUBJECT, "omega", VALUES, ("down",), course=QUICK)
MAP = MapPlan(SUBJECT, "omega", np.linspace(1.4, 1.5, 2), "b", np.array([0.25]))
BOX = np.outer(SUBJECT.scale([{"omega": 1.4}]), [-1.0, 1.0])
SHARES = SharePlan(SUBJECT, "omega", VALUES, BOX, np.random.default_rng(3).random((3, 5)), seed=3)
CURVES = CurvePlan(SUBJECT, "omega", "b", 0.25, PlaneWindow((1.3, 1.6), (0.2, 0.3)), depth=0)
OTHER = OtherCurve(
    PointKind.GRAZING, 1, True, (1.4, 0.25), (0.1,) * 4, True, GrazingContact(0, 1, True), 0.3, 0.25
)
CURVE = BorderCurve(
    "fold", "1-1-1", True, np.array([[1.4, 0.25], [1.41, 0.26]]), (True, False),
    ("edge of b", "closed"), (CurveMeeting("grazing meets fold", (1.4, 0.25), OTHER),),
)  # fmt: skip


def files(tmp_path: Path, notes: list[str]) -> WorkFiles:
    return WorkFiles(tmp_path, "work", {}, notes.append)


def no_rows(_rows: Sequence[Any]) -> list[dict[str, Any]]:
    return []


def met(key: str, value: Any) -> Change:
    """Another value in the first point of codimension two of a curve."""

    def change(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
        rows[0]["codimension_two"][0][key] = value
        return rows

    return change


def other(key: str, value: Any) -> Change:
    """Another value in the curve that meets a curve there."""

    def change(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
        inner = rows[0]["codimension_two"][0]["other"]
        if key in inner:
            inner[key] = value
        else:
            inner["touch"][key] = value
        return rows

    return change


class _Sweep:
    """A sweep of three steps."""

    changes: ClassVar[dict[str, Change]] = {
        "an unknown status": with_value("status", "asleep"),
        "no status": with_value("status", None),
        "no count": with_value("n", None),
        "no exponent": with_value("lyapunov", None),
        "no start": with_value("start", None),
        "nothing in a start": with_value("start", [0.1, None, 0.1, 0.1]),
    }
    unfit: ClassVar[dict[str, Change]] = {
        "no rows": no_rows,
        "a row less": lambda rows: rows[1:],
        "a period of none": with_value("n", 0),
        "impacts below none": with_value("p", -1),
        "a count without end": with_value("q", 10**15),
        "another system": with_value("start", [0.1] * 6),
        "an end of no number": with_value("end", [float("nan")] * 4),
        "too many periods": with_value("minima", [0.1] * 1000),
    }

    def store(self, folder: Path, notes: list[str]) -> Blocks[Any]:
        return sweep_blocks(SWEEP, files(folder, notes))

    def read(self, folder: Path, notes: list[str]) -> object:
        return self.store(folder, notes).read("down", 0)

    def run(self, folder: Path, notes: list[str]) -> object:
        made = sweep.run(SWEEP, store=self.store(folder, notes))
        return repr([step.__dict__ for step in made.steps["down"]])

    path = "sweep.parquet/down-000000.parquet"
    columns = (
        "track: string, omega: double, status: string, n: int64, p: int64, q: int64, "
        "symmetric: bool, lyapunov: double, lyapunov_error: double, radius: double, "
        "start: list<element: double>, end: list<element: double>, minima: list<element: double>, "
        "velocities: list<element: double>, periods: int64"
    )


class _Map:
    """A row of two cells."""

    changes: ClassVar[dict[str, Change]] = {
        "an unknown status": with_value("status", "asleep"),
        "no count": with_value("p", None),
        "no strobe": with_value("strobe", None),
        "nothing in a strobe": with_value("strobe", [0.1, None, 0.1, 0.1]),
        "another row": with_value("i", 1),
        "no place": with_value("j", None),
        "a cell twice": lambda rows: [rows[0], rows[0]],
        "a row too many": lambda rows: [*rows, rows[0]],
        "no rows": no_rows,
    }
    unfit: ClassVar[dict[str, Change]] = {
        "a period of none": with_value("n", 0),
        "another system": with_value("strobe", [0.1] * 6),
    }

    def store(self, folder: Path, notes: list[str]) -> Blocks[Any]:
        return grid_blocks(MAP, files(folder, notes))

    def read(self, folder: Path, notes: list[str]) -> object:
        return self.store(folder, notes).read(0)

    def run(self, folder: Path, notes: list[str]) -> object:
        return parameter_map.run(MAP, store=self.store(folder, notes)).cells

    path = "map.parquet/row-000000.parquet"
    columns = (
        "i: int64, j: int64, omega: double, b: double, status: string, n: int64, p: int64, "
        "q: int64, symmetric: bool, lyapunov: double, strobe: list<element: double>"
    )


class _Shares:
    """Counted basins at three values."""

    changes: ClassVar[dict[str, Change]] = {
        "an unknown status": with_value("status", "asleep"),
        "no number": with_value("attractor", None),
        "no strobes": with_value("strobes", None),
        "a pair of one": with_value("more", [[1]]),
        "nothing in a strobe": with_value("strobes", [[0.1, None, 0.1, 0.1]]),
    }
    unfit: ClassVar[dict[str, Change]] = {
        "no rows": no_rows,
        "a value less": with_value("omega", 1.45, 0),
        "more starts than there are": with_value("count", 10**6),
        "fewer than none": with_value("count", -1),
        "a number below none": with_value("attractor", -1),
        "a number without end": with_value("attractor", 10**15),
        "no strobe": with_value("strobes", []),
        "another system": with_value("strobes", [[0.1] * 6]),
    }

    def store(self, folder: Path, notes: list[str]) -> Blocks[Any]:
        return share_blocks(SHARES, files(folder, notes))

    def read(self, folder: Path, notes: list[str]) -> object:
        return self.store(folder, notes).read(0)

    def run(self, folder: Path, notes: list[str]) -> object:
        return basin_shares.run(SHARES, store=self.store(folder, notes)).steps

    path = "shares.parquet/block-000000.parquet"
    columns = (
        "omega: double, attractor: int64, status: string, n: int64, p: int64, q: int64, "
        "more: list<element: list<element: int64>>, symmetric: bool, twin: int64, count: int64, "
        "strobes: list<element: list<element: double>>"
    )


class _Curves:
    """A curve with a point of codimension two; no point of the sweep begins one."""

    changes: ClassVar[dict[str, Change]] = {
        "an unknown kind": with_value("kind", "trap"),
        "no response": with_value("response", None),
        "no points": with_value("points", []),
        "no point": with_value("points", None),
        "a point of one": with_value("points", [[1.0], [2.0]]),
        "nothing in a point": with_value("points", [[1.0, None], [1.0, 2.0]]),
        "a stability too few": with_value("stable", [True]),
        "no stability": with_value("stable", [True, None]),
        "one end": with_value("ends", ["closed"]),
        "no end": with_value("ends", ["closed", None]),
        "a meeting of no name": met("kind", None),
        "a meeting of one value": met("values", [1.0]),
        "another curve's kind": other("kind", "trap"),
        "another curve's period": other("n", None),
        "another curve's side": other("side", None),
    }
    unfit: ClassVar[dict[str, Change]] = {
        "a point of no number": with_value("points", [[1.0, float("nan")], [1.0, 2.0]]),
        "a period of none": other("n", 0),
        "a period without end": other("n", 10**15),
        "another system": other("state", [0.1] * 6),
        "a state of no number": other("state", [float("inf")] * 4),
        "a clearance that is not there": other("clearance", 3),
        "a side that is not there": other("side", 2),
        "a phase of no number": other("phase", float("nan")),
    }

    def store(self, folder: Path, notes: list[str]) -> Blocks[Any]:
        return curve_blocks(CURVES, files(folder, notes))

    def read(self, folder: Path, notes: list[str]) -> object:
        return self.store(folder, notes).read(0)

    def run(self, folder: Path, notes: list[str]) -> object:
        store = self.store(folder, notes)
        if not (folder / self.path).exists():
            store.write([CURVE], 0)
        return [curve.as_dict() for curve in border_curves.run(CURVES, [], store=store)]

    path = "curves.parquet/block-000000.parquet"
    columns = (
        "kind: string, response: string, symmetric: bool, "
        "points: list<element: list<element: double>>, stable: list<element: bool>, "
        "ends: list<element: string>, codimension_two: list<element: struct<kind: string, "
        "values: list<element: double>, other: struct<kind: string, n: int64, "
        "state: list<element: double>, stable: bool, touch: struct<clearance: int64, side: int64, "
        "tip: bool, phase: double, size: double>>>>, "
        "begun_at: struct<curve: int64, kind: string, values: list<element: double>>"
    )


WORKS: dict[str, Any] = {"sweep": _Sweep(), "map": _Map(), "shares": _Shares(), "curves": _Curves()}


@pytest.fixture(scope="module", params=list(WORKS))
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A work, its folder, and what it finds."""
    work, folder = WORKS[request.param], tmp_path_factory.mktemp(request.param)
    notes: list[str] = []
    first = work.run(folder, notes)
    assert work.run(folder, notes) == first
    assert notes == []
    return work, folder, first, (folder / work.path).read_bytes()


def test_blocks_have_the_columns_of_earlier_versions(made: Any) -> None:
    """Otherwise what those stored is not read."""
    work, folder, _, content = made
    (folder / work.path).write_bytes(content)
    assert columns(folder / work.path) == work.columns


def columns(path: Path) -> str:
    return ", ".join(f"{column.name}: {column.type}" for column in pq.read_schema(path))


def test_blocks_of_several_stops_have_the_columns_of_earlier_versions(tmp_path: Path) -> None:
    """Beside those of one, where there is something in them."""
    place = np.zeros(4)
    counts: dict[str, Any] = {"n": 1, "p": 1, "q": 1, "more": ((1, 2), (0, 3))}
    shared = {**counts, "status": OrbitStatus.PERIODIC, "symmetric": True, "lyapunov": -0.1}
    step = SteadyMotion(
        **shared, lyapunov_error=0.0, radius=0.5, start=place, end=place, minima=place,
        velocities=place, further=(place,), periods=4,
    )  # fmt: skip
    cell = MapCell(**shared, i=0, j=0, strobe=tuple(place.tolist()))
    store = sweep_blocks(replace(SWEEP, values=VALUES[:1]), files(tmp_path, []))
    store.write([step], "down", 0)
    assert columns(tmp_path / _Sweep.path) == (
        f"{_Sweep.columns}, more: list<element: list<element: int64>>, "
        "further: list<element: list<element: double>>"
    )
    grid = grid_blocks(MAP, files(tmp_path, []))
    grid.write([cell], 0)
    assert columns(tmp_path / _Map.path) == (
        f"{_Map.columns}, more: list<element: list<element: int64>>"
    )


def test_blocks_of_earlier_rules_are_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """By those up to 3, states beside fixed stops were counted from the base."""
    codes = {sweep_store.work_hash(SWEEP.as_dict())}
    for rules in range(1, 4):
        monkeypatch.setattr(sweep_store, "RULES", rules)
        codes.add(sweep_store.work_hash(SWEEP.as_dict()))
    assert len(codes) == 4


def test_blocks_of_a_board_without_its_corners_are_left() -> None:
    """By earlier versions a board's laws had none. What was made without points, or of a board
    without such laws, stays."""

    def decides(of: RuleSubject, *, points: bool = True) -> dict[str, Any]:
        made = of.synthesis
        low, high = map(made.design.errors.scales.frequency, (1.0, 1.2))
        request = Request(circuit=True, from_=low, to=high, steps=3, points=points)
        plan = plan_of(request, BoardSubject(made.design), made.modelfile)
        return BifurcationWork(request, plan, made.modelfile, 1).decides

    assert decides(bent(0.01))["corners"] == ["K at 0.5"]
    limits = ((-1.0, -0.3), (-0.5, -0.3), (0.5, 0.3), (1.0, 0.3))
    assert decides(bent(0.01, limits))["corners"] == ["K at 0.5", "K at -0.5"]
    assert "corners" not in decides(bent(0.01), points=False)
    assert "corners" not in decides(base())


def test_keys_of_a_curve_that_nobody_knows_are_left() -> None:
    row: Any = CURVE.as_dict()
    met = row["codimension_two"][0]
    for each in (row, met, met["other"], met["other"]["touch"]):
        each["since"] = 2
    assert read_curve(row).as_dict() == CURVE.as_dict()


def test_what_is_no_record_is_damage(made: Any) -> None:
    """It is said, and the work is as before."""
    work, folder, first, content = made
    path = folder / work.path
    for what, change in work.changes.items():
        path.write_bytes(content)
        reseal(path, change)
        notes: list[str] = []
        assert work.read(folder, notes) is None, what
        assert notes == [f"{path}: damaged, computed again"], what
    if not isinstance(work, _Curves):
        assert work.run(folder, []) == first
        assert path.read_bytes() == content


def test_what_is_of_no_such_work_is_made_again(made: Any) -> None:
    work, folder, first, content = made
    path = folder / work.path
    anew = [] if isinstance(work, _Curves) else first  # no point of the sweep begins a curve
    for what, change in work.unfit.items():
        path.write_bytes(content)
        reseal(path, change)
        assert path.read_bytes() != content
        assert work.run(folder, []) == anew, what
