"""Run each ``benchmarks/bench_*.py`` that has a ``main()`` and print how long it took."""

from __future__ import annotations

import importlib
import pkgutil
import sys
import time

from rich.console import Console
from rich.table import Table

import benchmarks


def main() -> int:
    """Exit status: 0, or 1 if a benchmark raised."""
    console = Console()
    table = Table("benchmark", "seconds", "result")
    failed = False
    names = sorted(m.name for m in pkgutil.iter_modules(benchmarks.__path__, "benchmarks."))
    for name in names:
        if not name.startswith("benchmarks.bench_"):
            continue
        run = getattr(importlib.import_module(name), "main", None)
        if run is None:
            continue
        start = time.perf_counter()
        try:
            result = run()
        except Exception as error:  # the others shall still run
            console.print_exception()
            failed, result = True, f"failed: {error!r}"
        seconds = time.perf_counter() - start
        shown = "" if result is None else str(result)
        table.add_row(name.removeprefix("benchmarks.bench_"), f"{seconds:.2f}", shown)
    console.print(table)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
