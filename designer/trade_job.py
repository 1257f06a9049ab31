"""The verb ``trade``: a design's rungs measured, and the stage ``trade`` of its folder.

Nothing here prints; ``designer.commands_trade`` does.
"""

from __future__ import annotations

import io
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from designer import api, design_files, gate, trade_rungs, trade_yield
from designer.api import Synthesis
from designer.catalog import load_catalog
from designer.folder import Folder
from designer.job import Options, standing_inputs
from designer.jsonout import dumps
from designer.modelfile import ModelFile
from designer.preconditions import cores, naming, need_responses, require_ngspice
from designer.progress import Progress
from designer.provenance import provenance
from designer.rung_choice import TRADE
from designer.stopwatch import SpiceClock
from designer.study import check
from designer.trade import Trade, trade
from designer.trade_rungs import LEVELS, ROUNDS, Answer
from designer.trade_yield import BOARDS
from designer.workers import SpicePool

SHEET = "trade.md"
PICTURES = ("trade.svg", "trade.png", "trade-numerics.svg", "trade-numerics.png")
NAMES = (TRADE, SHEET, *PICTURES)
TIMEOUT = 900.0
"""The longest that one run of ngspice may take, s."""


@dataclass(frozen=True)
class Extent:
    """How much is measured. boards : of each response, none where 0. levels : of ngspice's steps.
    rounds : of timing."""

    boards: int = BOARDS
    levels: tuple[tuple[float, float], ...] = LEVELS
    rounds: int = ROUNDS


def measure(made: Synthesis, extent: Extent, *, seed: int, jobs: int, progress: Progress) -> Trade:
    """Every rung on every response of a design, and the boards.

    Raises
    ------
    EnvironmentMissing : ngspice is missing.
    """
    with SpicePool(jobs, timeout=TIMEOUT) as pool, SpicePool(1, timeout=TIMEOUT) as timed:
        require_ngspice(pool)
        step = progress.stage("rungs", len(made.found))
        answers = trade_rungs.answers(
            made,
            pool,
            SpiceClock(timed),
            levels=extent.levels,
            rounds_=extent.rounds,
            progress=step,
        )
        boards: Sequence[trade_yield.BoardTrade | None] = ()
        if extent.boards:
            checked = check(made, pool, progress)
            seconds = tuple(_ideal(some) for some in answers)
            boards = trade_yield.boards(
                made,
                checked,
                pool,
                seconds,
                count=extent.boards,
                seed=seed,
                jobs=jobs,
                progress=progress,
            )
    return trade(made, answers, boards)


def answer(
    modelfile: ModelFile,
    out: Path | None,
    options: Options,
    extent: Extent,
    progress: Progress,
) -> tuple[dict[str, Any], bool]:
    """The JSON object, and whether the folder held it already; ``out`` None writes nothing."""
    options.check()
    need_responses(modelfile)
    catalog = load_catalog()
    if out is None:
        progress.stage("responses of the model, parts")
        return _document(api.synthesise(modelfile, catalog), extent, options, progress), False
    folder = Folder(out)
    wanted = standing_inputs(folder, modelfile, catalog, progress)
    levels = [f"{share:g}:{reltol:g}" for share, reltol in extent.levels]
    inputs = {**wanted["design"][0], **asdict(extent), "levels": levels, "seed": options.seed}
    wanted["trade"] = (inputs, list(NAMES))
    todo = folder.decide(wanted, overwrite=options.overwrite, resume=options.resume)
    if not todo:
        return folder.json(TRADE), True
    progress.stage("responses of the model, parts")
    if "design" in todo:
        made = api.synthesise(modelfile, catalog)
        with naming(modelfile):
            files = design_files.texts(made)
        folder.begin({s: wanted[s] for s in todo}, design_files.design_provenance(made))
        design_files.write(folder, made, files)
        folder.finish("design")
    else:
        made = design_files.load(folder, modelfile, catalog)
    document = _document(made, extent, options, progress)
    if "design" not in todo:
        folder.begin({s: wanted[s] for s in todo}, design_files.design_provenance(made))
    _write(folder, document)
    folder.finish("trade")
    return folder.json(TRADE), False


def _document(
    made: Synthesis, extent: Extent, options: Options, progress: Progress
) -> dict[str, Any]:
    from designer.trade_files import trade_json  # Matplotlib takes a while to import

    began = time.perf_counter()
    jobs = cores() if options.jobs is None else options.jobs
    found = measure(made, extent, seed=options.seed, jobs=jobs, progress=progress)
    said = provenance(
        made.modelfile, made.catalog.hash, seed=options.seed, settings={"trade": asdict(extent)}
    )
    return trade_json(found, said, time.perf_counter() - began, made.modelfile.title)


def _write(folder: Folder, document: dict[str, Any]) -> None:
    from designer import plots, trade_files

    folder.write(TRADE, dumps(document))
    folder.write(SHEET, trade_files.sheet(document))
    for name, key in trade_files.KEYS.items():
        figure = trade_files.front(document, key)
        folder.write(f"{name}.svg", plots.to_svg(figure))
        stream = io.BytesIO()
        plots.to_png(figure, stream)
        folder.write(f"{name}.png", stream.getvalue())


def _ideal(some: Sequence[Answer]) -> float:
    """CPU time of a drive period of the rung ``ideal`` at the gate's tolerance, else at the
    finest."""
    found = [a for a in some if a.rung == "ideal"]
    at_gate = [a for a in found if a.settings["reltol"] == gate.RELTOL]
    return (at_gate or found)[-1].seconds if found else float("nan")
