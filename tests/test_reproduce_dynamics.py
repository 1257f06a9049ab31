"""The report on the paper's dynamics, and what it is made of."""

from __future__ import annotations

import contextlib
import io
import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from designer import cli, reproduce_dynamics
from designer.attractor import settle
from designer.cascade import cascade
from designer.catalog import load_catalog
from designer.errors import InputError
from designer.flow import Flow
from designer.orbit import failed
from designer.paper_design import MODEL
from designer.paper_statements import AGREES, DISAGREES, IN_PART, main_windows
from designer.progress import Progress
from designer.reproduce_dynamics import Dynamics, Extent, measure, reproduce
from designer.system import Drive
from designer.windows import Window, WindowEnd

SMALL = Extent(low=1.29, high=1.6, depth=2, figures=(), shared=(1.55,), chatter=(0.2, 0.05))
DOCS = Path(__file__).parent.parent / "docs" / "bifurcations.md"


@cache
def small() -> Dynamics:
    return measure(SMALL, Progress())


def made(response: str, low: float, high: float, *, symmetric: bool = False) -> Window:
    ends = [WindowEnd(v, 0.0, "fold", None, failed("")) for v in (low, high)]
    return Window("omega", response, symmetric, ends[0], ends[1], 0)


def test_cascade_chains_what_begins_where_the_last_ended() -> None:
    first, second, third = made("1-1-1", 3.0, 4.0), made("2-2-2", 2.5, 3.0), made("4-4-4", 2.4, 2.5)
    aside, other = made("1-1-2", 2.9, 3.0), made("1-2-2", 1.0, 2.3)
    everything = [other, third, aside, second, first]
    assert cascade(everything, first).steps == (first, second, third)
    assert cascade(everything, third, down=False).steps == (third, second, first)
    assert cascade(everything, other).steps == (other,)
    assert cascade(everything, first).describe().startswith("1-1-1 (AS) → fold 3.00000 → 2-2-2")


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
    few = replace(SMALL, low=1.32, depth=2, figures=("fig2c",))
    found = reproduce(out, extent=few)
    data = json.loads((out / "dynamics.json").read_text(encoding="utf-8"))
    assert data["points"] == [p.as_dict() for p in found.found.points]
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
    assert len(rows) == sum(len(b.points) for b in found.found.branches)
    text = (out / "README.md").read_text(encoding="utf-8")
    assert text.splitlines()[2].startswith("Made by `designer reproduce dynamics")
    pictures = re.findall(r"\((\w+\.png)\)", text)
    assert pictures
    for name in pictures:
        assert (out / name).read_bytes().startswith(b"\x89PNG")
    for statement in found.statements:
        assert statement.found in text
    assert {path.name for path in out.iterdir()} <= reproduce_dynamics.NAMES
    reproduce_dynamics._check_ours(out)  # may be replaced
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
    assert cli.status(["reproduce", "dynamics", "--resume", "--out", str(out)]) == 2
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
