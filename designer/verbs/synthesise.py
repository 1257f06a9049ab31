"""The verb ``synthesise``."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from designer.base.defaults import SEED, cores
from designer.base.errors import InputError
from designer.base.progress import Progress, Show, quiet, reported, whole
from designer.verbs import next_steps
from designer.verbs.console import grid, say
from designer.verbs.declared import Jobs, Out, Overwrite, Resume, Seed, Source, Verb, option
from designer.verbs.tables import design_written, not_good_enough, synthesised

if TYPE_CHECKING:
    from designer.answers.design_answer import Comparison, DesignAnswer
    from designer.base.second_process import Ask
    from designer.catalog.parts_catalog import Catalog
    from designer.jobs.job_outcome import JobOutcome
    from designer.model.model_file import ModelFile


@reported
def synthesise(
    model: Source,
    out: Out = None,
    *,
    compare: Annotated[
        bool, option("--compare", None, "Set the design beside the paper's values; needs no --out.")
    ] = False,
    seed: Seed = SEED,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    catalog: Catalog | None = None,
    progress: Progress | None = None,
    shown: Show = quiet,
) -> JobOutcome:
    """Choose the parts and write the design folder.

    A ``ModelFile`` without ``out`` is worked on in memory, and so is a path with ``compare``.
    catalog : in memory, instead of the one that is found. shown : is given what is known of the
    design as soon as its parts stand.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built, or the folder holds
        something else.
    ResponseNotFound : the model does not show a wanted response; no parts are chosen.
    """
    from designer.jobs.options import Options
    from designer.jobs.writing_process import ask_responses

    options = Options(seed, jobs, overwrite=overwrite, resume=resume)
    options.check()
    with _process(out, jobs) as other:
        from designer.folders.model_source import source
        from designer.model.model_file import ModelFile, read_model_file

        folder: Path | None = None
        in_memory = isinstance(model, ModelFile) or (compare and not Path(model).is_dir())
        if out is None and in_memory:
            modelfile = model if isinstance(model, ModelFile) else read_model_file(Path(model))
        else:
            modelfile, folder = source(model, out)
        _check_comparable(modelfile, compare)
        ahead = ask_responses(other, modelfile)
        from designer.jobs import synthesise_job, usual_times
        from designer.jobs.open_design import design_file

        if folder is None:
            return synthesise_job.synthesise_in_memory(modelfile, catalog, compare, options.workers)
        with whole(usual_times.of_design(modelfile)):
            chosen = design_file(modelfile, folder, options)
            return synthesise_job.synthesise_into(
                chosen,
                folder,
                options,
                shown,
                compare=compare,
                ahead=ahead if chosen is modelfile else None,
            )


def _process(
    out: Path | str | None = None, jobs: int | None = None, **_: object
) -> AbstractContextManager[Ask]:
    """The process that finds responses, and writes, beside this one."""
    from designer.jobs.writing_process import finding_process

    return finding_process(1 if out is None else jobs or cores())


def _check_comparable(modelfile: ModelFile, compare: bool) -> None:
    if compare and modelfile.format != 1:
        expected = "a file of format 1: the paper's circuit is for its two masses"
        raise InputError(modelfile.source, "--compare", "a file of format 2", expected)


synthesize = synthesise
"""The same in American spelling."""


def show(result: JobOutcome) -> None:
    """The tables, where the files are, and what may be done next."""
    parts_stand_above = result.folder is not None and not result.reused
    design_written(
        result,
        result.answer,
        _after_parts if parts_stand_above else tables,
        next_steps.after_design,
    )


def tables(answer: DesignAnswer) -> None:
    """The design, and beside the paper's where that was asked for."""
    synthesised(answer)
    if "comparison" in answer:
        _compared(answer["comparison"])


def _after_parts(answer: DesignAnswer) -> None:
    """What was not known yet when the parts were shown."""
    not_good_enough(answer)
    if "comparison" in answer:
        _compared(answer["comparison"])


def _compared(answer: Comparison) -> None:
    """The design beside the paper's."""
    from designer.report import compare_table

    heads, *rows = compare_table.rows(answer)
    grid("Side by side", heads, rows)
    for note in compare_table.notes(answer):
        say(note)


VERB = Verb(
    synthesise,
    "Design",
    "designer synthesise model.toml --out out/model",
    show=show,
    parts=synthesised,
    beside=_process,
)
