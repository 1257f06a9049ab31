"""The report on the paper's dynamics, and what it is made of."""

from __future__ import annotations

import contextlib
import io
import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from designer.base.errors import InputError
from designer.base.report_pieces import check_report_folder
from designer.bifurcations.doubling_cascade import cascade
from designer.bifurcations.points import PointKind
from designer.bifurcations.windows import BranchWindow, WindowEnd
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.paper_values import MODEL
from designer.cli import entry
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import failed
from designer.dynamics.piecewise_linear import Drive
from designer.model.model_file import read_model_file
from designer.paper import reproduce_dynamics
from designer.paper.dynamics_page import Dynamics
from designer.paper.reproduce_dynamics import DynamicsExtent, measure, reproduce
from designer.paper.statements import (
    AGREES,
    DISAGREES,
    IN_PART,
    WindowGap,
    _dying,
    _each,
    _grazing,
    _grazings,
    _order,
    faults,
    gaps,
    main_windows,
)
from designer.plots import bifurcation_plots

SMALL = DynamicsExtent(
    low=1.29, high=1.6, depth=2, figures=(), borders=(), shared=(1.55,), chatter=(0.2, 0.05)
)
DOCS = Path(__file__).parents[2] / "docs" / "bifurcations.md"


@cache
def small() -> Dynamics:
    return measure(SMALL)


def made(response: str, low: float, high: float, *, symmetric: bool = False) -> BranchWindow:
    ends = [WindowEnd(v, 0.0, "fold", None, failed("")) for v in (low, high)]
    return BranchWindow("omega", response, symmetric, ends[0], ends[1], 0)


def test_cascade_chains_what_begins_where_the_last_ended() -> None:
    first, second, third = made("1-1-1", 3.0, 4.0), made("2-2-2", 2.5, 3.0), made("4-4-4", 2.4, 2.5)
    aside, other = made("1-1-2", 2.9, 3.0), made("1-2-2", 1.0, 2.3)
    everything = [other, third, aside, second, first]
    assert cascade(everything, first).steps == (first, second, third)
    assert cascade(everything, third, down=False).steps == (third, second, first)
    assert cascade(everything, other).steps == (other,)
    assert cascade(everything, first).describe().startswith("1-1-1 (AS) → fold 3.00000 → 2-2-2")


def ladder(seen: str = "aperiodic") -> tuple[list[BranchWindow], list[WindowGap]]:
    """Eight symmetric windows in turn, and between each two the same motion everywhere."""
    windows = [made(f"1-{p}-{p}", 10.0 - p, 10.5 - p, symmetric=True) for p in range(1, 9)]
    between = [
        WindowGap(p, p + 1, 9.5 - p, 10.0 - p, ((9.8 - p, seen), (9.7 - p, seen)))
        for p in range(1, 8)
    ]
    return windows, between


def test_chaos_between_the_windows_has_to_be_seen() -> None:
    windows, between = ladder()
    assert _order(windows, between).verdict == AGREES
    assert _order(windows, []).verdict == IN_PART  # nobody looked
    assert _order(windows[:-1], between[:-1]).verdict == IN_PART
    tame = replace(between[2], seen=((6.8, "1-3-3"), (6.7, "2-3-4")))
    said = _order(windows, [*between[:2], tame, *between[3:]])
    assert said.verdict == IN_PART
    assert "between p = 3 and 4 no aperiodic motion" in said.found


@pytest.mark.parametrize(
    ("seen", "stray"),
    [
        (("1-3-3", "aperiodic", "1-4-4"), None),  # twins above, another window of the next below
        (("1-4-4", "aperiodic", "1-3-3"), "1-3-3 out of turn at ω = 6.60000"),
        (("aperiodic", "1-1-1", "aperiodic"), "1-1-1 out of turn at ω = 6.70000"),
        (("1-7-7", "aperiodic", "aperiodic"), "1-7-7 out of turn at ω = 6.80000"),
    ],
)
def test_responses_out_of_turn(seen: tuple[str, ...], stray: str | None) -> None:
    windows, between = ladder()
    met = tuple(zip((6.8, 6.7, 6.6), seen, strict=True))
    said = _order(windows, [*between[:2], replace(between[2], seen=met), *between[3:]])
    assert said.verdict == (AGREES if stray is None else IN_PART)
    assert (stray or "") in said.found
    windows += [made(r, w - 0.01, w + 0.01) for w, r in met]  # and as windows on the branches
    chaos = replace(between[2], seen=((6.8, "aperiodic"),))
    again = _order(windows, [*between[:2], chaos, *between[3:]])
    assert again.verdict == said.verdict


def test_a_response_that_returns_beside_another() -> None:
    windows, between = ladder()
    said = _order([*windows, made("1-1-1", 8.1, 8.2, symmetric=False)], between)
    assert said.verdict == IN_PART
    assert "1-1-1 at ω = 8.15000 beside 1-2-2" in said.found


def test_from_1_7_7_to_1_8_8_there_is_no_chaos() -> None:
    """From rest, settled one by one: 1-7-7 goes on below where 1-8-8 was."""
    mains = [
        (7, made("1-7-7", 0.22879, 0.235, symmetric=True)),
        (8, made("1-8-8", 0.21, 0.21848, symmetric=True)),
    ]
    (gap,) = gaps(MODEL, mains, steps=5)
    assert len(gap.seen) == 5
    for omega, response in gap.seen:
        flow = Flow(MODEL.second_order().piecewise_linear(), Drive(omega))
        assert settle(flow, np.zeros(4)).response == response
    assert gap.chaotic == 0
    assert "no aperiodic motion" in faults([], gap)


@pytest.mark.parametrize(
    ("speeds", "dying"),
    [
        ([0.9, 0.5, 0.2], True),
        ([0.2, 0.9, 0.5], True),  # the period begins before the last bounce
        ([0.9, 0.2, 0.5], False),
        ([0.9], False),
        ([], False),
    ],
)
def test_bounces_that_die_out(speeds: list[float], dying: bool) -> None:
    assert _dying(np.array(speeds)) is dying


@pytest.mark.parametrize("turned", [False, True])
def test_the_touch_that_counts_lies_beyond_the_end(turned: bool) -> None:
    """A touch nearer to the end, but on the window's side, is not it."""

    def point(position: float, kind: PointKind, stable: tuple[bool, bool]) -> Any:
        if turned:
            position, stable = 10.0 - position, stable[::-1]
        return SimpleNamespace(position=position, kind=kind, stable=stable, value=1.0)

    end = point(5.5, PointKind.FOLD, (True, False))
    near, far = (point(p, PointKind.GRAZING, (True, True)) for p in (5.1, 8.5))
    found: Any = SimpleNamespace(on=lambda _: [near, end, far])
    window: Any = SimpleNamespace(branch=0, low=SimpleNamespace(point=end))
    assert _grazing(found, window) is far


@pytest.mark.slow
def test_each_step_of_the_first_cascade_is_what_long_runs_show() -> None:
    twins = main_windows(small().windows, 1)[1]
    assert twins is not None
    steps = cascade(small().windows, twins).steps
    assert [w.response for w in steps][:2] == ["1-1-1", "2-2-2"]
    x = twins.low.orbit.start
    for w in steps:
        if w.width < 1e-3:
            continue
        flow = Flow(
            MODEL.second_order().piecewise_linear(), Drive(0.5 * (w.low.value + w.high.value))
        )
        reached = settle(flow, x)
        n, p, q = map(int, w.response.split("-"))
        assert (reached.n, {reached.p, reached.q}) == (n, {p, q})
        x = reached.start


def grazing(before: str, after: str, direction: int, *stable: bool) -> Any:
    return SimpleNamespace(
        kind=PointKind.GRAZING,
        value=1.2,
        before=before,
        after=after,
        stable=stable,
        direction=direction,
    )


@pytest.mark.parametrize(
    ("point", "verdict"),
    [
        (grazing("1-1-1", "1-2-1", -1, True, True), AGREES),
        (grazing("1-2-3", "1-2-2", 1, True, True), AGREES),
        (grazing("1-1-1", "1-2-1", 1, True, True), DISAGREES),  # as ω rises
        (grazing("1-1-1", "1-2-1", -1, False, False), DISAGREES),  # no attractor
        (grazing("1-1-1", "1-2-2", -1, True, True), DISAGREES),
        (grazing("2-2-2", "2-3-2", -1, True, True), DISAGREES),
    ],
)
def test_grazing_from_1_p_p_to_one_impact_more(point: Any, verdict: str) -> None:
    said = _grazings(SimpleNamespace(points=[point]))  # type: ignore[arg-type]
    assert said.verdict == verdict


def test_the_course_of_every_1_p_p() -> None:
    def ended(p: int, why: str, *, symmetric: bool) -> BranchWindow:
        one = made(f"1-{p}-{p}", 10.0 - p, 10.5 - p, symmetric=symmetric)
        return replace(one, low=replace(one.low, why=why))

    ladders = [ended(p, "pitchfork", symmetric=True) for p in range(1, 9)]
    ladders += [ended(p, "period-doubling", symmetric=False) for p in range(1, 9)]
    assert _each(ladders).verdict == AGREES
    lacking = [w for w in ladders if w.symmetric or w.response != "1-7-7"]
    assert _each(lacking).verdict == IN_PART
    said = _each([*lacking, ended(7, "grazing", symmetric=False)])
    assert said.verdict == IN_PART
    assert "p = 7 by a grazing" in said.found
    assert _each([ended(1, "fold", symmetric=True)]).verdict == DISAGREES


def test_pictures_bear_the_title_of_the_papers_model() -> None:
    path = Path(__file__).parents[2] / "examples" / "paper.toml"
    assert read_model_file(path).title == reproduce_dynamics.TITLE


@pytest.mark.slow
def test_statements_say_where_the_paper_is_wrong() -> None:
    said = small().statements
    assert {s.verdict for s in said} <= {AGREES, IN_PART, DISAGREES}
    pitchfork, first = said[0], said[1]
    assert "pitchfork at ω = 1.4605" in pitchfork.found
    assert pitchfork.verdict == IN_PART
    assert "period-doubling at ω = 1.3499" in first.found
    assert first.verdict == DISAGREES
    assert all(s.command.startswith("designer ") for s in said)
    assert {"1-1-1", "3-3-3"} <= set(small().shared[1.55])


@pytest.mark.slow
def test_the_folder_holds_what_was_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "paper-dynamics"
    monkeypatch.setitem(reproduce_dynamics.FIGURES, "fig2c", (1.4, 1.5, 21))
    few = replace(SMALL, low=1.32, depth=2, figures=("fig2c",), borders=("b",))
    titles: list[str] = []
    draw = bifurcation_plots.diagram

    def titled(made: Any, points: Any, name: str = "") -> Any:
        titles.append(name)
        return draw(made, points, name)

    monkeypatch.setattr(bifurcation_plots, "diagram", titled)
    found = reproduce(out, extent=few)
    data = json.loads((out / "dynamics.json").read_text(encoding="utf-8"))
    captions = [p.pop("caption") for p in data["points"]]
    assert data["points"] == [p.as_dict() for p in found.survey.points]
    assert all(
        f" at ω = {p['value']:.9g}: " in c for p, c in zip(data["points"], captions, strict=True)
    )
    assert len(data["windows"]) == len(found.windows)
    assert data["provenance"]["versions"]["numpy"] == np.__version__
    said = data["provenance"]
    assert said["settings"]["dynamics"]["low"] == 1.32
    assert said["catalogue_sha256"] == load_catalog().hash
    assert len(said["model_sha256"]) == 64
    swept = pq.read_table(out / "fig2c.parquet").to_pylist()
    assert [row["track"] for row in swept] == ["down"] * 21 + ["up"] * 21
    np.testing.assert_array_equal([row["omega"] for row in swept[:21]], np.linspace(1.4, 1.5, 21))
    assert json.loads(pq.read_schema(out / "fig2c.parquet").metadata[b"designer"])[
        "provenance"
    ] == json.loads(json.dumps(said))
    rows = pq.read_table(out / "branches.parquet").to_pylist()
    assert len(rows) == sum(len(b.points) for b in found.survey.branches)
    text = (out / "README.md").read_text(encoding="utf-8")
    assert text.splitlines()[2].startswith("Made by `designer reproduce dynamics")
    pictures = re.findall(r"\(([\w-]+\.png)\)", text)
    assert pictures
    for name in pictures:
        assert (out / name).read_bytes().startswith(b"\x89PNG")
    for statement in found.statements:
        assert statement.found in text
    unseen = [w for w in data["windows"] if "not located" in (w["from_kind"], w["to_kind"])]
    assert f" {len(unseen)} of the {len(data['windows'])} windows" in text
    assert titles == [reproduce_dynamics.TITLE]
    assert {path.name for path in out.iterdir()} <= reproduce_dynamics.NAMES
    command = reproduce_dynamics.COMMAND
    check_report_folder(out, reproduce_dynamics.NAMES, "dynamics.json", command)  # may be replaced
    (out / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"notes\.txt"):
        reproduce(out, extent=few)


@pytest.mark.parametrize("name", ["README.md", "fig3.png", "notes.txt", "dynamics.json"])
def test_files_of_others_are_left_alone(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("{}", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        reproduce(tmp_path, extent=SMALL)
    assert name in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text(encoding="utf-8") == "{}"


def test_dynamics_is_not_taken_up_again(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert entry.status(["reproduce", "dynamics", "--resume", "--out", str(out)]) == 2
    assert "--resume" in capfd.readouterr().err
    assert not out.exists()


def test_a_folder_that_cannot_be_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="a directory that can be written"):
        reproduce(tmp_path / "file" / "below", extent=SMALL)


def test_the_documented_example_prints_what_the_page_says() -> None:
    text = DOCS.read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)```\n\nprints\n\n```text\n(.*?)```", text, re.DOTALL)
    assert code is not None
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(code.group(1), {})
    assert printed.getvalue() == code.group(2)
