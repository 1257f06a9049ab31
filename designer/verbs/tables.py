"""What the verbs answer, as tables for people on standard error."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from designer.answers.attribution_noise import lacks_noise
from designer.answers.rare_words import any_lost_words, boards_text, share_text
from designer.base.si_unit import acceleration_text, drive_text, is_angular, value_text
from designer.base.units import format_quantity
from designer.verbs.console import grid, say, table

if TYPE_CHECKING:
    from designer.answers.design_answer import DesignKeys, KnobRow
    from designer.answers.shared_rows import IntervalRow, TrustVerdict
    from designer.answers.study_answer import (
        MeasuredBoard,
        RareLossKeys,
        RatedCounts,
        RunAnswer,
        StudyAnswer,
        StudyKeys,
        StudyResponse,
        YieldCounts,
    )
    from designer.jobs.job_outcome import JobOutcome
    from designer.verbs.next_steps import Step

Shown = TypeVar("Shown")
YES_NO = {True: "yes", False: "no", None: "-"}


def design_written(
    outcome: JobOutcome,
    answer: Shown,
    tables: Callable[[Shown], None],
    after: Callable[[Path, Shown], Iterable[Step]],
) -> None:
    """What a verb that writes a design folder has to say. answer : of the outcome, as it is
    printed. tables : shows it. after : what may be done next."""
    tables(answer)
    if outcome.folder is not None:
        from designer.verbs import next_steps

        files(outcome.folder, outcome.reused)
        next_steps.show(after(outcome.folder, answer))


def whole_job(answer: RunAnswer) -> None:
    """Parts and errors, then the responses."""
    synthesised(answer)
    tolerance(answer)


def studied(answer: RunAnswer) -> None:
    """What is not good enough, then the responses; the parts were shown before."""
    not_good_enough(answer)
    tolerance(answer)


def worked_out_last(answer: StudyKeys) -> None:
    """Attribution and rare losses; all else was shown before."""
    attribution_status(answer)
    _rare(answer)


def not_good_enough(answer: DesignKeys) -> None:
    """What stands before everything else that a verb says of a design, where there is
    something."""
    for warning in answer.get("warnings", ()):
        say(f"Not good enough: {warning}")
    if failed := answer.get("failed_rules"):
        rows = (
            {"rule": r["id"], "found": r["found"], "limit": r["limit"], "what to do": r["do"]}
            for r in failed
        )
        table("Design rules that fail", rows)


def synthesised(answer: DesignKeys) -> None:
    """What is not good enough; the chosen parts, their error and the generator's settings."""
    not_good_enough(answer)
    equal: dict[tuple[str, float], list[str]] = defaultdict(list)
    for name, value in answer["parts"].items():
        equal[name[0], value].append(name)
    table(
        "Parts",
        (
            {
                "value": format_quantity(value, "F" if kind == "C" else "Ω"),
                "parts": " ".join(names),
            }
            for (kind, value), names in sorted(equal.items())
        ),
    )
    if answer.get("better_grades"):
        from designer.spread.part_grades import BetterGrade, better_grades_text

        better = {
            name: BetterGrade(g["asked"], g["bought"])
            for name, g in answer["better_grades"].items()
        }
        say(better_grades_text(better))
    stage = answer.get("dead_zone")
    if stage is not None and (reason := stage.get("reason")):
        say(f"The stage of the clearance was chosen. {reason}.")
    certificate = answer["certificate"]
    say(
        f"Largest coefficient error {_error(answer['max_error'])} "
        f"({certificate['status']}, lower bound {_error(certificate['lower_bound'])}); "
        f"{answer['distinct_values']} distinct values"
    )
    if answer["knobs"]:
        rows = answer["knobs"]
        table(
            "Generator",
            (
                {
                    **response_cells(r, rows, "mechanism_hz"),
                    "frequency": f"{r['frequency_hz']:.4g} Hz",
                    "amplitude (peak, high-Z)": f"{r['amplitude_v_peak']:.4g} V",
                    **_second_channel(r),
                    **_base(r),
                }
                for r in rows
            ),
        )


def _base(knob: KnobRow) -> dict[str, str]:
    """The base's acceleration per volt of the channel that stands for it, where it moves."""
    if "base_m_s2_per_v" not in knob:
        return {}
    return {"base per volt": acceleration_text(knob["base_m_s2_per_v"])}


def _second_channel(knob: KnobRow) -> dict[str, str]:
    """Amplitude and phase of the generator's second channel, where there is one."""
    if "second" not in knob:
        return {}
    second = knob["second"]
    phase = f", {second['phase_deg']:.4g}° ahead" if second["phase_deg"] else ""
    return {"second channel (peak)": f"{second['amplitude_v_peak']:.4g} V{phase}"}


def tolerance(answer: StudyAnswer | RunAnswer) -> None:
    """The responses on each engine, and their yields."""
    spread = (answer["provenance"]["spread"] or {}).get("name", "")
    of_file = f", spread of the {spread}" if spread == "model file" else ""
    rows = answer["responses"]
    table(
        f"Responses, {answer['samples']} samples{of_file}",
        (
            {
                **response_cells(r, rows),
                "model": r["model"] if r["found"] else f"{r['model']} (not what is wanted)",
                "circuit": r["circuit"],
                "ngspice": r["ngspice"] or "-",
                **_counts(r),
            }
            for r in rows
        ),
        gap=1,
    )
    if boards := answer.get("boards"):
        _boards(boards, [_head(r) for r in rows])
    for r in rows:
        for line in untrusted(_trust_with_figures(r)):
            say(f"{drive_text(r['omega'], r.get('frequency_hz'), 6)}: {line}")
    if (equations := answer.get("equation_check")) is not None:
        from designer.spice.equation_check import EquationCheck

        problem = EquationCheck.read(equations).problem
        if problem:
            say(problem)
    attribution_status(answer)
    if (until := answer.get("until")) is not None:
        reached = "reached" if answer.get("narrow") else "NOT reached: some interval is wider"
        say(f"Intervals narrower than {100 * until:g} % of boards: {reached}")
    _further(answer)
    _rare(answer)


def _counts(row: StudyResponse) -> dict[str, str]:
    """The yield of a response; of one that was left out, why."""
    y = row["yield"]
    if y is None:
        counted = ["-", row.get("left_out", ""), "", "", ""]
    else:
        lost = [str(y["lost"]), str(y["grazing"]), str(y["failed"])]
        counted = [_percent(row["rate"]), _interval(y, y), *lost]
    return dict(zip(("yield %", "95 %", "lost", "grazing", "failed"), counted, strict=True))


def _boards(boards: Sequence[MeasuredBoard], heads: Sequence[str]) -> None:
    """One row for each measured board, where the study is of all of them."""
    rows = ([b["board"], *(cell or "-" for cell in b["cells"]), b["all"] or "-"] for b in boards)
    grid(f"All {len(boards)} boards", ["board", *heads, "all of them"], rows, gap=1)


def attribution_status(answer: StudyKeys) -> None:
    """One line about an attribution that is not whole, or whose indices an earlier version stored
    without their noise; none else."""
    status = answer.get("blame")
    if status is not None and status["reason"]:
        say(f"Blame {status['status']}: {status['reason']}")
    if lacks_noise(answer):
        say(
            "Blame: the noise of the Sobol indices was not stored; designer tolerance DIR --blame "
            "--resume works it out"
        )


def _further(answer: StudyKeys) -> None:
    """The yields beside those as built, where there are any."""
    rows = answer["responses"]
    kinds: dict[str, Callable[[StudyResponse], RatedCounts | None]] = {
        "tuned %": lambda r: r.get("tuned"),
        "on the bench %": lambda r: None if (t := r.get("tuned")) is None else t["bench"],
        "trimmed %": lambda r: r.get("trimmed"),
        "reached %": lambda r: r.get("reached"),
    }
    kinds_present = {kind: of for kind, of in kinds.items() if any(of(r) for r in rows)}
    both = any(r.get("combined") for r in rows)
    if not kinds_present and not both:
        return
    table(
        "Further yields",
        (
            {
                **response_cells(r, rows),
                **{kind: _decided(of(r)) for kind, of in kinds_present.items()},
                **(_both_engines(r) if both else {}),
            }
            for r in rows
        ),
        gap=1,
    )
    joint = answer.get("all_on_one_board")
    if joint is None:
        return
    kinds_joint = {
        "as built": joint["built"],
        "tuned": joint["tuned"],
        "trimmed": joint["trimmed"],
        "reached": joint["reached"],
    }
    counts = [f"{kind} {y['ok']} of {y['samples']}" for kind, y in kinds_joint.items() if y]
    if counts:
        say(f"All on one board: {', '.join(counts)}")


def _rare(answer: StudyKeys) -> None:
    """How many of a million boards are lost, where that was asked for."""
    rows = answer["responses"]
    asked = [(r, found) for r in rows if (found := r.get("rare"))]
    if not asked:
        return

    def cells(found: RareLossKeys) -> dict[str, str]:
        estimate, low, high = map(boards_text, found["per_million"])
        regions = [f"{g['becomes']} ({g['found_by']}) {share_text(g['share'])}" for g in
                   found["regions"]]  # fmt: skip
        wide = next((m["widening"] for m in found["margins"] if not m["part"]), None)
        return {
            "lost of a million": estimate if found["drawn_lost"] else "0",
            "95 %": f"{low} to {high}",
            "boards asked": str(found["boards"] + found["pilots"]),
            "regions": "; ".join(regions[:2]) or ("none found" if found["pilots"] else "-"),
            "first loss at": "-" if wide is None else f"{wide:.2g} × the tolerances",
        }

    shown = ({**response_cells(r, rows), **cells(found)} for r, found in asked)
    table("Rare losses", shown, gap=1)
    if any_lost := answer.get("any_lost"):
        say(any_lost_words(any_lost))
    unseen = max(found["unseen"] for _, found in asked)
    if unseen:
        more = boards_text(1e6 * unseen)
        say(f"A region of losses that no search met may hold up to {more} of a million more")


def _both_engines(row: StudyResponse) -> dict[str, str]:
    both, counted, cells = row.get("combined"), row["yield"], ["-", "", ""]
    if both is not None and counted is not None:
        differ = both["disagreement"]
        cells = [
            _percent(both["estimate"]),
            _interval(both, counted),
            f"{differ['count']} of {differ['asked']}",
        ]
    return dict(zip(("both engines %", "95 %", "differ"), cells, strict=True))


def pictures(folder: Path, names: Sequence[str]) -> None:
    """Where the pictures are."""
    written = f"{len(names)} pictures written, such as {names[0]}" if names else "no orbit to draw"
    say(f"{folder}: {written}")


def files(folder: Path, reused: bool) -> None:
    """Where the results are."""
    how = "was there already, from the same inputs" if reused else "written"
    say(f"{folder}: {how}")


def untrusted(trust: Mapping[str, TrustVerdict | None]) -> list[str]:
    """A line for each result that is not to be trusted (``check.trust``), by what it is of."""
    results = {quantity: result for quantity, result in trust.items() if result is not None}
    return [
        f"{quantity} not to be trusted here: {'; '.join(result['reasons'])}"
        for quantity, result in results.items()
        if result["trusted"] is False
    ] + [
        f"{quantity} gave no answer: {'; '.join(result['reasons'])}"
        for quantity, result in results.items()
        if result["trusted"] is None and result["reasons"]
    ]


def _trust_with_figures(row: StudyResponse) -> dict[str, TrustVerdict | None]:
    """The trust of a study's response; ngspice's with the reason that has the figures."""
    trust = dict(row.get("trust", {}))
    if (ngspice := trust.get("ngspice")) is not None and row["ngspice_reason"]:
        trust["ngspice"] = {**ngspice, "reasons": [row["ngspice_reason"]]}
    return trust


def response_cells(
    row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], key: str = "frequency_hz"
) -> dict[str, str]:
    """The first cells of a response: its frequency and the wanted n-p-q. key : of the mechanism's
    frequency."""
    return {**drive_cells(row, rows, key), "expected": row["expected"] or "-"}


def drive_cells(
    row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], key: str = "mechanism_hz"
) -> dict[str, str]:
    """The frequency of one of these rows; ω not where it is in rad/s. key : as above."""
    mechanism = _mechanism(row, rows, key)
    if mechanism and all(is_angular(r["omega"], r[key]) for r in rows):
        return mechanism
    return {"ω": f"{row['omega']:g}", **mechanism}


def _head(row: StudyResponse) -> str:
    """A response above a column: its frequency and the wanted n-p-q."""
    place = drive_text(row["omega"], row.get("frequency_hz"), 6).removeprefix("ω = ")
    return f"{place} {row['expected'] or '-'}"


def _mechanism(
    row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], key: str
) -> dict[str, str]:
    """The mechanism's frequency, where all rows have it."""
    return {"mechanism": value_text(row[key], "Hz")} if all(key in r for r in rows) else {}


def _interval(ends: IntervalRow, counted: YieldCounts) -> str:
    """The interval of a share in per cent; where all boards there are were asked, which leaves
    none, their number."""
    if counted.get("census") and ends["low"] == ends["high"]:
        return f"all {counted['samples']}"
    return f"{100 * ends['low']:.0f}–{100 * ends['high']:.0f}"


def _percent(rate: float | None) -> str:
    return "-" if rate is None else f"{100 * rate:.1f}"


def _decided(counted: RatedCounts | None) -> str:
    """A yield, and how many boards had no answer, if any."""
    if counted is None:
        return _percent(None)
    failed = counted["failed"]
    return _percent(counted["rate"]) + (f" ({failed} failed)" if failed else "")


def _error(value: float) -> str:
    """A coefficient error; below 1e-12 it is rounding."""
    return f"{100 * value:.3g} %" if value >= 1e-12 else "0 to rounding"
