"""The files of a design folder that are about its board: bills of materials, notes, drawing."""

from __future__ import annotations

from designer import board_notes
from designer.api import Synthesis
from designer.board_parts import board_circuit
from designer.bom import bill, bill_csv
from designer.bom_layouts import file_of, layouts
from designer.components import components, pin_numbers, to_buy
from designer.modelfile import ModelFile

BILL, NOTES, DRAWING, PICTURE = "bom.csv", "board.md", "schematic.svg", "schematic.png"


def names(modelfile: ModelFile) -> list[str]:
    """The names of these files for a model."""
    return [BILL, NOTES, DRAWING, PICTURE, *(file_of(name) for name in modelfile.board.bom)]


def texts(made: Synthesis) -> dict[str, str]:
    """The content of all but the picture, by name.

    Raises
    ------
    InputError : a case, a part or a layout that the catalogue does not have.
    Unreachable : a value that cannot be bought.
    """
    from designer import drawing  # with matplotlib, which nothing before this needs

    circuit, choice = board_circuit(made)
    found = components(circuit, made.catalog, choice)
    bought = bill(to_buy(found, choice))
    others = layouts(made.modelfile.board.bom, made.catalog.folders)
    return {
        BILL: bill_csv(bought),
        NOTES: board_notes.markdown(made, circuit, choice, found),
        DRAWING: drawing.svg(circuit, made.modelfile.title, pin_numbers(found)),
        **{layout.file: layout.csv(bought) for layout in others},
    }


def picture(made: Synthesis) -> bytes:
    """The drawing once more, as points."""
    from designer import drawing

    circuit, choice = board_circuit(made)
    numbers = pin_numbers(components(circuit, made.catalog, choice))
    return drawing.png(circuit, made.modelfile.title, numbers=numbers)
