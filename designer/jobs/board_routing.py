"""Tracks and pours on the board of a design folder, for the verbs ``export`` and ``run``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from designer.base import progress
from designer.base.atomic_write import appearing
from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.base.manifest import file_hash
from designer.board.board_parts import board_circuit
from designer.board.component import components
from designer.board.kicad_names import project_name
from designer.board.kicad_reader import check_belongs, read_board
from designer.board.kicad_rules import board_rules
from designer.check.synthesis_result import Synthesis
from designer.folders import kicad_files
from designer.jobs.options import Options
from designer.routing.board_copper import layer_count, with_layers
from designer.routing.routed_board import RoutedBoard, route_board
from designer.routing.specctra import design_text, with_session

if TYPE_CHECKING:
    from designer.answers.export_answer import RoutingRow


def board_file(synthesis: Synthesis) -> str:
    """The board's name inside the design folder."""
    return f"{kicad_files.FOLDER}/{project_name(synthesis.modelfile.title)}.kicad_pcb"


def route_in_folder(
    folder: Folder,
    synthesis: Synthesis,
    session: Path | None = None,
    count: int | None = None,
) -> RoutingRow:
    """Route what is open on the folder's board; what the answer says of it.

    session : of another router, whose tracks and vias come first, in the place of the board's.
    count : of copper layers, 2 or 4; None for as many as the board has. With another number its
    tracks are laid anew. A
    board that somebody has changed stays one: the manifest keeps the hash of what was written
    before, so that no verb replaces it.

    Raises
    ------
    InputError : the board cannot be read, is of another design, or has another number of layers
        and somebody's changes.
    """
    name = board_file(synthesis)
    circuit, choice = board_circuit(synthesis)
    there = read_board(folder / name)
    check_belongs(there, components(circuit, synthesis.catalog, choice))
    progress.stage("routing")
    ours = _as_written(folder, name, (folder / name).read_bytes())
    text, layers = there.text, layer_count(there.text)
    if count not in (None, layers):
        if not ours:
            expected = f"{layers}, which the board has that somebody has changed"
            raise InputError(None, "--layers", str(count), expected)
        text = with_layers(text, count)
    text = text if session is None else with_session(text, session)
    rules = board_rules(circuit, synthesis.modelfile.rules)
    routed = route_board(text, circuit, rules, folder / name)
    if ours:
        folder.rewrite(name, routed.text)
    else:
        _replace(folder / name, routed.text)
    return _answer(name, routed)


def route_own_board(folder: Folder, synthesis: Synthesis) -> None:
    """Route the folder's board where it is as it was written and nothing is routed yet.

    What stands in the way is a note: everything else of the folder goes without tracks.
    """
    board = kicad_files.own_board(folder)
    if board is None or board.copper:
        return
    try:
        open_ = route_in_folder(folder, synthesis)["open"]
    except InputError as error:
        progress.note(f"the board is not routed: {error}")
        return
    if open_:
        progress.note(f"the board is routed but for {', '.join(open_)}")


def write_design(folder: Folder, synthesis: Synthesis, path: Path, options: Options) -> None:
    """Write the folder's board as Specctra's design for another router.

    Raises
    ------
    InputError : the board cannot be read or is of another design, or a file is in the way.
    """
    if path.exists() and not options.overwrite:
        raise InputError(path, "--dsn", "a file", "a name that is free, or --overwrite")
    circuit, choice = board_circuit(synthesis)
    board = read_board(folder / board_file(synthesis))
    check_belongs(board, components(circuit, synthesis.catalog, choice))
    progress.stage("design for another router")
    rules = board_rules(circuit, synthesis.modelfile.rules)
    name = project_name(synthesis.modelfile.title)
    _replace(path, design_text(board, name, circuit, rules))


def _as_written(folder: Folder, name: str, content: bytes) -> bool:
    """Whether the file is what the manifest says, or was about to be written anew when the tool was
    killed, of which the manifest says nothing."""
    assert folder.manifest is not None
    _, digest = folder.manifest.files.get(name, ("", ""))
    return digest is None or digest == file_hash(name, content)


def _replace(path: Path, text: str) -> None:
    with appearing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def _answer(name: str, routed: RoutedBoard) -> RoutingRow:
    return {
        "board": name,
        "layers": layer_count(routed.text),
        "open": dict(routed.open),
        "length_mm": round(sum(routed.lengths.values()), 3),
        "vias": routed.vias,
    }
