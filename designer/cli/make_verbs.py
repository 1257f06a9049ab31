"""The verbs on a finished design: files of its board, its rules, and the board on the bench."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from designer.cli import next_steps
from designer.cli.app import (
    Out,
    Output,
    Session,
    Source,
    option,
    verb,
)

if TYPE_CHECKING:
    pass


class DeckName(StrEnum):
    """Simulators that a deck is written for."""

    LTSPICE = "ltspice"
    PORTABLE = "portable"


@verb("Make", "designer export out/model --deck ltspice", "overwrite", "resume")
def export(
    session: Session,
    model: Source,
    out: Out = None,
    routed: Annotated[
        bool,
        option(
            "--routed", None, "With tracks and ground pours; exit status 1 where one stays open."
        ),
    ] = False,
    keep: Annotated[
        bool,
        option("--keep", None, "With --routed: on the board as you changed it, only what is open."),
    ] = False,
    routes: Annotated[
        Path | None,
        option("--session", "FILE", "With --routed: tracks of another router first, a .ses."),
    ] = None,
    layers: Annotated[
        int | None,
        option(
            "--layers",
            "N",
            "With --routed: copper layers, 2, or 4 with planes of ground between the sides "
            "[as the board has; 2].",
        ),
    ] = None,
    dsn: Annotated[
        Path | None,
        option("--dsn", "FILE", "Instead: write the board for another router, a .dsn."),
    ] = None,
    deck: Annotated[
        list[DeckName] | None,
        option(
            "--deck",
            None,
            "Instead: a deck for another simulator, with every response. May come twice.",
        ),
    ] = None,
    fab: Annotated[
        list[str] | None,
        option(
            "--fab",
            "NAME",
            "Instead: what a maker of boards is sent, such as jlcpcb or generic: Gerbers, holes, "
            "positions, bill. Needs KiCad 9 and a routed board. May come twice.",
        ),
    ] = None,
    board: Annotated[
        Path | None,
        option("--board", "FILE", "The board for --fab, a .kicad_pcb [the folder's own]."),
    ] = None,
    parts: Annotated[
        Path | None,
        option("--parts", "FILE", "For --fab: your list of order numbers and prices, CSV."),
    ] = None,
    accept: Annotated[
        list[str] | None,
        option("--accept", "RULE", "For --fab: a design rule that may fail. May come twice."),
    ] = None,
    **shared: Any,
) -> Output:
    """Write the KiCad project (schematic, placed board, netlist), decks, or orders of boards."""
    from designer.cli import tables
    from designer.jobs import export_job

    result = export_job.export(
        model,
        out,
        routed=routed,
        keep=keep,
        session=routes,
        layers=layers,
        dsn=dsn,
        deck=[name.value for name in deck or ()],
        fab=fab or (),
        board=board,
        parts=parts,
        accept=accept or (),
        progress=session.progress,
        **shared,
    )
    refused = result.answer.get("refused", [])

    def show() -> None:
        tables.exported(result.folder, result.reused, refused, result.answer)
        if routed and result.passed:
            next_steps.show(next_steps.after_board(result.folder))

    return Output(result.answer, show, result.passed)


@verb("Make", "designer rules out/model --board out/model/kicad/model.kicad_pcb")
def rules(
    session: Session,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A design folder.")],
    board: Annotated[
        Path | None, option("--board", "FILE", "Its board, a .kicad_pcb of KiCad 7 to 9.")
    ] = None,
    fab: Annotated[
        list[str] | None,
        option("--fab", "NAME", "With --board: who shall make it, by its limits. May come twice."),
    ] = None,
    junit: Annotated[Path | None, option("--junit", "FILE", "Also write a JUnit report.")] = None,
    **shared: Any,
) -> Output:
    """Test a circuit and its board against the design rules; exit status 1 where one fails."""
    from designer.cli import tables
    from designer.jobs import rules_job

    result = rules_job.rules(
        folder, board=board, fab=fab or (), junit=junit, progress=session.progress, **shared
    )

    def show() -> None:
        tables.rules(result.answer)
        next_steps.show(next_steps.after_rules(folder, result.answer))

    return Output(result.answer, show, result.passed)


@verb("Make", "designer bench out/model --record scope.csv --out out/board-1", "jobs", "overwrite")
def bench(
    session: Session,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A design folder.")],
    record: Annotated[
        list[Path] | None,
        option("--record", "FILE", "What an oscilloscope wrote of one board; may be repeated."),
    ] = None,
    omega: Annotated[
        float | None,
        option("--omega", "W", "Drive frequency in the model's own units [found in the record]."),
    ] = None,
    channels: Annotated[
        str | None,
        option("--channels", "NET=CHANNEL,…", "What each channel shows [found by the shapes]."),
    ] = None,
    fit: Annotated[
        bool, option("--fit", None, "Also look for the board behind them, and what to turn on it.")
    ] = False,
    boards: Annotated[
        bool,
        option("--boards", None, "Records of several boards, each in a folder with its name."),
    ] = False,
    decay: Annotated[
        list[Path] | None,
        option("--decay", "FILE", "A record that goes on when the generator is off; for --fit."),
    ] = None,
    out: Annotated[
        Path | None, option("--out", "DIR", "Write the answer, its page and pictures there.")
    ] = None,
    ngspice: Annotated[
        bool,
        option("--ngspice/--no-ngspice", None, "Lay ngspice's motion over each record [yes]."),
    ] = True,
    **shared: Any,
) -> Output:
    """Say what records of a board show, and how sure that is; exit status 1 where it is not sure or
    not what is wanted there."""
    from designer.cli import console, record_tables, tables
    from designer.jobs import bench_job

    roles = None if channels is None else bench_job.channels_of(channels)
    result = bench_job.bench(
        folder,
        record or (),
        omega=omega,
        channels=roles,
        fit=fit,
        boards=boards,
        decay=decay or (),
        ngspice=ngspice,
        out=out,
        progress=session.progress,
        **shared,
    )

    def show() -> None:
        with console.answering():
            record_tables.benched(result.answer)
        if out is not None:
            tables.files(out, False)

    return Output(result.answer, show, result.satisfied)
