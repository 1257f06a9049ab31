"""Boards of a million against plain boards: writes reports/rare/, of strangers
reports/rare-strangers/.

Cases are responses of the examples, with every law of the parts widened or narrowed until about one
board in 1e3 to 1e6 loses the response. Each is asked twice: by plain boards, a million of them, and
by ``rare_losses`` again and again with other seeds. How often does its interval hold the plain
share, and how many boards does it take?

With ``--strangers N`` the cases are drawn: the systems of one and two masses among the first N of
``SEED_DRAWN``, those of each other family among its first N/6. Each law is widened until some
boards of ``TRIED`` lose the response.

Every block of plain boards and every repetition is a line of ``rows.jsonl``, on disk as soon as it
is done; an interrupted run goes on, and one with more boards adds to what is there.

    python -m benchmarks rare --boards 1000000 --times 60 --minutes 45
    python -m benchmarks rare --strangers 30 --boards 60000 --times 1
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.bench_flow import commit, machine, table
from benchmarks.bench_strangers import filled, whole_lines
from benchmarks.stranger_systems import FAMILIES, Family, draw, shape
from designer.base.defaults import cores
from designer.base.errors import DesignerError
from designer.base.proportion import mid_p
from designer.check.synthesis_result import synthesise
from designer.dynamics.orbit import SETTLED
from designer.model.find_responses import matches
from designer.model.model_file import ModelFile, parse_model_file, read_model_file
from designer.spread.spread import Spread
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import StudyPlan, Verdict
from designer.yields.drawn_boards import Drawing
from designer.yields.rare_losses import rare_losses
from designer.yields.stored_parts import AnswerLog, StoredParts
from designer.yields.study_identity import RULES
from designer.yields.study_plan import plan_study
from designer.yields.tolerance_study import check

ROOT = Path(__file__).parent.parent
REPORT, STRANGERS = ROOT / "reports" / "rare", ROOT / "reports" / "rare-strangers"
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
SEED_DRAWN, MOST_MASSES = 61, 2
"""Of the strangers; those of more masses are left out, whose boards take longer."""
TRIED, SOME = 2048, (1, 4)
"""Boards by which the width of a stranger's laws is found, and how many of them are to be lost."""
PARTS = 8
"""Parts in which these boards are asked, until enough are lost."""
WIDTHS, HALVINGS = (0.25, 4.0), 5
"""Least and largest width that is tried, and how often what lies between is halved."""
FEW = 100
"""Lost plain boards below which their share has a larger error than an interval is wide."""
FLOOR = 1e-8
"""The least share that is drawn."""
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Case:
    """One response of an example, or the one of a stranger."""

    example: str
    """Name of the model file; of a stranger its seed and number."""
    number: int
    """Of the response, from 1."""
    width: float
    """By how much every law of the parts is widened."""
    family: Family | None = None
    """Of a stranger; None of an example."""

    @property
    def name(self) -> str:
        return f"{self.example} {self.number}" if self.family is None else self.example

    @property
    def file(self) -> ModelFile:
        if self.family is None:
            return read_model_file(ROOT / "examples" / f"{self.example}.toml")
        seed, _, number = self.example.rpartition(" ")[2].partition("-")
        return parse_model_file(draw(int(seed), int(number), self.family).text)

    @property
    def plan(self) -> StudyPlan:
        """The study of this response alone."""
        plan = _plan(replace(self, width=1.0))
        return replace(plan, spread=widened(plan.spread, self.width))


@cache
def _plan(case: Case) -> StudyPlan:
    """Of laws as they are."""
    file = case.file
    file = replace(file, responses=(file.responses[case.number - 1],))
    try:
        made = synthesise(file)
    except DesignerError as error:
        raise Unfit(f"{case.name}: {error}") from error
    checked = check(made, None)
    nominal = checked[0].circuit
    if nominal.status not in SETTLED or not matches(nominal, checked[0].model.spec):
        raise Unfit(f"{case.name}: the nominal circuit is {nominal.response}")
    return plan_study(file, made.design, checked, made.catalog, samples=1, seed=SEED)


class Unfit(SystemExit):
    """A case that is none, and why."""


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
# Strangers


def strangers(count: int) -> list[Case]:
    """Cases of so many drawn systems, of laws as they are; every system is drawn for itself."""
    counts = {family: count if family == "plain" else count // 6 for family in FAMILIES}
    return [
        Case(f"{family} {SEED_DRAWN}-{number}", 1, 1.0, family)
        for family in FAMILIES
        for number in range(counts[family])
        if shape(SEED_DRAWN, number)[0] <= MOST_MASSES
    ]


def fitting(case: Case) -> float:
    """The width at which `SOME` of `TRIED` boards lose the response; the widest of those tried that
    lose less, if none does.

    Raises
    ------
    Unfit : the nominal circuit does not show the response, or the narrowest loses it more often.
    """
    low, high = WIDTHS
    width = 1.0
    for _ in range(HALVINGS):
        many = lost_briefly(replace(case, width=width))
        if SOME[0] <= many <= SOME[1]:
            return width
        low, high = (width, high) if many < SOME[0] else (low, width)
        width = float(f"{math.sqrt(low * high):.3g}")
    if low == WIDTHS[0] and lost_briefly(replace(case, width=low)) > SOME[1]:
        raise Unfit(f"{case.name}: the laws at {low:g} of their width lose it too often")
    return low


def lost_briefly(case: Case) -> int:
    """Boards of `TRIED` that lose the response where each is asked briefly; some more than `SOME`
    where they are more."""
    plan, many = case.plan, 0
    drawing = Drawing(plan, plan.questions[0], cores(), lambda: None, AnswerLog(StoredParts(), ""))
    every = np.random.default_rng(SEED).random((TRIED, len(drawing.names)))
    for points in np.split(every, PARTS):  # a board without a period takes long
        many += int(drawing.scouted(points, np.zeros(len(points), dtype=int)).lost.sum())
        if many > SOME[1]:
            break
    return many


def fitted(path: Path, cases: Sequence[Case], end: float) -> list[Case]:
    """These strangers with their widths, as far as the time goes; what was found before stands in
    the file. One that is no case is left out, and the file says why."""
    known = {row["case"]: row for row in whole_lines(path) if row["kind"] == "width"}
    out = list[Case]()
    with path.open("a", encoding="utf-8") as file:
        for case in cases:
            row = known.get(case.name)
            if row is None and time.monotonic() < end:
                row = {"case": case.name, "kind": "width", "commit": commit()}
                try:
                    row["width"] = fitting(case)
                except Unfit as error:
                    row |= {"width": None, "why": str(error)}
                file.write(json.dumps(row) + "\n")
                file.flush()
                print(case.name, row["width"], row.get("why", ""), flush=True)
            if row is not None and row["width"] is not None:
                out.append(replace(case, width=row["width"]))
    return out


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


def missing(
    rows: Sequence[Row], cases: Sequence[Case], boards: int, times: int
) -> Iterator[tuple[Case, str, int]]:
    """What is to be measured, a few of each case in turn, so that an interrupted run has something
    of every case."""
    there = {(r["case"], r["kind"], r.get("first", r.get("time"))) for r in rows}
    firsts, repetitions = list(range(0, boards, BLOCK)), list(range(times))
    while firsts or repetitions:
        turn = [("plain", n) for n in firsts[:PLAIN_EACH]]
        turn += [("rare", n) for n in repetitions[:RARE_EACH]]
        firsts, repetitions = firsts[PLAIN_EACH:], repetitions[RARE_EACH:]
        for case in cases:
            yield from ((case, kind, n) for kind, n in turn if (case.name, kind, n) not in there)


def measured(
    path: Path, cases: Sequence[Case], boards: int, times: int, end: float = math.inf
) -> list[Row]:
    """All rows of the file, with what is missing of so many boards and repetitions, until the
    monotonic clock shows ``end``. Estimates of other rules than the present ones are left out."""
    here = whole_lines(path)
    rows = [row for row in here if row["kind"] == "plain" or row.get("rules") == RULES["rare"]]
    for case in cases:
        if any(row["case"] == case.name and row["width"] != case.width for row in rows):
            raise SystemExit(f"{path}: {case.name} of another width; take another --out")
    made = commit()
    with path.open("a", encoding="utf-8") as file:
        for case, kind, number in list(missing(rows, cases, boards, times)):
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
    def agrees(self) -> int:
        """Estimates that differ from the plain share by no more than the errors of both allow, by
        95 %."""
        return sum(self._agrees(row) for row in self.rare)

    def _agrees(self, row: Row) -> bool:
        """The limits of both logarithms joined in squares (G. Y. Zou, A. Donner, Stat. Med. 27,
        2008, 1693)."""
        low, high = self.interval
        if not (self.lost and row["lost"]):
            return bool(row["low"] <= high and row["high"] >= low)
        apart = math.log(row["lost"] / self.share)
        ends = (row["low"], high) if apart > 0.0 else (row["high"], low)
        both = math.hypot(math.log(ends[0] / row["lost"]), math.log(ends[1] / self.share))
        return abs(apart) <= both

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


def summaries(rows: Sequence[Row], cases: Sequence[Case]) -> list[Summary]:
    """Of each case with a row."""
    out = []
    for case in cases:
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
        "agree": sum(s.agrees for s in found),
        "share_held": sum(s.holds for s in sure) / times if times else None,
        "least_held": min((s.holds / len(s.rare) for s in sure), default=None),
    }


def _cells(s: Summary) -> list[str]:
    low, high = s.interval
    few = "" if s.counts else " (too few lost)"
    estimates = [
        f"{1e6 * s.median('lost'):.3g}",
        f"{s.holds} of {len(s.rare)}{few}",
        f"{s.agrees} of {len(s.rare)}",
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


def report(
    found: Sequence[Summary], command: str, wanted: int, left_out: Sequence[str] = ()
) -> str:
    """README.md. command : what made it. wanted : estimates. left_out : cases that are none, and
    why."""
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
            f"Made by `python -m benchmarks rare {command}`. Lines of "
            f"`{ROWS}` are taken as they are, each with its commit; to measure anew, take them "
            "away. A run with `--minutes` ends before all is measured, and the next one goes on."
        ),
        "",
        f"- Commit of the plain boards: {', '.join(plain) or 'none yet'}",
        f"- Commit of the estimates: {', '.join(rare) or 'none yet'}; so far "
        f"{f['of_all_cases']} of the {wanted}, all by the same rules",
        f"- Machine that made this page: {machine()}",
        "",
        filled(
            f"{f['agree']} of {f['of_all_cases']} estimates differ from the plain share by no more "
            f"than the errors of both allow, by 95 %. {held} Aimed at: "
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
             "hold it", "agree", "boards", "CPU s", "gain", "lost boards show"],
            [_cells(s) for s in found],
        ),
        *(["", "Left out:", "", *(f"- {why}" for why in left_out)] if left_out else []),
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
    parser.add_argument("--strangers", type=int, default=0, help="drawn systems, not examples")
    parser.add_argument("--out", type=Path, help="folder of the report")
    return parser.parse_args(words)


def main(words: Sequence[str] = ()) -> str:
    """Measure what is missing, write the report; returns a line of figures."""
    chosen = options(words)
    out: Path = chosen.out or (STRANGERS if chosen.strangers else REPORT)
    out.mkdir(parents=True, exist_ok=True)
    path, end = out / ROWS, time.monotonic() + 60.0 * chosen.minutes
    cases: Sequence[Case] = CASES
    command = f"--boards {chosen.boards} --times {chosen.times}"
    if chosen.strangers:
        cases = fitted(path, strangers(chosen.strangers), end)
        command = f"--strangers {chosen.strangers} {command}"
    rows = measured(path, cases, chosen.boards, chosen.times, end)
    found = summaries(rows, cases)
    left_out = [row["why"] for row in whole_lines(path) if row.get("why")]
    text = report(found, command, chosen.times * len(cases), left_out)
    (out / "README.md").write_text(text, encoding="utf-8")
    (out / "rare.json").write_text(json.dumps(figures(found), indent=1) + "\n", "utf-8")
    picture(found).savefig(out / "rare.png", dpi=130)
    return ", ".join(f"{name} {value}" for name, value in figures(found).items())
