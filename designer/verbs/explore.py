"""The verb ``explore``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from designer.base.defaults import SAMPLES, SEED
from designer.base.progress import Progress, quiet, reported, watched
from designer.verbs.declared import Jobs, Overwrite, Samples, Seed, Source, Verb, option


@reported
def explore(
    model: Source,
    *,
    port: Annotated[
        int | None, option("--port", "N", "Port of the page [8610, or a free one].")
    ] = None,
    host: Annotated[
        str, option("--host", "ADDRESS", "Address to listen at; others than this need a token.")
    ] = "127.0.0.1",
    token: Annotated[
        str | None, option("--token", "TOKEN", "What pages have to know [drawn, with --host].")
    ] = None,
    browser: Annotated[
        bool, option("--browser/--no-browser", None, "Open the page in a browser.")
    ] = True,
    save: Annotated[
        Path | str | None,
        option(
            "--save", "FILE", "Instead: write the page along ω as one file, for no server.", Path
        ),
    ] = None,
    samples: Samples = None,
    seed: Seed = SEED,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    progress: Progress | None = None,
    ready: Callable[[str], None] = quiet,
) -> None:
    """Move the model's parameters on a local page and see the response follow.

    The page is served until Ctrl-C. What it asks to be written goes below the folder that this was
    started in. samples, seed, jobs, overwrite : of the file that is written. ready : is given the
    page's address.

    Raises
    ------
    InputError : a model that cannot be read, a port that is taken, an address that is none here,
        a file that cannot be written.
    """
    from designer.folders.model_source import model_of

    modelfile = model_of(model)
    if save is not None:
        from designer.explorer.saved_page import save_page
        from designer.jobs.options import Options

        options = Options(seed, jobs, SAMPLES if samples is None else samples, overwrite)
        save_page(modelfile, Path(save), options)
        return
    from designer.explorer import server

    server.serve(
        modelfile,
        port=port,
        host=host,
        token=token,
        browser=browser,
        ready=ready,
        progress=watched(),
    )


VERB = Verb(explore, "Explore", "designer explore examples/paper.toml", json=None)
