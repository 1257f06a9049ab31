"""How much of the core the quick tests run, with branches: writes reports/coverage/.

What numba compiles is left out, since nobody sees its lines run: what tests say of it is measured
by mutants (``mutation``).

    python -m benchmarks.branch_coverage
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.bench_flow import commit, table
from benchmarks.bench_strangers import filled
from benchmarks.mutation import QUICK
from designer.base import jit

ROOT = Path(__file__).parent.parent
REPORT = ROOT / "reports" / "coverage"
WORK = ROOT / "out" / "coverage"
CORE = (
    "base", "kernels", "dynamics", "bifurcations", "catalog", "laws", "model", "circuit",
    "linear_network", "synthesis", "spread", "spice", "check", "verdicts", "yields",
)  # fmt: skip
"""Packages that every study goes through; the others are each read by their own verb."""
WANTED = 90
"""Per cent of the core."""
KINDS = ("num_statements", "covered_lines", "num_branches", "covered_branches")


def measured(words: Sequence[str]) -> dict[str, Any]:
    """Run the tests, and return what coverage.py says of each file."""
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    settings, data = WORK / "settings.ini", WORK / "data"
    omit = "omit =" + "".join(f"\n    designer/{pattern}" for pattern in jit.KERNELS)
    settings.write_text(
        f"[run]\nbranch = true\nsource = designer\n{omit}\nparallel = true\n"
        f"patch = subprocess\ndata_file = {data}\n[report]\n{omit}\n",
        "utf-8",
    )

    def run(*verb: str) -> int:
        return subprocess.run([sys.executable, "-m", "coverage", *verb], cwd=ROOT).returncode

    if run("run", f"--rcfile={settings}", "-m", "pytest", "-q", "-m", QUICK, *words):
        print("tests failed: more would be run if they did not", file=sys.stderr)
    told = str(WORK / "coverage.json")
    if run("combine", "-q", f"--rcfile={settings}") or run(
        "json", "-q", f"--rcfile={settings}", "-o", told
    ):
        raise SystemExit("coverage.py has no figures")
    return json.loads(Path(told).read_text("utf-8"))["files"]  # type: ignore[no-any-return]


def by_package(files: Mapping[str, Any]) -> dict[str, list[int]]:
    """Lines, of which run, ways of branches, of which taken: of each package."""
    found: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0, 0])
    for name, file in files.items():
        path = Path(name)
        if len(path.parts) > 2:
            for place, kind in enumerate(KINDS):
                found[path.parts[1]][place] += file["summary"][kind]
    return dict(found)


def percent(counts: Sequence[int]) -> float:
    """Of lines and ways together, as coverage.py counts."""
    lines, run, ways, taken = counts
    return 100.0 * (run + taken) / max(lines + ways, 1)


def _row(name: str, counts: Sequence[int]) -> list[str]:
    lines, run, ways, taken = counts
    return [name, f"{run} of {lines}", f"{taken} of {ways}", f"{percent(counts):.1f}"]


def report(found: Mapping[str, Sequence[int]], minutes: float) -> str:
    """README.md."""
    core = [found[name] for name in CORE if name in found]
    total = [sum(counts) for counts in zip(*core, strict=True)]
    whole = [sum(counts) for counts in zip(*found.values(), strict=True)]
    rows = [_row(name, found[name]) for name in CORE if name in found]
    rows.append(_row("core", total))
    rows += [_row(name, found[name]) for name in sorted(found) if name not in CORE]
    rows.append(_row("all", whole))
    lines = [
        "# What the quick tests run",
        "",
        filled(
            "Made by `make coverage` (`python -m benchmarks.branch_coverage`): coverage.py on the "
            f"tests of `make test`, in {minutes:.0f} minutes. Files that numba compiles "
            f"({', '.join(f'`{pattern}`' for pattern in jit.KERNELS)}) are left out: mutants "
            "([mutation](../mutation/README.md)) say what tests notice in them."
        ),
        "",
        f"- Commit: {commit()}",
        "",
        f"{percent(total):.1f} % of the core's lines and branches are run (wanted: {WANTED} %); "
        f"of the branches alone {100.0 * total[3] / total[2]:.1f} %.",
        "",
        *table(["package", "lines run", "ways of branches taken", "% of both"], rows),
    ]
    return "\n".join(lines) + "\n"


def main(words: Sequence[str] = ()) -> None:
    """Measure and write. words : further ones for pytest."""
    start = time.monotonic()
    found = by_package(measured(words))
    REPORT.mkdir(parents=True, exist_ok=True)
    text = report(found, (time.monotonic() - start) / 60.0)
    (REPORT / "README.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
