"""``designer reproduce tolerance``: yields of the paper's circuit, corrected and rebuilt.

For the paper's circuit as printed, corrected, and with the rectifier stage on the op-amps' full
range: resistors of 5 %, 1 % and 0.1 %, capacitors of 5 % and 1 %, offsets on and off; each 1-p-p
response as built, tuned (within the bands, and by the bench procedure) and reached; and the
attribution in the case of 1 % parts with offsets. Every case is on disk as soon as it is done.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from designer.base import progress
from designer.base.arrays import Array
from designer.base.atomic_write import write
from designer.base.defaults import check_count, check_seed, cores
from designer.base.figure_style import INK, MUTED, new_figure, number_cells, styled
from designer.base.page import Block, Page, PageSection, Picture, bullets, table
from designer.base.proportion import wilson
from designer.base.report_pieces import CaseStore
from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.check.synthesis_result import synthesise
from designer.circuit import paper_values
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit
from designer.folders.origin import provenance
from designer.model.find_responses import ModelResponse, find
from designer.model.model_file import ModelFile
from designer.model.tuning_bands import Bands
from designer.paper.circuits import CORRECTED, OMEGA, PRINTED, RECTIFIER, build, model_file
from designer.paper.report_files import README, write_files
from designer.spread.spread import Spread
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import Question, StudyPlan, Verdict, judge
from designer.yields.loss_attribution import attribute
from designer.yields.power_up import power_up_block
from designer.yields.setting_search import MOST_TRIES
from designer.yields.start_recipe_search import find_recipes
from designer.yields.study_identity import study_hash
from designer.yields.tuned_yield import tuned_block
from designer.yields.yield_count import Yield

RESISTORS = (0.05, 0.01, 0.001)
CAPACITORS = (0.05, 0.01)
REFERENCE = (0.01, 0.01, True)
"""Grades and offsets of the case whose attribution is worked out."""
TITLES = {
    PRINTED: "paper, as printed",
    CORRECTED: "paper, corrected",
    RECTIFIER: "rectifier stage",
}


@dataclass(frozen=True)
class SpreadCase:
    """A circuit under a spread."""

    circuit: str
    resistor: float
    """Grade of the resistors, a fraction."""
    capacitor: float
    """Grade of the capacitors, a fraction."""
    offsets: bool
    """Whether the op-amps have offsets."""
    plan: StudyPlan
    """What decides the samples, with the responses that the nominal circuit shows."""
    asked: tuple[int, ...]
    """p of the response of each question."""
    missing: dict[int, str]
    """What the nominal circuit shows instead of the wanted response, by p."""

    @property
    def name(self) -> str:
        """ "printed-r1-c5-offsets": grades in per cent."""
        ending = "offsets" if self.offsets else "level"
        return f"{self.circuit}-r{100 * self.resistor:g}-c{100 * self.capacitor:g}-{ending}"

    @property
    def reference(self) -> bool:
        """Whether it is the case whose attribution is worked out."""
        return (self.resistor, self.capacitor, self.offsets) == REFERENCE


@dataclass(frozen=True)
class YieldRow:
    """The yield of one response in one case."""

    circuit: str
    resistor: float
    """Grade of the resistors, a fraction."""
    capacitor: float
    """Grade of the capacitors, a fraction."""
    offsets: bool
    """Whether the op-amps have offsets."""
    expect: str
    """The wanted response, such as "1-3-3"."""
    omega: float
    """Dimensionless frequency."""
    kind: str
    """Kind of the yield, such as "as built"."""
    there: bool
    """Whether the nominal circuit shows it; where it does not every count is 0."""
    ok: int
    """Boards that keep the response."""
    lost: int
    """Boards that lose the response."""
    grazing: int
    """Boards whose count of impacts is undecided."""
    failed: int
    """Boards without an answer."""

    @property
    def counted(self) -> Yield:
        return Yield(self.ok, self.lost, self.grazing, self.failed)

    @property
    def spread(self) -> tuple[float, float, bool]:
        """Grade of the resistors and of the capacitors, and whether there are offsets."""
        return (self.resistor, self.capacitor, self.offsets)


def cases(catalog: Catalog, *, samples: int, seed: int) -> Iterator[SpreadCase]:
    """Every case, the reference case of each circuit first."""
    modelfile = model_file()
    wanted = find(modelfile.model, modelfile.responses)
    opamp = catalog.opamp(paper_values.OPAMP)
    grades = [(r, c, o) for o in (True, False) for r in RESISTORS for c in CAPACITORS]
    grades.sort(key=lambda g: g != REFERENCE)
    circuits = list(_circuits(modelfile, wanted, catalog))
    for resistor, capacitor, offsets in grades:
        spread = Spread.bench_1(opamp, resistor, capacitor)
        if not offsets:
            spread = replace(spread, offset_sigma=0.0, offset_limit=0.0)
        for name, circuit, questions, missing in circuits:
            plan = StudyPlan(circuit, spread, seed, samples, tuple(questions.values()))
            yield SpreadCase(name, resistor, capacitor, offsets, plan, tuple(questions), missing)


def _circuits(
    modelfile: ModelFile, wanted: tuple[ModelResponse, ...], catalog: Catalog
) -> Iterator[tuple[str, Circuit, dict[int, Question], dict[int, str]]]:
    for name in (PRINTED, CORRECTED):
        one = build(name, catalog)
        settings = [one.excitation(r.omega) for r in wanted]
        yield name, one.circuit, *_questions(one.circuit, one.volts, settings, wanted)
    design = synthesise(modelfile, catalog).design
    settings = [design.excitation(r.b, r.omega) for r in wanted]
    yield RECTIFIER, design.circuit, *_questions(design.circuit, design.volts(), settings, wanted)


def _questions(
    circuit: Circuit,
    volts: Array,
    settings: list[Excitation],
    wanted: tuple[ModelResponse, ...],
) -> tuple[dict[int, Question], dict[int, str]]:
    """The questions that can be asked, by p, and what stands in the place of the others."""
    system = Reduction(circuit, nominal_board(circuit)).system()
    questions: dict[int, Question] = {}
    missing: dict[int, str] = {}
    for p, response, excitation in zip(OMEGA, wanted, settings, strict=True):
        orbit: Orbit = settle(Flow(system, excitation.drive), response.orbit.start * volts)
        if judge(orbit, response.spec, orbit)[0] is Verdict.OK:
            questions[p] = Question(response.spec, excitation, orbit, None)
        else:
            missing[p] = orbit.response
    return questions, missing


FORMAT = 1
SAMPLES, SEED = 250, 20260
SHORT = 25
"""Boards that are tuned and powered up, at most: a board costs some hundred settings."""
DATA, FRAME = "tolerance.json", "tolerance.parquet"
FILES = (DATA, FRAME, "yields.png", README)
KINDS = ("as built", "tuned", "tuned on the bench", "reached")


def reproduce(
    out: Path,
    *,
    samples: int = SAMPLES,
    seed: int = SEED,
    jobs: int | None = None,
    resume: bool = False,
    only: Sequence[str] | None = None,
    short: int = SHORT,
) -> tuple[YieldRow, ...]:
    """Make the report in the folder ``out``.

    samples : boards of each case as built; of these the first ``short`` are tuned and powered up.
    resume : go on with what is there, as long as it was made with the same settings; a file of the
    report is replaced only beside a case that it was made of. only : names of cases, for a part of
    the report.

    Raises
    ------
    InputError : results, or files that go by their names, are there already; results of other
        settings; a number that cannot be.
    """
    jobs = cores() if jobs is None else jobs
    for name, value in (("--samples", samples), ("--jobs", jobs)):
        check_count(name, value, 1)
    check_seed(seed)
    store = CaseStore(out, FILES, resume=resume, note=progress.note)
    catalog = load_catalog()
    progress.stage("nominal circuits")
    asked = {
        case.name: case
        for case in cases(catalog, samples=samples, seed=seed)
        if only is None or case.name in only
    }
    store.expect({name: _key(case, short, catalog.hash) for name, case in asked.items()})
    short = min(short, samples)
    pieces = [store.piece(name, partial(_case, case, short, jobs)) for name, case in asked.items()]
    rows = tuple(YieldRow(**row) for piece in pieces for row in piece["rows"])
    settings = {"samples": samples, "short": short, "bands": Bands().as_dict()}
    source = provenance(model_file(), catalog.hash, seed=seed, settings=settings)
    document = {"format": FORMAT, "provenance": source, **_answers(pieces, rows)}
    page = tolerance_page(rows, document["blame"], samples=samples, short=short, seed=seed)
    write_files(out, (DATA, document), page, {"yields": yield_sheet(rows)})
    write(out / FRAME, pd.DataFrame([asdict(row) for row in rows]).to_parquet(index=False))
    return rows


def _answers(pieces: Sequence[dict[str, Any]], rows: Sequence[YieldRow]) -> dict[str, Any]:
    """What the data file says of all cases."""
    return {
        "rows": [_with_interval(row) for row in rows],
        "recipes": {piece["case"]: piece["recipes"] for piece in pieces},
        "missing": {piece["case"]: piece["missing"] for piece in pieces if piece["missing"]},
        "blame": {piece["circuit"]: piece["blame"] for piece in pieces if piece["blame"]},
        "cost": {"seconds": sum(piece["cost"]["seconds"] for piece in pieces)},
    }


def _case(case: SpreadCase, short: int, jobs: int) -> dict[str, Any]:
    """Everything about one case, as plain data."""
    began, plan = time.perf_counter(), case.plan
    number = len(plan.questions)
    step = progress.stage(f"{case.name}: as built", plan.samples * number)
    answers = exact_circuit.block(plan, range(plan.samples), jobs, step)
    some = [a for a in answers if a.sample < short]
    step = progress.stage(f"{case.name}: tuned", short * number)
    tuned = tuned_block(plan, range(short), some, Bands(), jobs, step)
    step = progress.stage(f"{case.name}: reached", short * number)
    recipes = find_recipes(plan, jobs)
    reached = power_up_block(plan, range(short), recipes, jobs, step)
    judged = {
        "as built": Counter((a.question, a.verdict) for a in answers),
        "tuned": Counter((t.question, t.verdict) for t in tuned),
        "tuned on the bench": Counter((t.question, t.bench_verdict) for t in tuned),
        "reached": Counter((r.question, r.verdict) for r in reached),
    }
    rows = [_row(case, p, kind, judged[kind]) for kind in KINDS for p in OMEGA]
    attributed = None
    if case.reference:
        step = progress.stage("blame")
        attributed = attribute(plan, answers, jobs=jobs, progress=step).as_dict()
    return {
        "format": FORMAT,
        "circuit": case.circuit,
        "case": case.name,
        "missing": {f"1-{p}-{p}": instead for p, instead in case.missing.items()},
        "recipes": {f"1-{p}-{p}": r.text for p, r in zip(case.asked, recipes, strict=True)},
        "rows": [asdict(row) for row in rows],
        "blame": attributed,
        "cost": {"seconds": time.perf_counter() - began},
    }


def _row(case: SpreadCase, p: int, kind: str, judged: Counter[tuple[int, Verdict]]) -> YieldRow:
    """The counts of one response; all 0 where the nominal circuit does not show it."""
    there = p in case.asked
    question = case.asked.index(p) if there else -1
    verdicts = (Verdict.OK, Verdict.LOST, Verdict.GRAZING, Verdict.FAILED)
    return YieldRow(
        case.circuit, case.resistor, case.capacitor, case.offsets, f"1-{p}-{p}", OMEGA[p], kind,
        there, *(judged[question, verdict] for verdict in verdicts),
    )  # fmt: skip


def _with_interval(row: YieldRow) -> dict[str, Any]:
    low, high = row.counted.interval if row.there else (0.0, 0.0)
    return {**asdict(row), "title": TITLES[row.circuit], "low": low, "high": high}


def _key(case: SpreadCase, short: int, catalog_hash: str) -> str:
    """Hash of what decides the case's result."""
    plan = case.plan
    layers = [study_hash(plan, layer) for layer in ("samples", "tuned", "reached")]
    text = json.dumps([FORMAT, layers, plan.samples, short, Bands().as_dict(), catalog_hash])
    return hashlib.sha256(text.encode("ascii")).hexdigest()


SHOWN = ("as built", "tuned", "reached")
"""Kinds of yield in the sheet."""
GROUPS_SHOWN = 3
RESPONSES = [f"1-{p}-{p}" for p in OMEGA]


@styled
def yield_sheet(rows: Sequence[YieldRow]) -> Figure:
    """Yield in per cent: a column of panels for each circuit, a row for each kind of yield."""
    circuits = [c for c in TITLES if any(r.circuit == c for r in rows)]
    spreads = _spreads(rows)
    figure = new_figure(1.3 + 3.1 * len(circuits), 0.7 + 3 * (0.19 * len(spreads) + 0.55))
    grid = figure.subplots(3, len(circuits), squeeze=False, sharex=True, sharey=True)
    image = None
    for i, kind in enumerate(SHOWN):
        for j, circuit in enumerate(circuits):
            chosen = [r for r in rows if (r.circuit, r.kind) == (circuit, kind)]
            image = _panel(grid[i, j], chosen, spreads)
            if i == 0:
                grid[i, j].set_title(TITLES[circuit], color=INK, size=9)
        grid[i, 0].set_ylabel(kind, color=INK, size=9)
    if image is not None:
        bar = figure.colorbar(image, ax=grid, pad=0.01, fraction=0.02)
        bar.set_label("yield [%]; ×: the nominal circuit does not show it")
    figure.supxlabel(
        "p of the response 1-p-p; rows: grade of resistors / capacitors, offsets on or off",
        size=8.5,
    )
    return figure


def _panel(
    axes: Axes, rows: Sequence[YieldRow], spreads: Sequence[tuple[float, float, bool]]
) -> AxesImage:
    values = np.full((len(spreads), len(OMEGA)), np.nan)
    for row in rows:
        if row.there:
            place = spreads.index(row.spread), RESPONSES.index(row.expect)
            values[place] = 100.0 * row.counted.rate
    image = axes.imshow(values, cmap="cividis", vmin=0.0, vmax=100.0, aspect="auto")
    axes.set_facecolor("#d9d9d9")
    number_cells(axes, values, size=6)
    for i, j in np.argwhere(~np.isfinite(values)):
        axes.text(j, i, "×", ha="center", va="center", color=MUTED, size=6)
    names = [f"{100 * r:g} / {100 * c:g} %, {'on' if on else 'off'}" for r, c, on in spreads]
    axes.set_yticks(range(len(spreads)), names, size=6.5, color=INK)
    axes.set_xticks(range(len(OMEGA)), [str(p) for p in OMEGA], color=INK)
    axes.tick_params(length=0, labelbottom=True)
    return image


def tolerance_page(
    rows: Sequence[YieldRow], attribution: Mapping[str, Any], *, samples: int, short: int, seed: int
) -> Page:
    """``README.md``. attribution : of the reference cases, by circuit, as JSON has it. short :
    boards that were tuned and powered up."""
    head: list[Block] = [
        Markup(
            f"Made by `designer reproduce tolerance --samples {samples} --seed {seed}`. The data "
            "are in `tolerance.json` and `tolerance.parquet`, case by case in `cases/`."
        ),
        Markup(
            "Three circuits for the paper's model (b = 0.25): its values as printed, driven as "
            "printed; the same corrected (R50, R204, amplitude, frequency; see docs/errata.md); "
            "and a design of this tool with the rectifier stage, whose voltages use the op-amps' "
            "range. All with the TL074C, under the spread `bench-1` (docs/definitions.md) with "
            "the grades named, and with input offsets as in `bench-1` or without."
        ),
        f"Per cent of boards that show each 1-p-p: as built ({samples} boards), tuned within the "
        f"bands (a setting that works was found among at most {MOST_TRIES} tries: a lower bound), "
        f"tuned by the bench procedure, and reached by the start recipe ({short} boards "
        "each). × stands where the nominal circuit does not show the response. Intervals (95 %, "
        f"Wilson) are in the data; at {samples} boards they are at most ± {_half_width(samples)} "
        f"points wide, at {short} boards ± {_half_width(short)}.",
        Picture("yields", file="yields.png"),
    ]
    sections = []
    for circuit, title in TITLES.items():
        mine = [r for r in rows if r.circuit == circuit]
        if mine:
            blocks = [_table(mine), *_limits(attribution.get(circuit), mine)]
            sections.append(PageSection(title.capitalize(), blocks))
    return Page("Tolerance of the paper's circuit", head, sections)


def _table(rows: Sequence[YieldRow]) -> Block:
    known = {(r.spread, r.kind, r.expect): r for r in rows}
    lines = [
        (
            f"{100 * spread[0]:g} %",
            f"{100 * spread[1]:g} %",
            "on" if spread[2] else "off",
            kind,
            *(_cell(known.get((spread, kind, expect))) for expect in RESPONSES),
        )
        for spread in _spreads(rows)
        for kind in dict.fromkeys(r.kind for r in rows)
    ]
    return table(("R", "C", "offsets", "yield", *RESPONSES), lines)


def _cell(row: YieldRow | None) -> str:
    if row is None or not row.there:
        return "×"
    rate = row.counted.rate
    text = f"{100 * rate:.0f}" if np.isfinite(rate) else "–"
    return text + (f" ({row.failed} failed)" if row.failed else "")


def _limits(attribution: Mapping[str, Any] | None, rows: Sequence[YieldRow]) -> list[Block]:
    """What limits each response in the reference case."""
    if attribution is None:
        return []
    asked = [e for e in RESPONSES if any(r.expect == e and r.there for r in rows)]
    lines = []
    for attributed in attribution["responses"]:
        p = attributed["prediction"]
        decided = p["ok"] + p["lost"]
        groups = [s for s in attributed["subjects"] if s["kind"] == "group"][:GROUPS_SHOWN]
        avoided = ", ".join(f"{s['name']} {s['avoided']} of {s['replayed']}" for s in groups)
        line = f"**{asked[attributed['question']]}**: {attributed['limited_by']}."
        line += f" Losses avoided if exact: {avoided}." if avoided else ""
        line += f" The margin foretells {p['right']} of {decided} verdicts." if decided else ""
        lines.append(Markup(line))
    r, c, _ = REFERENCE
    note = f"What limits it, with {100 * r:g} % resistors, {100 * c:g} % capacitors and offsets:"
    return [note, bullets(lines)]


def _half_width(samples: int) -> str:
    """The half width of Wilson's interval at one half, in points."""
    low, high = wilson(0.5 * samples, samples)
    return f"{50.0 * (high - low):.1f}"


def _spreads(rows: Sequence[YieldRow]) -> list[tuple[float, float, bool]]:
    return sorted({r.spread for r in rows}, key=lambda s: (not s[2], -s[0], -s[1]))
