"""What follows the parts, for strangers' systems: writes runs.md into reports/strangers/.

Systems of ``stranger_systems``, every third of a hundred. Each is given to ``designer run`` with
200 boards, and its routed board to ``designer rules``; each tenth goes to ``designer search`` too.
Each system is a line of ``runs.jsonl`` or ``searches.jsonl``, on disk as soon as it is done; an
interrupted run goes on.

    python -m benchmarks stranger_runs --seed 1 --runs 30 --searches 10 --out reports/strangers
"""

from __future__ import annotations

import argparse
import contextlib
import json
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.bench_flow import commit, machine, table
from benchmarks.bench_strangers import (
    REPORT,
    SEED,
    Run,
    ended,
    family_of,
    family_words,
    filled,
    last_line,
    printed_json,
    whole_lines,
)
from benchmarks.stranger_systems import FAMILIES, Family, Stranger, draw
from designer.base.design_folder import TOLERANCE

FILE, RUNS_FILE, SEARCHES_FILE = "runs.md", "runs.jsonl", "searches.jsonl"
RUNS, SEARCHES = 30, 10
"""Defaults: systems of ``run``, and of ``search``."""
APART, FAR_APART = 3, 10
"""From the number of one system of ``run`` to the next, and of ``search``."""
LONG = 900.0
"""CPU seconds of a verb, at most: half of it is wall time where two cores are at work."""
IN_TIME = 600.0
"""Wall time in which a search is to end [s]."""
WANTED = 0.95
"""The yield that a search is to reach."""
Row = Mapping[str, Any]


def designer(words: Sequence[str], seconds: float = LONG) -> Run:
    """A verb, as a user starts it."""
    return Run([sys.executable, "-P", "-m", "designer", *words], seconds)


def run_row(stranger: Stranger, file: Path, design: Path) -> dict[str, Any]:
    """What ``run`` says of the system, and ``rules`` of its board."""
    ran = designer(["run", str(file), "--out", str(design), "--json"])
    row = ended(stranger, ran)
    answer = printed_json(ran.output)
    if answer is None and (design / TOLERANCE).exists():  # yields stand, what follows has no end
        words = ["tolerance", str(design), "--resume", "--no-blame", "--json"]
        answer = printed_json(designer(words).output)
    if answer is None:
        return row | {"said": last_line(ran)}
    row |= _study(answer)
    boards = sorted((design / "kicad").glob("*.kicad_pcb"))
    if not boards:
        return row | {"said": "no board"}
    judged = designer(["rules", str(design), "--board", str(boards[0]), "--json"])
    answer = printed_json(judged.output)
    if answer is None:
        return row | {"said": last_line(judged)}
    rules = answer["rules"]
    unconnected = next(rule for rule in rules if rule["id"] == "unconnected")
    return row | {
        "open": unconnected["value"],
        "complete": answer["complete"],
        "rules": {rule["id"]: rule["found"] for rule in rules if rule["status"] == "fail"},
        "advised": all(rule["do"] for rule in rules if rule["status"] == "fail"),
    }


def search_row(stranger: Stranger, file: Path, design: Path) -> dict[str, Any]:
    """What ``search`` says of the system."""
    ran = designer(["search", str(file), "--out", str(design), "--json"], 2 * LONG)
    row = ended(stranger, ran)
    answer = printed_json(ran.output)
    if answer is None:
        return row | {"said": last_line(ran)}
    return row | {
        "max_error": answer["max_error"],
        "warnings": answer["warnings"],
        "responses": [_yield(response) for response in answer["responses"]],
        "search": answer.get("search"),
    }


def _study(answer: Row) -> dict[str, Any]:
    return {
        "max_error": answer["max_error"],
        "warnings": answer["warnings"],
        "failed_rules": [rule["id"] for rule in answer["failed_rules"]],
        "equations": (answer["equation_check"] or {}).get("passed"),
        "responses": [_yield(response) for response in answer["responses"]],
    }


def _yield(response: Row) -> dict[str, Any]:
    names = ["model", "circuit", "ngspice", "engines_agree", "rate", "reasons", "agreement"]
    names += ["limited_by"] if "limited_by" in response else []
    trust = response.get("trust") or {}
    doubts = {part: said["reasons"] for part, said in trust.items() if not said["trusted"]}
    return {name: response.get(name) for name in names} | {"doubts": doubts}


def population(
    path: Path,
    seed: int,
    family: Family,
    numbers: Sequence[int],
    measure: Callable[[Stranger, Path, Path], Row],
    work: Path,
) -> list[Row]:
    """A row for each number, of the file where it is there; each is written as it is done."""
    rows = {row["number"]: row for row in whole_lines(path)}
    if any((row["seed"], family_of(row)) != (seed, family) for row in rows.values()):
        raise SystemExit(f"{path}: systems of another seed or family; take another --out")
    with path.open("a", encoding="utf-8") as file:
        for number in numbers:
            if number in rows:
                continue
            stranger = draw(seed, number, family)
            model, design = work / f"{stranger.name}.toml", work / stranger.name
            model.write_text(stranger.text, encoding="utf-8")
            shutil.rmtree(design, ignore_errors=True)
            of = {"seed": seed, "family": family, "commit": commit()}
            rows[number] = {**of, **measure(stranger, model, design)}
            file.write(json.dumps(rows[number]) + "\n")
            file.flush()
            print(number, _words(rows[number]), flush=True)
    return [rows[number] for number in numbers]


# ---------------------------------------------------------------------------------------------
# The report


def causes(row: Row) -> list[str]:
    """What is not as it should be with a system after ``run``, each once."""
    return list(dict.fromkeys(_causes(row)))


def _causes(row: Row) -> Iterator[str]:
    if "responses" not in row:
        ran_out = row["exit"] < 0
        yield f"no end within {LONG:g} s of CPU" if ran_out else f"ended with status {row['exit']}"
        return
    if row["exit"] < 0:
        yield f"blame has no end within {LONG:g} s of CPU"
    if row["equations"] is False:
        yield "the deck fails its equation check"
    for response in row["responses"]:
        if response["model"] is None or response["circuit"] != response["model"]:
            yield "the nominal circuit shows another response"
        elif not response["engines_agree"]:
            yield "engines disagree on the nominal circuit"
        agreement = response["agreement"] or {}
        counted = [agreement.get(each, 0) for each in ("agreed", "undecided", "failed")]
        if agreement.get("asked", 0) > sum(counted):
            yield "engines disagree on boards"
        if agreement.get("failed"):
            yield "ngspice has no answer on boards"
        if response["rate"] is None:
            yield "no yield"
    for rule in row.get("rules", ()):
        yield f"rule {rule} fails"
    if row.get("open"):
        yield "connections stay open"
    if "said" in row:
        yield "no judgement of the board"
    elif not row["complete"]:
        yield "rules were not run"


def figures(rows: Sequence[Row], searches: Sequence[Row]) -> dict[str, int]:
    """What the populations say, as numbers."""
    whole = [row for row in rows if "responses" in row]
    nominal = [row for row in whole if all(r["model"] == r["circuit"] for r in row["responses"])]
    return {
        "runs": len(rows),
        "whole": sum(row["exit"] >= 0 for row in whole),
        "shown": len(nominal),
        "agree": sum(all(r["engines_agree"] for r in row["responses"]) for row in nominal),
        "boards_routed": sum(row.get("open") == 0 for row in rows),
        "rules_pass": sum(not row["rules"] for row in rows if "rules" in row),
        "yield_stated": sum(all(r["rate"] is not None for r in row["responses"]) for row in whole),
        "searches": len(searches),
        "in_time": sum(row["wall"] <= IN_TIME for row in searches if "responses" in row),
        "reached": sum(_reached(row) for row in searches),
    }


def _reached(row: Row) -> bool:
    return "responses" in row and all((r["rate"] or 0) >= WANTED for r in row["responses"])


def _limits(row: Row) -> Iterator[str]:
    """What limits the responses that a search leaves below the wanted yield; warnings."""
    for response in row.get("responses", ()):
        if response.get("limited_by") and (response["rate"] or 0.0) < WANTED:
            yield response["limited_by"]["line"]
    yield from row.get("warnings", [row.get("said", "")])


def _words(row: Row) -> str:
    rate = [r["rate"] for r in row.get("responses", ())]
    said = "; ".join(causes(row)) if "equations" in row else row.get("said", "")
    return f"wall {row['wall']:.0f} s, yields {rate}: {said}"


def _engines(of: Row) -> str:
    """A response in model and circuit, and in ngspice where that was asked."""
    return f"{of['model']} → {of['circuit']}, {of['ngspice'] or 'not asked'}"


def _cells(row: Row) -> list[str]:
    of = row.get("responses", ())
    return [
        str(row["number"]),
        f"{row['masses']}, {row['clearances']}",
        ", ".join([row["size"], *row["kinds"]]),
        f"{100 * row['max_error']:.2g} %" if "max_error" in row else "–",
        "; ".join(map(_engines, of)) or "–",
        "; ".join("–" if r["rate"] is None else f"{100 * r['rate']:.1f} %" for r in of) or "–",
        f"{row['cpu']:.0f}",
        f"{row['wall']:.0f}",
        row["commit"][:8],
    ]


def report(rows: Sequence[Row], searches: Sequence[Row], seed: int) -> str:
    """runs.md."""
    f = figures(rows, searches)
    found: dict[str, list[str]] = {}
    for row in rows:
        for cause in causes(row):
            found.setdefault(cause, []).append(str(row["number"]))
    columns = ["number", "masses, clearances", "what", "error", "model → circuit, ngspice", "yield"]
    columns += ["CPU s", "wall s", "commit"]
    by_count = sorted(found.items(), key=lambda item: -len(item[1]))
    lines = [
        "# Strangers' systems to the end: engines, board, rules, yield",
        "",
        filled(
            f"Made by `python -m benchmarks stranger_runs --seed {seed} --runs {len(rows)} "
            f"--searches {len(searches)}{family_words(rows)}`: systems {APART} apart (`run`, 200 "
            f"boards) and {FAR_APART} apart (`search`). Lines of `{RUNS_FILE}` and "
            f"`{SEARCHES_FILE}` are taken as they are; take them away to measure anew."
        ),
        "",
        f"- Commit of this page: {commit()}; each row states its own",
        f"- Machine: {machine()}",
        "",
        filled(
            f"Of {f['runs']} systems {f['whole']} come to the end of `run`. The nominal circuit "
            f"shows the model's response on {f['shown']}, and ngspice agrees on {f['agree']} of "
            f"them. A yield is stated for {f['yield_stated']}. The board is routed with nothing "
            f"open on {f['boards_routed']}; every rule on circuit and board passes on "
            f"{f['rules_pass']}."
        ),
        "",
        "## What is not as it should be, by cause",
        "",
        *table(
            ["cause", "count", "systems"],
            [[cause, str(len(numbers)), ", ".join(numbers)] for cause, numbers in by_count],
        ),
        "",
        "## System by system",
        "",
        *table([*columns, "what is not as it should be"],
               [[*_cells(row), "; ".join(causes(row))] for row in rows]),
    ]  # fmt: skip
    if searches:
        lines += [
        "",
        "## `search`",
        "",
        filled(
            f"Of {f['searches']} systems {f['in_time']} are answered within {IN_TIME:g} s of wall "
            f"time, and {f['reached']} reach a yield of {100 * WANTED:g} %."
        ),
        "",
        *table([*columns, "what limits a yield below it, warnings"],
               [[*_cells(row), "; ".join(_limits(row))] for row in searches]),
        ]  # fmt: skip
    return "\n".join(lines) + "\n"


def options(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks stranger_runs", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--family", choices=FAMILIES, default="plain", help="what is drawn")
    parser.add_argument("--runs", type=int, default=RUNS, help="systems of run")
    parser.add_argument("--searches", type=int, default=SEARCHES, help="systems of search")
    parser.add_argument("--out", type=Path, default=REPORT, help="folder of the report")
    parser.add_argument("--keep", type=Path, help="folder of the model files and designs")
    return parser.parse_args(words)


def main(words: Sequence[str] = ()) -> str:
    """Measure what is missing, write the report; returns a line of figures."""
    chosen = options(words)
    chosen.out.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as stack:
        work = chosen.keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        work.mkdir(parents=True, exist_ok=True)
        (seed, family), out = (chosen.seed, chosen.family), chosen.out
        numbers = range(0, APART * chosen.runs, APART)
        rows = population(out / RUNS_FILE, seed, family, numbers, run_row, work)
        numbers = range(0, FAR_APART * chosen.searches, FAR_APART)
        (work / "search").mkdir(exist_ok=True)
        searches = population(
            out / SEARCHES_FILE, seed, family, numbers, search_row, work / "search"
        )
    (out / FILE).write_text(report(rows, searches, seed), encoding="utf-8")
    return ", ".join(f"{name} {count}" for name, count in figures(rows, searches).items())
