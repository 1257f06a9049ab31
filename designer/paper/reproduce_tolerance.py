"""``designer reproduce tolerance``: yields of the paper's circuit, corrected and rebuilt.

For the paper's circuit as printed, corrected, and with the rectifier stage on the op-amps' full
range: resistors of 5 %, 1 % and 0.1 %, capacitors of 5 % and 1 %, offsets on and off; each 1-p-p
response as built, tuned (within the bands, and by the bench procedure) and reached; and the blame
in the case of 1 % parts with offsets. Every case is on disk as soon as it is done.
"""

from __future__ import annotations

import hashlib
import io
import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from designer.base.atomic_write import write
from designer.base.defaults import at_least, cores
from designer.base.progress import Progress
from designer.base.report_pieces import CaseStore
from designer.catalog.catalog import load_catalog
from designer.jobs.origin import provenance
from designer.model.tuning_bands import Bands
from designer.paper.tolerance_cases import OMEGA, TITLES, SpreadCase, cases, model_file
from designer.paper.tolerance_rows import YieldRow
from designer.yields import exact_rung
from designer.yields.blame_analysis import blame
from designer.yields.power_up_yield import reached_block
from designer.yields.start_recipe_search import find_recipes
from designer.yields.study_identity import study_hash
from designer.yields.tuned_yield import tuned_block
from designer.yields.verdict import Answer, StudyPlan, Verdict

FORMAT = 1
SAMPLES, SEED = 250, 20260
SHORT = 25
"""Boards that are tuned and powered up, at most: a board costs some hundred settings."""
FILES = ("tolerance.json", "tolerance.parquet", "yields.png", "README.md")
"""What is made of the cases."""
KINDS = ("as built", "tuned", "tuned on the bench", "reached")
Say = Callable[[], None]


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
    said = Progress() if progress is None else progress
    jobs = cores() if jobs is None else jobs
    for name, value, least in (("--samples", samples, 1), ("--seed", seed, 0), ("--jobs", jobs, 1)):
        at_least(name, value, least)
    store = CaseStore(out, FILES, resume=resume, note=said.note)
    catalog = load_catalog()
    said.stage("nominal circuits")
    asked = {
        case.name: case
        for case in cases(catalog, samples=samples, seed=seed)
        if only is None or case.name in only
    }
    store.expect({name: _key(case, short, catalog.hash) for name, case in asked.items()})
    found = [
        store.piece(name, partial(_case, case, min(short, samples), jobs, said))
        for name, case in asked.items()
    ]
    rows = tuple(YieldRow(**row) for known in found for row in known["rows"])
    settings = {"samples": samples, "short": min(short, samples), "bands": Bands().as_dict()}
    source = provenance(model_file(), catalog.hash, seed=seed, settings=settings)
    for name, content in _files(found, rows, source, samples, seed).items():
        write(out / name, content)
    return rows


def _case(case: SpreadCase, short: int, jobs: int, said: Progress) -> dict[str, Any]:
    """Everything about one case, as plain data."""
    began, plan = time.perf_counter(), case.plan
    number = len(plan.questions)
    step = said.stage(f"{case.name}: as built", plan.samples * number)
    answers = exact_rung.block(plan, range(plan.samples), jobs, step)
    some = [a for a in answers if a.sample < short]
    step = said.stage(f"{case.name}: tuned", short * number)
    tuned = tuned_block(plan, range(short), some, Bands(), jobs, step)
    step = said.stage(f"{case.name}: reached", short * number)
    recipes = find_recipes(plan, jobs)
    reached = reached_block(plan, range(short), recipes, jobs, step)
    kinds: dict[str, list[tuple[int, Verdict]]] = {
        "as built": [(a.question, a.verdict) for a in answers],
        "tuned": [(t.question, t.verdict) for t in tuned],
        "tuned on the bench": [(t.question, t.bench_verdict) for t in tuned],
        "reached": [(r.question, r.verdict) for r in reached],
    }
    rows = [_row(case, p, kind, judged) for kind, judged in kinds.items() for p in OMEGA]
    out: dict[str, Any] = {
        "format": FORMAT,
        "circuit": case.circuit,
        "case": case.name,
        "missing": {f"1-{p}-{p}": instead for p, instead in case.missing.items()},
        "recipes": {f"1-{p}-{p}": r.text for p, r in zip(case.asked, recipes, strict=True)},
        "rows": [dict(row.__dict__) for row in rows],
        "blame": _blame(plan, answers, jobs, said) if case.reference else None,
    }
    return {**out, "cost": {"seconds": time.perf_counter() - began}}


def _row(case: SpreadCase, p: int, kind: str, judged: Iterable[tuple[int, Verdict]]) -> YieldRow:
    tally = dict.fromkeys(Verdict, 0)
    there = p in case.asked
    if there:
        number = case.asked.index(p)
        for question, verdict in judged:
            tally[verdict] += question == number
    counts = (tally[v] for v in (Verdict.OK, Verdict.LOST, Verdict.GRAZING, Verdict.FAILED))
    return YieldRow(
        case.circuit, case.resistor, case.capacitor, case.offsets, f"1-{p}-{p}", OMEGA[p], kind,
        there, *counts,
    )  # fmt: skip


def _blame(plan: StudyPlan, answers: list[Answer], jobs: int, said: Progress) -> dict[str, Any]:
    return blame(plan, answers, jobs=jobs, progress=said.stage("blame")).as_dict()


def _files(
    found: Sequence[Mapping[str, Any]],
    rows: Sequence[YieldRow],
    source: Mapping[str, Any],
    samples: int,
    seed: int,
) -> dict[str, bytes]:
    """The report from its cases: content by file name."""
    from designer.base.figure_style import to_png  # Matplotlib takes a while to import
    from designer.paper.tolerance_page import readme, yield_sheet

    picture, table = io.BytesIO(), io.BytesIO()
    to_png(yield_sheet(rows), picture)
    _parquet(rows, table)
    cost = sum(known["cost"]["seconds"] for known in found)
    document = {
        "format": FORMAT,
        "provenance": dict(source),
        "rows": [_with_interval(row) for row in rows],
        "recipes": {known["case"]: known["recipes"] for known in found},
        "missing": {known["case"]: known["missing"] for known in found if known["missing"]},
        "blame": {known["circuit"]: known["blame"] for known in found if known["blame"]},
        "cost": {"seconds": cost},
    }
    text = readme(rows, document, samples=samples, seed=seed)
    contents = (_json(document), table.getvalue(), picture.getvalue(), text.encode("utf-8"))
    return dict(zip(FILES, contents, strict=True))


def _with_interval(row: YieldRow) -> dict[str, Any]:
    low, high = row.counted.interval if row.there else (0.0, 0.0)
    return {**row.__dict__, "title": TITLES[row.circuit], "low": low, "high": high}


def _parquet(rows: Sequence[YieldRow], stream: io.BytesIO) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {name: [getattr(r, name) for r in rows] for name in YieldRow.__annotations__}
    pq.write_table(pa.table(columns), stream)


def _key(case: SpreadCase, short: int, catalog_hash: str) -> str:
    """Hash of what decides the case's result."""
    plan = case.plan
    layers = [study_hash(plan, layer) for layer in ("samples", "tuned", "reached")]
    said = json.dumps([FORMAT, layers, plan.samples, short, Bands().as_dict(), catalog_hash])
    return hashlib.sha256(said.encode("ascii")).hexdigest()


def _json(value: Mapping[str, Any]) -> bytes:
    text = json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False)
    return f"{text}\n".encode()
