"""The verb ``tolerance``."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

from designer.base.defaults import Over, StudyEngine
from designer.base.errors import InputError
from designer.base.progress import Progress, Show, quiet, reported
from designer.verbs import next_steps, tables
from designer.verbs.declared import (
    Blame,
    BlameBudget,
    Jobs,
    Out,
    Overwrite,
    OwnSeed,
    Rare,
    Resume,
    Samples,
    Verb,
    argument,
    option,
)

if TYPE_CHECKING:
    from designer.answers.study_answer import RunAnswer, StudyAnswer
    from designer.check.synthesis_result import Synthesis
    from designer.jobs.job_outcome import JobOutcome
    from designer.model.model_file import ModelFile

STUDY_KEYS = (
    "format",
    "samples",
    "until",
    "narrow",
    "all_on_one_board",
    "any_lost",
    "blame",
    "boards",
    "equation_check",
    "responses",
    "maps",
    "provenance",
)
"""The keys of a study's JSON object that are printed, in their order."""


@reported
def tolerance(
    model: Annotated[
        Path | str | ModelFile | Synthesis | JobOutcome,
        argument("MODEL|DIR", "A model file (TOML) or a design folder.", reads=Path),
    ],
    out: Out = None,
    *,
    samples: Samples = None,
    until: Annotated[
        float | None, option("--until", "WIDTH", "Add boards until intervals are narrower.")
    ] = None,
    rung: Annotated[
        StudyEngine | None,
        option(
            "--rung",
            None,
            "Fidelity; exact: no ngspice; bandwidth: with op-amps that lag; ngspice: every board "
            "in ngspice too [auto, or as the folder has].",
        ),
    ] = None,
    tuned: Annotated[
        bool, option("--tuned", None, "Also with the generator free within its bands.")
    ] = False,
    reached: Annotated[
        bool, option("--reached", None, "Also from power-up, by the start recipe.")
    ] = False,
    rare: Rare = False,
    map_: Annotated[
        Sequence[Over],
        option(
            "--map",
            None,
            "Also the yield over this setting; may be repeated.",
            reads=list[Over],
        ),
    ] = (),
    measured: Annotated[
        Path | str | None,
        option("--measured", "FILE", "Study the boards in this list instead (CSV).", Path),
    ] = None,
    cluster: Annotated[
        str | None,
        option("--cluster", "tcp://…", "A Dask scheduler that shares the work.", decides=False),
    ] = None,
    blame: Blame = None,
    blame_budget: BlameBudget = None,
    seed: OwnSeed = None,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    progress: Progress | None = None,
    shown: Show = quiet,
) -> JobOutcome:
    """Count the boards that will work, into the design folder; a model file needs --out.

    model : a design is studied in its folder or, without one, in memory; so is a ``ModelFile``
    without ``out``. samples : at least. until : width of the 95 % intervals at which the study
    stops growing. rung : "auto" asks ngspice about some boards, and "bandwidth" is "auto" with
    op-amps that lag by their gain-bandwidth. measured : of boards of a design folder.

    Raises
    ------
    InputError, Unreachable, EnvironmentMissing : as ``run``.
    """
    from designer.jobs import folder_numbers
    from designer.jobs.job_outcome import JobOutcome
    from designer.jobs.options import Options, stated_options
    from designer.jobs.study_job import design_and_study, measured_into

    words = {"samples": samples, "seed": seed, "until": until, "rung": rung, "blame": blame}
    words |= {"blame_budget": blame_budget}
    options = Options(
        jobs=jobs,
        overwrite=overwrite,
        resume=resume,
        tuned=tuned,
        reached=reached,
        rare=rare,
        map_=tuple(dict.fromkeys(map_)),
        cluster=cluster,
        attribution_anew=bool(blame),
        **stated_options(words),
    )
    if measured is None:
        return design_and_study(model, out, options, words, VERB.command, shown)
    options.check()
    for name, value in (
        ("--out", out), ("--samples", samples), ("--until", until), ("--map", ", ".join(map_)),
        ("--rare", rare or None),
    ):  # fmt: skip
        if value not in (None, ""):
            expected = "no such option with --measured, whose boards are the samples"
            raise InputError(None, name, str(value), expected)
    folder = model.folder if isinstance(model, JobOutcome) else model
    if not isinstance(folder, Path | str):
        raise InputError(None, "DIR", "no folder", "a design folder, whose boards were measured")
    path = Path(folder)
    options = folder_numbers.of_measured(path, options, words)
    # The boards of the list are the samples.
    command = partial(VERB.command, model=path, out=None, without=("samples",))
    return measured_into(path, Path(measured), options, command, shown)


def printed(result: JobOutcome) -> StudyAnswer:
    """The part of the answer that is of the study."""
    answer: RunAnswer = result.answer
    own = {key: answer.get(key) for key in STUDY_KEYS if key in answer}
    return cast("StudyAnswer", {**own, "cost": answer["cost"]["study"]})


def show(result: JobOutcome) -> None:
    """The tables, where the files are, and what may be done next."""
    shown = tables.worked_out_last if result.shown else tables.tolerance
    tables.design_written(result, printed(result), shown, next_steps.after_study)


VERB = Verb(
    tolerance,
    "Study",
    "designer tolerance out/model --samples 2000 --rung exact",
    show=show,
    json=printed,
    early=(tables.tolerance, tables.tolerance),
)
