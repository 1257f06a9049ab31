"""The verb ``bifurcation``: options in, one JSON object or tables out."""

from __future__ import annotations

from typing import Annotated

import typer

from designer.cli.app import (
    Jobs,
    Json,
    Log,
    Out,
    Overwrite,
    Quiet,
    Resume,
    Source,
    Verbose,
    app,
    compiling,
    print_json,
    session,
)


@app.command()
def bifurcation(
    model: Source,
    over: Annotated[
        str | None,
        typer.Option(
            "--over",
            metavar="NAME",
            help="omega (default), b, k0, zeta, m, k, c or f20; with --circuit frequency in Hz "
            "(default), omega, amplitude or offset in V; with --basins a state.",
        ),
    ] = None,
    low: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="A",
            help='One end of the sweep; of a [mechanical] model also "10 Hz" or "0.5 mm".',
        ),
    ] = None,
    high: Annotated[str | None, typer.Option("--to", metavar="B", help="The other end.")] = None,
    steps: Annotated[
        int | None, typer.Option("--steps", metavar="N", help="Values, both ends included.")
    ] = None,
    omega: Annotated[
        float | None,
        typer.Option("--omega", metavar="W", help="The drive's frequency where it is not swept."),
    ] = None,
    frequency: Annotated[
        str | None,
        typer.Option(
            "--frequency",
            metavar="F",
            help='The same in units, such as "10 Hz"; with --circuit the generator\'s.',
        ),
    ] = None,
    down: Annotated[
        bool, typer.Option("--down", help="Follow the attractor downwards (the default).")
    ] = False,
    up: Annotated[bool, typer.Option("--up", help="Follow it upwards; with --down both.")] = False,
    starts: Annotated[
        int | None,
        typer.Option("--starts", metavar="K", help="From K starts at every value, rest first."),
    ] = None,
    periods: Annotated[
        int | None,
        typer.Option("--periods", metavar="N", help="Drive periods left out [500; maps 134]."),
    ] = None,
    keep: Annotated[
        int | None, typer.Option("--keep", metavar="N", help="Drive periods shown [30; maps 16].")
    ] = None,
    second: Annotated[
        tuple[str, str, str, int] | None,
        typer.Option("--map", metavar="NAME A B N", help="A map over this parameter too."),
    ] = None,
    basins: Annotated[
        bool, typer.Option("--basins", help="Where starts on a plane of states end.")
    ] = False,
    circuit: Annotated[
        bool, typer.Option("--circuit", help="The design folder's circuit, in Hz and volts.")
    ] = False,
    points: Annotated[
        bool, typer.Option("--points/--no-points", help="Locate the bifurcation points.")
    ] = True,
    out: Out = None,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """Bifurcation diagrams, maps of n-p-q over two parameters, basins of attraction."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        from designer.jobs import bifurcation_job

        found = bifurcation_job.bifurcation(
            model,
            over=over,
            from_=low,
            to=high,
            steps=steps,
            omega=omega,
            frequency=frequency,
            down=down,
            up=up,
            starts=starts,
            periods=periods,
            keep=keep,
            map_=second,
            basins=basins,
            circuit=circuit,
            points=points,
            out=out,
            jobs=jobs,
            overwrite=overwrite,
            resume=resume,
            progress=progress,
        )
    if json:
        print_json(found.answer)
    elif not quiet:
        from designer.cli import bifurcation_tables

        bifurcation_tables.show(found.answer, out, found.reused)
    return 0
