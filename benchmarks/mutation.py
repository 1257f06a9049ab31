"""Do the tests notice when the program is wrong? Writes reports/mutation/.

Files of ``mutation_targets`` are changed in one small place (``mutants``), in a copy of the work
tree, and their tests are run until one fails. Mutants are a random sample of a seed, of all groups
in turn. Each is a line of ``rows.jsonl``, on disk as soon as it is known; an interrupted run goes
on. A survivor is tried again when its tests have changed, unless ``judged.toml`` says why no test
can tell it from the program.

    python -m benchmarks.mutation --count 500 --minutes 60
"""

from __future__ import annotations

import argparse
import fcntl
import hashlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from benchmarks.bench_flow import commit, table
from benchmarks.bench_strangers import filled, whole_lines
from benchmarks.mutant_tests import NOTES, ORDER
from benchmarks.mutants import Mutant, differs, in_turn, mutants, shuffled
from benchmarks.mutation_targets import GROUPS, Target

ROOT = Path(__file__).parent.parent
REPORT = ROOT / "reports" / "mutation"
ROWS, JUDGED = "rows.jsonl", "judged.toml"
SEED, COUNT = 1, 500
QUICK = "not (slow or kicad or browser or wheel or docs)"
ASKED = "not (kicad or browser or wheel or docs)"
"""The slow tests too: of those that run a statement the quickest are asked first."""
PATIENCE = 3.0
"""Times the seconds that the slowest test of a file takes without a mutant, after which one of the
file is ended: the first of them makes what all share."""
START, COMPILE = 10.0, 180.0
"""Seconds beside, and those of numba's work where a kernel was changed."""
MEMORY = 8 << 30
"""Bytes that the tests of a mutant may take."""
Row = Mapping[str, Any]
Key = tuple[str, str, str, str, int]
NAMES = ("module", "function", "text", "operator", "number")


# ---------------------------------------------------------------------------------------------
# The copy, and what runs in it


@dataclass(frozen=True)
class Outcome:
    """What tests say."""

    result: str
    """One of "passed", "failed", "timed out"."""
    failed: str
    """The first test that failed, or in which the process ended; "" where none did."""
    seconds: Mapping[str, float]
    """Of each test that ran."""


class Copy:
    """A copy of a tree of sources, whose files may be changed."""

    def __init__(self, root: Path, work: Path) -> None:
        self.root = root
        self.work = work
        self.path = work / "copy"
        self._stamp = 0

    def refresh(self, names: Sequence[str]) -> None:
        """Take these files as they are now, and no others."""
        wanted = {self.path / name for name in names}
        for old in self.path.rglob("*"):
            if old.is_file() and "__pycache__" not in old.parts and old not in wanted:
                old.unlink()
        for name in names:
            there, here = self.root / name, self.path / name
            if not here.exists() or here.read_bytes() != there.read_bytes():
                here.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(there, here)

    @contextmanager
    def changed(self, mutant: Mutant) -> Iterator[None]:
        """The copy with a mutant in it.

        Python takes a file for unchanged that has the same size and the same time in whole seconds:
        each mutant has a time of its own.
        """
        path = self.path / mutant.module
        source, times = path.read_bytes(), path.stat()
        self._stamp += 1
        path.write_bytes(mutant.of(source))
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns + self._stamp * 10**9))
        try:
            yield
        finally:
            path.write_bytes(source)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))

    def compile(self) -> None:
        """What most tests compile, so that none of them is slow because it is the first."""
        call = "from tests.shared.compile_kernels import compile_kernels; compile_kernels()"
        environment = os.environ | self._environment("kernels")
        subprocess.run([sys.executable, "-P", "-c", call], cwd=self.path, env=environment)

    def _environment(self, kernels: str) -> dict[str, str]:
        places = {"PYTHONPATH": str(self.path), "NUMBA_CACHE_DIR": str(self.work / kernels)}
        return places | {"PYTHONHASHSEED": "0"}

    def tests(
        self, files: Sequence[str], limits: Mapping[str, float] | None = None,
        before: Sequence[str] = (), kernels: str = "kernels",
    ) -> Outcome:  # fmt: skip
        """Run the tests of these files until one fails.

        limits : tests in their order, and the seconds that each may take; all, where there are
        none. before : words between ``python`` and ``-m pytest``.
        kernels : folder of ``work`` for what numba compiles.
        """
        notes, chosen = self.work / "notes.json", self.work / "order.json"
        notes.unlink(missing_ok=True)
        more = self._environment(kernels) | {NOTES: str(notes)}
        if limits is not None:
            chosen.write_text(json.dumps(limits), "utf-8")
            more[ORDER] = str(chosen)
        words = [sys.executable, "-P", *before, "-m", "pytest", "-q", "-x", "-m", ASKED]
        words += ["-p", "benchmarks.mutant_tests", "-p", "no:cacheprovider", *files]
        with (self.work / "log.txt").open("wb") as log:
            process = subprocess.Popen(
                words, cwd=self.path, env=os.environ | more, stdin=subprocess.DEVNULL,
                stdout=log, stderr=subprocess.STDOUT, start_new_session=True,
                preexec_fn=_little_memory,
            )  # fmt: skip
            try:
                status = process.wait()
            finally:
                _end(process)
        told = json.loads(notes.read_text("utf-8")) if notes.exists() else {}
        result = "failed" if status else "passed"
        if "running" in told and b"+ Timeout +" in (self.work / "log.txt").read_bytes():
            result = "timed out"
        failed = told.get("failed") or told.get("running", "")
        return Outcome(result, failed, told.get("seconds", {}))


def _little_memory() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def _end(process: subprocess.Popen[bytes]) -> None:
    """With all that it has started."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


# ---------------------------------------------------------------------------------------------
# Which tests run which lines


@dataclass(frozen=True)
class Cover:
    """What one file of tests runs."""

    seconds: Mapping[str, float]
    """Of each test, in their order."""
    lines: Mapping[str, Mapping[str, Sequence[int]]]
    """By module and test; the test "" is what is run between tests, as imports are."""

    def running(self, mutant: Mutant) -> list[str]:
        """The tests that run the statement, quickest first."""
        span = range(mutant.first, mutant.last + 1)
        found = self.lines.get(mutant.module, {})
        those = [test for test, lines in found.items() if any(n in span for n in lines)]
        return sorted(those, key=lambda test: self.seconds.get(test, 0.0))


def _hash(root: Path, names: Sequence[str]) -> str:
    digest = hashlib.sha256()
    for name in names:
        digest.update((root / name).read_bytes())
    return digest.hexdigest()[:16]


def covered(copy: Copy, tests: str, modules: Sequence[str]) -> Cover:
    """What a file of tests runs of these modules: measured anew when one of them has changed."""
    import coverage  # needed for nothing else

    path = copy.work / "covers" / (tests.replace("/", ".") + ".json")
    state = _hash(copy.path, [tests, *modules])
    if path.exists():
        known = json.loads(path.read_text("utf-8"))
        if known["state"] == state:
            return Cover(known["seconds"], known["lines"])
    data = copy.work / "lines.sqlite"
    data.unlink(missing_ok=True)
    before = ["-m", "coverage", "run", "--branch", "--source=designer", f"--data-file={data}"]
    done = copy.tests([tests], before=before)
    if done.result != "passed" or not done.seconds:
        raise SystemExit(f"{tests}: no pass without a mutant; see {copy.work / 'log.txt'}")
    measured = coverage.CoverageData(str(data))
    measured.read()
    lines: dict[str, dict[str, list[int]]] = {}
    for module in modules:
        by_test = lines.setdefault(module, {})
        for line, those in measured.contexts_by_lineno(str(copy.path / module)).items():
            for test in those:
                by_test.setdefault(test, []).append(line)
    path.parent.mkdir(parents=True, exist_ok=True)
    told = {"state": state, "seconds": done.seconds, "lines": lines}
    path.write_text(json.dumps(told), "utf-8")
    return Cover(done.seconds, lines)


def choice(mutant: Mutant, target: Target, covers: Mapping[str, Cover]) -> dict[str, list[str]]:
    """The tests of a mutant by file: of each with a test that runs the changed line those first,
    the quickest before the others, then the rest, which may see what a fixture or a cache has kept.
    Where no test but an import runs it, or numba has compiled it, all."""
    blocks: list[tuple[float, str, list[str]]] = []
    for file in target.tests:
        cover = covers[file]
        running = [] if target.compiled else [t for t in cover.running(mutant) if t]
        if running:
            rest = [test for test in cover.seconds if test not in running]
            blocks.append((cover.seconds[running[0]], file, [*running, *rest]))
    if not blocks and (target.compiled or any(covers[f].running(mutant) for f in target.tests)):
        blocks = [(0.0, file, list(covers[file].seconds)) for file in target.tests]
    return {file: tests for _, file, tests in sorted(blocks, key=lambda block: block[0])}


def limits(
    chosen: Mapping[str, Sequence[str]], target: Target, covers: Mapping[str, Cover]
) -> dict[str, float]:
    """The seconds that each test may take, in their order."""
    least = START + (COMPILE if target.compiled else 0.0)
    slowest = {file: max(covers[file].seconds.values()) for file in chosen}
    return {
        test: least + PATIENCE * slowest[file] for file, tests in chosen.items() for test in tests
    }


# ---------------------------------------------------------------------------------------------
# Trying


def tried(copy: Copy, mutant: Mutant, target: Target, covers: Mapping[str, Cover]) -> Row:
    """What becomes of a mutant."""
    chosen = choice(mutant, target, covers)
    before, after = mutant.diff((copy.path / mutant.module).read_bytes())
    start = time.perf_counter()
    result, by = "survived", ""
    if chosen:
        kernels = "changed-kernels" if target.compiled else "kernels"
        with copy.changed(mutant):
            found = copy.tests(list(chosen), limits(chosen, target, covers), kernels=kernels)
        shutil.rmtree(copy.work / "changed-kernels", ignore_errors=True)
        if found.result != "passed":
            result = "timed out" if found.result == "timed out" else "killed"
            by = found.failed
    return {
        **dict(zip(NAMES, mutant.key, strict=True)),
        "line": mutant.line,
        "before": before,
        "after": after,
        "result": result,
        "by": by,
        "tests": sum(map(len, chosen.values())),
        "seconds": round(time.perf_counter() - start, 1),
        "state": _hash(copy.path, target.tests),
    }


def key_of(row: Row) -> Key:
    """That of its mutant."""
    return tuple(row[name] for name in NAMES)


def judged(path: Path) -> dict[Key, str]:
    """Why no test can tell a mutant from the program, for those that somebody has looked at."""
    if not path.exists():
        return {}
    found = tomllib.loads(path.read_text("utf-8")).get("mutant", [])
    return {key_of({"number": 0, **row}): row["why"] for row in found}


class Population:
    """All mutants of the targets, as the sources are."""

    def __init__(self, root: Path, groups: Mapping[str, Sequence[Target]], seed: int) -> None:
        self.root = root
        self.groups = groups
        self.seed = seed

    @cached_property
    def targets(self) -> dict[str, Target]:
        return {target.module: target for group in self.groups.values() for target in group}

    @cached_property
    def sources(self) -> dict[str, bytes]:
        return {module: (self.root / module).read_bytes() for module in self.targets}

    @cached_property
    def mutants(self) -> dict[Key, Mutant]:
        found = (m for module, source in self.sources.items() for m in mutants(module, source))
        return {mutant.key: mutant for mutant in found}

    def sample(self, count: int, prefixes: Sequence[str] = ("",)) -> list[Mutant]:
        """So many that differ from the program: of the groups in turn, and of a group's modules.
        Those of modules whose path begins with one of the prefixes."""
        groups = []
        for group in self.groups.values():
            modules = (t.module for t in group if t.module.startswith(tuple(prefixes)))
            mine = [[m for m in self.mutants.values() if m.module == name] for name in modules]
            groups.append(in_turn([shuffled(each, self.seed) for each in mine]))
        out: list[Mutant] = []
        for mutant in in_turn(groups):
            if len(out) == count:
                break
            if differs(mutant, self.sources[mutant.module]):
                out.append(mutant)
        return out


def missing(
    wanted: Sequence[Mutant], rows: Sequence[Row], why: Mapping[Key, str], population: Population
) -> Iterator[Mutant]:
    """Survivors whose tests have changed, then what was not tried."""
    last = {key_of(row): row for row in rows}
    for key, row in last.items():
        mutant = population.mutants.get(key)
        if mutant is None or row["result"] != "survived" or key in why:
            continue
        if row["state"] != _hash(population.root, population.targets[mutant.module].tests):
            yield mutant
    yield from (mutant for mutant in wanted if mutant.key not in last)


# ---------------------------------------------------------------------------------------------
# The report


def _ways(rows: Sequence[Row], why: Mapping[Key, str]) -> Counter[str]:
    """How many went which way."""
    return Counter(
        "judged" if row["result"] == "survived" and key_of(row) in why else row["result"]
        for row in rows
    )


def _name(row: Row) -> str:
    where = row["function"] or "the module"
    short = row["module"].removeprefix("designer/").removesuffix(".py")
    return f"`{short}`, {where}: `{row['before']}` becomes `{row['after']}`"


def report(rows: Sequence[Row], why: Mapping[Key, str], population: Population, count: int) -> str:
    """README.md."""
    last = {key_of(row): row for row in rows}
    there = [row for key, row in last.items() if key in population.mutants]
    survived_once = {key_of(row) for row in rows if row["result"] == "survived"}
    body = []
    for group, targets in population.groups.items():
        for target in targets:
            mine = [row for row in there if row["module"] == target.module]
            if mine:
                body.append([group, target.module.removeprefix("designer/"), *_cells(mine, why)])
    body.append(["all", "", *_cells(there, why)])
    ways = _ways(there, why)
    dead = ways["killed"] + ways["timed out"]
    share = f"{100 * dead / max(len(there) - ways['judged'], 1):.1f} %"
    lines = [
        "# Mutants: do the tests notice a wrong program?",
        "",
        filled(
            f"Made by `make mutate` (`python -m benchmarks.mutation --count {count}`). Lines of "
            f"`{ROWS}` are taken as they are, each with its commit, its test and its seconds; the "
            "next run goes on, and tries survivors again whose tests have changed."
        ),
        "",
        f"- Commits of the rows: {', '.join(dict.fromkeys(row['commit'] for row in there))}",
        f"- Seed of the sample: {population.seed}",
        "",
        filled(
            f"{len(there)} mutants, of {len(population.mutants)} that there are. {dead} are killed "
            f"({share} of those that a test can tell), of which {ways['timed out']} by the "
            f"limit of time of a test: {PATIENCE:g} times what the slowest of its file takes "
            f"without a mutant, and {START:g} s ({START + COMPILE:g} s where numba compiles). "
            f"{ways['judged']} are the program in other words, or change a figure that was chosen, "
            "which a test would only "
            f"repeat; {ways['survived']} survive. {len(last) - len(there)} "
            "further ones were of lines that have changed since. Mutants with the program's "
            "bytecode are not counted."
        ),
        "",
        *table(["group", "file", "mutants", "killed", "by time", "judged", "survive"], body),
    ]
    killed = [r for r in there if key_of(r) in survived_once and r["result"] != "survived"]
    if killed:
        lines += ["", "## Survivors that a test now kills", ""]
        lines += [f"- {_name(row)}: {_test(row)}" for row in killed]
    alike = [row for row in there if row["result"] == "survived" and key_of(row) in why]
    if alike:
        lines += ["", "## That no test can tell", ""]
        lines += [f"- {_name(row)}: {why[key_of(row)]}" for row in alike]
    alive = [row for row in there if row["result"] == "survived" and key_of(row) not in why]
    if alive:
        lines += ["", "## Survive", ""]
        lines += [f"- {_name(row)}{'' if row['tests'] else ': no test runs it'}" for row in alive]
    return "\n".join(lines) + "\n"


def _test(row: Row) -> str:
    by = f"`{row['by']}`" if row["by"] else "an import"
    return f"{by}, by time" if row["result"] == "timed out" else by


def _cells(rows: Sequence[Row], why: Mapping[Key, str]) -> list[str]:
    ways = _ways(rows, why)
    shown = (ways[way] for way in ("killed", "timed out", "judged", "survived"))
    return [str(len(rows)), *map(str, shown)]


# ---------------------------------------------------------------------------------------------


def options(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mutation", description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT, help="mutants in all")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="ends after these")
    parser.add_argument("--only", nargs="*", default=[""], help="files whose path begins so")
    parser.add_argument("--work", type=Path, default=ROOT / "out" / "mutation", help="of the copy")
    parser.add_argument("--out", type=Path, default=REPORT, help="folder of the report")
    return parser.parse_args(words)


def tracked() -> list[str]:
    """Files of the work tree, as they are."""
    words = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    found = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [name for name in found.splitlines() if (ROOT / name).is_file()]


def main(words: Sequence[str] = ()) -> str:
    """Try what was not tried, write the report; returns a line of figures."""
    chosen = options(words)
    end = time.monotonic() + 60.0 * chosen.minutes
    chosen.out.mkdir(parents=True, exist_ok=True)
    chosen.work.mkdir(parents=True, exist_ok=True)
    lock = (chosen.work / "lock").open("w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise SystemExit(f"{chosen.work}: another run works there") from None
    population = Population(ROOT, GROUPS, SEED)
    path, made = chosen.out / ROWS, commit()
    rows, why = whole_lines(path), judged(chosen.out / JUDGED)
    copy = Copy(ROOT, chosen.work)
    copy.refresh(tracked())
    copy.compile()
    covers: dict[str, Cover] = {}
    users: dict[str, list[str]] = {}
    for target in population.targets.values():
        for tests in target.tests:
            users.setdefault(tests, []).append(target.module)
    wanted = population.sample(chosen.count, chosen.only)
    with path.open("a", encoding="utf-8") as file:
        for mutant in list(missing(wanted, rows, why, population)):
            if time.monotonic() > end:
                break
            target = population.targets[mutant.module]
            for tests in target.tests:
                if tests not in covers:
                    covers[tests] = covered(copy, tests, users[tests])
            rows.append({**tried(copy, mutant, target, covers), "commit": made})
            file.write(json.dumps(rows[-1]) + "\n")
            file.flush()
            shown = {name: rows[-1][name] for name in ("result", "seconds", "after", "by")}
            print(f"{mutant.module}:{mutant.line}", *shown.values(), flush=True)
    (chosen.out / "README.md").write_text(report(rows, why, population, chosen.count), "utf-8")
    ways = _ways(list({key_of(row): row for row in rows}.values()), why)
    return ", ".join(f"{count} {way}" for way, count in sorted(ways.items()))


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # with what it has started
    print(main(sys.argv[1:]))
