"""``--no-skips`` counts skips as failures, and nothing else; long files come first."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

CONFTEST = Path(__file__).parents[1].joinpath("conftest.py")


@pytest.fixture
def session(pytester: pytest.Pytester) -> pytest.Pytester:
    pytester.makeconftest(CONFTEST.read_text(encoding="utf-8"))
    return pytester


def test_a_skip_passes_without_the_option(session: pytest.Pytester) -> None:
    session.makepyfile("import pytest\ndef test_a(): pytest.skip('no reason')\ndef test_b(): pass")
    result = session.runpytest_subprocess()
    result.assert_outcomes(passed=1, skipped=1)
    assert result.ret == 0


@pytest.mark.parametrize(
    "body",
    [
        "def test_a(): pytest.skip('the reason')",
        "@pytest.mark.skip('the reason')\ndef test_a(): pass",
        "@pytest.fixture\ndef f(): pytest.skip('the reason')\ndef test_a(f): pass",
    ],
    ids=["call", "mark", "fixture"],
)
def test_a_skip_fails_with_the_option(session: pytest.Pytester, body: str) -> None:
    session.makepyfile(f"import pytest\n{body}\ndef test_b(): pass")
    result = session.runpytest_subprocess("--no-skips")
    outcomes = result.parseoutcomes()
    assert outcomes.pop("passed") == 1
    assert sum(outcomes.values()) == 1
    assert "skipped" not in outcomes
    assert result.ret == 1
    result.stdout.fnmatch_lines(["*under --no-skips: *the reason*"])


def test_a_skipped_module_fails_with_the_option(session: pytest.Pytester) -> None:
    session.makepyfile("import pytest\npytest.importorskip('no_such_module')\ndef test_a(): pass")
    result = session.runpytest_subprocess("--no-skips")
    assert result.ret != 0
    result.stdout.fnmatch_lines(["*under --no-skips: *no_such_module*"])


def test_an_expected_failure_stays_one(session: pytest.Pytester) -> None:
    session.makepyfile("import pytest\n@pytest.mark.xfail\ndef test_a(): assert False")
    result = session.runpytest_subprocess("--no-skips")
    result.assert_outcomes(xfailed=1)
    assert result.ret == 0


def test_files_that_take_long_come_first(session: pytest.Pytester) -> None:
    slow = "import pytest\n@pytest.mark.slow\ndef test_a(): pass"
    session.makepyfile(test_c=slow, test_b="def test_a(): pass", test_a="def test_a(): pass")
    session.mkdir("cli").joinpath("test_entry.py").write_text(slow, encoding="utf-8")
    lines = session.runpytest_subprocess("--collect-only", "-q").outlines
    assert [line for line in lines if "::" in line] == [
        f"{name}.py::test_a" for name in ("cli/test_entry", "test_c", "test_a", "test_b")
    ]


def test_files_of_known_seconds_are_there() -> None:
    text = CONFTEST.read_text(encoding="utf-8")
    names = re.findall(r'^    "(\w+/test_\w+\.py)": \d+,$', text, re.MULTILINE)
    assert len(names) > 20
    for name in names:
        assert (CONFTEST.parent / name).exists(), name
