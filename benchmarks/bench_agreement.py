"""How often ngspice calls a random board what the exact circuit calls it, and why it does not.

Every board of a study of ``examples/paper.toml``, under its own spread and a seed that no search
has seen, is asked at both fidelities by the code that a study uses: from the nominal design's
orbit, with halved steps where the two differ. Each disagreement is then run once more at a much
finer step, and listed with its margins.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from benchmarks.bench_flow import commit, machine, table
from designer.base.defaults import cores
from designer.base.plain_json import dumps
from designer.base.proportion import wilson
from designer.check.synthesis_result import synthesise
from designer.jobs.study_stage import SPICE_TIMEOUT
from designer.model.model_file import ModelFile, read_model_file
from designer.spice import convergence_aids, numerics_gate
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed
from designer.verdicts import exact_circuit as exact
from designer.verdicts.cross_check import SLOW, CrossCheck, StartKind
from designer.verdicts.verdict import Answer
from designer.yields.study import Study
from designer.yields.tolerance_study import tolerance
from designer.yields.two_engine_yield import Explanation, differences

ROOT = Path(__file__).parent.parent
REPORT = ROOT / "reports" / "agreement"
MODEL = ROOT / "examples" / "paper.toml"
SAMPLES, SEED = 100, 2026
GOAL = 0.99
FINER = 8.0
"""How much finer the last step is than the one that passed the gate; a study halves it once."""


@dataclass(frozen=True)
class Difference:
    """A board on which ngspice says another n-p-q from the nominal orbit.

    omega : of the response. finer : what it says at the finer step. penetration, miss : of the
    exact orbit, over the nominal orbit's peak; radius : its largest multiplier. why : in words,
    "unexplained" where nothing does.
    """

    omega: float
    response: str
    sample: int
    exact: str
    ngspice: str
    finer: str
    penetration: float
    miss: float
    radius: float
    why: str


@dataclass(frozen=True)
class Row:
    """One response. agreed of ``decided`` boards are called the same from the nominal orbit; the
    rest of ``samples`` has no answer: undecided, failed, or too long a way. own_agreed of
    ``own_decided`` : from the board's own orbit, on the boards that a study asks there."""

    response: str
    omega: float
    samples: int
    agreed: int
    decided: int
    undecided: int
    failed: int
    too_long: int
    own_agreed: int
    own_decided: int
    explained: int

    @property
    def rate(self) -> float:
        return self.agreed / self.decided if self.decided else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        return wilson(self.agreed, self.decided)


def measure(file: ModelFile, samples: int = SAMPLES) -> tuple[list[Row], list[Difference]]:
    """Both fidelities on every board of a study of this model file."""
    made = synthesise(file)
    with SpicePool(cores(), timeout=SPICE_TIMEOUT) as pool:
        study = tolerance(
            made, samples=samples, fidelity="ngspice", attributed=False, seed=SEED, pool=pool
        )
        found = [d for index in study.response_indices for d in _differences(study, index, pool)]
    return [_row(study, index, found) for index in study.response_indices], found


def _row(study: Study, index: int, found: Sequence[Difference]) -> Row:
    answers = {a.sample: a for a in study.answers_to(index)}
    heard = study.rows_of(index, study.cross_checks)

    def said(kind: StartKind) -> list[bool | None]:
        return [h.agrees(answers[h.sample]) for h in heard if h.kind is kind]

    nominal, own = said(StartKind.NOMINAL), said(StartKind.OWN)
    words = [h.response for h in heard if h.kind is StartKind.NOMINAL]
    omega = study.checked[index].model.omega
    return Row(
        response=study.plan.questions[study.response_indices.index(index)].start.response,
        omega=omega,
        samples=len(nominal),
        agreed=nominal.count(True),
        decided=len(nominal) - nominal.count(None),
        undecided=words.count("undecided"),
        failed=words.count("failed"),
        too_long=words.count(""),
        own_agreed=own.count(True),
        own_decided=len(own) - own.count(None),
        explained=sum(d.omega == omega and d.why != Explanation.NONE for d in found),
    )


def _differences(study: Study, index: int, pool: SpicePool) -> list[Difference]:
    number = study.response_indices.index(index)
    question = study.plan.questions[number]
    answers = {a.sample: a for a in study.answers_to(index)}
    heard = {
        h.sample: h for h in study.rows_of(index, study.cross_checks) if h.kind is StartKind.NOMINAL
    }
    met = [
        d
        for d in differences(
            list(answers.values()), study.rows_of(index, study.cross_checks), question
        )
        if d.kind is StartKind.NOMINAL
    ]
    peak = float(abs(question.start.extremes[0]).max())
    out = []
    for d in met:
        answer, finer = answers[d.sample], _at_finer_step(study, number, heard[d.sample], pool)
        out.append(
            Difference(
                study.checked[index].model.omega,
                question.start.response,
                d.sample,
                d.exact,
                d.ngspice,
                finer,
                answer.penetration / peak,
                answer.miss / peak,
                answer.radius,
                _why(d.explanation, finer, answer),
            )
        )
    return out


def _at_finer_step(study: Study, number: int, said: CrossCheck, pool: SpicePool) -> str:
    """What ngspice says of this board, by the same way, at a step ``FINER`` times as fine."""
    question = study.plan.questions[number]
    assert question.settings is not None
    alone = replace(study.plan, questions=(question,))
    ((_, subject),) = exact.subjects(alone, range(said.sample, said.sample + 1), 1)
    assert subject is not None
    subject = replace(subject, start=question.start.start, discard=said.periods)
    settings = replace(question.settings, max_step=question.settings.max_step / FINER)
    ((_, outcome),) = convergence_aids.run(pool, [numerics_gate.task(subject, settings)])
    if isinstance(outcome.result, SimulationFailed):
        return f"failed: {outcome.result.reason}"
    return outcome.result.orbit.response


def _why(known: Explanation, finer: str, answer: Answer) -> str:
    if known in (Explanation.GRAZING, Explanation.CLIPPED):
        return str(known)
    if finer == answer.response:
        return "the same at a finer step"
    if known is Explanation.BASIN:
        return str(known)
    if answer.radius > SLOW:
        return f"settles slowly (multiplier above {SLOW:g})"
    return str(Explanation.NONE)


def report(rows: Sequence[Row], found: Sequence[Difference], seconds: float) -> str:
    """agreement.md."""
    body = [
        [
            f"{r.omega:g}",
            r.response,
            f"{r.agreed} of {r.decided}",
            f"{100 * r.rate:.1f} %",
            f"{100 * r.interval[0]:.1f} to {100 * r.interval[1]:.1f} %",
            f"{r.decided - r.agreed - r.explained}",
            f"{r.undecided} / {r.failed} / {r.too_long}",
            f"{r.own_agreed} of {r.own_decided}",
        ]
        for r in rows
    ]
    header = ["ω", "response", "agreed", "rate", "95 %", "unexplained"]
    header += ["undecided / failed / too long", "own orbit"]
    agreed, decided = sum(r.agreed for r in rows), sum(r.decided for r in rows)
    low, high = wilson(agreed, decided)
    lines = [
        "# The exact circuit and ngspice on random boards",
        "",
        "Made by `python -m benchmarks agreement` (`make bench`).",
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}",
        f"- Took {seconds:.0f} s, at a load of {os.getloadavg()[2]:.1f} in the last 15 minutes.",
        "",
        f"`examples/paper.toml` under its own spread, seed {SEED}: {max(r.samples for r in rows)}",
        "boards as built for each response. Both engines start on the nominal design's orbit;",
        "`agreed` counts boards that they call by the same n-p-q, or both aperiodic. Boards on",
        "which ngspice has no answer stand apart: two step sizes still differ, it failed, or its",
        f"way to the attractor is too long. The goal is {100 * GOAL:g} % for each response. `own",
        "orbit` is the same from the board's own orbit.",
        "",
        *table(header, body),
        "",
        f"Together {agreed} of {decided}: {100 * agreed / max(decided, 1):.2f} % "
        f"({100 * low:.2f} to {100 * high:.2f} %, Wilson).",
        "",
        "![Agreement by response](agreement.svg)",
        "",
        "## Every disagreement",
        "",
    ]
    if not found:
        return "\n".join([*lines, "There is none."]) + "\n"
    header = [
        "ω",
        "response",
        "board",
        "exact",
        "ngspice",
        f"step / {FINER:g}",
        "penetration",
        "miss",
    ]
    header += ["multiplier", "explained by"]
    body = [
        [
            f"{d.omega:g}",
            d.response,
            f"{d.sample}",
            d.exact,
            d.ngspice,
            d.finer,
            f"{d.penetration:.2g}",
            f"{d.miss:.2g}",
            f"{d.radius:.3f}",
            d.why,
        ]
        for d in found
    ]
    lines += [
        "Penetration and miss of the exact orbit are over the nominal orbit's peak; ngspice's",
        "error is 0.002 of it, and below that it cannot tell whether there is an impact.",
        "",
        *table(header, body),
    ]
    return "\n".join(lines) + "\n"


def plot(rows: Sequence[Row]) -> Figure:
    """Agreement by response with its interval."""
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    ax = figure.subplots()
    for k, r in enumerate(rows):
        low, high = r.interval
        ax.plot([k, k], [100 * low, 100 * high], color="#1f77b4", lw=2)
        ax.plot(k, 100 * r.rate, "o", color="#1f77b4", label="" if k else "from the nominal orbit")
        if r.own_decided:
            own = 100 * r.own_agreed / r.own_decided
            label = "" if k else "from the board's own orbit"
            ax.plot(k + 0.15, own, "s", mfc="none", color="#d62728", label=label)
    ax.axhline(100 * GOAL, color="#555555", lw=0.8, ls="--", label=f"goal, {100 * GOAL:g} %")
    ax.set_xticks(range(len(rows)), [f"{r.response}\nω = {r.omega:g}" for r in rows], fontsize=8)
    ax.set_ylabel("boards that both engines call the same, %")
    ax.grid(visible=True, axis="y", lw=0.4, alpha=0.6)
    figure.legend(fontsize=8, frameon=False, loc="outside upper center", ncols=3)
    return figure


def main() -> str:
    """Measure, print, write reports/agreement/; returns a line of figures."""
    began = time.perf_counter()
    rows, found = measure(read_model_file(MODEL))
    write(REPORT, rows, found, time.perf_counter() - began)
    agreed, decided = sum(r.agreed for r in rows), sum(r.decided for r in rows)
    bare = sum(r.decided - r.agreed - r.explained for r in rows)
    return f"{agreed} of {decided} boards agree, {bare} differ without explanation"


def write(folder: Path, rows: Sequence[Row], found: Sequence[Difference], seconds: float) -> None:
    """agreement.{md,json,svg,png} in a folder."""
    text = report(rows, found, seconds)
    print(text)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "agreement.md").write_text(text, encoding="utf-8")
    data = {
        "format": 1,
        "commit": commit(),
        "machine": machine(),
        "seed": SEED,
        "rows": [
            {**asdict(r), "rate": r.rate, "low": r.interval[0], "high": r.interval[1]} for r in rows
        ],
        "differences": [asdict(d) for d in found],
        "cost": {"seconds": seconds},
    }
    (folder / "agreement.json").write_text(dumps(data), encoding="utf-8")
    figure = plot(rows)
    with mpl.rc_context({"svg.hashsalt": "agreement", "svg.fonttype": "none"}):
        figure.savefig(folder / "agreement.svg", metadata={"Date": None})
    figure.savefig(folder / "agreement.png", dpi=130)


if __name__ == "__main__":
    print(main())
