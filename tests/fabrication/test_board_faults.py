"""Faults put into a finished board by hand: none of them gets an order, and no harmless change of
the same kinds is refused.

Each fault is a change of one saved board. The rules that read the file, KiCad's check, and what the
plotted files say when they are read back all stand between it and the maker.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.board.board_facts import check_edge
from designer.board.board_parts import board_circuit
from designer.board.bom import Line
from designer.board.bom_layouts import layouts
from designer.board.component import Component
from designer.board.footprints import footprint as shape_of
from designer.board.kicad_reader import check_belongs, read_board
from designer.board.kicad_rules import CustomRule, board_rules
from designer.board.sexpr import Expression, expression_text, read
from designer.catalog.fab import fab_limits, fabs
from designer.check.synthesis_result import synthesise
from designer.design_rules import on_board, on_fab
from designer.design_rules.kicad_drc import DesignRuleCheck, check
from designer.fabrication.kicad_plot import plot
from designer.fabrication.order import BoardOrder, FaultyOrder, _places, order_files
from designer.folders import board_files
from designer.folders.kicad_files import texts
from designer.jobs.board_routing import board_file
from designer.jobs.export_job import refusals
from designer.model.model_file import read_model_file
from designer.routing.routed_board import route_board
from tests.shared.kicad_python import asked_of_pcbnew
from tests.shared.stages import CATALOG

pytestmark = [pytest.mark.kicad, pytest.mark.slow]
ROOT = Path(__file__).parent.parent.parent
MODEL = ROOT / "examples" / "duffing-gap.toml"
"""One mass, four op-amp sections of one package and two of another, diodes, references, parts
through holes."""
Change = Callable[[Expression], Expression]
ID = '(uuid "11111111-1111-4111-8111-111111111111")'


@dataclass(frozen=True)
class Finished:
    """A routed board and what its design says of it."""

    text: str
    sheet: str
    components: tuple[Component, ...]
    rules: tuple[CustomRule, ...]
    bought: tuple[Line, ...]


@pytest.fixture(scope="module")
def finished() -> Finished:
    """As ``export --routed`` makes it, without the rest of a design folder."""
    synthesis = synthesise(read_model_file(MODEL), CATALOG)
    circuit, _ = board_circuit(synthesis)
    rules = board_rules(circuit, synthesis.modelfile.rules)
    files, board = texts(synthesis), board_file(synthesis)
    routed = route_board(files[board], circuit, rules)
    assert routed.open == {}
    return Finished(
        routed.text,
        files[board.replace(".kicad_pcb", ".kicad_sch")],
        board_files.listed(synthesis),
        rules,
        board_files.bought(synthesis),
    )


@pytest.fixture(scope="module")
def sound(finished: Finished, tmp_path_factory: pytest.TempPathFactory) -> DesignRuleCheck:
    """What KiCad's check finds on the board without a fault."""
    path = tmp_path_factory.mktemp("sound") / "board.kicad_pcb"
    path.write_text(finished.text, encoding="utf-8")
    path.with_suffix(".kicad_sch").write_text(finished.sheet, encoding="utf-8")
    shapes = {c.footprint: shape_of(c.footprint) for c in finished.components if c.footprint}
    limits = fab_limits(["generic"], CATALOG.folders)
    return check(read_board(path), finished.rules, tuple(shapes.values()), limits)


def reasons(
    folder: Path, made: Finished, board: str, by_kicad: DesignRuleCheck | None = None
) -> tuple[str, ...]:
    """Why a board is not ordered, as ``export --fab`` comes to it; none where the order stands.

    by_kicad : what KiCad's check is made to say of the board; None to ask it.
    """
    path = folder / "board.kicad_pcb"
    path.write_text(board, encoding="utf-8")
    path.with_suffix(".kicad_sch").write_text(made.sheet, encoding="utf-8")
    limits = fab_limits(["generic"], CATALOG.folders)
    try:
        file = read_board(path)
        check_edge(file)
        check_belongs(file, made.components)
        if by_kicad is None:
            found = on_board.checked(file, made.components, made.rules, {}, limits)
        else:
            found = on_board.on_board(file, made.components, made.rules, {}, by_kicad, limits)
    except InputError as error:
        return (str(error),)
    if refused := refusals(found):
        return refused
    return read_back(folder, made, board)


def read_back(folder: Path, made: Finished, board: str) -> tuple[str, ...]:
    """What the plotted files alone say, whatever KiCad's check does."""
    path = folder / "board.kicad_pcb"
    path.write_text(board, encoding="utf-8")
    (fab,) = fabs(["generic"], CATALOG.folders)
    (layout,) = layouts([fab.table.bom], CATALOG.folders)
    order = BoardOrder("board", "title", read_board(path), made.components, made.bought, ())
    try:
        order_files(order, fab, layout, fab_limits(["generic"], CATALOG.folders))
    except FaultyOrder as why:
        return why.faults
    return ()


# Changes of a tree.


def with_children(tree: Expression, children: Iterable[Expression]) -> Expression:
    """The same list with other lists in it, behind its atoms."""
    return Expression((*(i for i in tree.items if not isinstance(i, Expression)), *children))


def each(which: Callable[[Expression], bool], change: Callable[[Expression], list[Expression]]
         ) -> Change:  # fmt: skip
    """Every list directly in a tree for which this holds gives way to others."""

    def changed(tree: Expression) -> Expression:
        out: list[Expression] = []
        met = 0
        for child in tree.children:
            fits = which(child)
            met += fits
            out += change(child) if fits else [child]
        assert met, "nothing to change"
        return with_children(tree, out)

    return changed


def first(which: Callable[[Expression], bool], change: Callable[[Expression], list[Expression]]
          ) -> Change:  # fmt: skip
    seen: list[Expression] = []

    def once(child: Expression) -> bool:
        if seen or not which(child):
            return False
        seen.append(child)
        return True

    def changed(tree: Expression) -> Expression:
        seen.clear()
        return each(once, change)(tree)

    return changed


def named(name: str) -> Callable[[Expression], bool]:
    return lambda child: child.name == name


def gone(_: Expression) -> list[Expression]:
    return []


def inside(change: Change) -> Callable[[Expression], list[Expression]]:
    return lambda child: [change(child)]


def put(text: str) -> Change:
    """A list of this name is this one instead, or comes to be."""
    new = read(text)

    def changed(tree: Expression) -> Expression:
        return with_children(tree, [*(c for c in tree.children if c.name != new.name), new])

    return changed


def more(*texts: str) -> Change:
    """With these lists besides."""
    return lambda tree: with_children(tree, [*tree.children, *map(read, texts)])


def part(reference: str, change: Callable[[Expression], list[Expression]]) -> Change:
    """The footprint of one part gives way to others."""

    def ours(child: Expression) -> bool:
        names = (p.text(1) for p in child.all("property") if p.text(0) == "Reference")
        return child.name == "footprint" and reference in names

    return each(ours, change)


def footprint(reference: str, change: Change) -> Change:
    """A change of the footprint of one part."""
    return part(reference, inside(change))


def pad(reference: str, number: str, change: Change) -> Change:
    def ours(child: Expression) -> bool:
        return child.name == "pad" and child.text(0) == number

    return footprint(reference, each(ours, inside(change)))


def field(reference: str, name: str, value: str) -> Change:
    """Another value of a field on the board."""

    def ours(child: Expression) -> bool:
        return child.name == "property" and child.text(0) == name

    def changed(child: Expression) -> Expression:
        head, _ = read(f'(property "{name}" "{value}")'), child
        return Expression((*head.items, *child.children))

    return footprint(reference, each(ours, inside(changed)))


def attribute(reference: str, *marks: str) -> Change:
    """The part's marks as KiCad writes them."""
    return footprint(reference, put(f"(attr smd {' '.join(marks)})"))


def net_number(tree: Expression, net: str) -> str:
    return next(n.text(0) for n in tree.all("net") if n.text(1).strip("/") == net)


def of_net(net: str, change: Callable[[Expression], list[Expression]]) -> Change:
    """A change of the longest piece of track of a net."""

    def changed(tree: Expression) -> Expression:
        number = net_number(tree, net)
        pieces = [
            s for s in tree.all("segment") if s.get("net").text() == number and _length(s) > 0.0
        ]
        longest = max(pieces, key=_length)
        return each(lambda child: child == longest, change)(tree)

    return changed


def _ends(piece: Expression) -> tuple[tuple[float, float], tuple[float, float]]:
    start, end = piece.get("start"), piece.get("end")
    return (start.number(0), start.number(1)), (end.number(0), end.number(1))


def _length(piece: Expression) -> float:
    (a, b), (c, d) = _ends(piece)
    return float(((a - c) ** 2 + (b - d) ** 2) ** 0.5)


def at_middle(net: str, item: str) -> Change:
    """With an item at the middle of the longest piece of track of a net: ``{x}``, ``{y}``, and
    ``{r}`` 1 mm right of it."""

    def changed(tree: Expression) -> Expression:
        number = net_number(tree, net)
        longest = max(
            (s for s in tree.all("segment") if s.get("net").text() == number), key=_length
        )
        (a, b), (c, d) = _ends(longest)
        x, y = (a + c) / 2.0, (b + d) / 2.0
        own = longest.get("layer").text()
        return more(item.format(x=x, y=y, r=x + 1.0, layer=own, number=number))(tree)

    return changed


def at_pad(reference: str, number: str, item: str) -> Change:
    """With an item at a pad: ``{x}``, ``{y}``, and ``{r}`` 1.5 mm right of it."""

    def changed(tree: Expression) -> Expression:
        owner = next(
            f
            for f in tree.all("footprint")
            if any(p.text(0) == "Reference" and p.text(1) == reference for p in f.all("property"))
        )
        (one,) = (p for p in owner.all("pad") if p.text(0) == number)
        at, place = one.get("at"), owner.get("at")
        turned = len(place.atoms) > 2 and place.number(2) == 180.0
        sign = -1.0 if turned else 1.0
        x, y = place.number(0) + sign * at.number(0), place.number(1) + sign * at.number(1)
        return more(item.format(x=x, y=y, r=x + 1.5))(tree)

    return changed


def moved(by: tuple[float, float]) -> Change:
    def changed(child: Expression) -> Expression:
        at = child.get("at")
        rest = " ".join(at.atoms[2:])
        return put(f"(at {at.number(0) + by[0]} {at.number(1) + by[1]} {rest})")(child)

    return changed


def exchanged(reference: str, one: str, other: str) -> Change:
    """Two pads of a part change their numbers."""
    swap = {one: other, other: one}

    def changed(child: Expression) -> Expression:
        number = child.text(0)
        if number not in swap:
            return child
        head = read(f'(pad "{swap[number]}" {child.text(1)} {child.text(2)})')
        return Expression((*head.items, *child.children))

    return footprint(reference, each(named("pad"), inside(changed)))


def without_layer(layer: str) -> Change:
    def changed(child: Expression) -> Expression:
        kept = " ".join(f'"{name}"' for name in child.get("layers").atoms if name != layer)
        return put(f"(layers {kept})")(child)

    return changed


def doubled(child: Expression) -> list[Expression]:
    return [child, moved((0.0, 30.0))(child)]


def turned(child: Expression) -> Expression:
    """Half a turn: the pads' own angles turn too, as KiCad writes them."""
    at = child.get("at")
    now = at.number(2) if len(at.atoms) > 2 else 0.0

    def half(inner: Expression) -> Expression:
        place = inner.get("at")
        angle = place.number(2) if len(place.atoms) > 2 else 0.0
        return put(f"(at {place.number(0)} {place.number(1)} {(angle + 180) % 360})")(inner)

    out = each(named("pad"), inside(half))(child)
    return put(f"(at {at.number(0)} {at.number(1)} {(now + 180) % 360})")(out)


def unfilled(child: Expression) -> Expression:
    return with_children(child, [c for c in child.children if c.name != "filled_polygon"])


def flooded(child: Expression) -> Expression:
    """One filled area over the whole board."""
    area = child.get("filled_polygon")
    points = "(pts (xy 26 26) (xy 85 26) (xy 85 92) (xy 26 92))"
    return with_children(unfilled(child), [*unfilled(child).children, put(points)(area)])


def on_edge(child: Expression) -> bool:
    return any(layer.text() == "Edge.Cuts" for layer in child.all("layer"))


HOLE = (
    '(footprint "designer:hole" (layer "F.Cu") ' + ID + " (at {x} {y}) (attr exclude_from_pos_files"
    ' exclude_from_bom) (property "Reference" "H9" (at 0 0) (layer "F.Fab") (hide yes) '
    "(effects (font (size 1 1) (thickness 0.15)))) "
    '(pad "" np_thru_hole circle (at 0 0) (size 0.8 0.8) (drill 0.8) (layers "*.Cu" "*.Mask")))'
)
CIRCLE = (
    "(gr_circle (center {x} {y}) (end {r} {y}) (stroke (width 0.1) (type solid)) (fill no)"
    ' (layer "Edge.Cuts") ' + ID + ")"
)
FOREIGN_PART = (
    '(footprint "designer:R_0603_1608Metric" (layer "F.Cu") ' + ID + " (at 30 90) (attr smd)"
    ' (property "Reference" "R999" (at 0 0) (layer "F.Fab") (effects (font (size 1 1)'
    ' (thickness 0.15)))) (pad "1" smd rect (at 0 0) (size 0.8 0.8) (layers "F.Cu" "F.Mask")'
    ' (net 1 "GND")))'
)
FAULTS: dict[str, tuple[Change, str]] = {
    # Copper.
    "a piece of track is missing": (of_net("v1", gone), "unconnected"),
    "a via is missing": (first(lambda c: c.name == "via", gone), "unconnected|kicad-errors"),
    "every via is missing": (each(named("via"), gone), "unconnected"),
    "a track of 0.05 mm": (of_net("v1", inside(put("(width 0.05)"))), "fab-track"),
    "a track across two nets": (
        at_pad("R1", "1", '(segment (start {x} {y}) (end {r} {y}) (width 0.3) (layer "F.Cu") '
               "(net 0) " + ID + ")"), "short-circuit|clearance|kicad-errors"),
    "a line of copper across two pads": (
        at_pad("R1", "1", "(gr_line (start {x} {y}) (end {r} {y}) (stroke (width 0.3)"
               ' (type solid)) (layer "F.Cu") ' + ID + ")"), "short|clearance|kicad-errors"),
    "letters of copper over two pads": (
        at_pad("R1", "1", '(gr_text "-----" (at {r} {y} 0) (layer "F.Cu") ' + ID
               + " (effects (font (size 1 1) (thickness 0.3))))"),
        "short|clearance|kicad-errors"),
    "the ground pour is missing": (each(named("zone"), gone), "unconnected"),
    "the ground pour is not filled": (each(named("zone"), inside(unfilled)), "unconnected"),
    "an old filling of the pour over all nets": (
        each(named("zone"), inside(flooded)), "short|clearance|kicad-errors"),
    "a via beside its track": (
        first(named("via"), inside(moved((1.3, 1.3)))), "unconnected|short|clearance"),
    "a hole is drilled through a track": (at_middle("v1", HOLE), "kicad-errors"),
    "the board is cut through a track": (at_middle("v1", CIRCLE), "kicad-errors"),
    "a via with a hole of 0.1 mm": (
        first(named("via"), inside(put("(drill 0.1)"))), "fab-hole|kicad-errors"),
    "a via without a ring": (
        first(named("via"), inside(put("(size 0.31)"))), "fab-ring|kicad-errors"),
    "a via on a pad of another net": (
        at_pad("R1", "1", '(via (at {x} {y}) (size 0.6) (drill 0.3) (layers "F.Cu" "B.Cu") '
               "(net 1) " + ID + ")"), "short|clearance|kicad-errors"),
    "a track at the edge": (
        lambda t: more('(segment (start 25.05 30) (end 25.05 35) (width 0.25) (layer "F.Cu") '
                       "(net 1) " + ID + ")")(t), "kicad-errors"),
    # The edge.
    "no edge": (each(on_edge, gone), "Edge.Cuts"),
    "an edge that is not closed": (
        more('(gr_line (start 0 0) (end 9 9) (stroke (width 0.1) (type solid)) '
             '(layer "Edge.Cuts") ' + ID + ")"), "Edge.Cuts"),
    "a part outside the edge": (
        footprint("J2", moved((-30.0, 0.0))), "board-outline|unconnected"),
    # Pads.
    "the mask covers a pad": (pad("R1", "1", without_layer("F.Mask")), "kicad-errors"),
    "a pad without solder paste": (pad("R1", "1", without_layer("F.Paste")), "kicad-errors"),
    "a pad that is smaller than the library's": (
        pad("R1", "1", put("(size 0.3 0.3)")), "kicad-errors"),
    "a pad with a ring of 0.05 mm": (pad("J1", "1", put("(drill 1.6)")), "fab-ring|kicad-errors"),
    "a hole that the pin does not go through": (pad("J1", "1", put("(drill 0.6)")), "pin-hole"),
    "a hole without copper": (
        footprint("J1", each(lambda c: c.name == "pad" and c.text(0) == "1", lambda c: [
            Expression((*read(f'(pad "1" np_thru_hole {c.text(2)})').items, *c.children))])),
        "unconnected|kicad-errors|no plated|copper"),
    "a pad on another net": (pad("R1", "1", put('(net 1 "GND")')), "the nets of this design"),
    "a pad is missing": (
        footprint("R1", each(lambda c: c.name == "pad" and c.text(0) == "1", gone)),
        "the nets of this design"),
    "the pads of a diode are exchanged": (exchanged("D200", "1", "2"), "the nets of this design"),
    "a pad is 0.4 mm off": (
        footprint("R1", each(lambda c: c.name == "pad" and c.text(0) == "1",
                             inside(moved((-0.4, 0.0))))), "kicad-errors"),
    # Parts.
    "another value on the board": (field("R1", "Value", "1.23kΩ"), "part-value"),
    "another part number": (field("R1", "MPN", "RC0603FR-0712KL"), "part-number"),
    "a footprint of another name": (
        part("R1", lambda c: [Expression(
            (*read('(footprint "designer:R_0805_2012Metric")').items, *c.children))]),
        "part-footprint"),
    "a part that is marked as left out": (attribute("R1", "dnp"), "part-fitted"),
    "a part that is left out of the positions": (
        attribute("R1", "exclude_from_pos_files"), "part-fitted"),
    "a part that is left out of the bill": (attribute("R1", "exclude_from_bom"), "part-fitted"),
    "a part is missing": (part("R1", gone), "without R1"),
    "a part stands twice": (part("R1", doubled), "R1 twice"),
    "a part that the design has not": (more(FOREIGN_PART), "with R999"),
    "an op-amp is turned by half": (footprint("U1", turned), "short|unconnected"),
    "a diode is turned by half": (footprint("D200", turned), "short|unconnected"),
    "a part on the other side": (footprint("R1", put('(layer "B.Cu")')), "."),
    "a part upon another": (footprint("R1", moved((1.5, 0.0))), "."),
    "a hole for a screw is missing": (part("H1", gone), "mounting-holes"),
    # Silk and the board itself.
    "letters of 0.4 mm in silk": (
        first(lambda c: c.name == "gr_text", inside(put(
            "(effects (font (size 0.4 0.4) (thickness 0.15)))"))), "fab-silk"),
    "lines of 0.05 mm in silk": (
        first(lambda c: c.name == "gr_text", inside(put(
            "(effects (font (size 1 1) (thickness 0.05)))"))), "fab-silk"),
    "a board of 0.2 mm": (put("(general (thickness 0.2))"), "fab-thickness"),
    "a board of another thickness than the design's": (
        put("(general (thickness 0.8))"), "board-thickness"),
    "a board of another number of layers": (
        lambda t: first(named("layers"), inside(more(
            '(4 "In1.Cu" signal)', '(6 "In2.Cu" signal)')))(t), "board-layers"),
    "a file of a version that nobody knows": (put("(version 20991231)"), "version"),
}  # fmt: skip
"""A change of the board, and what one of the reasons names."""
READ_FROM_THE_FILE = {*on_board.READ, *on_board.MEASURED, *on_fab.READ}
"""Rules that KiCad is not asked about."""
HARMLESS: tuple[Change, ...] = (
    at_middle("v1", '(gr_circle (center {x} {y}) (end {r} {y}) (stroke (width 0.1) (type solid))'
              ' (fill no) (layer "Dwgs.User") ' + ID + ")"),
    of_net("v1", inside(put("(width 0.19)"))),
    first(named("via"), inside(put("(size 0.59)"))),
    first(lambda c: c.name == "gr_text", inside(put(
        "(effects (font (size 1.2 1.2) (thickness 0.2)))"))),
    footprint("H1", moved((0.1, 0.1))),
)  # fmt: skip


@cache
def _tree(text: str) -> Expression:
    return read(text)


@pytest.mark.parametrize("fault", FAULTS)
def test_no_faulty_board_is_ordered(
    fault: str, finished: Finished, sound: DesignRuleCheck, tmp_path: Path
) -> None:
    """What a rule of ours reads from the file is told though KiCad finds nothing."""
    change, told = FAULTS[fault]
    by_kicad = sound if told in READ_FROM_THE_FILE else None
    found = reasons(tmp_path, finished, expression_text(change(_tree(finished.text))), by_kicad)
    assert found, "an order was written"
    assert any(re.search(told, reason) for reason in found), found


def test_the_board_as_it_is_and_with_harmless_changes_is_ordered(
    finished: Finished, tmp_path: Path
) -> None:
    assert reasons(tmp_path, finished, finished.text) == ()
    tree = _tree(finished.text)
    for change in HARMLESS:
        tree = change(tree)
    assert reasons(tmp_path, finished, expression_text(tree)) == ()


ON_THE_FILES = {
    "a piece of track is missing": "is open",
    "a line of copper across two pads": "a short between",
    "an old filling of the pour over all nets": "a short between",
    "a hole is drilled through a track": "is open",
    "the board is cut through a track": "is open",
    "a hole without copper": "has no copper",
    "the mask covers a pad": "is covered by the mask",
    "a pad without solder paste": "gets no paste",
    "a diode is turned by half": "a short between",
    "a part that is left out of the positions": "R1 has no position",
}
"""Faults that the plotted files show too, and what is said of them."""


@pytest.mark.parametrize("fault", ON_THE_FILES)
def test_the_plotted_files_show_it_without_kicad_s_check(
    fault: str, finished: Finished, tmp_path: Path
) -> None:
    change, _ = FAULTS[fault]
    found = read_back(tmp_path, finished, expression_text(change(_tree(finished.text))))
    assert any(ON_THE_FILES[fault] in line for line in found), found


MOVE = """
import pcbnew, sys
board = pcbnew.LoadBoard(sys.argv[1])
for name, degrees, over in (("R1", 0, 1), ("U1", 0, 1), ("D200", 90, 1), ("VR1", 37, 1),
                            ("R2", 33, 0), ("VR2", 90, 0)):
    part = board.FindFootprintByReference(name)
    part.SetOrientationDegrees(part.GetOrientationDegrees() + degrees)
    if over:
        part.Flip(part.GetPosition(), pcbnew.FLIP_DIRECTION_LEFT_RIGHT)
pcbnew.SaveBoard(sys.argv[2], board)
"""


def test_parts_that_kicad_has_turned_and_flipped_stand_on_their_pads(
    finished: Finished, tmp_path: Path
) -> None:
    """By KiCad's own position file, on either side and at any angle; one turned there does not."""
    before, after = tmp_path / "before.kicad_pcb", tmp_path / "after.kicad_pcb"
    before.write_text(finished.text, encoding="utf-8")
    asked_of_pcbnew(MOVE, tmp_path, before, after)
    board = read_board(after)
    positions = plot(board, "board", protel_names=True).positions
    assert sum(one.bottom for one in positions) == 4
    assert list(_places(positions, board, finished.components)) == []
    half = [replace(one, degrees=one.degrees + 180.0) for one in positions]
    assert len(list(_places(half, board, finished.components))) == len(positions)
