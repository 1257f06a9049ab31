"""The verb ``reproduce``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, get_args

from designer.base.defaults import check_count, cores
from designer.base.errors import InputError
from designer.base.progress import Progress, reported
from designer.verbs.declared import Jobs, Resume, Verb, argument, option

PaperPart = Literal["dynamics", "circuit", "tolerance"]
PLACES: dict[PaperPart, Path] = {
    "dynamics": Path("reports/paper-dynamics"),
    "circuit": Path("reports/paper-circuit"),
    "tolerance": Path("reports/tolerance"),
}
"""Where the reports go if nothing is said."""


@reported
def reproduce(
    what: Annotated[
        PaperPart,
        argument("dynamics|circuit|tolerance", "Which part of the paper."),
    ],
    out: Annotated[
        Path | str | None,
        option(
            "--out",
            "DIR",
            "The folder to write [reports/paper-dynamics, reports/paper-circuit or "
            "reports/tolerance].",
            Path,
        ),
    ] = None,
    *,
    samples: Annotated[int | None, option("--samples", "N", "Boards a case (tolerance).")] = None,
    seed: Annotated[int | None, option("--seed", "N", "Seed of the boards (tolerance).")] = None,
    jobs: Jobs = None,
    resume: Resume = False,
    progress: Progress | None = None,
) -> Path:
    """Measure the paper's figures and statements again.

    The folder of the report is returned. resume : "dynamics" is made anew each time.

    Raises
    ------
    InputError : an unknown part, a word that this part does not have, or a folder that holds
        something else.
    EnvironmentMissing : ngspice is missing.
    """
    from designer.base.schema import one_of
    from designer.paper import reproduce_circuit, reproduce_dynamics, reproduce_tolerance

    if what not in get_args(PaperPart):
        raise InputError(None, "the part", what, one_of(what, get_args(PaperPart)))
    check_count("--jobs", jobs, 1)
    place = PLACES[what] if out is None else Path(out)
    if what != "tolerance":
        for name, value in (("--samples", samples), ("--seed", seed)):
            if value is not None:
                raise InputError(None, name, value, f"nothing: {what} draws no boards")
    if what == "dynamics":
        if resume:
            raise InputError(None, "--resume", "given", "nothing: dynamics is made anew each time")
        reproduce_dynamics.reproduce(place, jobs=jobs or cores())
    elif what == "circuit":
        reproduce_circuit.reproduce(place, jobs=jobs, resume=resume)
    else:
        reproduce_tolerance.reproduce(
            place,
            samples=reproduce_tolerance.SAMPLES if samples is None else samples,
            seed=reproduce_tolerance.SEED if seed is None else seed,
            jobs=jobs,
            resume=resume,
        )
    return place


VERB = Verb(reproduce, "Study", "designer reproduce dynamics --out out/paper-dynamics", json=None)
