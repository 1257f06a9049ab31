"""The verbs ``catalog``, ``new`` and ``reproduce``, which know no design folder."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import typer

from designer.base.errors import InputError
from designer.base.printed import tell
from designer.cli import next_steps
from designer.cli.app import Output, Session, option, verb


@verb("Design", "designer catalog --check TL074", computes=False)
def catalog(
    session: Session,
    check: Annotated[
        str | None, option("--check", "NAME", "Measure this op-amp's model against its figures.")
    ] = None,
    **_: Any,
) -> Output:
    """List what can be bought (part families, op-amps, diodes, …), or check an op-amp's model."""
    from designer.catalog.catalog import load_catalog
    from designer.cli import catalog_tables

    entries = load_catalog()
    if check is None:
        kinds = (
            "opamps", "families", "diodes", "references", "supply_diodes", "trimmers", "headers",
            "coaxial_jacks",
        )  # fmt: skip
        names = {kind: [entry.name for entry in getattr(entries, kind)] for kind in kinds}
        answer = {"format": 1, **names, "hash": entries.hash}
        return Output(answer, lambda: catalog_tables.catalog(entries))
    from designer.spice.opamp_check import checks

    session.progress.stage(f"{check} in ngspice")
    measured = checks(entries.opamp(check))
    rows = [{**asdict(row), "agrees": row.agrees} for row in measured]
    return Output(
        {"format": 1, "opamp": check, "checks": rows, "hash": entries.hash},
        lambda: catalog_tables.checks(check, measured),
        all(row.agrees for row in measured),
    )


@verb("Design", "designer new hammer.toml --format 2", computes=False)
def new(
    _session: Session,
    path: Annotated[Path, typer.Argument(metavar="PATH", help="The file to write.")] = Path(
        "model.toml"
    ),
    from_: Annotated[
        Path | None,
        option("--from", "OLD", "Rewrite this model file in format 2; its other tables stay."),
    ] = None,
    format_: Annotated[
        int | None, option("--format", "1|2", "Format of the commented file: 2 for any system [1].")
    ] = None,
    **_: Any,
) -> Output:
    """Write a commented model file to start from; an existing file is never replaced."""
    from designer.model.template import SCHEMA, new as write_model_file

    if format_ not in (None, 1, 2):
        raise InputError(None, "--format", format_, "1 or 2")
    write_model_file(path, from_, format=cast("Literal[1, 2] | None", format_))
    files = [str(path), *([] if from_ else [str(path.with_name(SCHEMA))])]
    answer = {"format": 1, "files": files}

    def show() -> None:
        tell(f"written: {', '.join(files)}")
        next_steps.show(next_steps.after_model(path))

    return Output(answer, show)


@verb("Study", "designer reproduce dynamics --out out/paper-dynamics", "jobs", "resume", json=False)
def reproduce(
    session: Session,
    what: Annotated[
        Literal["dynamics", "circuit", "tolerance"],
        typer.Argument(metavar="dynamics|circuit|tolerance", help="Which part of the paper."),
    ],
    out: Annotated[
        Path | None,
        option(
            "--out",
            "DIR",
            "The folder to write [reports/paper-dynamics, reports/paper-circuit or "
            "reports/tolerance].",
        ),
    ] = None,
    samples: Annotated[int | None, option("--samples", "N", "Boards a case (tolerance).")] = None,
    seed: Annotated[int | None, option("--seed", "N", "Seed of the boards (tolerance).")] = None,
    **shared: Any,
) -> Output:
    """Measure the paper's figures and statements again."""
    from designer.paper import paper_reports

    paper_reports.reproduce(
        what, out, samples=samples, seed=seed, progress=session.progress, **shared
    )
    return Output({})
