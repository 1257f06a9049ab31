"""The verb ``export``."""

from __future__ import annotations

from designer.cli.app import (
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
def export(
    model: Source,
    out: Out = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
    log: Log = None,
) -> int:
    """The KiCad project: schematic, placed board, netlist; into the design folder."""
    with session(verbose, quiet, log) as progress, compiling(progress):
        from designer.jobs import synthesise_job
        from designer.jobs.export_job import export_into
        from designer.jobs.options import Options

        options = Options(overwrite=overwrite, resume=resume)
        modelfile, folder = synthesise_job.source(model, out)
        answer, reused = export_into(modelfile, folder, options, progress)
    if json:
        print_json(answer)
    elif not quiet:
        from designer.cli import tables

        tables.files(folder, reused)
    return 0
