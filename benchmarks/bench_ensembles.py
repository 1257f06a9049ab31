"""Ten thousand boards of the paper's circuit: where each settles, by the compiled ensemble, against
heyoka in batch mode and Runge-Kutta over an ensemble.

Of ours this is ``Ensemble.settle``, which answers a study's question; the others carry a state,
with the boards' reductions given. One orbit for long is raced in ``benchmarks.bench_flow``.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.bench_flow import commit, machine, table
from benchmarks.bench_tolerance import BEST, plan_of
from benchmarks.ensembles import LANES, BoardNumbers, HeyokaBatch, runge_kutta
from benchmarks.figures import Figures
from designer.base.arrays import Array
from designer.circuit.ensemble import Ensemble
from designer.dynamics.orbit import Orbit
from designer.dynamics.piecewise_linear import Drive, PiecewiseLinearSystem
from designer.verdicts.verdict import Question, StudyPlan

REPORT = Path(__file__).parent.parent / "reports" / "speed"
RESPONSES = (1, 3, 8)
"""p of the responses."""
BOARDS, RIVALS = 10_000, 1_000
"""Boards that ours settles; those of them that the others carry, in each round."""
ROUNDS = 5
TOLERANCE = 1e-12
"""At which heyoka is fastest below an error of 1e-13."""
STEP = 0.005
"""The paper's, of Runge-Kutta, in dimensionless time."""
SETTLED = 1e-9
"""Share of a disturbance that is left once a board has settled."""
OURS, HEYOKA, RUNGE_KUTTA = "ours", "heyoka, batch", "Runge-Kutta, ensemble"
COMPARED, CHECKED = 3, 20
"""Drive periods and boards after which states are compared with those of the exact flow."""


@dataclass(frozen=True)
class Row:
    """One response; speeds per second of CPU time, the best of the rounds, over boards."""

    p: int
    """Impacts at each stop, in as many drive periods of the model's time."""
    ours: float
    """Boards that settle in a second."""
    periods: float
    """Drive periods that ours spent on a board, in the mean."""
    needed: float
    """Drive periods after which a disturbance is ``SETTLED`` of itself, by the orbits' own
    multipliers, in the mean."""
    rivals: Mapping[str, tuple[float, float]]
    """Of each: the drive periods of one board that it carries in a second, and the largest
    difference of a state [V] from the exact flow of the same reduction."""

    def over(self, rival: str) -> tuple[float, float]:
        """How many times as many boards ours does as a rival that carries each over as many drive
        periods as ours spent, and over as many as are needed."""
        speed = self.rivals[rival][0]
        return self.ours * self.periods / speed, self.ours * self.needed / speed


def numbers_of(boards: Ensemble, drive: Drive, count: int) -> BoardNumbers:
    """Those of the first boards' reductions.

    Raises
    ------
    ValueError : a contact changes more than what is linear in its depth.
    """
    every = [_numbers(boards.reduction(i).system(), drive) for i in range(count)]
    A, B, d, depth, push = (np.array(column) for column in zip(*every, strict=True))
    return BoardNumbers(A, B, d, depth, push, drive.omega)


def _numbers(
    system: PiecewiseLinearSystem, drive: Drive
) -> tuple[Array, Array, Array, Array, Array]:
    rest = system.mode(system.start)
    depths, pushes = [], []
    for guard in rest.guards:
        if guard.clearance != 0:
            continue
        contact = system.mode(guard.target)
        push = (contact.A - rest.A) @ guard.C / (guard.C @ guard.C)
        left = contact.A - rest.A - np.outer(push, guard.C)
        if np.abs(left).max() > 1e-9 * np.abs(contact.A).max():
            raise ValueError(f"{guard.target}: the contact is no spring")
        depths.append(
            np.concatenate([guard.C, [guard.D * drive.amplitude, guard.D * drive.offset + guard.e]])
        )
        pushes.append(push)
    return (
        rest.A,
        rest.B * drive.amplitude,
        rest.d + rest.B * drive.offset,
        np.array(depths),
        np.array(pushes),
    )


def _speed(work: int, run: Callable[[], object]) -> float:
    before = time.process_time()
    run()
    return work / (time.process_time() - before)


def measure(plan: StudyPlan, question: Question, count: int = BOARDS, rivals: int = RIVALS) -> Row:
    """One response's row; smaller numbers for a quick look. The rounds are interleaved."""
    drive, start = question.excitation.drive, question.start.start
    asked = replace(plan, questions=(question,))

    def settle(boards: int) -> list[Orbit]:
        drawn = Ensemble(asked.boards(range(boards)))
        return drawn.settle(range(boards), [drive] * boards, np.tile(start, (boards, 1)))

    exact = Ensemble(asked.boards(range(rivals)))
    numbers, starts = numbers_of(exact, drive, rivals), np.tile(start, (rivals, 1))
    checked = min(CHECKED, rivals)
    runs = exact.run(range(checked), [drive] * checked, starts[:checked], COMPARED)
    truth = np.array([run.strobes[-1] for run in runs if run is not None])
    orbits = settle(rivals)  # code is compiled
    periods = float(np.mean([orbit.periods for orbit in orbits]))
    needed = [np.log(SETTLED) / np.log(orbit.radius) * orbit.n for orbit in orbits]
    # The model's time, in which the paper's step is, is the board's over a factor.
    steps = round(2.0 * np.pi / BEST[question.start.p] / STEP)
    racers: dict[str, Callable[[Array, int], Array]] = {
        RUNGE_KUTTA: lambda x, laps: runge_kutta(numbers, x, laps, steps)
    }
    with contextlib.suppress(ImportError):
        racers[HEYOKA] = HeyokaBatch(numbers, TOLERANCE)
    errors = {
        name: float(np.abs(run(starts, COMPARED)[:checked] - truth).max())
        for name, run in racers.items()
    }
    best = dict.fromkeys((OURS, *racers), 0.0)
    laps = round(periods)
    for _ in range(ROUNDS):
        best[OURS] = max(best[OURS], _speed(count, lambda: settle(count)))
        for name, run in racers.items():
            speed = _speed(rivals * laps, lambda run=run: run(starts, laps))  # type: ignore[misc]
            best[name] = max(best[name], speed)
    return Row(
        p=question.start.p,
        ours=best[OURS],
        periods=periods,
        needed=float(np.mean(needed)),
        rivals={name: (best[name], errors[name]) for name in racers},
    )


def report(rows: Sequence[Row], seconds: float) -> str:
    """ensembles.md."""
    header = ["", *(f"1-{row.p}-{row.p}" for row in rows)]
    body = [
        ["ours: boards that settle in a second", *(f"{row.ours:,.0f}" for row in rows)],
        ["drive periods that ours spent on one", *(f"{row.periods:.0f}" for row in rows)],
        ["drive periods that settling needs", *(f"{row.needed:.0f}" for row in rows)],
    ]
    for name in rows[0].rivals:
        speeds = [row.rivals[name] for row in rows]
        body += [
            [f"{name}: drive periods a second, error", *(f"{v:,.0f}, {e:.0e}" for v, e in speeds)],
            ["ours over it, as many periods", *(f"{row.over(name)[0]:.1f}" for row in rows)],
            ["ours over it, as many as are needed", *(f"{row.over(name)[1]:.1f}" for row in rows)],
        ]
    lines = [
        "# Speed of many boards",
        "",
        "Made by `python -m benchmarks ensembles` (`make bench`).",
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}",
        f"- Took {seconds:.0f} s.",
        "",
        f"{BOARDS} boards of the paper's circuit, saturating stage, with parts of 0.2 %, each from",
        "the nominal orbit, on one core (CPU time, best of the rounds in which all take turns).",
        "",
        *table(header, body),
        "",
        "- Ours is what a study does: a board's reduction, its modes' tables, settling, Newton's",
        "  method to the orbit, its multipliers, impacts and margins.",
        "- The others have the reductions given and carry a state. As many periods: as ours spent",
        f"  on a board; as are needed: until a disturbance is {SETTLED:.0e} of itself, by the",
        "  boards' own multipliers. They find neither the orbit's period nor its multipliers.",
        f"- heyoka is at a tolerance of {TOLERANCE:.0e}, in batch mode, as many boards a batch as",
        "  it recommends; callbacks in Python switch the contacts. Compilation is not counted.",
        f"- Runge-Kutta has the paper's step of {STEP} and does not look for the contacts; {LANES}",
        "  boards are stepped together, by the processor's vector instructions.",
        f"- An error is the largest difference of a state [V] after {COMPARED} drive periods from",
        f"  the exact flow, on {CHECKED} boards.",
        "- One orbit for long: [flow.md](flow.md).",
    ]
    return "\n".join(lines) + "\n"


def main() -> Figures:
    """Measure, print, write reports/speed/ensembles.md; returns the ratios."""
    begin = time.perf_counter()
    plan = plan_of("paper", max(RESPONSES))
    rows = [measure(plan, plan.questions[p - 1]) for p in RESPONSES]
    text = report(rows, time.perf_counter() - begin)
    print(text)
    REPORT.mkdir(parents=True, exist_ok=True)
    (REPORT / "ensembles.md").write_text(text, encoding="utf-8")
    found = {
        f"1-{row.p}-{row.p}, boards over {name}, {what}": ratio
        for row in rows
        for name in row.rivals
        for what, ratio in zip(("as many periods", "settled"), row.over(name), strict=True)
    }
    return Figures(
        ", ".join(
            f"{'/'.join(f'{row.over(name)[1]:.1f}' for row in rows)} x {name} on boards"
            for name in rows[0].rivals
        ),
        found,
    )


if __name__ == "__main__":
    print(main())
