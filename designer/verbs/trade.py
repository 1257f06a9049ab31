"""The verb ``trade``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from designer.base.defaults import SEED, TRADE_BOARDS, check_count
from designer.base.errors import InputError
from designer.base.frames import frame, table_html
from designer.base.printed import tell
from designer.base.progress import Progress, reported
from designer.verbs.declared import Jobs, Out, Overwrite, OwnSeed, Resume, Source, Verb, option

if TYPE_CHECKING:
    import pandas as pd

    from designer.answers.trade_answer import TradeAnswer
    from designer.model.model_file import ModelFile


@dataclass(frozen=True)
class TradeResult:
    """What the verb ``trade`` answers."""

    answer: TradeAnswer
    """The JSON object (docs/contract.md)."""
    reused: bool
    """Whether the folder held the answer already."""

    def rungs(self) -> pd.DataFrame:
        """Time and error of every fidelity on every response."""
        return frame(self.answer["rungs"])

    def boards(self) -> pd.DataFrame:
        """What both engines say of the same boards, a row for each response."""
        return frame(self.answer["boards"])

    def cheapest(self) -> pd.DataFrame:
        """The cheapest fidelity for each question."""
        return frame(self.answer["cheapest"])

    def _repr_html_(self) -> str:
        names = ("question", "of", "expected", "rung", "level", "bound", "measured")
        rows = [{name: row.get(name) for name in names} for row in self.answer["cheapest"]]
        return table_html("The cheapest rung for each question", rows)


@reported
def trade(
    model: Source,
    out: Out = None,
    *,
    boards: Annotated[
        int | None,
        option(
            "--boards",
            "N",
            f"Boards of each response for the yield; 0: none [{TRADE_BOARDS}, or the folder's "
            "own].",
        ),
    ] = None,
    truth: Annotated[
        Literal["full", "vendor"] | None,
        option(
            "--truth",
            None,
            "What stands for the board: full op-amps from data-sheet figures, or the vendor's "
            "macromodel that the catalogue names [full].",
        ),
    ] = None,
    seed: OwnSeed = None,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    progress: Progress | None = None,
) -> TradeResult:
    """Measure time and error of each way to simulate this design, and name the cheapest.

    Of a model file without ``out`` nothing is written.

    Raises
    ------
    InputError : a number that cannot be, or a folder that holds something else.
    EnvironmentMissing : ngspice is missing.
    """
    from designer.base.design_folder import Folder
    from designer.fidelity.fidelity_answers import TOP, VENDOR
    from designer.folders.model_source import source
    from designer.jobs import folder_numbers, trade_job
    from designer.jobs.options import MOST_SAMPLES, Options, stated_options
    from designer.model.model_file import ModelFile, read_model_file

    argument = model if isinstance(model, ModelFile) else Path(model)
    words = {"boards": boards, "seed": seed, "truth": truth}
    usual = {"boards": TRADE_BOARDS, "seed": SEED, "truth": TOP}
    numbers: dict[str, Any] = usual | stated_options(words)
    if numbers["truth"] not in (TOP, VENDOR):
        raise InputError(None, "--truth", numbers["truth"], f"{TOP} or {VENDOR}")
    check_count("--boards", numbers["boards"], 0, MOST_SAMPLES)
    options = Options(numbers["seed"], jobs, overwrite=overwrite, resume=resume)
    options.check()
    folder: Path | None = None
    if out is not None or (isinstance(argument, Path) and argument.is_dir()):
        modelfile, folder = source(argument, out)
    else:
        modelfile = argument if isinstance(argument, ModelFile) else read_model_file(argument)
    if folder is not None and folder_numbers.goes_on(argument, folder, resume):
        numbers |= folder_numbers.stage_numbers(
            Folder(folder), "trade", tuple(words)
        ) | stated_options(words)
        options = replace(options, seed=numbers["seed"])
    extent = trade_job.TradeExtent(boards=numbers["boards"], truth=numbers["truth"])
    if extent.truth == VENDOR:
        _need_vendor_model(modelfile)
    return TradeResult(*trade_job.answer(modelfile, folder, options, extent))


def _need_vendor_model(modelfile: ModelFile) -> None:
    """InputError unless the catalogue names a vendor's model of the wanted op-amp."""
    from designer.catalog.parts_catalog import load_catalog
    from designer.fidelity.fidelity_answers import TOP, VENDOR

    spec = modelfile.circuit
    opamp = load_catalog().opamp(spec.opamp, spec.supply)
    if opamp.spice is None:
        expected = f"{TOP}: the catalogue has no vendor's model of {opamp.name}"
        raise InputError(None, "--truth", VENDOR, expected)


def show(result: TradeResult) -> None:
    """Time and error of every fidelity."""
    from designer.fidelity.trade_files import sheet

    tell(sheet(result.answer))


VERB = Verb(trade, "Study", "designer trade out/model --boards 100", show=show)
