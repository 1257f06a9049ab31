"""The verbs on model files and design folders; each calls its function of ``designer``."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from designer.base.defaults import (
    DRAWN_STARTS,
    SEARCH_SAMPLES,
    SEED,
    TRADE_BOARDS,
    StudyEngine,
    cores,
)
from designer.base.errors import MISSING, EnvironmentMissing, InputError
from designer.base.version import __version__
from designer.cli import next_steps
from designer.cli.app import (
    Out,
    Output,
    OwnSeed,
    Samples,
    Seed,
    Session,
    Source,
    app,
    option,
    verb,
)

if TYPE_CHECKING:
    from designer.jobs.job_outcome import JobOutcome

STUDY_KEYS = (
    "format",
    "samples",
    "until",
    "narrow",
    "all_on_one_board",
    "blame",
    "boards",
    "equation_check",
    "responses",
    "maps",
    "provenance",
)
"""Of what a study's JSON object has, in the order in which ``tolerance`` prints it."""
KINDS = ("grade", "network", "reference", "trimmer", "op-amp", "dead-zone", "place", "trim")
"""Of upgrades; as ``cure_branch.KINDS``."""


class MapOver(StrEnum):
    """What a yield is mapped over."""

    OMEGA = "omega"
    B = "b"
    GRADE = "grade"
    OMEGA_GRADE = "omega-grade"


WithBlame = Annotated[
    bool | None,
    option("--blame/--no-blame", None, "Say which part is to blame [yes, or as the folder has]."),
]
BlameBudget = Annotated[
    int | None, option("--blame-budget", "STEPS", "Most steps of the work on the blame [20000].")
]


@app.callback(invoke_without_command=True)
def _designer(
    version: Annotated[
        bool, option("--version", None, "Print the version, and what it works with here.")
    ] = False,
) -> None:
    if version:
        print(f"designer {__version__}")
        for name, version_text in _surroundings():
            print(f"{name:8} {version_text}")
        raise typer.Exit


def _surroundings() -> Iterator[tuple[str, str]]:
    """The programs that verbs call and the cores that they use, as they are on this machine."""
    from designer.design_rules.kicad_program import kicad_version
    from designer.linear_network.solver_check import solver_words
    from designer.spice.batch_backend import program_version

    yield "Python", platform.python_version()
    try:
        yield "ngspice", program_version()
    except EnvironmentMissing as missing:
        yield "ngspice", str(missing)
    yield "KiCad", kicad_version() or "none (kicad-cli 9 checks boards in designer rules)"
    yield "solver", solver_words()
    yield "cores", str(cores())


@verb(
    "Design", "designer run model.toml --out out/model --samples 200", "jobs", "overwrite", "resume"
)
def run(
    session: Session,
    model: Source,
    out: Out = None,
    samples: Samples = None,
    blame: WithBlame = None,
    blame_budget: BlameBudget = None,
    seed: OwnSeed = None,
    **shared: Any,
) -> Output:
    """Do the whole job: parts, circuit, check in ngspice, yield, report."""
    from designer.cli import tables
    from designer.jobs import study_job

    outcome = study_job.run(
        model,
        out,
        samples=samples,
        blame=blame,
        blame_budget=blame_budget,
        seed=seed,
        progress=session.progress,
        shown=session.early(tables.run, tables.tolerance),
        **shared,
    )
    return _output(outcome, outcome.answer, tables.run, next_steps.after_study)


@verb("Design", "designer synthesise model.toml --out out/model", "jobs", "overwrite", "resume")
def synthesise(
    session: Session,
    model: Source,
    out: Out = None,
    compare: Annotated[
        bool, option("--compare", None, "Set the design beside the paper's values; needs no --out.")
    ] = False,
    seed: Seed = SEED,
    **shared: Any,
) -> Output:
    """Choose the parts and write the design folder."""
    from designer.cli import tables
    from designer.jobs import synthesise_job

    outcome = synthesise_job.synthesise(
        model, out, compare=compare, seed=seed, progress=session.progress, **shared
    )
    return _output(outcome, outcome.answer, tables.synthesised, next_steps.after_design)


app.command(
    "synthesize",
    hidden=True,
    epilog="\b\nExample:\n  designer synthesise model.toml --out out/model",
)(synthesise)


@verb(
    "Study",
    "designer tolerance out/model --samples 2000 --rung exact",
    "jobs",
    "overwrite",
    "resume",
)
def tolerance(
    session: Session,
    model: Source,
    out: Out = None,
    samples: Samples = None,
    until: Annotated[
        float | None, option("--until", "WIDTH", "Add boards until intervals are narrower.")
    ] = None,
    rung: Annotated[
        StudyEngine | None,
        option(
            "--rung",
            None,
            "exact: no ngspice; bandwidth: with op-amps that lag; ngspice: every board in ngspice "
            "too [auto, or as the folder has].",
        ),
    ] = None,
    tuned: Annotated[
        bool, option("--tuned", None, "Also with the generator free within its bands.")
    ] = False,
    reached: Annotated[
        bool, option("--reached", None, "Also from power-up, by the start recipe.")
    ] = False,
    map_: Annotated[
        list[MapOver] | None,
        option("--map", None, "Also the yield over this setting; may be repeated."),
    ] = None,
    measured: Annotated[
        Path | None, option("--measured", "FILE", "Study the boards in this list instead (CSV).")
    ] = None,
    cluster: Annotated[
        str | None, option("--cluster", "tcp://…", "A Dask scheduler that shares the work.")
    ] = None,
    blame: WithBlame = None,
    blame_budget: BlameBudget = None,
    seed: OwnSeed = None,
    **shared: Any,
) -> Output:
    """Count the boards that will work, into the design folder; a model file needs --out."""
    from designer.cli import tables
    from designer.jobs import study_job

    outcome = study_job.tolerance(
        model,
        out,
        samples=samples,
        until=until,
        rung=rung,
        tuned=tuned,
        reached=reached,
        map_=[over.value for over in map_ or ()],
        measured=measured,
        cluster=cluster,
        blame=blame,
        blame_budget=blame_budget,
        seed=seed,
        progress=session.progress,
        shown=session.early(tables.tolerance, tables.tolerance),
        **shared,
    )
    answer = {k: outcome.answer[k] for k in STUDY_KEYS if k in outcome.answer}
    answer["cost"] = outcome.answer["cost"]["study"]
    return _output(outcome, answer, tables.tolerance, next_steps.after_study)


def _output(
    outcome: JobOutcome,
    answer: Mapping[str, Any],
    table: Any,
    after: Callable[[Path, Mapping[str, Any]], Iterable[next_steps.Step]],
) -> Output:
    """What a verb that writes a design folder has to say. table : shows its answer. after : what
    may be done next."""
    from designer.cli import tables

    def show() -> None:
        if outcome.shown:
            tables.blame_status(answer)
        else:
            table(answer)
        if "comparison" in answer:
            tables.compared(answer["comparison"])
        if outcome.folder is not None:
            tables.files(outcome.folder, outcome.reused)
            next_steps.show(after(outcome.folder, answer))

    return Output(answer, show, outcome.satisfied)


@verb("Explore", "designer simulate model.toml --omega 0.85 --plots pictures", "jobs")
def simulate(
    session: Session,
    model: Source,
    omega: Annotated[
        list[float] | None,
        option("--omega", "W", "Frequency in the model's own units; may be repeated."),
    ] = None,
    frequency: Annotated[
        list[str] | None,
        option(
            "--frequency",
            "F",
            'Of a model file with SI values, such as "10 Hz" or "62.8 rad/s"; may be repeated.',
        ),
    ] = None,
    engine: Annotated[
        Literal["model", "circuit", "ngspice"], option("--engine", None, "What simulates.")
    ] = "model",
    rung: Annotated[
        Literal["ideal", "dynamic", "full"],
        option("--rung", None, "The op-amps' model, with --engine ngspice."),
    ] = "ideal",
    starts: Annotated[
        int, option("--starts", "N", "Initial states that are drawn: the attractors' shares.")
    ] = DRAWN_STARTS,
    seed: Seed = SEED,
    plots: Annotated[
        Path | None, option("--plots", "DIR", "Draw each response: PNG and SVG.")
    ] = None,
    overwrite: Annotated[
        bool, option("--overwrite", None, "Replace pictures of the same names.")
    ] = False,
    **shared: Any,
) -> Output:
    """Name the responses: those that the model file wants, or those reached from rest at
    --omega and --frequency."""
    from designer.cli import simulate_tables, tables
    from designer.jobs import simulate_job

    result = simulate_job.simulate(
        model,
        omega or (),
        frequency=frequency or (),
        engine=engine,
        rung=rung,
        starts=starts,
        seed=seed,
        plots=plots,
        overwrite=overwrite,
        progress=session.progress,
        **shared,
    )

    def show() -> None:
        simulate_tables.simulated(result.answer)
        if plots is not None:
            tables.pictures(plots, result.answer["files"])
        next_steps.show(next_steps.after_response(model, result.answer["responses"]))

    return Output(result.answer, show, result.satisfied)


@verb("Design", "designer search model.toml --out out/robust", "jobs", "overwrite", "resume")
def search(
    session: Session,
    model: Source,
    out: Out = None,
    samples: Annotated[
        int | None, option("--samples", "N", f"Fresh boards at the end [{SEARCH_SAMPLES}].")
    ] = None,
    wanted: Annotated[
        float | None, option("--yield", "Y", "Cure this design folder: the yield wanted.")
    ] = None,
    budget: Annotated[
        float | None, option("--budget", "PRICE", "The most that a cure may cost.")
    ] = None,
    without: Annotated[
        list[str] | None,
        option(
            "--without",
            "KIND",
            f"A cure without upgrades of this kind: {', '.join(KINDS)}; may be repeated.",
        ),
    ] = None,
    rung: Annotated[
        StudyEngine | None,
        option(
            "--rung", None, "Of the final study; auto: by a trade that is in the folder. [auto]"
        ),
    ] = None,
    seed: OwnSeed = None,
    **shared: Any,
) -> Output:
    """Find the design of the highest yield; with --yield, the cheapest cure of a design folder."""
    shared |= {"seed": seed, "progress": session.progress}
    if not model.exists():
        raise InputError(model, "MODEL|DIR", MISSING, "a model file or a design folder")
    if model.is_dir():
        _refuse({"--samples": samples, "--rung": rung}, "no such option with a design folder")
        from designer.cli import tables
        from designer.jobs import cure_job

        cured = cure_job.cure(
            model, yield_=wanted, budget=budget, without=without or (), out=out, **shared
        )
        return Output(cured.answer, lambda: tables.cured(cured.answer), cured.reached)
    expected = "a design folder to cure; a model file gets its highest yield"
    _refuse({"--yield": wanted, "--budget": budget, "--without": without}, expected)
    from designer.cli import tables
    from designer.jobs import search_job

    outcome = search_job.search(model, out, samples=samples, rung=rung or "auto", **shared)
    return _output(outcome, outcome.answer, tables.searched, next_steps.after_study)


def _refuse(options: Mapping[str, object], expected: str) -> None:
    """InputError for the first of these options that has a value."""
    for name, value in options.items():
        if value not in (None, []):
            raise InputError(None, name, value, expected)


@verb("Study", "designer trade out/model --boards 100", "jobs", "overwrite", "resume")
def trade(
    session: Session,
    model: Source,
    out: Out = None,
    boards: Annotated[
        int | None,
        option(
            "--boards",
            "N",
            f"Boards of each response for the yield; 0: none [{TRADE_BOARDS}, or the folder's "
            "own].",
        ),
    ] = None,
    truth: Annotated[
        Literal["full", "vendor"] | None,
        option(
            "--truth",
            None,
            "What stands for the board: full op-amps from data-sheet figures, or the vendor's "
            "macromodel that the catalogue names [full].",
        ),
    ] = None,
    seed: OwnSeed = None,
    **shared: Any,
) -> Output:
    """Measure time and error of each way to simulate this design, and name the cheapest."""
    from designer.cli import tables
    from designer.jobs import trade_job

    result = trade_job.trade(
        model, out, boards=boards, seed=seed, truth=truth, progress=session.progress, **shared
    )
    return Output(result.answer, lambda: tables.traded(result.answer))
