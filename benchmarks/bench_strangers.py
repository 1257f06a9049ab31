"""A stranger's system gets its circuit, or hears why not: writes reports/strangers/.

Systems from a seed (``stranger_systems``). Each is given to ``designer synthesise`` as a user does,
in a process of its own with a limit of CPU time; then its nominal circuit and 200 boards are asked
on the exact engine, and what was refused is sought by another search (``stranger_parts``). Each
system is a line of ``systems.jsonl``, on disk as soon as it is done; an interrupted run goes on.

    python -m benchmarks strangers --seed 1 --count 100 --seconds 120 --out reports/strangers
    python -m benchmarks strangers --family laws --count 60 --out reports/strangers-laws
    python -m benchmarks strangers --family linked --count 60 --out reports/strangers-linked
    python -m benchmarks strangers --family driven --count 30 --out reports/strangers-driven
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from benchmarks.bench_flow import commit, machine, table
from benchmarks.stranger_systems import FAMILIES, Family, Stranger, draw
from designer.base.plain_json import dumps
from designer.circuit.coefficients import LARGE_ERROR

ROOT = Path(__file__).parent.parent
REPORT = ROOT / "reports" / "strangers"
LINES = "systems.jsonl"
FILES = ("README.md", "strangers.json", "strangers.png", "strangers.svg")
SEED, COUNT, SECONDS, BOARDS, SEARCHED = 1, 100, 120, 200, 60
"""Defaults: of the population; CPU seconds of ``synthesise``; boards; CPU seconds of the other
search after a refusal."""
AT_ONCE, SOON, LATE = 5.0, 20.0, 60.0
"""Seconds in which first parts are to stand, and 95 and 99 of 100 to be answered."""
GRACE = 5
"""CPU seconds that a process has to end by itself."""
WALL = 10
"""Of the limit of CPU time: wall time after which a process that does nothing is stopped."""
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}
"""As the command line has it: the matrices are small."""
STAND = "parts stand"
"""How the line on standard error begins that says so."""
ANSWERED, INEXACT, REFUSED, SILENT, FAILED = (
    "answered", "above 1 %", "refused", "no answer", "failed",
)  # fmt: skip
Row = Mapping[str, Any]


class Run:
    """A process that ended: its status, outputs, and what it cost."""

    def __init__(self, command: Sequence[str], seconds: float, note: str = "") -> None:
        """note : how the line of standard error begins whose time is taken."""
        before, began = _children(), time.perf_counter()
        self.noted: float | None = None
        self.errors: list[str] = []
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env=ONE_THREAD | os.environ,
            preexec_fn=lambda: _limited(seconds),
        )
        assert process.stderr is not None
        assert process.stdout is not None
        printed: list[str] = []

        def listen(lines: Iterator[str]) -> None:
            for line in lines:
                if note and line.startswith(note) and self.noted is None:
                    self.noted = time.perf_counter() - began
                self.errors.append(line.rstrip())

        threads = [
            threading.Thread(target=printed.extend, args=(iter(process.stdout),)),
            threading.Thread(target=listen, args=(iter(process.stderr),)),
        ]
        for thread in threads:
            thread.start()
        try:
            process.wait(WALL * seconds)
        except subprocess.TimeoutExpired:
            pass
        finally:
            _end(process)
            for thread in threads:
                thread.join()
            process.stdout.close()
            process.stderr.close()
        self.output, self.status = "".join(printed), process.returncode
        self.wall = time.perf_counter() - began
        self.cpu = _children() - before


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _limited(seconds: float) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + GRACE))


def _end(process: subprocess.Popen[str]) -> None:
    """It and what it started and left, which is a session of its own."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def measure(stranger: Stranger, folder: Path, seconds: float, boards: int) -> Row:
    """What becomes of one system, whose model file is in the folder; its design stays there."""
    file, design = folder / f"{stranger.name}.toml", folder / stranger.name
    shutil.rmtree(design, ignore_errors=True)
    words = ["synthesise", str(file), "--out", str(design), "--json"]
    run = Run([sys.executable, "-P", "-m", "designer", *words], seconds, STAND)
    row = ended(stranger, run)
    row["first_parts"] = None if run.noted is None else round(run.noted, 2)
    answer = printed_json(run.output)
    if run.status in (0, 1) and answer is not None:
        row |= _answer(answer)
        after = [sys.executable, "-P", "-m", "benchmarks.stranger_boards", str(design), str(boards)]
        asked = Run(after, LATE)
        row |= printed_json(asked.output) or {"not_asked": (asked.errors or ["no time left"])[-1]}
        return row
    last = last_line(run)
    if run.status in (1, 2) and answer is None:
        said = _said(run.errors)
        row |= {"outcome": REFUSED, "said": said}
    elif run.status < 0:
        row |= {"outcome": SILENT, "said": last}
    else:
        row |= {"outcome": FAILED, "said": last}
    return row


def ended(stranger: Stranger, run: Run) -> dict[str, Any]:
    """What a row says of its system, and of how a verb on it ended."""
    return {
        "number": stranger.number,
        "masses": stranger.masses,
        "clearances": stranger.clearances,
        "kinds": list(stranger.kinds),
        "size": stranger.size,
        "exit": run.status,
        "cpu": round(run.cpu, 2),
        "wall": round(run.wall, 2),
    }


def last_line(run: Run) -> str:
    """The last line on standard error that says something; empty where none does."""
    return next((line for line in reversed(run.errors) if line.strip()), "")


def _to_seek(row: Row) -> bool:
    return row["outcome"] in (REFUSED, SILENT) and "sought" not in row


def sought(file: Path, seconds: float) -> dict[str, Any] | None:
    """What the other search finds; None where it does not come to an end."""
    words = ["benchmarks.stranger_parts", str(file), "--seconds", str(seconds)]
    return printed_json(Run([sys.executable, "-P", "-m", *words], 2 * seconds + 20).output)


def printed_json(text: str) -> dict[str, Any] | None:
    """The object on standard output; None where there is none."""
    try:
        found = json.loads(text)
    except ValueError:
        return None
    return found if isinstance(found, dict) else None


def _answer(answer: Mapping[str, Any]) -> dict[str, Any]:
    error, certificate = answer["max_error"], answer["certificate"]
    return {
        "outcome": ANSWERED if error < LARGE_ERROR else INEXACT,
        "max_error": error,
        "worst": max(answer["errors"], key=lambda name: abs(answer["errors"][name])),
        "certificate": certificate["status"],
        "lower_bound": certificate["lower_bound"],
        "found": all(knob["found"] for knob in answer["knobs"]),
        "coefficients": len(answer["errors"]),
        "parts": len(answer["parts"]),
        "parts_seconds": answer["cost"].get("synthesis_seconds"),
    }


def _said(lines: Sequence[str]) -> str:
    """The refusal: what follows the last line about progress."""
    text = " ".join(line.strip() for line in lines if line.strip() and "…" not in line[-3:])
    place = text.rfind("expected")
    return text[max(0, text.find("circuit")) :][:600] if place >= 0 else text[-600:]


def population(
    out: Path,
    seed: int,
    numbers: Sequence[int],
    seconds: float,
    boards: int,
    search: float,
    work: Path,
    say: Callable[[str], object] = print,
    *,
    family: Family = "plain",
) -> list[Row]:
    """A row for each number, of the file where it is there; each is written as it is done. The last
    line of a number counts: the other search may come later."""
    rows = {row["number"]: row for row in _read(out / LINES, seed, seconds, family)}
    with (out / LINES).open("a", encoding="utf-8") as file:
        for number in numbers:
            row = rows.get(number)
            if row is not None and not (search and _to_seek(row)):
                continue
            stranger = draw(seed, number, family)
            (work / f"{stranger.name}.toml").write_text(stranger.text, encoding="utf-8")
            row = dict(row or measure(stranger, work, seconds, boards))
            if search and _to_seek(row):
                row["sought"] = sought(work / f"{stranger.name}.toml", search)
            own = {"seed": seed, "limit": seconds, "family": family}
            rows[number] = {**own, **row}
            file.write(json.dumps(rows[number]) + "\n")
            file.flush()
            say(_line(rows[number]))
    return [rows[number] for number in numbers if number in rows]


def whole_lines(path: Path) -> list[Row]:
    """Rows of a file that an interrupted run left; a line that was cut off is none, and is taken
    away."""
    if not path.exists():
        return []
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        path.write_text(whole, encoding="utf-8")
    return [json.loads(line) for line in whole.splitlines()]


def _read(path: Path, seed: int, seconds: float, family: Family) -> Iterator[Row]:
    """Rows of this population that are there."""
    for row in whole_lines(path):
        if (row["seed"], row["limit"], family_of(row)) != (seed, seconds, family):
            found = f"systems of seed {row['seed']} with a limit of {row['limit']:g} s"
            found += f" and of the family {family_of(row)}"
            raise SystemExit(f"{path}: {found}; take another --out for another population")
        yield row


def family_of(row: Row) -> Family:
    """Family of a system that was measured."""
    family: Family = row.get("family", "plain")
    return family


def family_words(rows: Sequence[Row]) -> str:
    """The option that asks for the family of these; "" for the plain one."""
    family = family_of(rows[0]) if rows else "plain"
    return "" if family == "plain" else f" --family {family}"


def _line(row: Row) -> str:
    what = row["outcome"]
    if "max_error" in row:
        what += f" {100 * row['max_error']:.3g} % ({row['certificate']})"
        what += f", nominal {row.get('nominal')} for {row.get('model')}, boards {row.get('boards')}"
    else:
        what += f": {row['said'][:160]}"
        what += f"; the other search: {_sought(row)}"
    shape = f"{row['masses']} masses, {row['clearances']} clearances"
    return f"{row['number']:4d} {shape}, CPU {row['cpu']:.1f} s: {what}"


def _sought(row: Row) -> str:
    found = row.get("sought")
    if not found:
        return "not asked" if "sought" not in row else "no end"
    return f"{100 * found['max_error']:.2g} %" if found["found"] else "nothing"


# ---------------------------------------------------------------------------------------------
# The report


def good(row: Row) -> bool:
    return bool(row["outcome"] == ANSWERED)


def wrongly_refused(row: Row) -> bool:
    """Whether the other search found parts where ``synthesise`` had none."""
    return row["outcome"] in (REFUSED, SILENT) and bool((row.get("sought") or {}).get("found"))


def share(row: Row) -> float | None:
    """Of the boards that keep the response; None where it was not asked."""
    boards = row.get("boards")
    if not boards:
        return 0.0 if row.get("shown") is False else None
    return float(boards.get("ok", 0) / sum(boards.values()))


def figures(rows: Sequence[Row]) -> dict[str, Any]:
    """What the population says, as numbers."""
    solved = [row for row in rows if good(row)]
    yields = [y for row in solved if (y := share(row)) is not None]
    first = [row["first_parts"] for row in solved if row["first_parts"] is not None]
    return {
        "systems": len(rows),
        "below_1_percent": len(solved),
        "parts_within_5_s": sum(seconds <= AT_ONCE for seconds in first),
        "parts_within_20_s": sum(seconds <= SOON for seconds in first),
        "parts_within_60_s": sum(seconds <= LATE for seconds in first),
        "within_20_s": sum(row["cpu"] <= SOON for row in solved),
        "within_60_s": sum(row["cpu"] <= LATE for row in solved),
        "wall_within_20_s": sum(row["wall"] <= SOON for row in solved),
        "above_1_percent": sum(row["outcome"] == INEXACT for row in rows),
        "refused": sum(row["outcome"] == REFUSED for row in rows),
        "no_answer": sum(row["outcome"] == SILENT for row in rows),
        "failed": sum(row["outcome"] == FAILED for row in rows),
        "wrongly_refused": sum(wrongly_refused(row) for row in rows),
        "nominal_shows_it": sum(bool(row.get("shown")) for row in solved),
        "nominal_asked": sum("shown" in row for row in solved),
        "yield_95": sum(y >= 0.95 for y in yields),
        "yield_asked": len(yields),
        "median_cpu": median(row["cpu"] for row in solved) if solved else None,
        "first_parts_latest": max(first) if first else None,
    }


def _shape_rows(rows: Sequence[Row]) -> Iterator[list[str]]:
    shapes = sorted({(row["masses"], row["clearances"]) for row in rows})
    for masses, clearances in shapes:
        of = [r for r in rows if (r["masses"], r["clearances"]) == (masses, clearances)]
        yield [f"{masses}, {clearances}", *_counts(of)]
    for kind in sorted({kind for row in rows for kind in row["kinds"]}):
        yield [kind, *_counts([row for row in rows if kind in row["kinds"]])]
    for size in sorted({row["size"] for row in rows}):
        yield [size, *_counts([row for row in rows if row["size"] == size])]
    yield ["all", *_counts(rows)]


def _counts(rows: Sequence[Row]) -> list[str]:
    f = figures(rows)
    keys = (
        "systems",
        "below_1_percent",
        "parts_within_20_s",
        "within_20_s",
        "within_60_s",
        "above_1_percent",
    )
    more = ("refused", "wrongly_refused", "no_answer", "failed")
    shown = f"{f['nominal_shows_it']} of {f['nominal_asked']}"
    return [str(f[k]) for k in (*keys, *more)] + [shown, f"{f['yield_95']} of {f['yield_asked']}"]


def _system_rows(rows: Sequence[Row]) -> Iterator[list[str]]:
    for row in rows:
        solved = "max_error" in row
        y = share(row) if solved else None
        yield [
            str(row["number"]),
            f"{row['masses']}, {row['clearances']}",
            ", ".join([row["size"], *row["kinds"]]),
            row["outcome"],
            f"{100 * row['max_error']:.2g} %" if solved else "–",
            row["certificate"] if solved else "–",
            f"{100 * (row['max_error'] - row['lower_bound']):.2g} %" if solved else "–",
            f"{row['cpu']:.1f}",
            f"{row['wall']:.1f}",
            "–" if row["first_parts"] is None else f"{row['first_parts']:.1f}",
            f"{row['model']} → {row['nominal']}" if "nominal" in row else "–",
            "–" if y is None else f"{100 * y:.0f} %",
            "" if solved else _sought(row),
        ]


def why(rows: Sequence[Row]) -> Iterator[str]:
    """A line for each that has no circuit."""
    for row in rows:
        if "max_error" not in row:
            yield f"- {row['number']}: {row['said']}".replace("|", "/")


def report(rows: Sequence[Row], seed: int, seconds: float) -> str:
    """README.md."""
    f = figures(rows)
    family = family_of(rows[0])
    header = ["what", "systems", "below 1 %", "parts ≤ 20 s", "all ≤ 20 s", "all ≤ 60 s"]
    header += [
        "above 1 %",
        "refused",
        "wrongly",
        "no answer",
        "failed",
        "nominal shows it",
        "yield ≥ 95 %",
    ]
    columns = ["number", "masses, clearances", "what", "outcome", "error", "certificate", "gap"]
    columns += ["CPU s", "wall s", "parts s", "model → nominal", "yield", "other search"]
    worst = Counter(row["worst"] for row in rows if row["outcome"] == INEXACT)
    lines = [
        "# Strangers' systems: who gets a circuit, how good, how soon, and who does not",
        "",
        filled(
            f"Made by `python -m benchmarks strangers --seed {seed} --count {len(rows)} "
            f"--seconds {seconds:g}{family_words(rows)}`; "
            f"systems that stand in `{LINES}` are taken as they are, so take the folder away to "
            "measure anew. Every system can be had again from the seed and its number."
        ),
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}",
        "",
        filled(
            f"Of {f['systems']} systems {f['below_1_percent']} get a circuit whose largest "
            f"coefficient error is below 1 %: their parts stand within {AT_ONCE:g} s for "
            f"{f['parts_within_5_s']} of them, within {SOON:g} s for {f['parts_within_20_s']} "
            f"and within {LATE:g} s for {f['parts_within_60_s']}; with files, design rules and "
            f"start recipes all is done within {SOON:g} s of CPU time for {f['within_20_s']} and "
            f"within {LATE:g} s for {f['within_60_s']}, within {SOON:g} s of wall time on two "
            f"cores for {f['wall_within_20_s']}. {f['above_1_percent']} get one above 1 %, "
            f"{f['refused']} are refused, {f['no_answer']} have no answer after {seconds:g} s. "
            f"{f['wrongly_refused']} of the refused and unanswered have parts that keep every side "
            "condition with an error below 1 %: another search found them. "
            f"{f['nominal_shows_it']} of {f['nominal_asked']} nominal circuits show the wanted "
            f"response. {f['yield_95']} of {f['yield_asked']} have a yield of 95 % or more "
            f"({BOARDS} boards, exact engine)."
        ),
        "",
        filled(
            "*All* is CPU time of the whole verb `synthesise`, start-up and start recipes "
            "included, with all compiled code there; wall time counts the load of the machine too. "
            "*Parts* is wall time until the line on standard error that "
            "says that parts stand, start-up included; they do not change after it. "
            "*Gap* is the error less its proved lower bound. *Wrongly* "
            "counts refused or unanswered systems for which the other search (`stranger_parts`: "
            "random scales inside the side conditions, values rounded to the series, the finished "
            "circuit reduced and checked) has parts."
        ),
        "",
        *([_OF_FAMILY[family], ""] if family in _OF_FAMILY else []),
        "![Largest coefficient error over CPU seconds](strangers.png)",
        "",
        *table(header, list(_shape_rows(rows))),
        "",
        "## Why there is no circuit",
        "",
        *(list(why(rows)) or ["Every system has one."]),
        "",
        *(f"- above 1 % by {name}: {count}" for name, count in worst.most_common()),
        "",
        "## System by system",
        "",
        *table(columns, list(_system_rows(rows))),
    ]
    return "\n".join(lines) + "\n"


def filled(text: str) -> str:
    """A paragraph of a report."""
    return textwrap.fill(text, 100, break_long_words=False, break_on_hyphens=False)


_OF_FAMILY = {
    "laws": filled(
        "Each of these systems has a force that is no linear spring, damper or stop: a hardening "
        "cubic spring, two wells, dry friction, also with a static force above the sliding one, a "
        "law of two to four corners with slopes of both signs, a Hertz contact, or a preload that "
        "rises."
    ),
    "linked": filled(
        "Most stops of these systems have a damper, as such or by a restitution; of those with "
        "several masses half have a mass matrix with couplings, and half of their clearances are "
        "of combinations of displacements."
    ),
    "driven": filled(
        "No drive of these systems is one sine: a square, triangular or sawtooth wave of two to "
        "five harmonics, harmonics of sizes and phases of their own, two forces of two phases or "
        "of two shapes, a base that moves in such a shape, or a force beside a moving base. Two "
        "phases, two shapes, and a force beside a base take a generator of two channels."
    ),
}
COLOURS = {1: "#0072b2", 2: "#009e73", 3: "#d55e00", 4: "#cc79a7"}
MARKERS = {0: "D", 1: "o", 2: "s", 3: "^"}
NO_ERROR = 1e-7
"""Where an error below it is drawn."""


def picture(rows: Sequence[Row], seconds: float) -> Figure:
    """Error over CPU seconds, a mark for each system; those without a circuit above the frame's
    last decade."""
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    axes = figure.subplots()
    top = 3.0
    for row in rows:
        error = max(row["max_error"], NO_ERROR) if "max_error" in row else top
        wrong = wrongly_refused(row)
        axes.plot(
            min(row["cpu"], seconds),
            error,
            MARKERS[row["clearances"]],
            color=COLOURS[row["masses"]],
            markerfacecolor="none" if row.get("shown") is False else COLOURS[row["masses"]],
            markeredgecolor="black" if wrong else COLOURS[row["masses"]],
            markeredgewidth=1.8 if wrong else 1.0,
        )
    axes.set(xscale="log", yscale="log", xlabel="CPU seconds of synthesise")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set(ylabel="largest coefficient error", ylim=(NO_ERROR / 2, 2 * top))
    axes.axhline(LARGE_ERROR, color="0.6", lw=0.8)
    axes.text(
        1.0, LARGE_ERROR, "1 % ", ha="right", va="bottom", transform=axes.get_yaxis_transform()
    )
    axes.text(1.0, top / 2, "no circuit ", ha="right", transform=axes.get_yaxis_transform())
    for mark in (SOON, LATE):
        axes.axvline(mark, color="0.6", lw=0.8)
        axes.text(mark, NO_ERROR, f"{mark:g} s ", ha="right", va="bottom")
    handles = [
        *(_mark(f"{n} mass{'es' * (n > 1)}", color=c) for n, c in COLOURS.items()),
        *(_mark(f"{n} clearance{'s' * (n != 1)}", marker=m) for n, m in MARKERS.items()),
        _mark("nominal circuit shows another response", markerfacecolor="none"),
        _mark("refused, but there are parts", markeredgecolor="black", markeredgewidth=1.8),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8)
    f = figures(rows)
    axes.set_title(
        f"{f['systems']} random systems: {f['below_1_percent']} circuits below 1 %, "
        f"{f['within_20_s']} of them in {SOON:g} s, {f['wrongly_refused']} refused wrongly",
        fontsize=10,
    )
    return figure


def _mark(label: str, **style: Any) -> Line2D:
    """An entry of the legend."""
    return Line2D([], [], **{"color": "0.3", "marker": "o", "ls": "", "label": label, **style})


def write(out: Path, rows: Sequence[Row], seed: int, seconds: float) -> None:
    """README.md, strangers.json and the picture."""
    (out / FILES[0]).write_text(report(rows, seed, seconds), encoding="utf-8")
    data = {"format": 1, "commit": commit(), "machine": machine(), "seed": seed}
    data |= {"figures": figures(rows), "systems": list(rows)}
    (out / FILES[1]).write_text(dumps(data), encoding="utf-8")
    figure = picture(rows, seconds)
    with mpl.rc_context({"svg.hashsalt": "strangers", "svg.fonttype": "none"}):
        figure.savefig(out / FILES[3], metadata={"Date": None})
    figure.savefig(out / FILES[2], dpi=110)


def options(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks strangers", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--first", type=int, default=0, help="number of the first system")
    parser.add_argument("--count", type=int, default=COUNT, help="how many systems")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="CPU limit of synthesise")
    parser.add_argument("--family", choices=FAMILIES, default="plain", help="what is drawn")
    parser.add_argument("--boards", type=int, default=BOARDS, help="boards of each circuit")
    parser.add_argument(
        "--search", type=float, default=SEARCHED, help="CPU seconds of the other search; 0: none"
    )
    parser.add_argument("--out", type=Path, default=REPORT, help="folder of the report")
    parser.add_argument("--keep", type=Path, help="folder of the model files and designs")
    parser.add_argument("--files", type=Path, help="write the model files into it, and no more")
    return parser.parse_args(words)


def main(words: Sequence[str] = ()) -> str:
    """Measure what is missing, write the report; returns a line of figures."""
    chosen = options(words)
    numbers = range(chosen.first, chosen.first + chosen.count)
    if chosen.files is not None:
        chosen.files.mkdir(parents=True, exist_ok=True)
        for number in numbers:
            stranger = draw(chosen.seed, number, chosen.family)
            (chosen.files / f"{stranger.name}.toml").write_text(stranger.text, encoding="utf-8")
        return f"{len(numbers)} model files in {chosen.files}"
    chosen.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        work = Path(scratch) if chosen.keep is None else chosen.keep
        work.mkdir(parents=True, exist_ok=True)
        try:
            rows = population(
                chosen.out,
                chosen.seed,
                numbers,
                chosen.seconds,
                chosen.boards,
                chosen.search,
                work,
                family=chosen.family,
            )
        except KeyboardInterrupt:
            said = f"{chosen.out / LINES} has what was done; the same command goes on"
            raise SystemExit(f"interrupted: {said}") from None
    write(chosen.out, rows, chosen.seed, chosen.seconds)
    f = figures(rows)
    return (
        f"{f['below_1_percent']} of {f['systems']} below 1 %, "
        f"{f['within_20_s']} within {SOON:g} s, {f['wrongly_refused']} refused wrongly"
    )
