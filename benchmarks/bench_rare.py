"""Boards of a million against plain boards: writes reports/rare/.

Cases are responses of the examples, with every law of the parts widened or narrowed until about one
board in 1e3 to 1e6 loses the response. Each is asked twice: by plain boards, a million of them, and
by ``rare_losses`` again and again with other seeds. How often does its interval hold the plain
share, and how many boards does it take?

Every block of plain boards and every repetition is a line of ``rows.jsonl``, on disk as soon as it
is done; an interrupted run goes on, and one with more boards adds to what is there.

    python -m benchmarks rare --boards 1000000 --times 60 --minutes 45
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.bench_flow import commit, machine, table
from benchmarks.bench_strangers import filled, whole_lines
from designer.base.defaults import cores
from designer.base.proportion import mid_p
from designer.check.synthesis_result import synthesise
from designer.dynamics.orbit import SETTLED
from designer.model.model_file import read_model_file
from designer.spread.spread import Spread
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import StudyPlan, Verdict
from designer.yields.rare_losses import rare_losses
from designer.yields.study_identity import RULES
from designer.yields.study_plan import plan_study
from designer.yields.tolerance_study import check

ROOT = Path(__file__).parent.parent
REPORT = ROOT / "reports" / "rare"
ROWS = "rows.jsonl"
SEED = 7
"""Of the plain boards; a repetition's is beyond `FIRST_SEED`."""
FIRST_SEED = 1000
BLOCK = 20_000
"""Plain boards of a line."""
PLAIN_EACH, RARE_EACH = 5, 6
"""Blocks and repetitions of a case in one turn over all cases."""
BOARDS, TIMES = 1_000_000, 60
WANTED = 0.93
"""Share of the intervals that are to hold the plain share."""
FEW = 100
"""Lost plain boards below which their share has a larger error than an interval is wide."""
FLOOR = 1e-8
"""The least share that is drawn."""
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Case:
    """One response of an example."""

    example: str
    """Name of the model file."""
    number: int
    """Of the response, from 1."""
    width: float
    """By how much every law of the parts is widened."""

    @property
    def name(self) -> str:
        return f"{self.example} {self.number}"

    @cached_property
    def plan(self) -> StudyPlan:
        """The study of this response alone."""
        file = read_model_file(ROOT / "examples" / f"{self.example}.toml")
        file = replace(file, responses=(file.responses[self.number - 1],))
        made = synthesise(file)
        checked = check(made, None)
        if checked[0].circuit.status not in SETTLED:
            raise SystemExit(f"{self.name}: the nominal circuit is {checked[0].circuit.response}")
        plan = plan_study(file, made.design, checked, made.catalog, samples=1, seed=SEED)
        return replace(plan, spread=widened(plan.spread, self.width))


CASES: tuple[Case, ...] = (
    Case("paper", 1, 1.75),
    Case("paper", 2, 0.75),
    Case("paper", 3, 1.8),
    Case("paper", 4, 0.85),
    Case("paper", 6, 0.65),
    Case("rectifier", 1, 1.8),
    Case("rectifier", 2, 1.2),
    Case("backlash", 1, 1.4),
)


def widened(spread: Spread, by: float) -> Spread:
    """The reference spread with every part, offset and limit so much further off."""
    return replace(
        spread,
        resistor=by * spread.resistor,
        capacitor=by * spread.capacitor,
        offset_sigma=by * spread.offset_sigma,
        offset_limit=by * spread.offset_limit,
        saturation=by * spread.saturation,
        reference=by * spread.reference,
        grades={name: by * grade for name, grade in spread.grades.items()},
    )


# ---------------------------------------------------------------------------------------------
# Measuring


def plain_row(case: Case, first: int) -> dict[str, Any]:
    """What a block of plain boards shows."""
    began, cpu = time.perf_counter(), time.process_time()
    plan = replace(case.plan, samples=first + BLOCK)
    answers = exact_circuit.block(plan, range(first, first + BLOCK), cores())
    lost = Counter(a.response for a in answers if a.verdict not in (Verdict.OK, Verdict.FAILED))
    return {
        "first": first,
        "boards": BLOCK,
        "lost": sum(lost.values()),
        "failed": sum(a.verdict is Verdict.FAILED for a in answers),
        "becomes": dict(lost.most_common()),
        "wall": time.perf_counter() - began,
        "cpu": time.process_time() - cpu,
    }


def rare_row(case: Case, time_: int) -> dict[str, Any]:
    """What one estimate says."""
    cpu = time.process_time()
    found = rare_losses(replace(case.plan, seed=FIRST_SEED + time_), 0, jobs=cores())
    return {
        "time": time_,
        "lost": found.lost,
        "low": found.low,
        "high": found.high,
        "boards": found.boards,
        "pilots": found.pilots,
        "effective": found.effective,
        "largest_weight": found.largest_weight,
        "gain": found.gain,
        "unseen": found.unseen,
        "narrow": found.narrow,
        "regions": [[r.found_by, r.becomes, r.share] for r in found.regions],
        "wall": found.seconds,
        "cpu": time.process_time() - cpu,
    }


def missing(rows: Sequence[Row], boards: int, times: int) -> Iterator[tuple[Case, str, int]]:
    """What is to be measured, a few of each case in turn, so that an interrupted run has something
    of every case."""
    there = {(r["case"], r["kind"], r.get("first", r.get("time"))) for r in rows}
    firsts, repetitions = list(range(0, boards, BLOCK)), list(range(times))
    while firsts or repetitions:
        turn = [("plain", n) for n in firsts[:PLAIN_EACH]]
        turn += [("rare", n) for n in repetitions[:RARE_EACH]]
        firsts, repetitions = firsts[PLAIN_EACH:], repetitions[RARE_EACH:]
        for case in CASES:
            yield from ((case, kind, n) for kind, n in turn if (case.name, kind, n) not in there)


def measured(path: Path, boards: int, times: int, minutes: float) -> list[Row]:
    """All rows of the file, with what is missing of so many boards and repetitions, as far as the
    time goes. Estimates of other rules than the present ones are left out."""
    here = whole_lines(path)
    rows = [row for row in here if row["kind"] == "plain" or row.get("rules") == RULES["rare"]]
    for case in CASES:
        if any(row["case"] == case.name and row["width"] != case.width for row in rows):
            raise SystemExit(f"{path}: {case.name} of another width; take another --out")
    end = time.monotonic() + 60.0 * minutes
    made = commit()
    with path.open("a", encoding="utf-8") as file:
        for case, kind, number in list(missing(rows, boards, times)):
            if time.monotonic() > end:
                break
            row = plain_row(case, number) if kind == "plain" else rare_row(case, number)
            of = {"case": case.name, "width": case.width, "kind": kind, "commit": made}
            rows.append(of | ({"rules": RULES["rare"]} if kind == "rare" else {}) | row)
            file.write(json.dumps(rows[-1]) + "\n")
            file.flush()
            print(case.name, kind, number, row["lost"], f"{row['wall']:.1f} s", flush=True)
    return rows


# ---------------------------------------------------------------------------------------------
# The report


@dataclass(frozen=True)
class Summary:
    """What is known of a case."""

    case: Case
    plain: Sequence[Row]
    """Its blocks of plain boards."""
    rare: Sequence[Row]
    """Its estimates."""

    @property
    def boards(self) -> int:
        """Plain boards with an answer."""
        return sum(row["boards"] - row["failed"] for row in self.plain)

    @property
    def lost(self) -> int:
        return sum(row["lost"] for row in self.plain)

    @property
    def share(self) -> float:
        return self.lost / self.boards if self.boards else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % of the plain share."""
        return mid_p(self.lost, self.boards) if self.boards else (0.0, 1.0)

    @property
    def holds(self) -> int:
        """Estimates whose interval holds the plain share itself, as if that had no error."""
        return sum(row["low"] <= self.share <= row["high"] for row in self.rare)

    @property
    def meets(self) -> int:
        """Estimates whose interval meets that of the plain share."""
        low, high = self.interval
        return sum(row["low"] <= high and row["high"] >= low for row in self.rare)

    @property
    def counts(self) -> bool:
        """Whether the plain boards say enough."""
        return self.lost >= FEW and bool(self.rare)

    @property
    def becomes(self) -> str:
        """What most lost plain boards show instead."""
        kinds = Counter[str]()
        for row in self.plain:
            kinds.update(row["becomes"])
        return ", ".join(f"{response} ({count})" for response, count in kinds.most_common(3))

    def median(self, key: str) -> float:
        """Of a figure of the estimates."""
        return float(np.median([row[key] for row in self.rare])) if self.rare else float("nan")

    @property
    def asked(self) -> float:
        """Boards that an estimate takes, pilots included, in the middle."""
        return float(np.median([r["boards"] + r["pilots"] for r in self.rare] or [np.nan]))


def summaries(rows: Sequence[Row]) -> list[Summary]:
    """Of each case with a row."""
    out = []
    for case in CASES:
        mine = [row for row in rows if row["case"] == case.name]
        kinds = ([r for r in mine if r["kind"] == kind] for kind in ("plain", "rare"))
        if mine:
            out.append(Summary(case, *kinds))
    return out


def figures(found: Sequence[Summary]) -> dict[str, Any]:
    """What all cases say, as numbers."""
    sure = [s for s in found if s.counts]
    times = sum(len(s.rare) for s in sure)
    return {
        "cases": len(found),
        "plain_boards": sum(s.boards for s in found),
        "estimates": times,
        "hold": sum(s.holds for s in sure),
        "of_all_cases": sum(len(s.rare) for s in found),
        "meet": sum(s.meets for s in found),
        "share_held": sum(s.holds for s in sure) / times if times else None,
        "least_held": min((s.holds / len(s.rare) for s in sure), default=None),
    }


def _cells(s: Summary) -> list[str]:
    low, high = s.interval
    few = "" if s.counts else " (too few lost)"
    estimates = [
        f"{1e6 * s.median('lost'):.3g}",
        f"{s.holds} of {len(s.rare)}{few}",
        f"{s.meets} of {len(s.rare)}",
        f"{s.asked:.0f}",
        f"{s.median('cpu'):.0f}",
        f"{s.median('gain'):.0f}",
    ]
    return [
        s.case.name,
        f"{s.case.width:g}",
        f"{s.boards:,}".replace(",", " "),
        str(s.lost),
        f"{1e6 * s.share:.3g} ({1e6 * low:.3g} to {1e6 * high:.3g})",
        *(estimates if s.rare else ["–"] * len(estimates)),
        s.becomes or "–",
    ]


def report(found: Sequence[Summary], boards: int, times: int) -> str:
    """README.md."""
    f = figures(found)
    plain = dict.fromkeys(row["commit"] for s in found for row in s.plain)
    rare = dict.fromkeys(row["commit"] for s in found for row in s.rare)
    held = f"In no case were {FEW} plain boards lost, of which a share is known well enough."
    if f["share_held"] is not None:
        held = (
            f"Of the cases in which {FEW} plain boards or more were lost, {f['hold']} of "
            f"{f['estimates']} hold the plain share itself ({100 * f['share_held']:.0f} %)."
        )
    lines = [
        "# Boards of a million: estimates against plain boards",
        "",
        filled(
            f"Made by `python -m benchmarks rare --boards {boards} --times {times}`. Lines of "
            f"`{ROWS}` are taken as they are, each with its commit; to measure anew, take them "
            "away. A run with `--minutes` ends before all is measured, and the next one goes on."
        ),
        "",
        f"- Commit of the plain boards: {', '.join(plain) or 'none yet'}",
        f"- Commit of the estimates: {', '.join(rare) or 'none yet'}; so far "
        f"{f['of_all_cases']} of the {times * len(CASES)}, all by the same rules",
        f"- Machine that made this page: {machine()}",
        "",
        filled(
            f"{f['meet']} of {f['of_all_cases']} intervals of 95 % meet that of the plain share. "
            f"{held} Aimed at: "
            f"{100 * WANTED:.0f} % of {TIMES} of each case, against a million plain boards."
        ),
        "",
        "![Estimates beside plain shares](rare.png)",
        "",
        filled(
            "*Width*: every law of the parts, offsets and limits over that of bench-1. *Boards*: "
            "those that an estimate takes, pilots included. *Gain*: plain boards that the same "
            "interval would take over those. *CPU s*: of one estimate, also where other work was "
            "beside it on the machine. Middle values are medians. The engine that decides on a "
            "board is the same for both; only which boards are drawn differs."
        ),
        "",
        *table(
            ["case", "width", "plain boards", "lost", "of a million, plain", "estimated",
             "hold it", "meet its interval", "boards", "CPU s", "gain", "lost boards show"],
            [_cells(s) for s in found],
        ),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def picture(found: Sequence[Summary]) -> Figure:
    """Every estimate's interval over the plain share of its case."""
    figure = Figure(figsize=(8.0, 0.6 + 0.75 * max(len(found), 1)), layout="constrained")
    axes = figure.subplots()
    for k, s in enumerate(found):
        low, high = s.interval
        axes.fill_betweenx([k - 0.4, k + 0.4], max(low, FLOOR), high, color="0.85", lw=0)
        if s.lost:
            axes.plot([s.share] * 2, [k - 0.4, k + 0.4], color="0.3", lw=1.5)
        places = np.linspace(-0.35, 0.35, len(s.rare) + 2)[1:-1]
        for row, at in zip(s.rare, places.tolist(), strict=True):
            inside = row["low"] <= s.share <= row["high"]
            color = "tab:blue" if inside or not s.counts else "tab:red"
            axes.plot([max(row["low"], FLOOR), row["high"]], [k + at] * 2, color=color, lw=1)
    axes.set_xscale("log")
    axes.set_yticks(range(len(found)), [s.case.name for s in found])
    axes.invert_yaxis()
    axes.set_xlabel("share of boards that lose the response")
    axes.set_title(
        "grey: plain boards, share and 95 %; lines: estimates, "
        f"red where they miss a share of {FEW} lost",
        fontsize="small",
    )
    return figure


def options(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks rare", description=__doc__)
    parser.add_argument("--boards", type=int, default=BOARDS, help="plain boards of a case")
    parser.add_argument("--times", type=int, default=TIMES, help="estimates of a case")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="ends after these")
    parser.add_argument("--out", type=Path, default=REPORT, help="folder of the report")
    return parser.parse_args(words)


def main(words: Sequence[str] = ()) -> str:
    """Measure what is missing, write the report; returns a line of figures."""
    chosen = options(words)
    chosen.out.mkdir(parents=True, exist_ok=True)
    rows = measured(chosen.out / ROWS, chosen.boards, chosen.times, chosen.minutes)
    found = summaries(rows)
    text = report(found, chosen.boards, chosen.times)
    (chosen.out / "README.md").write_text(text, encoding="utf-8")
    (chosen.out / "rare.json").write_text(json.dumps(figures(found), indent=1) + "\n", "utf-8")
    picture(found).savefig(chosen.out / "rare.png", dpi=130)
    return ", ".join(f"{name} {value}" for name, value in figures(found).items())
