"""Blocks on a cluster: the same rows, whoever makes them and whoever dies."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import distributed
import pytest

from designer.base.errors import EnvironmentMissing
from designer.cli import entry
from designer.jobs import dask_runner
from designer.jobs.dask_runner import Cluster
from designer.verdicts.verdict import Answer, StudyPlan
from designer.yields.layers import LocalRunner, fill, samples_task
from designer.yields.row_store import BlockStore
from designer.yields.study_identity import study_hash
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE
from tests.verdicts.test_verdict import nothing, plan

ROOT = Path(__file__).resolve().parents[2]
LOCAL: Any = distributed.LocalCluster


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A cluster of two worker processes."""
    with LOCAL(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0"
    ) as two:
        yield two.scheduler_address


def _store(root: Path, p: StudyPlan) -> BlockStore[Answer]:
    return BlockStore(root, "samples.parquet", Answer, study_hash(p), size=4)


@pytest.mark.slow
def test_a_cluster_gives_equal_files(address: str, tmp_path: Path) -> None:
    p = plan(22)
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
    rows = fill(
        p, _store(tmp_path / "here", p), 4, partial(samples_task, p), LocalRunner(2), nothing
    )
    calls: list[int] = []
    with Cluster(address) as there:
        again = fill(
            p, _store(tmp_path / "there", p), 4, partial(samples_task, p), there,
            lambda: calls.append(1),
        )  # fmt: skip
    assert [repr(row) for row in again] == [repr(row) for row in rows]
    assert len(calls) == len(rows) == 44
    files = sorted((tmp_path / "here" / "samples.parquet").iterdir())
    assert len(files) == 6
    for path in files:
        other = tmp_path / "there" / "samples.parquet" / path.name
        assert path.read_bytes() == other.read_bytes()


class Deadly:
    """A block that kills the worker that makes it first."""

    def __init__(self, number: int, marker: Path) -> None:
        self.number, self.marker = number, marker

    def __call__(self, jobs: int, progress: Any) -> list[int]:
        if self.number == 2 and not self.marker.exists():
            self.marker.write_text(str(os.getpid()))
            os.kill(os.getpid(), signal.SIGKILL)
        time.sleep(0.05)
        return [self.number]


@pytest.mark.slow
def test_a_worker_that_dies_loses_nothing(address: str, tmp_path: Path) -> None:
    marker = tmp_path / "killed"
    with Cluster(address) as there:
        tasks = (Deadly(i, marker) for i in range(12))
        found = dict(there.run(tasks, nothing))
    assert marker.exists()
    assert found == {i: [i] for i in range(12)}


class Slow:
    """A block that takes its time, so that others wait behind it."""

    def __call__(self, jobs: int, progress: Any) -> list[int]:
        time.sleep(0.2)
        return [0]


@pytest.mark.slow
def test_a_scheduler_that_dies_is_said() -> None:
    """As exit 3, by its own error: neither a traceback nor an end without the rows."""
    with LOCAL(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0"
    ) as mortal:
        there = Cluster(mortal.scheduler_address)
        found = there.run((Slow() for _ in range(200)), nothing)
        assert next(found)[1] == [0]
        mortal.close()
        with there, pytest.raises(EnvironmentMissing, match="the cluster went away"):
            for _ in found:
                pass


@pytest.mark.slow
def test_nobody_at_the_address(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exit 3 and nothing written: neither anew nor over what is there."""
    monkeypatch.setattr(dask_runner, "PATIENCE", 0.5)
    model, out = tmp_path / "small.toml", tmp_path / "out"
    model.write_text(f"format = 1\n{PAPER_TABLE}[[response]]\nomega = 1.55\n{COARSE_RECTIFIER}")
    words = ["tolerance", str(model), "--out", str(out), "--rung", "exact", "--samples", "5"]
    assert entry.status([*words, "--cluster", "tcp://127.0.0.1:9", "-q"]) == 3
    assert "no cluster at tcp://127.0.0.1:9" in capfd.readouterr().err
    assert not out.exists()


def test_a_scheduler_without_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_runner, "PATIENCE", 0.5)
    with (
        LOCAL(
            n_workers=0, processes=False, dashboard_address="127.0.0.1:0", protocol="tcp://"
        ) as empty,
        pytest.raises(EnvironmentMissing, match="no worker at"),
    ):
        Cluster(empty.scheduler_address)


@pytest.mark.slow
def test_workers_with_other_rules_are_refused(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_runner, "RULES", {"samples": 999})
    with pytest.raises(EnvironmentMissing, match="rules"):
        Cluster(address)


def test_without_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(EnvironmentMissing, match=r"designer-circuits\[cluster\]"):
        Cluster("tcp://127.0.0.1:9")


@pytest.mark.slow
def test_the_command_line_on_a_cluster(
    address: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The same study here and there: equal files but for cost."""
    model = tmp_path / "small.toml"
    text = (ROOT / "examples" / "paper.toml").read_text(encoding="utf-8")
    head, first, *_ = text.partition("[circuit]")[0].split("[[response]]")
    circuit = "[circuit]" + text.partition("[circuit]")[2].split("[[response]]")[0]
    model.write_text(f"{head}[[response]]{first}{circuit}", encoding="utf-8")
    answers = []
    for more in ([], ["--cluster", address]):
        out = tmp_path / ("there" if more else "here") / "out"
        words = ["tolerance", str(model), "--out", str(out), "--rung", "exact", "--samples", "6"]
        assert entry.status([*words, *more, "--json", "-q"]) == 0
        answers.append(json.loads(capfd.readouterr().out))
        del answers[-1]["cost"]
    assert answers[0] == answers[1]
    one, two = (
        tmp_path / n / "out/samples.parquet/block-000000.parquet" for n in ("here", "there")
    )
    assert one.read_bytes() == two.read_bytes()
