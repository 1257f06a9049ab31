"""The ratios of every run of the benchmarks with their commits, and which of them have fallen.

A ratio is of two things in one run, so what else the machine does changes both; larger is better.
"""

from __future__ import annotations

import json
import math
import statistics
from pathlib import Path

from benchmarks.bench_flow import commit, machine
from benchmarks.bench_strangers import whole_lines
from benchmarks.figures import Figures

HISTORY = Path(__file__).parent.parent / "reports" / "bench-history" / "rows.jsonl"
LOSS = 0.1
"""Share of a ratio that may be chance."""
RECENT = 5
"""Latest runs, whose median a new one is compared with."""


def noted(benchmark: str, result: object, path: Path | None = None) -> list[str]:
    """Add a line with the ratios of a result, if it has some; which of them have fallen by more
    than ``LOSS`` since the latest runs on a like processor, in words. path : ``HISTORY``, if None.
    """
    if not isinstance(result, Figures):
        return []
    path = HISTORY if path is None else path
    processor = machine().partition(";")[0]
    ratios = {name: value for name, value in result.ratios.items() if math.isfinite(value)}
    before = [
        row["ratios"]
        for row in whole_lines(path)
        if (row["benchmark"], row["processor"]) == (benchmark, processor)
    ]
    fallen = []
    for name, value in ratios.items():
        known = [row[name] for row in before if name in row][-RECENT:]
        if known and value < (1.0 - LOSS) * (usual := statistics.median(known)):
            less = 100.0 * (1.0 - value / usual)
            change = f"from {usual:.3g} to {value:.3g}"
            fallen.append(f"{benchmark}: {name} fell by {less:.0f} %, {change}")
    row = {"benchmark": benchmark, "commit": commit(), "processor": processor, "ratios": ratios}
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")
    return fallen
