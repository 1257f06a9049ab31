"""The report on the design that a search finds, beside the paper's circuits.

    python -m reports.makers.robust_design reports/robust-design

A search of ``examples/robust.toml`` (every place free) and one at the model's own clearance (ω
free), the paper's circuit as printed and as corrected, and the rectifier stage by the match alone:
yields as built on fresh boards, tuned and reached for what was searched, attribution, what limits
each response, price and parts, and what every lever is worth. Each case is on disk when it is done.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from designer.base.defaults import cores
from designer.base.design_folder import Folder
from designer.base.manifest import read_json
from designer.base.plain_json import dumps, plain
from designer.base.progress import note, stage
from designer.base.report_pieces import CaseStore
from designer.base.toml_reader import parse_toml
from designer.base.toml_writer import toml_text
from designer.base.version import __version__
from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.centering.limiting_parts import limitings
from designer.check import checked_design
from designer.check.synthesis_result import Synthesis
from designer.folders.design_files import load
from designer.folders.origin import provenance
from designer.folders.study_stores import FolderStores
from designer.jobs.options import Options
from designer.jobs.search_job import search_into
from designer.jobs.search_stage import RULES as SEARCH_RULES
from designer.model.circuit_table import CircuitSpec
from designer.model.model_file import ModelFile, parse_model_file, read_model_file
from designer.paper.circuits import model_file
from designer.paper.report_files import README, write_files
from designer.paper.reproduce_tolerance import TITLES, cases
from designer.report import comparison
from designer.verbs.search import VERB
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import StudyPlan
from designer.yields import study_identity
from designer.yields.loss_attribution import attribute
from designer.yields.study import Study
from designer.yields.study_plan import plan_study
from designer.yields.tolerance_study import tolerance
from designer.yields.yield_count import Yield, all_on_one, count
from reports.makers.make_report import make_report
from reports.makers.robust_design_page import lever_chart, robust_design_page, yield_chart

FORMAT = 1
MODEL = Path("examples/robust.toml")
SAMPLES, SHORT, SEED = 4000, 500, 71
"""Boards as built; boards that are tuned and powered up, at first; of the boards that count."""
TARGET, MORE = 0.99, 4
"""Yield that tuned and reached boards are to have; where the interval of a response has this
inside, so many times the boards are asked, once."""
OTHERS, ATTRIBUTED = 500, 250
"""Boards at most of the paper's circuits, where most settle slowly; boards behind an
attribution."""
FREE, NOMINAL = "searched", "searched, nominal b"
DATA = "robust-design.json"
FILES = (DATA, "yields.png", "yields.svg", "levers.png", "levers.svg", README)


def report(
    out: Path,
    *,
    model: Path = MODEL,
    samples: int = SAMPLES,
    short: int = SHORT,
    seed: int = SEED,
    jobs: int | None = None,
) -> dict[str, Any]:
    """Make the report in the folder ``out``; finished cases that are there are not made again.

    Raises
    ------
    InputError, Unreachable, EnvironmentMissing : as of a search.
    """
    jobs = cores() if jobs is None else jobs
    catalog, file = load_catalog(), read_model_file(model)
    options = Options(seed, jobs, samples, resume=True)
    rules = [__version__, SEARCH_RULES, study_identity.RULES]
    settings = plain([FORMAT, rules, file.sha256, catalog.hash, samples, short, seed])
    store = CaseStore(out, FILES, resume=True, place="out", note=note)
    store.expect(dumps(settings, indent=None))

    def case(name: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        slug = name.replace(", ", "-").replace(" ", "-")
        return store.piece(slug, lambda: plain({"name": name, **make()}))

    def searched(name: str, asked: ModelFile, *, tuned: bool) -> dict[str, Any]:
        place = out / name
        command = partial(VERB.command, model=model, out=place)
        outcome = search_into(asked, place, options, command)
        row = _searched(_load(place, catalog), place, options, short, tuned=tuned)
        return {**row, "confirmation": outcome.answer["confirmation"]}

    def nominal() -> dict[str, Any]:
        fixed = parse_model_file(at_model_clearance(file), out / "nominal.toml")
        return searched("nominal", fixed, tuned=True)

    pieces = []
    for other in cases(catalog, samples=min(samples, OTHERS), seed=seed):
        if other.reference:
            spec = model_file().circuit
            title = TITLES[other.circuit]
            make = partial(_as_built, other.plan, spec, catalog, jobs)
            pieces.append(case(title, make))
    free = partial(searched, "free", file, tuned=False)
    pieces += [case(FREE, free), case(NOMINAL, nominal)]
    numbers = {"samples": samples, "short": short}
    source = provenance(file, catalog.hash, seed=seed, settings=numbers)
    document = {"format": FORMAT, "cases": pieces, "provenance": source}
    command = (
        "python -m reports.makers.robust_design reports/robust-design "
        f"--samples {samples} --short {short} --seed {seed}"
    )
    page = robust_design_page(pieces, command, model.name)
    figures = {"yields": yield_chart(pieces), "levers": lever_chart(pieces)}
    write_files(out, (DATA, document), page, figures, ("png", "svg"))
    return document


def at_model_clearance(file: ModelFile) -> str:
    """The text of the model file with every response at the model's own clearance."""
    data = parse_toml(file.text, None)
    for response in data["response"]:
        response.pop("b", None)
    data["title"] = f"{file.title}, nominal b"
    return toml_text(data)


def _load(folder: Path, catalog: Catalog) -> Synthesis:
    return load(Folder(folder), read_model_file(folder / "model.toml"), catalog)


def _searched(
    synthesis: Synthesis,
    place: Path,
    options: Options,
    short: int,
    *,
    tuned: bool,
) -> dict[str, Any]:
    """A searched design: as built on all boards, reached (and tuned) on some."""
    checked = checked_design.check(synthesis.design, synthesis.model_responses, None)
    jobs = cores() if options.jobs is None else options.jobs
    asked = [c for c in checked if c.model.found]
    plan = plan_study(
        synthesis.modelfile,
        synthesis.design,
        asked,
        synthesis.catalog,
        samples=options.samples,
        seed=options.seed,
    )
    row = _as_built(plan, synthesis.modelfile.circuit, synthesis.catalog, jobs)
    powered = place / "powered-up"
    powered.mkdir(exist_ok=True)
    for boards in (short, MORE * short):
        study = tolerance(
            synthesis,
            samples=boards,
            fidelity="exact",
            tuned=tuned,
            reached=True,
            attributed=False,
            seed=options.seed,
            jobs=jobs,
            checked=checked,
            stores=FolderStores(powered, lambda: None, note),
        )
        if _decided(study, len(checked)):
            break
    for name, rows in (("reached", study.power_ups), ("tuned", study.tuned)):
        whole = study.on_one_board(rows)
        row["all_on_one"][name] = None if whole is None else _counted(whole)
        for i in range(len(checked) if rows is not None else 0):
            row["responses"][i][name] = _counted(count(study.rows_of(i, rows)))
    for i in range(len(checked)):
        row["responses"][i]["b"] = synthesis.model_responses[i].b
    search = read_json(place / "search.json")
    keys = ("choice", "start", "final", "contributions", "designs_tried", "places_tried", "cost")
    return {**row, "search": {key: search[key] for key in keys}}


def _decided(study: Study, responses: int) -> bool:
    """Whether the intervals of tuned and power-up yields have the target outside, all of them."""
    counted: list[Yield | None] = []
    for rows in (study.power_ups, study.tuned):
        if rows is not None:
            counted += [count(study.rows_of(i, rows)) for i in range(responses)]
            counted.append(study.on_one_board(rows))
    intervals = [one.interval for one in counted if one is not None]
    return not any(low <= TARGET <= high for low, high in intervals)


def _as_built(plan: StudyPlan, spec: CircuitSpec, catalog: Catalog, jobs: int) -> dict[str, Any]:
    """Yields, attribution, limits, price and parts of a circuit."""
    step = stage("boards as built", plan.samples * len(plan.questions))
    answers = exact_circuit.block(plan, range(plan.samples), jobs, step)
    some = replace(plan, samples=min(plan.samples, ATTRIBUTED))
    first = answers[: some.samples * len(plan.questions)]
    attributed = attribute(some, first, jobs=jobs, progress=stage("blame")).responses
    limits = limitings(some, first, jobs=jobs, progress=stage("limits"))
    rows = []
    for k, question in enumerate(plan.questions):
        counted = count([a for a in answers if a.question == k])
        rows.append(
            {
                "expect": str(question.spec.expect),
                "omega": question.spec.omega,
                "as built": _counted(counted),
                "blame": attributed[k].limited_by,
                "limited_by": limits[k].line,
            }
        )
    return {
        "responses": rows,
        "all_on_one": {"as built": _counted(all_on_one(answers))},
        "bill": dict(comparison.bill_of(plan.circuit, spec, catalog).__dict__),
        "parts": plan.circuit.values,
    }


def _counted(counted: Yield) -> dict[str, Any]:
    low, high = counted.interval
    return {**counted.__dict__, "rate": counted.rate, "low": low, "high": high}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m reports.makers.robust_design")
    parser.add_argument("out", type=Path)
    parser.add_argument("--model", type=Path, default=MODEL)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--short", type=int, default=SHORT)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--jobs", type=int)
    return make_report(report, parser, arguments)


if __name__ == "__main__":
    sys.exit(main())
