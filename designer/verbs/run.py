"""The verb ``run``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from designer.base.progress import Progress, Show, quiet, reported
from designer.verbs import next_steps
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
    Source,
    Verb,
)
from designer.verbs.tables import (
    design_written,
    studied,
    synthesised,
    tolerance,
    whole_job,
    worked_out_last,
)

if TYPE_CHECKING:
    from designer.catalog.parts_catalog import Catalog
    from designer.jobs.job_outcome import JobOutcome


@reported
def run(
    model: Source,
    out: Out = None,
    *,
    samples: Samples = None,
    rare: Rare = False,
    blame: Blame = None,
    blame_budget: BlameBudget = None,
    seed: OwnSeed = None,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    catalog: Catalog | None = None,
    progress: Progress | None = None,
    shown: Show = quiet,
) -> JobOutcome:
    """Do the whole job: parts, circuit, check in ngspice, yield, report.

    A ``ModelFile`` without ``out`` is worked on in memory. catalog : in memory, instead of the one
    that is found. shown : is given the answer while the work goes on.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built, or the folder holds
        something else.
    ResponseNotFound : the model does not show a wanted response; no parts are chosen.
    EnvironmentMissing : there is work to do and no ngspice.
    """
    from designer.jobs.options import Options, stated_options
    from designer.jobs.study_job import design_and_study

    words = {"samples": samples, "seed": seed, "until": None, "blame": blame}
    words |= {"blame_budget": blame_budget}
    options = Options(
        jobs=jobs,
        overwrite=overwrite,
        resume=resume,
        rare=rare,
        attribution_anew=bool(blame),
        **stated_options(words),
    )
    return design_and_study(
        model, out, options, words, VERB.command, shown, catalog, whole_job=True
    )


def show(result: JobOutcome) -> None:
    """The tables, where the files are, and what may be done next."""
    parts_stand_above = result.folder is not None and not result.reused
    tables = studied if parts_stand_above else whole_job
    tables = worked_out_last if result.shown else tables
    design_written(result, result.answer, tables, next_steps.after_study)


VERB = Verb(
    run,
    "Design",
    "designer run model.toml --out out/model --samples 200",
    show=show,
    parts=synthesised,
    early=(studied, tolerance),
)
