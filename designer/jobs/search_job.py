"""The search of a design folder: what is done, in which order it is written, what is reused.

A found design is written as any other: ``model.toml`` is the model file with everything filled in,
``asked.toml`` the one that was given. Nothing here prints; ``cli.search`` does.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

from designer.base.defaults import SEARCH_SAMPLES, SEED, cores
from designer.base.design_folder import DESIGN, DESIGN_FILES, MODEL, TOLERANCE, Folder
from designer.base.errors import MISSING, InputError
from designer.base.manifest import MANIFEST, StageName
from designer.base.plain_json import dumps
from designer.base.progress import Progress
from designer.base.version import __version__
from designer.catalog.catalog import Catalog, load_catalog
from designer.centering.design_search import look, search as design_search
from designer.centering.memory import Memory
from designer.centering.ngspice_check import LEVELS, RUNG, Listener
from designer.centering.resolved_file import resolved
from designer.centering.result_json import confirmation_json, search_json
from designer.check.synthesis_result import Synthesis
from designer.circuit import nominal
from designer.jobs import design_files, folder_numbers, rung_choice, synthesise_job
from designer.jobs.json_answers import run_json
from designer.jobs.options import Options
from designer.jobs.origin import provenance
from designer.jobs.rung_choice import LEAST, SEARCH
from designer.jobs.study_folder import FolderStores
from designer.jobs.study_job import run_into
from designer.jobs.study_stage import SPICE_TIMEOUT
from designer.jobs.synthesise_job import (
    JobOutcome,
    design_inputs,
    grade_inputs,
    made_from,
    model_file,
)
from designer.model.model_file import ModelFile, naming
from designer.spice import numerics_gate
from designer.spice.batch_backend import program_version
from designer.spice.numerics_gate import GateSubject
from designer.spice.pool import SpicePool, require_ngspice
from designer.yields import ngspice_runs
from designer.yields.limiting_parts import limitings
from designer.yields.ngspice_sampling import Ask, StartKind, Why
from designer.yields.study_layers import RungName
from designer.yields.tolerance_study import check, tolerance
from designer.yields.verdict import Answer, Verdict

ASKED, CANDIDATES = "asked.toml", "candidates.jsonl"
FILES = [ASKED, SEARCH, CANDIDATES]
CONFIRMATION = "confirmation.json"
DIFFERING = 0.05
"""Share of the confirming boards that may differ, or have no answer."""
RULES = 5
"""Number of the rules by which a search goes; whoever changes what it finds raises it."""


def chosen(modelfile: ModelFile, out: Path, options: Options, progress: Progress) -> ModelFile:
    """The model file that a verb is to work with: as it is, or where it leaves the design to a
    search, that of the folder ``out``, with the design found and written there.

    A design folder's own model file has its design already.
    """
    if modelfile.circuit.objective != "yield" or modelfile.source == out / MODEL:
        return modelfile
    return searched_into(modelfile, out, options, progress)


def searched_into(
    modelfile: ModelFile, out: Path, options: Options, progress: Progress
) -> ModelFile:
    """Search for a design of this model file, unless the folder has it; the folder's model file.

    Raises
    ------
    InputError, Unreachable : see ``design_search.search``; nothing was written by then, but for
    what a
        design could not be made of.
    EnvironmentMissing : no ngspice; said before any work.
    """
    options.check()
    catalog, folder = load_catalog(), Folder(out)
    inputs = _inputs(modelfile, catalog, options)
    todo = folder.decide(
        {"search": (inputs, [*FILES, *DESIGN_FILES])},
        overwrite=options.overwrite,
        resume=options.resume,
    )
    if not todo:
        return model_file(out / MODEL)
    begun = folder.state("search", inputs) == "unfinished"
    if not (begun or options.overwrite) and folder.manifest and "design" in folder.manifest.stages:
        raise InputError(
            folder / MODEL,
            "the design",
            "one that no search made",
            "another folder, or --overwrite to replace what manifest.json lists",
        )
    program_version()
    goes_on = begun and options.resume
    trade = _word(folder, modelfile, goes_on=goes_on)
    began = time.perf_counter()
    jobs = cores() if options.jobs is None else options.jobs
    windows = look(modelfile, catalog, jobs, progress)
    source = provenance(modelfile, catalog.hash, seed=options.seed, settings={"rules": RULES})
    if not goes_on:
        (folder / CANDIDATES).unlink(missing_ok=True)
    # trade.json goes with its design, and so before this is done.
    folder.begin({"search": (inputs, FILES)}, source, {"trade": trade} if trade else None)
    folder.write(ASKED, modelfile.text)
    memory = Memory(folder / CANDIDATES, inputs["model"], progress.note)
    with SpicePool(jobs, timeout=SPICE_TIMEOUT) as pool:
        found = design_search(
            modelfile,
            catalog,
            seed=options.seed,
            jobs=jobs,
            memory=memory,
            windows=windows,
            listen=Listener(pool, memory),
            progress=progress,
        )
    final = resolved(modelfile, found.made, found.final.choice, out / MODEL)
    made = replace(found.made, modelfile=final, seconds=time.perf_counter() - began)
    progress.stage("start recipes, files of the design")
    with naming(final):
        files = design_files.texts(made)
    folder.begin(design_inputs(final, catalog), design_files.design_provenance(made))
    design_files.write(folder, made, files)
    folder.finish("design")
    if trade is not None:
        trade = {**trade, "model": final.sha256}
    said = {**search_json(found), "trade": trade, "provenance": source}
    folder.write(SEARCH, dumps({**said, "cost": {"seconds": time.perf_counter() - began}}))
    folder.finish("search")
    return model_file(out / MODEL)


def search(
    model: Path | str,
    out: Path | str | None = None,
    *,
    samples: int | None = None,
    rung: RungName = "auto",
    seed: int | None = None,
    jobs: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
) -> JobOutcome:
    """The verb ``search`` for a model file: the design of the highest yield, written into ``out``.

    samples : fresh boards at the end. rung : of the final study. samples, seed : None for the usual
    ones, or with ``resume`` for the folder's own.

    Raises
    ------
    InputError : no model file, no ``out``, or a folder that holds something else. A design folder
        is not searched but cured (``cure_job.cure``).
    EnvironmentMissing : no ngspice; said before any work.
    """
    path = Path(model)
    given = {"samples": samples, "seed": seed}
    options = Options(
        SEED if seed is None else seed,
        jobs,
        SEARCH_SAMPLES if samples is None else samples,
        overwrite,
        resume,
        rung=rung,
    )
    options.check()
    if path.is_dir() or not path.exists():
        found = "a folder" if path.is_dir() else MISSING
        raise InputError(path, "MODEL", found, "a model file; a design folder can be cured")
    place = None if out is None else Path(out)
    modelfile, folder = synthesise_job.source(path, place)
    options = folder_numbers.of_search(folder, options, given)
    command = partial(Options.command, verb="search", model=path, out=place)
    said = Progress() if progress is None else progress
    return search_into(modelfile, folder, options, said, command)


def search_into(
    modelfile: ModelFile,
    out: Path,
    options: Options,
    progress: Progress,
    command: Callable[[Options], str],
) -> JobOutcome:
    """The verb ``search`` for a model file: design, study of fresh boards, confirmation.

    Raises
    ------
    EnvironmentMissing : there is something to confirm and no ngspice; said before any work.
    """
    known = Folder(out).manifest
    stage = None if known is None else known.stages.get("confirmation")
    if stage is None or not stage.complete:
        program_version()
    final = searched_into(modelfile, out, options, progress)
    rung = rung_choice.for_search(Folder(out), options, progress)
    study = run_into(final, out, replace(options, rung=rung), progress, lambda _: command(options))
    confirmed = _confirmed(final, out, options, progress)
    folder = Folder(out)
    answer = run_json(folder.json(DESIGN), folder.json(TOLERANCE))
    answer["search"] = {
        k: v for k, v in folder.json(SEARCH).items() if k not in ("format", "provenance", "cost")
    }
    answer["confirmation"] = confirmed
    for row, other in zip(answer["responses"], confirmed["responses"], strict=True):
        row["limited_by"] = other["limited_by"]
    held = all(confirms(row) for row in confirmed["responses"])
    return replace(study, answer=answer, satisfied=study.satisfied and held)


def confirms(row: Mapping[str, Any]) -> bool:
    """Whether ngspice bears a response out: its gate passed, and of the boards that it was asked
    at most the share ``DIFFERING`` differ or have no answer."""
    passed = row["gate"] is not None and row["gate"]["passed"]
    asked, agreed = int(row["asked"]), int(row["agreed"])
    return bool(passed and asked and asked - agreed <= DIFFERING * asked)


def _confirmed(
    modelfile: ModelFile, out: Path, options: Options, progress: Progress
) -> dict[str, Any]:
    """What ngspice says of boards of the study, and what limits each response."""
    folder, catalog = Folder(out), load_catalog()
    inputs = {
        **made_from(folder),
        "seed": options.seed,
        "samples": options.samples,
        "rung": RUNG,
        "boards": LEAST,
        **grade_inputs(modelfile, catalog),
    }
    wanted: dict[StageName, tuple[dict[str, Any], list[str]]] = {
        "confirmation": (inputs, [CONFIRMATION])
    }
    if folder.decide(wanted, overwrite=options.overwrite, resume=options.resume):
        began = time.perf_counter()
        jobs = cores() if options.jobs is None else options.jobs
        made = design_files.load(folder, modelfile, catalog)
        said = _confirm(made, folder, options, jobs, progress)
        folder.begin(wanted, provenance(modelfile, catalog.hash, seed=options.seed))
        cost = {"seconds": time.perf_counter() - began}
        folder.write(CONFIRMATION, dumps({"format": 1, **said, "cost": cost}))
        folder.finish("confirmation")
    answer = folder.json(CONFIRMATION)
    return {k: v for k, v in answer.items() if k not in ("format", "cost")}


def _confirm(
    made: Synthesis, folder: Folder, options: Options, jobs: int, progress: Progress
) -> dict[str, Any]:
    checked = check(made, None, progress)
    stores = FolderStores(folder.path, folder.watch(), progress.note, vouch=folder.vouches)
    study = tolerance(
        made,
        samples=options.samples,
        rung="exact",
        blamed=False,
        seed=options.seed,
        jobs=jobs,
        checked=checked,
        stores=stores,
        progress=progress,
    )
    step = progress.stage("what limits each response")
    limits = limitings(study.plan, study.answers, jobs=jobs, progress=step)
    with SpicePool(jobs, timeout=SPICE_TIMEOUT) as pool:
        require_ngspice(pool)
        progress.stage(f"ngspice, rung {RUNG}, numerics gate")
        reduction = nominal.nominal_reduction(made.design)
        gates = numerics_gate.check(
            pool,
            [
                GateSubject(reduction, q.excitation, q.start, rung=RUNG)
                for q in study.plan.questions
            ],
            LEVELS,
        )
        plan = replace(
            study.plan,
            questions=tuple(
                replace(q, settings=g.settings if g.passed else None)
                for q, g in zip(study.plan.questions, gates, strict=True)
            ),
        )
        asks = [
            a for a in to_confirm(study.answers) if plan.questions[a.question].settings is not None
        ]
        step = progress.stage(f"ngspice, rung {RUNG}, {len(asks)} boards", len(asks))
        heard = ngspice_runs.hear(plan, asks, pool, jobs, step, rung=RUNG)
    answers = {(a.sample, a.question): a for a in study.answers}
    rows = confirmation_json(heard, answers, study.asked, len(study.checked))
    for index, limit in zip(study.asked, limits, strict=True):
        rows[index]["limited_by"] = limit.as_dict()
    for index, found in zip(study.asked, gates, strict=True):
        rows[index]["gate"] = found.as_dict()
    return {"rung": RUNG, "responses": rows}


def to_confirm(answers: Iterable[Answer]) -> list[Ask]:
    """The first `LEAST` boards of each response that the exact circuit has an answer to, from
    their own orbit: one without is replaced by the next."""
    count: Counter[int] = Counter()
    asks = []
    for a in sorted(answers, key=lambda a: (a.question, a.sample)):
        if a.verdict is not Verdict.FAILED and count[a.question] < LEAST:
            count[a.question] += 1
            asks.append(Ask(a.sample, a.question, StartKind.OWN, Why.RANDOM))
    return asks


def _word(folder: Folder, modelfile: ModelFile, *, goes_on: bool) -> dict[str, Any] | None:
    """What a trade says that stood here when the search began, as ``rung_choice.RungChoice``."""
    if goes_on:
        assert folder.manifest is not None
        found: object = folder.manifest.stages["search"].kept.get("trade")
        if not (found is None or isinstance(found, dict)):
            place = "stages.search.kept.trade"
            raise InputError(folder / MANIFEST, place, found, "the word of a trade")
        return found
    word = rung_choice.before_search(folder, modelfile.sha256)
    return None if word is None else asdict(word)


def _inputs(modelfile: ModelFile, catalog: Catalog, options: Options) -> dict[str, Any]:
    inputs = dict(design_inputs(modelfile, catalog)["design"][0])
    return {**inputs, "version": __version__, "rules": RULES, "seed": options.seed}
