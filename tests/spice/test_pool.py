"""The pool: same results for any number of workers, and what happens when one dies."""

from __future__ import annotations

import functools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import designer
from designer.base.errors import EnvironmentMissing
from designer.spice import pool as workers
from designer.spice.batch_backend import program_version
from designer.spice.pool import SpicePool
from designer.spice.simulator import Backend, SimulationFailed, SpiceJob, Waveforms


def deck(ohms: float) -> str:
    return f"""RC with a limiter
V1 in 0 SIN(0 2 1k)
R1 in out {ohms!r}
C1 out 0 100n
A1 out lim limiter
.model limiter limit(gain=1 out_lower_limit=-1 out_upper_limit=1 limit_range=1m)
R2 lim 0 1k
.tran 5u 2m 0 5u
.end
"""


FLOATING = "floating\nV1 a 0 SIN(0 1 1k)\nC1 a out 1u\nC2 out 0 1u\n.tran 5u 2m 0 5u\n.end\n"
FATAL = "fatal\nV1 a 0 1\nR1 a out {nosuch}\nR2 out 0 1k\n.tran 5u 2m 0 5u\n.end\n"


def last_value(waves: Waveforms) -> float:
    return float(waves.signals["out"][-1])


def everything(waves: Waveforms) -> Waveforms:
    return waves


def divide_by_zero(waves: Waveforms) -> float:
    return waves.seconds / 0


def die(status: int, waves: Waveforms) -> None:
    os._exit(status)


def kill_myself(waves: Waveforms) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def leave(waves: Waveforms) -> None:
    raise SystemExit(3)


def die_once(flag: Path, waves: Waveforms) -> float:
    if not flag.exists():
        flag.touch()
        os._exit(139)
    return last_value(waves)


def sleep(seconds: float, waves: Waveforms) -> None:
    time.sleep(seconds)


def refuse_to_start(*arguments: object) -> None:
    os._exit(7)


def give_a_lambda(waves: Waveforms) -> Callable[[], None]:
    return lambda: None


class Unreadable:
    """Pickles, but not back."""

    def __reduce__(self) -> tuple[Any, ...]:
        return int, ("not a number",)


def give_the_unreadable(waves: Waveforms) -> Unreadable:
    return Unreadable()


def describe_process(waves: Waveforms) -> dict[str, Any]:
    return {
        "pid": os.getpid(),
        "home": os.environ["HOME"],
        "cwd": str(Path.cwd()),
        "files": sorted(os.listdir()),
        "spice": [name for name in os.environ if name.startswith("SPICE")],
        "threads": os.environ["OMP_NUM_THREADS"],
        "heavy": sorted({"pandas", "cvxpy", "scipy", "matplotlib", "numba"} & set(sys.modules)),
        "interrupt": signal.getsignal(signal.SIGINT),
        "temporary": os.environ["TMPDIR"],
    }


def job(reduce: Callable[[Waveforms], Any], netlist: str = deck(1e3)) -> SpiceJob[Any]:
    return SpiceJob(netlist, ("out",), 2e-3, reduce)


@pytest.fixture(scope="module")
def pool() -> Iterator[SpicePool]:
    with SpicePool(2) as pool:
        yield pool


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Where a pool of this test puts its folders; it must leave nothing there."""
    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(place))
    yield place
    assert list(place.iterdir()) == []


def ends(pid: int) -> bool:
    """Whether a process is gone within two seconds."""
    for _ in range(100):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.02)
    return False


@pytest.mark.slow
def test_results_do_not_depend_on_the_number_of_workers(pool: SpicePool) -> None:
    jobs = [job(everything, deck(1e3 + 37.0 * i)) for i in range(12)]
    jobs[3] = job(last_value, FLOATING)
    jobs[6] = job(last_value, FATAL)
    jobs[8] = job(divide_by_zero)

    def run(pool: SpicePool) -> dict[int, Any]:
        results = dict(pool.map(iter(jobs)))
        assert sorted(results) == list(range(12))
        return results

    two = run(pool)
    others = []
    for workers_, backend in ((1, "shared"), (2, "batch")):
        with SpicePool(workers_, backend=backend) as other:  # type: ignore[arg-type]
            others.append(run(other))
            assert other.version == program_version()
    for i in range(12):
        for other_results in others:
            a, b = two[i], other_results[i]
            assert type(a) is type(b)
            if isinstance(a, Waveforms):
                np.testing.assert_array_equal(a.axis, b.axis)
                np.testing.assert_array_equal(a.signals["out"], b.signals["out"])
    assert "singular matrix" in two[3].reason
    assert "nosuch" in two[6].reason
    assert two[8].reason == "analysis failed: ZeroDivisionError: float division by zero"


def test_a_worker_is_alone_in_an_empty_folder(
    monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    monkeypatch.setenv("SPICE_SCRIPTS", str(folder))
    with SpicePool(1) as pool:
        ((_, found),) = pool.map([job(describe_process)])
        assert not isinstance(found, SimulationFailed)
        assert found["home"] == found["cwd"]
        assert Path(found["home"]).is_relative_to(folder)
        assert Path(found["temporary"]).is_relative_to(folder)
        assert found["files"] == []
        assert found["spice"] == []
        assert found["threads"] == "1"
        assert found["heavy"] == []
        assert found["interrupt"] == signal.SIG_IGN
    assert ends(found["pid"])


@pytest.mark.parametrize(
    ("reduce", "reason"),
    [
        (functools.partial(die, 139), "worker died (exit 139) twice"),
        (kill_myself, "worker died (exit -9) twice"),
        (leave, "worker died (exit 3) twice"),
        (divide_by_zero, "analysis failed: ZeroDivisionError: float division by zero"),
        (give_a_lambda, "analysis failed: "),
        (give_the_unreadable, "analysis failed: its result cannot be read: ValueError"),
    ],
    ids=["exits", "killed", "leaves", "raises", "does not pickle", "does not unpickle"],
)
def test_analyses_that_fail(pool: SpicePool, reduce: Callable[..., Any], reason: str) -> None:
    results = dict(pool.map([job(last_value), job(reduce), job(last_value)]))
    assert isinstance(results[1], SimulationFailed)
    assert results[1].reason.startswith(reason)
    assert results[0] == results[2]
    assert isinstance(results[0], float)


def test_a_refused_deck_is_a_failure_of_its_job(pool: SpicePool) -> None:
    bad = job(last_value, deck(1e3).replace("V1", ".control\nV1"))
    ((_, result),) = pool.map([bad])
    assert isinstance(result, SimulationFailed)
    assert "line 2 is refused" in result.reason


def test_a_job_is_tried_again(pool: SpicePool, tmp_path: Path) -> None:
    ((_, result),) = pool.map([job(functools.partial(die_once, tmp_path / "flag"))])
    assert isinstance(result, float)


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["shared", "batch"])
def test_a_job_that_hangs(backend: Backend, folder: Path) -> None:
    # neither ngspice itself nor the analysis may take for ever
    endless = job(last_value, deck(1e3).replace(".tran 5u 2m 0 5u", ".tran 5u 1e6 0 5u"))
    with SpicePool(2, backend, timeout=1.0) as pool:
        slow = replace(job(functools.partial(sleep, 1.5)), patience=20.0)
        jobs = [job(functools.partial(sleep, 60.0)), endless, job(last_value), slow]
        results = dict(pool.map(jobs))
    assert not isinstance(results[3], SimulationFailed), "a job may be given more time"
    for i in (0, 1):
        assert isinstance(results[i], SimulationFailed)
        assert results[i].reason == "worker gave no answer within 1 s twice"
    assert isinstance(results[2], float)


def test_an_idle_worker_that_dies_is_replaced(pool: SpicePool) -> None:
    found = [result for _, result in pool.map([job(describe_process)] * 4)]
    for pid in {one["pid"] for one in found if not isinstance(one, SimulationFailed)}:
        os.kill(pid, signal.SIGKILL)
    results = [result for _, result in pool.map([job(last_value)] * 4)]
    assert len(results) == 4
    assert all(isinstance(result, float) for result in results)


def test_jobs_are_taken_as_workers_become_free(pool: SpicePool) -> None:
    taken = 0

    def jobs() -> Iterator[SpiceJob[float]]:
        nonlocal taken
        while True:
            taken += 1
            yield job(last_value)

    results = pool.map(jobs())
    for _ in range(5):
        next(results)
    with pytest.raises(RuntimeError, match="at work"):
        next(pool.map([job(last_value)]))
    results.close()  # type: ignore[attr-defined]
    assert taken <= 5 + 2 * 2
    assert len(list(pool.map([job(last_value)] * 3))) == 3
    assert list(pool.map([])) == []


def test_a_job_that_does_not_pickle_is_the_callers_mistake(pool: SpicePool) -> None:
    with pytest.raises(Exception, match=r"pickle|lambda"):
        list(pool.map([job(lambda waves: None)]))
    assert len(list(pool.map([job(last_value)]))) == 1


def test_a_closed_pool_says_so(folder: Path) -> None:
    pool = SpicePool(1)
    pool.close()
    pool.close()
    with pytest.raises(RuntimeError, match="closed"):
        list(pool.map([]))
    with pytest.raises(ValueError, match="jobs"):
        SpicePool(0)
    with pytest.raises(ValueError, match="timeout"):
        SpicePool(1, timeout=0.0)


def test_a_forgotten_pool_leaves_nothing(folder: Path) -> None:
    pool = SpicePool(1)
    ((_, found),) = pool.map([job(describe_process)])
    assert not isinstance(found, SimulationFailed)
    del pool
    assert ends(found["pid"])


def test_missing_ngspice_is_said(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, folder: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with SpicePool(1, "batch") as pool, pytest.raises(EnvironmentMissing, match="install"):
        list(pool.map([job(last_value)]))


def test_workers_that_do_not_start(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.setattr(workers, "work", refuse_to_start)
    with SpicePool(2) as pool, pytest.raises(EnvironmentMissing, match=r"do not start.*exit 7"):
        list(pool.map([job(last_value)] * 5))


_INTERRUPTED = """
import os, signal, sys, time
from pathlib import Path
from designer.spice.pool import SpiceJob, SpicePool

def wait(waves):
    Path(sys.argv[1], str(os.getpid())).touch()
    time.sleep(60)

if __name__ == "__main__":
    # a job that a shell starts in the background inherits a deaf ear
    signal.signal(signal.SIGINT, signal.default_int_handler)
    deck = "rc\\nV1 a 0 1\\nR1 a 0 1k\\n.tran 1u 1m\\n.end\\n"
    with SpicePool(2) as pool:
        list(pool.map([SpiceJob(deck, ("a",), 1e-3, wait)] * 4))
"""


def start_interrupted(tmp_path: Path) -> tuple[subprocess.Popen[str], list[int], Path]:
    """A script with two workers amid a job, the workers' numbers, and its temporary folder."""
    script, pids, temporary = tmp_path / "script.py", tmp_path / "pids", tmp_path / "tmp"
    script.write_text(_INTERRUPTED)
    pids.mkdir()
    temporary.mkdir()
    environment = {
        **os.environ,
        "PYTHONPATH": str(Path(designer.__file__).parents[1]),
        "TMPDIR": str(temporary),
    }
    process = subprocess.Popen(
        [sys.executable, str(script), str(pids)],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    limit = time.monotonic() + 60.0
    while len(list(pids.iterdir())) < 2:
        assert time.monotonic() < limit
        assert process.poll() is None
        time.sleep(0.02)
    return process, [int(file.name) for file in pids.iterdir()], temporary


def test_ctrl_c_ends_everything_at_once(tmp_path: Path) -> None:
    process, pids, temporary = start_interrupted(tmp_path)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    _, stderr = process.communicate(timeout=5.0)
    assert process.returncode == -signal.SIGINT
    assert stderr.count("Traceback") == 1
    assert all(ends(pid) for pid in pids)
    assert list(temporary.iterdir()) == []


@pytest.mark.slow
def test_workers_of_a_killed_parent_end_amid_their_jobs(tmp_path: Path) -> None:
    process, pids, _ = start_interrupted(tmp_path)
    process.kill()
    process.communicate()
    assert all(ends(pid) for pid in pids)


_LEFT = """
import multiprocessing
import sys
from designer.spice.worker import work

if __name__ == "__main__":
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=work, args=(theirs, "batch", sys.argv[1]))
    process.start()
    theirs.close()
    assert ours.poll(60.0)
    ours.close()  # with the worker's first word unread, as a parent that is killed leaves it
    process.join()
    assert process.exitcode == 0, process.exitcode
"""


def test_a_worker_whose_parent_is_killed_ends_without_a_word(tmp_path: Path) -> None:
    script, folder = tmp_path / "script.py", tmp_path / "worker"
    script.write_text(_LEFT)
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, str(script), str(folder)],
        env={**os.environ, "PYTHONPATH": str(Path(designer.__file__).parents[1])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
