"""The KiCad project of a design, decks, or what a fab is sent.

All are stages of the design folder: one for each deck and for each order, so that one may come
later and another stays.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base import progress
from designer.base.defaults import Dialect
from designer.base.design_folder import DESIGN, Folder
from designer.base.errors import EnvironmentMissing, InputError
from designer.base.frames import table_html
from designer.base.manifest import ORDERS, DeckStage, OrderStage, StageName, Stages
from designer.base.plain_json import FORMAT
from designer.base.schema import one_of
from designer.base.seal import sha256
from designer.base.version import __version__
from designer.board.board_facts import check_edge
from designer.board.bom_layouts import layouts
from designer.board.kicad_names import project_name
from designer.board.kicad_reader import BoardFile, read_board
from designer.catalog.design_rule import FAIL, NOT_RUN, PASS, RuleOutcome
from designer.catalog.design_rules import RULES
from designer.catalog.fab import Fab, fab_limits, fabs
from designer.catalog.parts_catalog import load_catalog
from designer.catalog.stock_list import stock_rows
from designer.check.deck_runs import response_runs, simulator_notes
from designer.check.synthesis_result import Synthesis
from designer.design_rules.kicad_drc import OPEN, SHORT
from designer.design_rules.kicad_program import KicadFailed, needed_version
from designer.fabrication.order import BoardOrder, FaultyOrder, order_files
from designer.folders import board_files, kicad_files
from designer.folders.design_files import design_provenance
from designer.folders.model_source import design_inputs_of
from designer.jobs.board_routing import route_in_folder, write_design
from designer.jobs.options import Options
from designer.jobs.rules_job import checked
from designer.jobs.stage_runner import StageRunner
from designer.model.model_file import ModelFile
from designer.spice import simulator_decks
from designer.spice.simulator_decks import file_name

if TYPE_CHECKING:
    from designer.answers.export_answer import ExportExtras, ExportJson
    from designer.answers.shared_rows import ProvenanceRow


@dataclass(frozen=True)
class OrderRequest:
    """What is to be ordered, and from whom."""

    fabs: tuple[str, ...]
    board: Path | None
    """The board file; None for the folder's own."""
    parts: Path | None
    """A list of order numbers and prices, or None."""
    accepted: tuple[str, ...]
    """Ids of rules that may fail."""


@dataclass(frozen=True)
class ExportResult:
    """What the verb ``export`` answers."""

    answer: ExportJson
    """The JSON object (docs/contract.md)."""
    folder: Path
    """The design folder."""
    reused: bool
    """Whether every file was there already."""

    @property
    def passed(self) -> bool:
        """Whether everything was written; False where an order is refused or a net stays open."""
        routing = self.answer.get("routing")
        return not self.answer.get("refused") and (routing is None or not routing["open"])

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that were asked for."""
        return tuple(self.folder / name for name in self.answer["files"])

    def _repr_html_(self) -> str:
        return table_html(str(self.folder), [{"file": name} for name in self.answer["files"]])


@dataclass
class Export:
    """What is written of a design into its folder, which is made where there is none."""

    modelfile: ModelFile
    out: Path
    options: Options

    def project(self) -> ExportResult:
        """Write the KiCad project."""
        runner, synthesis, reused = self._design()
        folder, files, inputs = runner.folder, kicad_files.texts(synthesis), _inputs(runner)
        if folder.state(kicad_files.STAGE, inputs) == "other" and not self.options.overwrite:
            # The project is of its time, as the design is: it may hold a routed board.
            assert folder.manifest is not None
            inputs = folder.manifest.stages[kicad_files.STAGE].inputs
            listed = folder.manifest.files.items()
            files = {name: "" for name, (stage, _) in listed if stage == kicad_files.STAGE}
            note = "so does its KiCad project: --overwrite makes it anew, with what is here"
            progress.note(note)
        todo = self._decide(folder, kicad_files.stages(inputs, files))
        if todo:
            progress.stage("KiCad project")
            kicad_files.write(folder, synthesis, inputs, files)
        return _result(runner, list(files), reused and not todo)

    def for_router(self, file: Path) -> ExportResult:
        """Write the project where there is none, and its board for another router."""
        runner, synthesis, reused = self._design()
        self._board(runner, None)
        write_design(runner.folder, synthesis, file, self.options)
        return _result(runner, [], reused, {"dsn": str(file)})

    def routed(
        self, keep: bool, session: Path | None = None, layers: int | None = None
    ) -> ExportResult:
        """Write the project where there is none, and route what is open on its board.

        session : of another router, or None. layers : of copper; None for as many as there are.

        Raises
        ------
        InputError : a board that somebody has changed, but with ``keep``.
        """
        made = self._design() if keep else None
        if made is None or made[0].folder.state(kicad_files.STAGE, _inputs(made[0])) == "new":
            self.project()
            made = self._design()
        runner, synthesis, reused = made
        folder = runner.folder
        routing = route_in_folder(folder, synthesis, session, layers)
        listed = {} if folder.manifest is None else folder.manifest.files
        files = [name for name, (stage, _) in listed.items() if stage == kicad_files.STAGE]
        return _result(runner, files, reused, {"routing": routing})

    def decks(self, dialects: Sequence[Dialect]) -> ExportResult:
        """Write decks."""
        runner, synthesis, reused = self._design()
        folder, inputs = runner.folder, _inputs(runner)
        names = {dialect: file_name(dialect) for dialect in dialects}
        stages: Stages = {DeckStage.of(d): (dict(inputs), [name]) for d, name in names.items()}
        todo = self._decide(folder, stages)
        if todo:
            progress.stage("decks")
            texts = {
                name: deck_text(synthesis, dialect)
                for dialect, name in names.items()
                if DeckStage.of(dialect) in todo
            }
            begun = {stage: stages[stage] for stage in todo}
            with folder.working(begun, design_provenance(synthesis)):
                for name, text in texts.items():
                    folder.write(name, text)
        return _result(runner, list(names.values()), reused and not todo)

    def orders(self, asked: OrderRequest) -> ExportResult:
        """Write what fabs are sent.

        An order that the rules forbid, or whose files do not make the circuit, is refused: nothing
        is written, and the answer says why.
        """
        try:
            version = needed_version()
        except KicadFailed as why:
            raise EnvironmentMissing(f"{why}: --fab needs it") from None
        names, parts = asked.fabs, asked.parts
        fabs(names, load_catalog().folders)
        check_accepted(asked.accepted)
        stock = () if parts is None else stock_rows(parts, "--parts")
        runner, synthesis, _ = self._design()
        folder, board = runner.folder, self._board(runner, asked.board)
        check_edge(board)
        inputs = {**_inputs(runner), "board": sha256(board.text.encode("utf-8")), "kicad": version}
        inputs["parts"] = None if parts is None else sha256(parts.read_bytes())
        inputs["accepted"] = ", ".join(sorted(asked.accepted))
        # What stands in the way is known before any work.
        wanted: Stages = {OrderStage.of(name): (dict(inputs), []) for name in names}
        todo = self._decide(folder, wanted)
        if not todo:
            return _ordered(runner, names, True)
        makers = [name for name in names if OrderStage.of(name) in todo]
        progress.stage("design rules")
        outcomes = checked(synthesis, board, makers).outcomes
        if reasons := refusals(outcomes, asked.accepted):
            return _refused(runner, names, reasons)
        progress.stage("Gerbers, holes, positions, read back")
        order = BoardOrder(
            name=project_name(self.modelfile.title),
            title=self.modelfile.title,
            board=board,
            components=board_files.listed(synthesis),
            bought=board_files.bought(synthesis, stock),
            not_checked=not_checked(outcomes),
            accepted=accepted_failures(outcomes, asked.accepted),
        )
        try:
            files = {
                OrderStage.of(fab.name): _order_texts(order, fab, runner)
                for fab in fabs(makers, runner.catalog.folders)
            }
        except FaultyOrder as why:
            return _refused(runner, names, read_back(why.faults))
        stages: Stages = {stage: (dict(inputs), list(texts)) for stage, texts in files.items()}
        self._decide(folder, stages)
        with folder.working(stages, design_provenance(synthesis)):
            for path, content in ChainMap(*files.values()).items():
                folder.write(path, content)
        return _ordered(runner, names, False)

    def _design(self) -> tuple[StageRunner, Synthesis, bool]:
        """The folder with its design, and whether the design was there already."""
        runner = StageRunner(self.modelfile, self.out, self.options)
        reused = not runner.decide()
        return runner, runner.design(), reused

    def _decide(self, folder: Folder, stages: Stages) -> list[StageName]:
        overwrite, resume = self.options.overwrite, self.options.resume
        return folder.decide(stages, overwrite=overwrite, resume=resume)

    def _board(self, runner: StageRunner, file: Path | None) -> BoardFile:
        """The board that is named, else the folder's own, whoever has routed it."""
        name = project_name(self.modelfile.title)
        own = runner.folder / f"{kicad_files.FOLDER}/{name}.kicad_pcb"
        if file is None and not own.is_file():
            self.project()
        return read_board(own if file is None else file)


def _refused(runner: StageRunner, names: Sequence[str], reasons: Sequence[str]) -> ExportResult:
    """The answer of an order that is not written."""
    return _result(runner, [], False, {"fabs": names, "refused": reasons})


def _order_texts(order: BoardOrder, fab: Fab, runner: StageRunner) -> dict[str, bytes]:
    """Every file of an order, by its name inside the design folder."""
    (layout,) = layouts([fab.table.bom], runner.catalog.folders)
    try:
        limits = fab_limits([fab.name], runner.catalog.folders)
        content = order_files(order, fab, layout, limits)
    except KicadFailed as why:
        raise EnvironmentMissing(str(why)) from None
    return {f"{ORDERS}/{fab.name}/{name}": text for name, text in content.items()}


def _ordered(runner: StageRunner, names: Sequence[str], reused: bool) -> ExportResult:
    """The answer with the files of these fabs."""
    assert runner.folder.manifest is not None
    folders = tuple(f"{ORDERS}/{name}/" for name in names)
    files = [name for name in runner.folder.manifest.files if name.startswith(folders)]
    return _result(runner, files, reused, {"fabs": names, "refused": []})


def deck_text(synthesis: Synthesis, dialect: Dialect) -> str:
    """A deck of a design, with every response that is wanted of it."""
    runs = response_runs(synthesis)
    return simulator_decks.write(
        dialect,
        synthesis.design.circuit,
        runs,
        title=synthesis.modelfile.title,
        notes=simulator_notes(synthesis, dialect, runs),
    )


def _inputs(runner: StageRunner) -> dict[str, Any]:
    """What decides the files that are exported now."""
    current = {"catalogue": runner.catalog.hash, "version": __version__}
    return {**design_inputs_of(runner.folder), **current}


def _result(
    runner: StageRunner, files: Sequence[str], reused: bool, more: ExportExtras | None = None
) -> ExportResult:
    origin: ProvenanceRow = runner.folder.json(DESIGN)["provenance"]
    extras: ExportExtras = {} if more is None else more
    answer: ExportJson = {
        "format": FORMAT,
        "files": sorted(files),
        "provenance": origin,
        **extras,
    }
    return ExportResult(answer, runner.folder.path, reused)


WANTED = (OPEN, SHORT)
"""Rules that have to be run and passed; any other may stay without a run."""


def check_accepted(names: Sequence[str]) -> None:
    """Whether these are rules whose failure may be accepted.

    Raises
    ------
    InputError : no such rule, or one without which no board works.
    """
    known = [rule.id for rule in RULES if rule.id not in WANTED]
    for name in names:
        if name not in known:
            raise InputError(None, "--accept", name, one_of(name, known))


def refusals(outcomes: Sequence[RuleOutcome], accepted: Sequence[str] = ()) -> tuple[str, ...]:
    """A line for each reason against an order; none where it may be sent.

    accepted : rules that may fail.
    """
    return tuple(
        f"{one.rule.id}: {one.found}; {one.do}"
        for one in outcomes
        if (one.status == FAIL and one.rule.id not in accepted)
        or (one.rule.id in WANTED and one.status != PASS)
    )


def read_back(faults: Sequence[str]) -> tuple[str, ...]:
    """A line for each fault that an order's files had when they were read back."""
    do = "fill the zones anew, mend the board, and run export --fab again"
    return tuple(f"order-files: {fault}; {do}" for fault in faults)


def accepted_failures(outcomes: Sequence[RuleOutcome], accepted: Sequence[str]) -> tuple[str, ...]:
    """A line for each rule that fails and is accepted."""
    return tuple(
        f"{one.rule.id}: {one.found}"
        for one in outcomes
        if one.status == FAIL and one.rule.id in accepted
    )


def not_checked(outcomes: Sequence[RuleOutcome]) -> tuple[str, ...]:
    """A line for each rule that was not run, with the reason."""
    return tuple(f"{one.rule.id}: {one.found}" for one in outcomes if one.status == NOT_RUN)
