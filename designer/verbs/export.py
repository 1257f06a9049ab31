"""The verb ``export``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from designer.base.defaults import Dialect
from designer.base.errors import InputError
from designer.base.progress import Progress, reported
from designer.verbs.console import say
from designer.verbs.declared import Out, Overwrite, Resume, Source, Verb, option
from designer.verbs.tables import files

if TYPE_CHECKING:
    from designer.answers.export_answer import ExportJson
    from designer.jobs.export_job import ExportResult


@reported
def export(
    model: Source,
    out: Out = None,
    *,
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
    session: Annotated[
        Path | str | None,
        option("--session", "FILE", "With --routed: tracks of another router first, a .ses.", Path),
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
        Path | str | None,
        option("--dsn", "FILE", "Instead: write the board for another router, a .dsn.", Path),
    ] = None,
    deck: Annotated[
        Sequence[Dialect],
        option(
            "--deck",
            None,
            "Instead: a deck for another simulator, with every response. May come twice.",
            reads=list[Dialect],
        ),
    ] = (),
    fab: Annotated[
        Sequence[str],
        option(
            "--fab",
            "NAME",
            "Instead: what a maker of boards is sent, such as jlcpcb or generic: Gerbers, holes, "
            "positions, bill. Needs KiCad 9 and a routed board. May come twice.",
            reads=list[str],
        ),
    ] = (),
    board: Annotated[
        Path | str | None,
        option("--board", "FILE", "The board for --fab, a .kicad_pcb [the folder's own].", Path),
    ] = None,
    parts: Annotated[
        Path | str | None,
        option("--parts", "FILE", "For --fab: your list of order numbers and prices, CSV.", Path),
    ] = None,
    accept: Annotated[
        Sequence[str],
        option(
            "--accept",
            "RULE",
            "For --fab: a design rule that may fail. May come twice.",
            reads=list[str],
        ),
    ] = (),
    overwrite: Overwrite = False,
    resume: Resume = False,
    progress: Progress | None = None,
) -> ExportResult:
    """Write the KiCad project (schematic, placed board, netlist), decks, or orders of boards.

    Without ``layers`` a board keeps as many as it has, 2 at first (docs/kicad.md,
    docs/fabrication.md).

    Raises
    ------
    InputError : a footprint that is not known here, files that somebody has changed, decks of
        another design or version, an unknown fab, a wrong list, or a board of another design.
    EnvironmentMissing : with ``fab``, no KiCad 9.
    """
    from designer.folders.model_source import source
    from designer.jobs import export_job
    from designer.jobs.options import Options
    from designer.routing.board_copper import INNER

    options = Options(overwrite=overwrite, resume=resume)
    if deck and fab:
        raise InputError(None, "--fab", ", ".join(fab), "no --deck beside it: one after the other")
    only = (("--board", board), ("--parts", parts), ("--accept", ", ".join(accept) or None))
    for name, value in only:
        if value is not None and not fab:
            raise InputError(None, name, str(value), "a fab that it is for: --fab NAME")
    if routed and (deck or fab):
        other = "--fab" if fab else "--deck"
        raise InputError(None, other, "with --routed", "one after the other: --routed first")
    for name, given in (("--keep", keep), ("--session", session), ("--layers", layers)):
        if given and not routed:
            raise InputError(None, name, "given alone", "--routed beside it")
    if layers not in (None, *INNER):
        raise InputError(None, "--layers", str(layers), "2 or 4")
    if dsn is not None and (routed or deck or fab):
        raise InputError(None, "--dsn", "with another", "one after the other")
    modelfile, folder = source(model, out)
    job = export_job.Export(modelfile, folder, options)
    if routed:
        return job.routed(keep, _path(session), layers)
    if dsn is not None:
        return job.for_router(Path(dsn))
    if fab:
        asked = export_job.OrderRequest(tuple(fab), _path(board), _path(parts), tuple(accept))
        return job.orders(asked)
    return job.decks(deck) if deck else job.project()


def _path(named: Path | str | None) -> Path | None:
    return None if named is None else Path(named)


def show(result: ExportResult) -> None:
    """What was written, or why an order is refused; and what may be done next."""
    answer = result.answer
    tables(result.folder, result.reused, answer.get("refused", []), answer)
    if "routing" in answer and result.passed:
        from designer.verbs import next_steps

        next_steps.show(next_steps.after_board(result.folder))


def tables(folder: Path, reused: bool, refused: Sequence[str], answer: ExportJson) -> None:
    """Where the files are and how a board was routed, or why an order is refused."""
    if refused:
        say("\n".join(["No order is written, since the board is not finished:", *refused]))
    elif "routing" not in answer:
        files(folder, reused)
    if "dsn" in answer:
        say(f"{answer['dsn']}: the board for another router")
    if (routing := answer.get("routing")) is not None:
        say(
            f"{folder / routing['board']}: {routing['length_mm']:.0f} mm of track and "
            f"{routing['vias']} vias laid"
        )
        for net, count in routing["open"].items():
            say(f"no way was found on {net}: {count} connections stay open")


VERB = Verb(
    export,
    "Make",
    "designer export out/model --deck ltspice",
    show=show,
    satisfied=lambda result: result.passed,
)
