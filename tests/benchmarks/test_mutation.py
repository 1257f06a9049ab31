"""Mutants of a tiny file that are known, and what its tests say of them."""

from __future__ import annotations

import json
import shutil
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchmarks import mutant_tests, mutation
from benchmarks.mutants import Mutant, differs, in_turn, mutants, shuffled
from benchmarks.mutation import (
    Copy,
    Cover,
    Population,
    choice,
    judged,
    key_of,
    missing,
    report,
    tried,
)
from benchmarks.mutation_targets import GROUPS, Target

MODULE, TESTS = "tiny.py", "test_tiny.py"
SOURCE = '''\
"""A docstring with 1 < 2."""
from __future__ import annotations

LIMIT: int = 3


def inside(x: float, wide: bool = False) -> bool:
    """Whether x < 3."""
    assert x != 7.0
    if x < 0.0 and not wide:
        raise ValueError(f"{x - 1}")
    return x < LIMIT


def steps(n: int) -> int:
    done = 0
    while done < n:
        done += 1
    return done
'''
CHECKS = """\
from tiny import inside, steps


def test_inside():
    assert inside(1.0)
    assert not inside(4.0)
    assert inside(-1.0, True)


def test_steps():
    assert steps(2) == 2
"""
KNOWN = {
    ("3 to 4", "LIMIT: int = 4"),
    ("False to True", "def inside(x: float, wide: bool = True) -> bool:"),
    ("< to <=", "if x <= 0.0 and not wide:"),
    ("< to >=", "if x >= 0.0 and not wide:"),
    ("0.0 to 1.0", "if x < 1.0 and not wide:"),
    ("and to or", "if x < 0.0 or not wide:"),
    ("not to", "if x < 0.0 and  wide:"),
    ("statement dropped", "pass"),
    ("return not (…)", "return not (x < LIMIT)"),
    ("< to <=", "return x <= LIMIT"),
    ("< to >=", "return x >= LIMIT"),
    ("0 to 1", "done = 1"),
    ("< to <=", "while done <= n:"),
    ("< to >=", "while done >= n:"),
    ("+= to -=", "done -= 1"),
    ("1 to 2", "done += 2"),
    ("return -(…)", "return -(done)"),
}
"""Operator and changed line of each; two statements may be dropped."""
TINY = Target(MODULE, (TESTS,))
COVERS = {
    TESTS: Cover(
        {f"{TESTS}::test_inside": 0.01, f"{TESTS}::test_steps": 0.02},
        {
            MODULE: {
                "": [4, 7, 15],
                f"{TESTS}::test_inside": [10, 12],
                f"{TESTS}::test_steps": [16, 17, 18, 19],
            }
        },
    )
}


def found() -> dict[tuple[str, str], Mutant]:
    """By operator and changed line."""
    return {(m.operator, m.diff(SOURCE.encode())[1]): m for m in mutants(MODULE, SOURCE.encode())}


def test_a_files_mutants_are_these() -> None:
    """None of texts, annotations, assertions, or of what an error says."""
    all_ = mutants(MODULE, SOURCE.encode())
    told = Counter((m.operator, m.diff(SOURCE.encode())[1]) for m in all_)
    assert set(told) == KNOWN
    assert [pair for pair, times in told.items() if times > 1] == [("statement dropped", "pass")]
    assert {m.function for m in all_} == {"", "inside", "steps"}
    assert all(differs(m, SOURCE.encode()) for m in all_)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("x[1:n]", {"x[2:n]", "x[1:(n + 1)]"}),
        ("range(a, b)", {"range(a, (b + 1))", "range(a, (b - 1))"}),
        ("a if b else c", {"a if (not (b)) else c"}),
        ("(a\n  # + b\n  + c)", {"(a\n  # + b\n  - c)"}),
        ("a is  not b", {"a is b"}),
        ("zip(a, b, strict=True)", set()),
        ('"%s" % a', set()),
        ("-1.0", {"1.0", "-2.0"}),
    ],
)
def test_expressions(before: str, after: set[str]) -> None:
    source = f"def f(a, b, c, n, x):\n    return ({before})\n".encode()
    changed = {m.of(source).decode() for m in mutants("f.py", source)}
    plain = {text.partition("return (")[2].rstrip()[:-1].strip() for text in changed}
    assert plain == after


def test_the_same_bytecode_is_no_mutant() -> None:
    source = b"def f():\n    return 2**2\n"
    by_operator = {m.operator: m for m in mutants("f.py", source)}
    assert not differs(by_operator["** to *"], source)
    assert differs(by_operator["2 to 3"], source)
    assert not differs(replace(by_operator["2 to 3"], new="2  # two\n    "), source)


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    root = tmp_path_factory.mktemp("tree")
    (root / MODULE).write_text(SOURCE)
    (root / TESTS).write_text(CHECKS)
    (root / "benchmarks").mkdir()
    (root / "benchmarks" / "__init__.py").touch()
    shutil.copy(mutant_tests.__file__, root / "benchmarks" / "mutant_tests.py")
    made = Copy(root, tmp_path_factory.mktemp("work"))
    made.refresh([str(p.relative_to(root)) for p in root.rglob("*.py")])
    return made


@pytest.mark.slow
@pytest.mark.parametrize(
    ("operator", "after", "result", "by"),
    [
        ("< to >=", "return x >= LIMIT", "killed", "test_inside"),
        ("+= to -=", "done -= 1", "timed out", "test_steps"),
        ("1 to 2", "done += 2", "survived", ""),
        ("False to True", "def inside(x: float, wide: bool = True) -> bool:", "survived", ""),
    ],
)
def test_what_becomes_of_known_mutants(
    copy: Copy, monkeypatch: pytest.MonkeyPatch, operator: str, after: str, result: str, by: str
) -> None:
    """Two steps of 1 are one of 2, and whether a width that nobody gave is wide, no test asks."""
    if result == "timed out":
        monkeypatch.setattr(mutation, "START", 1.5)
    row = tried(copy, found()[operator, after], TINY, COVERS)
    assert row["result"] == result, (copy.work / "log.txt").read_text()
    assert row["by"] == (f"{TESTS}::{by}" if by else "")
    assert (copy.path / MODULE).read_text() == SOURCE


def test_tests_that_run_the_line_come_first() -> None:
    inside, steps = COVERS[TESTS].seconds
    last = found()["return -(…)", "return -(done)"]
    assert choice(last, TINY, COVERS) == {TESTS: [steps, inside]}
    constant = found()["3 to 4", "LIMIT: int = 4"]
    assert choice(constant, TINY, COVERS) == {TESTS: [inside, steps]}
    assert choice(last, TINY, {TESTS: Cover(COVERS[TESTS].seconds, {})}) == {}


def row_of(mutant: Mutant, result: str, **more: Any) -> dict[str, Any]:
    names = dict(zip(mutation.NAMES, mutant.key, strict=True))
    before, after = mutant.diff(SOURCE.encode())
    told = {"line": mutant.line, "before": before, "after": after, "by": "", "tests": 2}
    return {**names, **told, "result": result, "state": "old", "commit": "c", **more}


def test_a_run_goes_on_and_tries_survivors_again(copy: Copy, tmp_path: Path) -> None:
    population = Population(copy.path, {"all": (TINY,)}, 1)
    wanted = population.sample(5)
    assert wanted == shuffled(population.mutants.values(), 1)[:5]
    killed, alike, alive = wanted[:3]
    rows = [row_of(killed, "killed"), row_of(alike, "survived"), row_of(alive, "survived")]
    listed = tmp_path / "judged.toml"
    told = {name: json.dumps(value) for name, value in zip(mutation.NAMES, alike.key, strict=True)}
    lines = [f"{name} = {value}" for name, value in told.items()]
    listed.write_text("\n".join(["[[mutant]]", *lines, 'why = "no other number"']))
    why = judged(listed)
    assert list(missing(wanted, rows, why, population)) == [alive, *wanted[3:]]
    rows.append(row_of(alive, "killed", by=f"{TESTS}::test_steps"))
    assert [key_of(row) for row in rows[-2:]] == [alive.key] * 2
    assert list(missing(wanted, rows, why, population)) == wanted[3:]
    text = report(rows, why, population, 5)
    assert "3 mutants, of 18 that there are. 2 are killed (100.0 %" in text
    assert f": `{TESTS}::test_steps`" in text.partition("## That")[0]
    assert ": no other number" in text.partition("## That")[2]


def test_groups_take_turns() -> None:
    one, two = (
        [found()[pair] for pair in list(KNOWN)[:3]],
        [found()[pair] for pair in [*KNOWN][3:4]],
    )
    assert list(in_turn([one, two])) == [one[0], two[0], *one[1:]]


def test_the_files_that_are_mutated_are_there() -> None:
    targets = [target for group in GROUPS.values() for target in group]
    names = [name for target in targets for name in (target.module, *target.tests)]
    assert [name for name in names if not (mutation.ROOT / name).is_file()] == []
    assert len({target.module for target in targets}) == len(targets)


def test_what_is_judged_is_a_mutant_of_the_sources_as_they_are() -> None:
    known = Population(mutation.ROOT, GROUPS, mutation.SEED).mutants
    listed = judged(mutation.REPORT / mutation.JUDGED)
    assert listed
    assert [key for key in listed if key not in known] == []
