"""The verb ``explore``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from designer.base.defaults import SAMPLES, SEED
from designer.cli.app import Output, Samples, Seed, Session, Source, option, verb


@verb("Explore", "designer explore examples/paper.toml", "jobs", "overwrite", json=False)
def explore(
    session: Session,
    model: Source,
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
        Path | None,
        option("--save", "FILE", "Instead: write the page along ω as one file, for no server."),
    ] = None,
    samples: Samples = None,
    seed: Seed = SEED,
    **shared: Any,
) -> Output:
    """Move the model's parameters on a local page and see the response follow."""
    from designer.explorer import server

    server.explore(
        model,
        port=port,
        host=host,
        token=token,
        browser=browser,
        progress=session.progress,
        save=save,
        samples=SAMPLES if samples is None else samples,
        seed=seed,
        **shared,
    )
    return Output({})
