"""A design's fidelities measured, and the stage ``trade`` of its folder."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base import progress
from designer.base.defaults import TRADE_BOARDS
from designer.base.design_folder import Folder
from designer.base.manifest import ManifestStage
from designer.base.plain_json import dumps
from designer.centering import stage_choice
from designer.check.synthesis_result import Synthesis
from designer.fidelity import fidelity_answers as trade_fidelities, pieces as trade_pieces, yields
from designer.fidelity.cpu_clock import SpiceClock
from designer.fidelity.fidelity_answers import LEVELS, ROUNDS, TOP, Truths
from designer.fidelity.fidelity_errors import ResponseLabel, compare
from designer.fidelity.pieces import CHUNK, PIECES, TradePieces, read_pieces
from designer.fidelity.trade_study import Trade, TradedResponse, trade as traded
from designer.fidelity.yields import BoardTrade, LeftOut, Tally
from designer.folders.design_source import grade_inputs
from designer.folders.origin import provenance
from designer.folders.report_sections import renew_report
from designer.jobs.fidelity_choice import TRADE
from designer.jobs.options import Options
from designer.jobs.stage_runner import StageRunner
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile, need_responses
from designer.spice.pool import SpicePool, require_ngspice
from designer.verdicts.verdict import StudyPlan

if TYPE_CHECKING:
    from designer.answers.trade_answer import TradeAnswer

SHEET = "trade.md"
PICTURES = ("trade.svg", "trade.png", "trade-numerics.svg", "trade-numerics.png")
NAMES = (TRADE, SHEET, *PICTURES)
TIMEOUT = 900.0
"""The longest that one run of ngspice may take, s."""
RULES = 6
"""Raised whenever the same inputs are to give another answer."""


@dataclass(frozen=True)
class TradeExtent:
    """How much is measured."""

    boards: int = TRADE_BOARDS
    """Boards of each response; none where 0."""
    levels: tuple[tuple[float, float], ...] = LEVELS
    """Levels of ngspice's steps."""
    rounds: int = ROUNDS
    truth: Truths = TOP
    """What stands for the board: our full op-amps, or the vendor's macromodel."""


def measure(
    synthesis: Synthesis,
    extent: TradeExtent,
    pieces: TradePieces,
    *,
    seed: int,
    jobs: int,
) -> Trade:
    """Every fidelity on every response of a design, and the boards.

    pieces : the pieces that are stored already for this very design, extent and seed.

    Raises
    ------
    EnvironmentMissing : ngspice is missing.
    """
    count = len(synthesis.model_responses)
    with SpicePool(jobs, timeout=TIMEOUT) as pool, SpicePool(1, timeout=TIMEOUT) as timed:
        require_ngspice(pool)
        clock = SpiceClock(timed)
        fidelities = []
        for number, r in enumerate(synthesis.model_responses, start=1):

            def fidelity(number: int = number, r: ModelResponse = r) -> dict[str, Any]:
                progress.stage(f"response {number} of {count}, every rung")
                measured = trade_fidelities.measured(
                    synthesis,
                    r,
                    pool,
                    clock,
                    levels=extent.levels,
                    rounds_=extent.rounds,
                    truth=extent.truth,
                )
                rows, truth = compare(ResponseLabel.of(number, r), measured.answers, extent.truth)
                return trade_pieces.fidelities_json(
                    rows, truth, measured.settings, measured.seconds
                )

            fidelities.append(trade_pieces.fidelities(pieces.piece(f"rungs {number}", fidelity)))
        responses = []
        for number, (rows, truth, settings, seconds) in enumerate(fidelities, start=1):
            boards: BoardTrade | LeftOut | None = None
            if extent.boards:
                plan = yields.question(
                    synthesis, number, settings, samples=extent.boards, seed=seed
                )
                label = truth.label
                if isinstance(plan, str):
                    boards = LeftOut(label, plan)
                else:
                    tallied = _tally(plan, label, count, pieces, pool, jobs)
                    boards = BoardTrade.of(label, tallied, seconds)
            responses.append(TradedResponse(rows, truth, boards))
    return traded(responses)


def _tally(
    plan: StudyPlan,
    label: ResponseLabel,
    count: int,
    pieces: TradePieces,
    pool: SpicePool,
    jobs: int,
) -> Tally:
    """The boards of one response, of ``count``, piece by piece."""
    total = Tally()
    for first in range(0, plan.samples, CHUNK):
        samples = range(first, min(first + CHUNK, plan.samples))

        def some(samples: range = samples) -> dict[str, Any]:
            boards = f"boards {samples.start + 1} to {samples.stop} of {plan.samples}"
            step = progress.stage(f"response {label.number} of {count}, {boards}", len(samples))
            return asdict(yields.tally(plan, samples, pool, jobs, step))

        name = f"boards {label.number}, {samples.start} to {samples.stop - 1}"
        total += trade_pieces.tally(pieces.piece(name, some))
    return total


def answer(
    modelfile: ModelFile,
    out: Path | None,
    options: Options,
    extent: TradeExtent,
) -> tuple[TradeAnswer, bool]:
    """The JSON object, and whether the folder held it already; ``out`` None writes nothing."""
    options.check()
    need_responses(modelfile)
    if out is None:
        progress.stage("responses of the model, parts")
        synthesis = stage_choice.synthesise(modelfile, jobs=options.workers)
        return _document(synthesis, extent, TradePieces(), options), False
    runner = StageRunner(modelfile, out, options)
    folder = runner.folder
    levels = [f"{factor:g}:{reltol:g}" for factor, reltol in extent.levels]
    inputs = {**runner.design_inputs, **asdict(extent), "levels": levels, "seed": options.seed}
    inputs |= {"rules": RULES, **grade_inputs(modelfile, runner.catalog)}
    if not runner.decide({"trade": (inputs, [*NAMES, PIECES])}):
        renew_report(folder)
        return folder.json(TRADE), True
    key = ManifestStage(inputs).hash
    unfinished = folder.state("trade", inputs) == "unfinished"
    resumes = options.resume and unfinished and "design" not in runner.todo
    pieces = read_pieces(folder / PIECES, key, progress.note) if resumes else {}
    synthesis = runner.design()
    guard = folder.watch()

    def save(text: str) -> None:
        guard()
        folder.write(PIECES, text)

    document = _document(synthesis, extent, TradePieces(pieces, save, key), options)
    guard()
    _write(folder, document)
    (folder / PIECES).unlink(missing_ok=True)
    folder.finish("trade")
    renew_report(folder)
    return folder.json(TRADE), False


def _document(
    synthesis: Synthesis,
    extent: TradeExtent,
    pieces: TradePieces,
    options: Options,
) -> TradeAnswer:
    from designer.fidelity.trade_files import trade_json  # Matplotlib takes a while to import

    measured = measure(synthesis, extent, pieces, seed=options.seed, jobs=options.workers)
    file = synthesis.modelfile
    origin = provenance(
        file,
        synthesis.catalog.hash,
        seed=options.seed,
        settings={"trade": asdict(extent)},
    )
    return trade_json(measured, origin, pieces.seconds, file.title, file.si)


def _write(folder: Folder, document: TradeAnswer) -> None:
    from designer.base import figure_style
    from designer.fidelity import trade_files

    folder.write(TRADE, dumps(document))
    folder.write(SHEET, trade_files.sheet(document))
    for name, key in trade_files.KEYS.items():
        figure = trade_files.front(document, key)
        folder.write(f"{name}.svg", figure_style.to_svg(figure))
        folder.write(f"{name}.png", figure_style.to_png(figure))
