"""The files of a design folder that are about its board: bills of materials, notes, drawing."""

from __future__ import annotations

from collections.abc import Sequence

from designer.base.errors import InputError
from designer.base.progress import doing
from designer.board import board_notes
from designer.board.board_parts import board_circuit
from designer.board.bom import Line, bill, bill_csv
from designer.board.bom_layouts import file_of, layouts
from designer.board.component import Component, components, pin_numbers, to_buy
from designer.catalog.stock_list import StockRow
from designer.check.synthesis_result import Synthesis
from designer.design_rules.rule_subject import RuleSubject
from designer.fabrication.bench_sheet import bench_sheet
from designer.fabrication.board_cost import CostEstimate, cost_markdown
from designer.model.model_file import ModelFile

BILL, NOTES, DRAWING, PICTURE = "bom.csv", "board.md", "schematic.svg", "schematic.png"


def names(modelfile: ModelFile) -> list[str]:
    """The names of these files for a model."""
    return [BILL, NOTES, DRAWING, PICTURE, *(file_of(name) for name in modelfile.board.bom)]


def notes(
    synthesis: Synthesis, subject: RuleSubject | InputError, cost: CostEstimate | None
) -> str:
    """The text of ``board.md``; raises as ``bills`` does. subject : what the circuit does, for the
    sheet at the bench. cost : of the boards, where they can be placed."""
    circuit, choice = board_circuit(synthesis)
    parts = components(circuit, synthesis.catalog, choice)
    sections = [board_notes.markdown(synthesis, circuit, choice, parts)]
    sheet = bench_sheet(subject) if isinstance(subject, RuleSubject) else None
    sections += [] if sheet is None else [sheet.markdown]
    sections += [] if cost is None else [cost_markdown(cost)]
    return "\n".join(section for section in sections if section)


def bills(synthesis: Synthesis) -> dict[str, str]:
    """The bills of materials, by name.

    Raises
    ------
    InputError : a case, a part or a layout that the catalogue does not have.
    Unreachable : a value that cannot be bought.
    """
    doing("bill of materials")
    lines = bought(synthesis)
    others = layouts(synthesis.modelfile.board.bom, synthesis.catalog.folders)
    return {
        BILL: bill_csv(lines),
        **{layout.file: layout.csv(lines) for layout in others},
    }


def listed(synthesis: Synthesis) -> tuple[Component, ...]:
    """Everything of the board and the bill; raises as ``bills`` does."""
    circuit, choice = board_circuit(synthesis)
    return components(circuit, synthesis.catalog, choice)


def bought(synthesis: Synthesis, stock: Sequence[StockRow] = ()) -> tuple[Line, ...]:
    """The lines of the bill; raises as ``bills`` does. stock : a list before the catalogue's."""
    _, choice = board_circuit(synthesis)
    return bill(to_buy(listed(synthesis), choice), (*stock, *synthesis.catalog.stock))


def drawing(synthesis: Synthesis) -> dict[str, str | bytes]:
    """The drawing, as lines and as points, by name."""
    from designer.schematic import schematic_drawing  # with matplotlib, which all else needs not

    doing("drawing")
    circuit, choice = board_circuit(synthesis)
    numbers = pin_numbers(components(circuit, synthesis.catalog, choice))
    title = synthesis.modelfile.title
    return {
        DRAWING: schematic_drawing.svg(circuit, title, numbers),
        PICTURE: schematic_drawing.png(circuit, title, numbers=numbers),
    }
