"""The benchmark of routing has model files that are understood, and states what it measured."""

from __future__ import annotations

from benchmarks import bench_routing
from designer.model.model_file import parse_model_file
from tests.shared.kicad_cases import case_files


def test_every_board_has_a_model_file_of_its_own() -> None:
    texts = {name: text() for name, (text, _) in bench_routing.BOARDS.items()}
    assert all(parse_model_file(text) for text in texts.values())
    assert len(set(texts.values())) == len(texts) - 1, "the paper's stands there twice"


def test_the_report_has_a_row_and_a_picture_of_each_board() -> None:
    row = bench_routing.Row("a board", 40, 36.4, 561.04, 14.25, 74, 2.31, 1, ("unconnected",), ())
    text = bench_routing.report([row], 12.0)
    cells = [cell.strip() for cell in text.split("| a board ")[1].splitlines()[0].split("|")]
    assert cells[1:-1] == [
        "40",
        "36",
        "561",
        "14.2",
        "74",
        "2.3",
        "1",
        "unconnected",
        "as the circuit",
    ]
    board = next(t for n, t in case_files("one mass").items() if n.endswith(".kicad_pcb"))
    (panel, *_) = bench_routing.plot([(row, board)]).axes
    assert panel.get_title() == "a board\n561 mm, 74 vias, 2.3 s"
    assert len(panel.collections) > 50
