"""What all tests share: no skipping under ``--no-skips``, Hypothesis profiles, no display."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections import defaultdict
from collections.abc import Generator, Iterator
from pathlib import Path

# Before anything imports matplotlib.pyplot: tests run without a display.
os.environ["MPLBACKEND"] = "Agg"
# Before anything imports NumPy: one thread of linear algebra, as on the command line. Threads that
# wait for each other's core keep both busy: 120 equations took 26 times as long on a busy machine.
os.environ.update(OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1", BLIS_NUM_THREADS="1")

import pytest
from hypothesis import settings

from tests.shared.answer_store import during, open_store
from tests.shared.blank_figures import blank_figures
from tests.shared.this_process import in_this_process
from tests.shared.typed_answers import printed_answers_checked

# Many processes read the same sources: without bytecode files each compiles all of them anew.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# What a script starts in the background is deaf to Ctrl-C, and so is all that it starts: the tests
# of Ctrl-C are to hold there too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples in each run: a failure that one run shows, the next shows too. A property that
# names no number of its own has few; the profile below has the many.
settings.register_profile("ci", deadline=None, derandomize=True, max_examples=30)
# New examples in each run, to look for failures: HYPOTHESIS_PROFILE=explore. Other populations are
# larger under it too (tests/shared/exploring.py).
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


# The objects of all imported libraries live to the end: the collector of garbage need not go
# through them again and again, which took a sixth of the tests' time.
gc.disable()


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
    gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    """The exact engine is compiled once, before several processes need it at the same moment."""
    if getattr(session.config.option, "numprocesses", None):
        from tests.shared.compile_kernels import compile_kernels

        compile_kernels()


TESTS = Path(__file__).parent
LONG = ("slow", "kicad", "browser", "wheel", "docs")
"""Marks of tests that take about ten times as long as one without."""
SECONDS = {
    "repository/test_doc_commands.py": 680,
    "fabrication/test_board_faults.py": 300,
    "yields/test_study.py": 150,
    "yields/test_tuned_yield.py": 150,
    "cli/test_entry.py": 120,
    "fuzz/test_random_models.py": 120,
    "jobs/test_repair_whole.py": 120,
    "centering/test_repair.py": 110,
    "jobs/test_search_job.py": 100,
    "cli/test_bifurcation.py": 80,
    "routing/test_routed_kicad.py": 80,
    "explorer/test_page.py": 70,
    "report/test_report_browser.py": 70,
    "bifurcations/test_window_ends.py": 60,
    "jobs/test_bench_job.py": 60,
    "explorer/test_page_layout.py": 50,
    "fuzz/test_killed_work.py": 50,
    "repository/test_notebook.py": 50,
    "bifurcations/test_loop_check.py": 45,
    "centering/test_operating_points.py": 35,
    "centering/test_levers.py": 30,
    "dynamics/test_event_by_event.py": 30,
    "fidelity/test_trade_study.py": 30,
    "jobs/test_two_at_once.py": 30,
    "report/test_comparison.py": 30,
    "repository/test_site.py": 30,
}
"""Of files with long tests that the rule below does not foretell: wall time, on one process of two
busy cores. They decide the order alone, so that they may be out of date by half."""
A_TEST, A_LONG_ONE = 0.1, 1.0
"""Seconds of one of all other tests, in the mean."""


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files that take long come first, so that no process ends long after the other."""
    work: defaultdict[Path, float] = defaultdict(float)
    known = dict[Path, float]()
    for item in items:
        long = any(item.get_closest_marker(name) for name in LONG)
        work[item.path] += A_LONG_ONE if long else A_TEST
        if long:
            name = item.path.as_posix().removeprefix(f"{TESTS.as_posix()}/")
            known[item.path] = SECONDS.get(name, 0.0)
    items.sort(key=lambda item: (-max(work[item.path], known.get(item.path, 0.0)), item.path))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--no-skips",
        action="store_true",
        help="count a skipped test or module as failed (an expected failure stays what it is)",
    )


def _fail_if_skipped(report: pytest.TestReport | pytest.CollectReport) -> None:
    # pytest reports an expected failure as skipped too, with the attribute wasxfail.
    if not report.skipped or hasattr(report, "wasxfail"):
        return
    reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
    report.outcome = "failed"
    report.longrepr = f"under --no-skips: {reason}"


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if item.config.getoption("--no-skips"):
        _fail_if_skipped(report)
    return report


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    report = yield
    if collector.config.getoption("--no-skips"):
        _fail_if_skipped(report)
    return report


@pytest.fixture(scope="session", autouse=True)
def one_process() -> Iterator[None]:
    """``tests/base/test_second_process.py`` takes it back, and so does all that starts a verb as a
    process."""
    with in_this_process():
        yield


@pytest.fixture(scope="session", autouse=True)
def answers_are_typed() -> Iterator[None]:
    """What a verb prints is of its type."""
    with printed_answers_checked():
        yield


@pytest.fixture(scope="session", autouse=True)
def answers_are_kept(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """In the folder of this run, of which a worker's folder is a part."""
    run = tmp_path_factory.getbasetemp()
    open_store((run.parent if hasattr(request.config, "workerinput") else run) / "answers")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    with during(item):
        return (yield)


@pytest.fixture(scope="module")
def figures_are_blank() -> Iterator[None]:
    """For modules that ask nothing of pictures; ``tests/plots``, ``tests/report`` and
    ``tests/board`` look at them."""
    with blank_figures():
        yield


@pytest.fixture(scope="module")
def designs_are_made_once() -> Iterator[None]:
    """For modules that ask nothing of the choice of parts, nor of the way of the tracks."""
    from tests.shared.made_once import made_once  # imports what some modules of tests do not need

    with made_once():
        yield


@pytest.fixture
def quick_reports() -> Iterator[None]:
    """Reports are files of one word: their pictures take longer than all else."""

    def write(_data: object, html: Path, text: Path, _sections: object) -> None:
        for path in (html, text):
            path.write_text("report")

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("designer.report.write.write_report", write)
        yield
