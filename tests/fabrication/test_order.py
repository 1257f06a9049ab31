"""What a fab is sent, plotted by KiCad and read back: each pad has its copper, hole and net."""

from __future__ import annotations

import csv
import hashlib
import io
import zipfile
from functools import cache
from pathlib import Path

import pytest

from designer.board.board_facts import facts_of
from designer.board.bom_layouts import layouts
from designer.board.kicad_names import kicad_net
from designer.board.kicad_reader import BoardFile, PlacedFootprint, read_board
from designer.board.sexpr import Expression, expression, expression_text, read
from designer.catalog.design_rule import FAIL, NOT_RUN, PASS, RuleOutcome, Status
from designer.catalog.design_rules import BY_ID
from designer.catalog.fab import fab_limits, fabs
from designer.fabrication.kicad_plot import undated
from designer.fabrication.order import BoardOrder, order_files, packed
from designer.jobs.export_job import accepted_failures, not_checked, refusals
from designer.routing.board_copper import with_layers
from tests.shared.gerber_reader import flashes, holes
from tests.shared.kicad_cases import case_files
from tests.shared.stages import CATALOG

VIA = (60.0, 45.0)
"""Of the track and the via that the board is given [mm]."""


def with_items(text: str, *items: Expression) -> str:
    return expression_text(Expression((*read(text).items, *items)))


@cache
def board_text(name: str = "paper", layers: int = 2) -> str:
    """The board of a case, with a piece of track and a via; the rest is not routed."""
    made = case_files(name)
    text = next(text for name, text in made.items() if name.endswith(".kicad_pcb"))
    text = with_layers(text, layers)
    (net,) = (n for n in read(text).all("net") if n.text(1) == "GND")
    number = float(net.text(0))
    via = expression("via", at=VIA, size=0.6, drill=0.3, layers=("F.Cu", "B.Cu"), net=number)
    track = expression("segment", start=VIA, end=(61.0, 45.0), width=0.25, layer="B.Cu", net=number)
    return with_items(text, via, track)


def board_of(text: str, folder: Path) -> BoardFile:
    path = folder / "board.kicad_pcb"
    path.write_text(text, encoding="utf-8")
    return read_board(path)


def soldered(footprint: PlacedFootprint) -> bool:
    """Whether a part is soldered there: no bare pad, no hole, nothing that stays empty."""
    return footprint.fitted and footprint.wired and not footprint.name.startswith("TestPoint")


def ordered(board: BoardFile, name: str, title: str = "A board") -> dict[str, bytes]:
    (fab,) = fabs([name], CATALOG.folders)
    (layout,) = layouts([fab.table.bom], CATALOG.folders)
    limits = fab_limits([name], CATALOG.folders)
    # Of a board that is not routed: nothing is asked of its nets.
    order = BoardOrder("board", title, board, (), (), ("slew: why",))
    return order_files(order, fab, layout, limits)


@pytest.mark.kicad
def test_every_pad_has_its_copper_its_opening_and_its_hole(tmp_path: Path) -> None:
    """On a board of four layers: what goes through it is on all of them."""
    board = board_of(board_text(layers=4), tmp_path)
    files = ordered(board, "jlcpcb")
    top, *inner, bottom, mask = (
        {
            (*flash.pad, flash.at): flash
            for flash in flashes(files[f"gerbers/board-{layer}"].decode())
        }
        for layer in ("F_Cu.gtl", "In1_Cu.g1", "In2_Cu.g2", "B_Cu.gbl", "F_Mask.gts")
    )
    opened = {(round(x, 6), round(y, 6)) for _, _, (x, y) in mask}
    through = 0
    expected: list[tuple[float, float, float]] = []
    bare: list[tuple[float, float, float]] = []
    for footprint, item in zip(board.footprints, read(board.text).all("footprint"), strict=True):
        for pad, shape in zip(footprint.pads, item.all("pad"), strict=True):
            place = round(pad.at[0], 6), round(-pad.at[1], 6)
            if shape.text(1) == "np_thru_hole":
                bare.append((*place, shape.get("drill").number()))
                continue
            key = (footprint.reference, pad.number, place)
            flash = top[key]
            assert not pad.net or flash.net == kicad_net(pad.net)
            xs, ys = (
                [c[0] - pad.at[0] for c in pad.corners],
                [pad.at[1] - c[1] for c in pad.corners],
            )
            assert flash.box == pytest.approx((min(xs), min(ys), max(xs), max(ys)), abs=2e-6)
            assert place in opened
            if (drill := shape.find("drill")) is not None:
                through += 1
                assert bottom[key].box == pytest.approx(flash.box)
                for layer in inner:  # where KiCad does not name the pad
                    assert layer["", "", place].box == pytest.approx(flash.box)
                expected.append((*place, drill.number()))
    assert through > 15
    marks = {f"FID{k}" for k in (1, 2, 3)}  # bare copper, without a number
    assert {key[:2] for key in top} == {
        (f.reference, p.number)
        for f in board.footprints
        for p in f.pads
        if p.number or f.reference in marks
    } | {("", "")}
    expected.append((VIA[0], -VIA[1], 0.3))
    assert sorted(holes(files["gerbers/board-PTH.drl"].decode())) == sorted(expected)
    assert len(bare) == 4
    assert sorted(holes(files["gerbers/board-NPTH.drl"].decode())) == sorted(bare)


@pytest.mark.kicad
def test_parts_stand_where_the_board_has_them_in_the_fab_s_own_angles(tmp_path: Path) -> None:
    board = board_of(board_text("surface"), tmp_path)
    items = read(board.text).all("footprint")
    ours, theirs = (
        {row[key]: row for row in csv.DictReader(io.StringIO(files[name].decode()))}
        for files, name, key in (
            (ordered(board, "generic"), "board-positions.csv", "Ref"),
            (ordered(board, "jlcpcb"), "board-positions.csv", "Designator"),
        )
    )
    fitted = {f.reference for f in board.footprints if soldered(f)}
    assert ours.keys() == theirs.keys() == fitted
    for footprint, item in zip(board.footprints, items, strict=True):
        if footprint.reference not in fitted:
            continue
        at = item.get("at")
        row, turned = ours[footprint.reference], theirs[footprint.reference]
        assert (float(row["PosX"]), -float(row["PosY"])) == pytest.approx(
            (at.number(0), at.number(1)), abs=1e-4
        )
        angle = at.number(2) if len(at.atoms) > 2 else 0.0
        assert float(row["Rot"]) == angle
        more = {"SOIC": 270.0, "SOT-": 180.0}.get(footprint.name[:4], 0.0)
        assert float(turned["Rotation"]) == (angle + more) % 360.0
        assert (row["Side"], turned["Layer"]) == ("top", "Top")
    assert any(row["Package"].startswith("SOIC") for row in ours.values())


@pytest.mark.kicad
def test_equal_boards_give_equal_files_whose_hashes_are_stated(tmp_path: Path) -> None:
    board = board_of(board_text(), tmp_path)
    files = ordered(board, "generic", title="<b>a title</b>\n# more")
    assert ordered(board, "generic", title="<b>a title</b>\n# more") == files
    sums = (line.split("  ") for line in files["SHA256SUMS"].decode().splitlines())
    stated = {name: digest for digest, name in sums}
    assert stated == {
        name: hashlib.sha256(content).hexdigest()
        for name, content in files.items()
        if name != "SHA256SUMS"
    }
    with zipfile.ZipFile(io.BytesIO(files["board-gerbers.zip"])) as archive:
        assert archive.testzip() is None
        assert {f"gerbers/{name}": archive.read(name) for name in archive.namelist()} == {
            name: content for name, content in files.items() if name.startswith("gerbers/")
        }
    assert {n.rpartition("/")[2] for n in files if n.endswith((".gbr", ".gbrjob"))} >= {
        "board-F_Cu.gbr", "board-B_Cu.gbr", "board-Edge_Cuts.gbr", "board-job.gbrjob",
    }  # fmt: skip
    notes = files["README.md"].decode()
    assert "    <b>a title</b> # more\n" in notes
    assert "- Not checked: slew: why" in notes
    assert "| finest track | 0.25 mm |" in notes


def test_what_a_fab_asks_is_read_from_the_board(tmp_path: Path) -> None:
    board = board_of(board_text(), tmp_path)
    facts = facts_of(board)
    edge = read(board.text).get("gr_rect")
    size = [edge.get("end").number(i) - edge.get("start").number(i) for i in (0, 1)]
    assert (facts.width, facts.height) == pytest.approx(size)
    assert (facts.layers, facts.thickness) == (2, 1.6)
    assert (facts.finest_track, facts.smallest_hole, facts.vias) == (0.25, 0.3, 1)
    assert facts.through_parts + facts.surface_parts == sum(soldered(f) for f in board.footprints)


def test_dates_go_from_the_lines_that_say_when_a_file_was_made() -> None:
    lines = [
        b"%TF.CreationDate,2026-11-23T02:51:40+00:00*%",
        b"G04 Created by KiCad (PCBNEW 9.0.8) date 2026-11-23 02:51:40*",
        b"; DRILL file {KiCad 9.0.8} date 2026-11-23T02:51:42+0000",
        b"%TO.N,/2026-11-23 02:51:40*%",
    ]
    out = undated(b"\n".join(lines)).split(b"\n")
    assert [b"2026" in line for line in out] == [False, False, False, True]
    assert out[0] == b"%TF.CreationDate,1980-01-01T00:00:00+00:00*%"


def test_an_archive_of_the_same_files_is_the_same() -> None:
    files = {"b": b"2", "a": b"1" * 1000}
    assert packed(files) == packed(dict(reversed(files.items())))
    with zipfile.ZipFile(io.BytesIO(packed(files))) as archive:
        assert {name: archive.read(name) for name in archive.namelist()} == files


def outcome(id_: str, status: Status) -> RuleOutcome:
    return RuleOutcome(BY_ID[id_], status, "why")


@pytest.mark.parametrize(
    ("id_", "status", "refused"),
    [
        ("unconnected", FAIL, True),
        ("unconnected", NOT_RUN, True),
        ("short-circuit", NOT_RUN, True),
        ("slew", FAIL, True),
        ("slew", NOT_RUN, False),
        ("unconnected", PASS, False),
    ],
)
def test_an_order_is_refused_for_what_fails_and_for_nets_that_nobody_checked(
    id_: str, status: Status, refused: bool
) -> None:
    one = outcome(id_, status)
    assert bool(refusals([one], ["slew"])) is (refused and id_ != "slew")
    assert bool(accepted_failures([one], ["slew"])) is (id_ == "slew" and status == FAIL)
    reasons = refusals([one])
    assert bool(reasons) is refused
    assert not refused or reasons == (f"{id_}: why; {one.rule.do}",)
    assert bool(not_checked([one])) is (status == NOT_RUN)
