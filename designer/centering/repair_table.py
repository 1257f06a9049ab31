"""What the command line says about a repair."""

from __future__ import annotations

from typing import TYPE_CHECKING

from designer.answers.rare_words import boards_text
from designer.base.si_unit import drive_text

if TYPE_CHECKING:
    from designer.answers.cure_answer import CureAnswer, MeasuredYieldRow, TrialRow


def text(answer: CureAnswer) -> str:
    """The answer, yields before and after, rounds and the front, as lines of text.

    answer : the JSON object of ``repair_json``.
    """
    percent = f"{100.0 * answer['target']:.8g} %"
    digits = 4 if answer["target"] < 0.999 else 8
    lines = []
    if answer["reached"]:
        lines.append(f"every response at {percent} or better for {answer['price']:.2f} euro:")
        lines += [f"  {upgrade}" for upgrade in answer["said"]] or ["  nothing has to change"]
    else:
        lines.append(f"{percent} not reached: {answer['why']}")
        best = "; ".join(answer["said"]) or "the design as it is"
        lines.append(f"  best measured, {answer['price']:.2f} euro: {best}")
    lines += ["", "response            before                  after", *_responses(answer)]
    for number, trial in enumerate(answer["rounds"], start=1):
        lines += ["", f"round {number}, {trial['price']:.2f} euro: " + _upgrades(trial)]
        for r, (promised, m) in enumerate(
            zip(trial["predicted"], trial["measured"], strict=True), start=1
        ):
            lines.append(f"  response {r}: promised {promised:.{digits}f}, measured {_yield(m)}")
    lines += ["", "price     worst response          upgrades"]
    for trial in answer["front"]:
        worst = min(trial["measured"], key=lambda m: (_rate(m), m["low"]))
        lines.append(f"{trial['price']:<9.2f} {_yield(worst):<23} {_upgrades(trial)}")
    lines += [
        "",
        *(f"not built: {'; '.join(r['upgrades'])}: {r['why']}" for r in answer["refused"]),
    ]
    return "\n".join(lines).rstrip() + "\n"


def _responses(answer: CureAnswer) -> list[str]:
    out = []
    for r in answer["responses"]:
        place = drive_text(r["omega"], r.get("frequency_hz"))
        name = f"{place} {r['expected'] or ''}".strip()
        out.append(f"{name:<19} {_yield(r['before']):<23} {_yield(r['after'])}")
        if r["limit"]:
            out.append(f"    {r['limit']}")
    return out


def _upgrades(trial: TrialRow) -> str:
    return "; ".join(trial["said"]) or "as it is"


def _rate(m: MeasuredYieldRow) -> float:
    return 0.0 if m["rate"] is None else float(m["rate"])


def _yield(m: MeasuredYieldRow) -> str:
    if m["rate"] is None:
        return "not shown"
    if rare := m.get("rare"):
        shares = rare["lost"], rare["low"], rare["high"], rare["unseen"]
        lost, low, high, unseen = (boards_text(1e6 * share) for share in shares)
        return f"{lost} of a million lost ({low} to {high}; at most {unseen} that no search met)"
    text = f"{m['rate']:.4f} ({m['low']:.4f} to {m['high']:.4f})"
    return text + (f", {m['failed']} failed" if m["failed"] else "")
