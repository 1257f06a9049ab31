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
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from designer.base.atomic_write import write
from designer.base.defaults import check_count, check_seed, cores
from designer.base.progress import Progress
from designer.base.report_pieces import CaseStore
from designer.catalog.parts_catalog import load_catalog
from designer.folders.origin import provenance
from designer.model.tuning_bands import Bands
from designer.paper.circuits import OMEGA, model_file
from designer.paper.report_files import README, write_files
from designer.paper.tolerance_cases import TITLES, SpreadCase, YieldRow, cases
from designer.paper.tolerance_page import tolerance_page, yield_sheet
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import Verdict
from designer.yields.loss_attribution import attribute
from designer.yields.power_up import power_up_block
from designer.yields.start_recipe_search import find_recipes
from designer.yields.study_identity import study_hash
from designer.yields.tuned_yield import tuned_block

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
    progress: Progress | None = None,
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
    progress = Progress() if progress is None else progress
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
    pieces = [
        store.piece(name, partial(_case, case, short, jobs, progress))
        for name, case in asked.items()
    ]
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


def _case(case: SpreadCase, short: int, jobs: int, progress: Progress) -> dict[str, Any]:
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
