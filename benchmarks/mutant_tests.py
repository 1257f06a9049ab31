"""What pytest does for mutants, as its plugin: ``-p benchmarks.mutant_tests``.

Under coverage.py every test is a context of its own. Where ``ORDER`` names a file with tests and
the seconds that each may take, those run in its order, and no others. Hypothesis does not shrink
what it found. ``NOTES`` says which test is running, and at the end the seconds of each test and the
first one that failed.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Generator
from pathlib import Path

import pytest

ORDER = "MUTANT_TESTS_ORDER"
NOTES = "MUTANT_TESTS_NOTES"

_seconds: dict[str, float] = {}
_failed: list[str] = []


def pytest_configure() -> None:
    from hypothesis import Phase, settings  # pytest rewrites its assertions before

    settings.register_profile(
        "mutants", deadline=None, derandomize=True, phases=[Phase.explicit, Phase.generate]
    )
    settings.load_profile("mutants")


@pytest.hookimpl(wrapper=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Generator[None, None, None]:
    yield
    if ORDER in os.environ:
        limits = json.loads(Path(os.environ[ORDER]).read_text("utf-8"))
        place = {test: number for number, test in enumerate(limits)}
        items[:] = sorted((i for i in items if i.nodeid in place), key=lambda i: place[i.nodeid])
        for item in items:
            # A thread ends the process: compiled code does not listen to signals.
            item.add_marker(pytest.mark.timeout(limits[item.nodeid], method="thread"))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    coverage = sys.modules.get("coverage")
    running = coverage.Coverage.current() if coverage else None
    if running is not None:
        running.switch_context(item.nodeid)
    _note({"running": item.nodeid})
    start = time.perf_counter()
    try:
        return (yield)
    finally:
        _seconds[item.nodeid] = time.perf_counter() - start
        if running is not None:
            running.switch_context("")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.failed:
        _failed.append(report.nodeid)


def pytest_collectreport(report: pytest.CollectReport) -> None:
    if report.failed:
        _failed.append(report.nodeid)


def pytest_sessionfinish() -> None:
    _note({"seconds": _seconds, "failed": _failed[0] if _failed else None})


def _note(what: dict[str, object]) -> None:
    if NOTES in os.environ:
        Path(os.environ[NOTES]).write_text(json.dumps(what), "utf-8")
