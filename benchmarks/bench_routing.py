"""Routing: wire length, vias, time and open items of boards, and what KiCad and their files say.

Designs are made from model files, so boards are those of today's catalogue. Seconds are CPU time of
this process for the routing alone, pours included.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import shapely
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import designer
from benchmarks.bench_flow import commit, machine, table
from designer.board.board_parts import board_circuit
from designer.board.component import components
from designer.board.kicad_reader import read_board
from designer.board.kicad_rules import board_rules
from designer.board.sexpr import read
from designer.catalog.design_rule import FAIL, NOT_RUN
from designer.catalog.fab import fab_limits
from designer.check.synthesis_result import Synthesis
from designer.design_rules import on_board
from designer.fabrication import kicad_plot
from designer.fabrication.order import check_order
from designer.fabrication.plotted_copper import plotted
from designer.folders import board_files
from designer.folders.kicad_files import texts
from designer.jobs.board_routing import board_file
from designer.model.model_file import parse_model_file
from designer.routing.board_copper import BACK, FRONT, read_copper, with_layers
from designer.routing.routed_board import RoutedBoard, route_board

EXAMPLES = Path(__file__).parent.parent / "examples"
REPORT = Path(__file__).parent.parent / "reports" / "routing"
Change = Callable[[str], str]


def example(name: str, change: Change = str) -> str:
    """A model file of ``examples/``, changed."""
    return change((EXAMPLES / f"{name}.toml").read_text(encoding="utf-8"))


def mounted(mounting: str) -> Change:
    return lambda text: f'{text}\n[board]\nmounting = "{mounting}"\n'


def replaced(old: str, new: str) -> Change:
    """Another text in the place of the only one; the responses are not expected to stay."""

    def change(text: str) -> str:
        assert text.count(old) == 1, old
        lines = text.replace(old, new).splitlines()
        return "\n".join(line for line in lines if not line.startswith("expect"))

    return change


BOARDS: dict[str, tuple[Callable[[], str], int]] = {
    "paper": (lambda: example("paper"), 2),
    "rectifier": (lambda: example("rectifier"), 2),
    "drill": (lambda: example("drill"), 2),
    "one-sided": (lambda: example("paper", replaced('sides = "both"', 'sides = "upper"')), 2),
    "f20 = 0.3": (lambda: example("paper", replaced("f20 = 0.0", "f20 = 0.3")), 2),
    "composites": (
        lambda: example(
            "paper",
            lambda text: replaced('resistors = "E96"', 'resistors = "E12"')(
                replaced("composites = false", "composites = true")(text)
            ),
        ),
        2,
    ),
    "all on the surface": (lambda: example("paper", mounted("smd")), 2),
    "all through holes": (lambda: example("paper", mounted("tht")), 2),
    "backlash": (lambda: example("backlash"), 2),
    "hammer-base": (lambda: example("hammer-base"), 2),
    "paper, four layers": (lambda: example("paper"), 4),
    **{
        name: (lambda name=name: example(name), 2)  # type: ignore[misc]
        for name in (
            "three-masses", "duffing-gap", "preloaded", "rig", "shaw-holmes", "aberdeen", "spread",
        )
    },
}  # fmt: skip
"""Model file and copper layers of each board."""


@dataclass(frozen=True)
class Row:
    """A routed board."""

    board: str
    """Its name here."""
    parts: int
    """Components on it."""
    area: float
    """Its size [cm²]."""
    length: float
    """Tracks [mm]."""
    summing: float
    """Tracks of the longest summing node [mm]."""
    vias: int
    """Vias, those between the pours among them."""
    seconds: float
    """CPU time of the routing [s]."""
    open: int
    """Connections that stay open."""
    failed: tuple[str, ...] | None
    """Rules on boards that fail or are not run; None without KiCad."""
    faults: tuple[str, ...] | None
    """What its plotted files say that the circuit does not; None without KiCad."""


def measure(name: str, text: str, layers: int, folder: Path) -> tuple[Row, str]:
    """A board of this model file, and its text."""
    made = designer.synthesise(parse_model_file(text)).synthesis
    assert made is not None
    circuit, _ = board_circuit(made)
    placed = with_layers(texts(made)[board_file(made)], layers)
    rules = board_rules(circuit, made.modelfile.rules)
    routed = route_board(placed, circuit, rules)  # compiles, where that is not done
    before = time.process_time()
    again = route_board(placed, circuit, rules)
    seconds = time.process_time() - before
    if again != routed:
        raise RuntimeError(f"{name}: another board the second time")
    failed = broken(made, routed, folder)
    copper = read_copper(read(routed.text))
    nodes = {section.inverting for section in circuit.sections}
    row = Row(
        name,
        sum(footprint.wired for footprint in read_board(folder / "b.kicad_pcb").footprints),
        float(copper.area.area) / 100.0,
        sum(routed.lengths.values()),
        max(routed.lengths.get(node, 0.0) for node in nodes - {"0"}),
        routed.vias,
        seconds,
        sum(routed.open.values()),
        failed,
        None if failed is None else read_back(made, folder / "b.kicad_pcb"),
    )
    return row, routed.text


def read_back(made: Synthesis, path: Path) -> tuple[str, ...]:
    """Faults of the files that would be ordered."""
    board = read_board(path)
    plots = kicad_plot.plot(board, "board", protel_names=True)
    listed, bought = board_files.listed(made), board_files.bought(made)
    files = plotted(plots.gerbers)
    return check_order(files, plots.positions, board, listed, bought).faults


def broken(made: Synthesis, routed: RoutedBoard, folder: Path) -> tuple[str, ...] | None:
    """Ids of the rules on boards that this one does not pass; None without KiCad."""
    circuit, choice = board_circuit(made)
    path = folder / "b.kicad_pcb"
    path.write_text(routed.text, encoding="utf-8")
    listed = components(circuit, made.catalog, choice)
    rules = board_rules(circuit, made.modelfile.rules)
    limits = fab_limits([], made.catalog.folders)
    outcomes = on_board.checked(read_board(path), listed, rules, {}, limits)
    if all(o.status == NOT_RUN for o in outcomes if o.rule.id in ("clearance", "unconnected")):
        return None
    return tuple(o.rule.id for o in outcomes if o.status in (FAIL, NOT_RUN))


def report(rows: Sequence[Row], seconds: float) -> str:
    """routing.md."""
    body = [
        [
            row.board, str(row.parts), f"{row.area:.0f}", f"{row.length:.0f}",
            f"{row.summing:.1f}", str(row.vias), f"{row.seconds:.1f}", str(row.open),
            "not asked" if row.failed is None else ", ".join(row.failed) or "all pass",
            "not asked" if row.faults is None else "; ".join(row.faults) or "as the circuit",
        ]
        for row in rows
    ]  # fmt: skip
    header = [
        "board", "parts", "cm²", "track, mm", "longest summing node, mm", "vias", "CPU s", "open",
        "rules on the board (KiCad 9)", "plotted files, read back",
    ]  # fmt: skip
    lines = [
        f"# Routing of {len(rows)} boards",
        "",
        "Made by `python -m benchmarks routing`; the data are in `routing.json`.",
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}",
        f"- Took {seconds:.0f} s, the designs included.",
        "",
        "Each board is that of a design from a file of `examples/`, or of the paper's model with",
        "the one change that its name says. Each was",
        "routed twice, to the same bytes; seconds are CPU time of one core for the second time,",
        "pours included. About half of the vias only join the pours.",
        "",
        *table(header, body),
        "",
        "![The boards](routing.png)",
        "",
        "Front red, back blue, vias green; pads and ground pale. Pours are not drawn.",
    ]
    return "\n".join(lines) + "\n"


PALE, COLOURS = 0.35, {(True, False): "#c62828", (False, True): "#1e50c8", (True, True): "#1b8a3a"}


def draw(axes: Axes, text: str, row: Row) -> None:
    """One board from above, its pours left out."""
    copper = read_copper(read(text))
    for piece in sorted(copper.pieces, key=lambda p: (p.relief, p.layers == (True, False))):
        ring = shapely.get_coordinates(shapely.get_exterior_ring(piece.shape))
        ground = copper.nets.get(piece.net) in ("GND", "")
        colour = "#8a8a8a" if piece.relief else COLOURS[piece.on(FRONT), piece.on(BACK)]
        axes.add_collection(
            PolyCollection([ring], color=colour, alpha=PALE if ground else 0.9, lw=0)
        )
    edge = shapely.get_coordinates(shapely.get_exterior_ring(copper.area))
    axes.plot(*edge.T, color="black", lw=0.6)
    axes.set_aspect("equal")
    axes.invert_yaxis()
    axes.set_axis_off()
    axes.set_title(
        f"{row.board}\n{row.length:.0f} mm, {row.vias} vias, {row.seconds:.1f} s", fontsize=8
    )


def plot(boards: Sequence[tuple[Row, str]]) -> Figure:
    """All boards, each in its own scale."""
    figure = Figure(figsize=(15.0, 9.5), layout="constrained")
    panels = figure.subplots(2, -(-len(boards) // 2), squeeze=False).ravel()
    for axes in panels[len(boards) :]:
        axes.set_axis_off()
    for axes, (row, text) in zip(panels, boards, strict=False):
        draw(axes, text, row)
    return figure


def main(out: Path = REPORT, names: Sequence[str] = tuple(BOARDS)) -> str:
    """Measure the boards of these names and write the report."""
    began = time.perf_counter()
    boards = []
    with tempfile.TemporaryDirectory() as scratch:
        for name in names:
            model, layers = BOARDS[name]
            boards.append(measure(name, model(), layers, Path(scratch)))
            print(boards[-1][0], flush=True)
    rows = [row for row, _ in boards]
    out.mkdir(parents=True, exist_ok=True)
    figures = json.dumps([asdict(row) for row in rows], indent=1, ensure_ascii=False)
    (out / "routing.json").write_text(figures + "\n", encoding="utf-8")
    text = report(rows, time.perf_counter() - began)
    (out / "routing.md").write_text(text, encoding="utf-8")
    plot(boards).savefig(out / "routing.png", dpi=110, metadata={"Software": None})
    return f"{max(row.seconds for row in rows):.1f} s at most, {sum(row.open for row in rows)} open"
