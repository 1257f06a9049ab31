"""Run each ``benchmarks/bench_*.py`` that has a ``main()`` and print how long it took. Ratios go to
reports/bench-history/ with their commit, and those that have fallen by a tenth are named.

With names as arguments (``python -m benchmarks ngspice``), only those; what follows one name and
begins with ``-`` are that benchmark's own options (``python -m benchmarks strangers --count 30``).
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import sys
import time
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

import benchmarks
from benchmarks.history import noted

PREFIX = "benchmarks.bench_"


def main(words: Sequence[str] = ()) -> int:
    """Exit status: 0, 1 if a benchmark raised, or 2 if there is none of a wanted name."""
    end = next((i for i, word in enumerate(words) if word.startswith("-")), len(words))
    wanted, options = words[:end], words[end:]
    if options and len(wanted) != 1:
        print("options are those of one benchmark, which stands before them", file=sys.stderr)
        return 2
    console = Console()
    table = Table("benchmark", "seconds", "result")
    failed, fallen = False, list[str]()
    modules = sorted(m.name for m in pkgutil.iter_modules(benchmarks.__path__, "benchmarks."))
    names = [name for name in modules if name.startswith(PREFIX)]
    unknown = {f"{PREFIX}{name}" for name in wanted} - set(names)
    if unknown:
        found = ", ".join(name.removeprefix(PREFIX) for name in names)
        print(f"no such benchmark; there are: {found}", file=sys.stderr)
        return 2
    for name in names:
        if wanted and name.removeprefix(PREFIX) not in wanted:
            continue
        run = getattr(importlib.import_module(name), "main", None)
        if run is None:
            continue
        if options and "words" not in inspect.signature(run).parameters:
            print(f"{wanted[0]} has no options", file=sys.stderr)
            return 2
        start = time.perf_counter()
        try:
            result = run(options) if options else run()
        except Exception as error:  # the others shall still run
            console.print_exception()
            failed, result = True, f"failed: {error!r}"
        seconds = time.perf_counter() - start
        fallen += noted(name.removeprefix(PREFIX), result)
        shown = "" if result is None else str(result)
        table.add_row(name.removeprefix(PREFIX), f"{seconds:.2f}", shown)
    console.print(table)
    for line in fallen:
        console.print(line, markup=False)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
