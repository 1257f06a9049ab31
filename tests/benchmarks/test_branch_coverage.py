"""The table of what tests run, from figures of files that are made up."""

from __future__ import annotations

from benchmarks.branch_coverage import CORE, KINDS, by_package, percent, report
from tests.shared.house import ORDER


def file(*counts: int) -> dict[str, dict[str, int]]:
    return {"summary": dict(zip(KINDS, counts, strict=True))}


def test_packages_are_added_up_and_the_core_is_its_own() -> None:
    assert set(CORE) < set(ORDER)
    found = by_package(
        {
            "designer/base/a.py": file(10, 8, 4, 2),
            "designer/base/b.py": file(10, 10, 0, 0),
            "designer/model/c.py": file(5, 5, 1, 0),
            "designer/cli/d.py": file(100, 0, 0, 0),
            "designer/__init__.py": file(1, 0, 0, 0),
        }
    )
    assert found == {"base": [20, 18, 4, 2], "model": [5, 5, 1, 0], "cli": [100, 0, 0, 0]}
    assert percent(found["base"]) == 100.0 * 20 / 24
    text = report(found, 3.0)
    assert "83.3 % of the core's lines and branches are run" in text
    assert "of the branches alone 40.0 %" in text
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines()]
    assert ["core", "23 of 25", "2 of 5", "83.3"] in rows
    assert ["all", "23 of 125", "2 of 5", "19.2"] in rows
