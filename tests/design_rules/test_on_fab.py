"""Rules by what a fab makes: for each a board that breaks it, and one that just keeps it."""

from __future__ import annotations

from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.catalog.design_rule import FAIL, NOT_RUN, PASS, RuleOutcome
from designer.catalog.fab import fab_limits
from designer.catalog.read import FABS
from designer.design_rules import on_board, on_fab
from tests.design_rules.test_rules_board import board_of, by_id, custom, drawn
from tests.shared.rule_cases import base, generic
from tests.shared.stages import CATALOG

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

TRACK = '(segment (start 0 0) (end 1 0) (width {}) (layer "F.Cu") (net 0))'
VIA = '(via (at 0 0) (size {}) (drill 0.3) (layers "F.Cu" "B.Cu") (net 0))'
HOLE = '(footprint "x" (at 0 0) (pad "" np_thru_hole circle (at 0 0) (size {0} {0}) (drill {0})))'
PAD = '(footprint "x" (at 0 0) (pad "" thru_hole circle (at 0 0) (size {0} {0}) (drill 1.0)))'
SLOT = '(footprint "x" (at 0 0) (pad "" thru_hole oval (at 0 0) (size 3 4) (drill oval {} 2)))'
LETTERS = '(gr_text "x" (at 0 0) (layer "F.SilkS") (effects (font (size {} 1) (thickness 0.2))))'
LINE = '(gr_line (start 0 0) (end 1 0) (stroke (width {}) (type solid)) (layer "B.SilkS"))'


def looked(folder: Path, item: str = "", text: str | None = None) -> dict[str, RuleOutcome]:
    """What the rules say of the exported board with one item more, without KiCad."""
    whole = drawn() if text is None else text
    board = board_of(whole.rstrip()[:-1] + item + ")", folder)
    found = on_board.on_board(board, base().components, custom(), {}, "not asked", generic())
    own = {*on_fab.READ, *on_board.MEASURED}
    return {id_: outcome for id_, outcome in by_id(found).items() if id_ in own}


@pytest.mark.parametrize(
    ("id_", "item", "breaks", "keeps"),
    [
        ("fab-track", TRACK, 0.05, 0.15),
        ("fab-ring", VIA, 0.55, 0.57),
        ("fab-ring", PAD, 1.35, 1.41),
        ("fab-hole", HOLE, 0.2, 0.3),
        ("fab-hole", HOLE, 6.5, 6.3),
        ("fab-slot", SLOT, 0.5, 0.6),
        ("fab-silk", LETTERS, 0.7, 0.8),
        ("fab-silk", LINE, 0.09, 0.1),
    ],
)
def test_what_no_fab_makes_fails(
    id_: str, item: str, breaks: float, keeps: float, tmp_path: Path
) -> None:
    """A track of 0.05 mm passed all rules, and KiCad's own check, which knew no limit."""
    failing = looked(tmp_path, item.format(breaks))
    assert [name for name, one in failing.items() if one.status == FAIL] == [id_]
    assert generic().title in failing[id_].found
    assert looked(tmp_path, item.format(keeps))[id_].status == PASS


def test_a_hole_that_is_no_number_is_refused_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"some\.kicad_pcb.*wide.*a number"):
        looked(tmp_path, HOLE.replace("(drill {0})", "(drill wide)").format(1.0))


def test_thickness_and_layers_are_those_of_the_file(tmp_path: Path) -> None:
    thick = drawn().replace("(thickness 1.6)", "(thickness 3.2)")
    assert thick != drawn()
    found = looked(tmp_path, text=thick)["fab-thickness"]
    assert found.status == FAIL
    assert found.value == pytest.approx(0.8)
    inner = "".join(f'({2 * k + 4} "In{k}.Cu" signal)' for k in range(1, 5))
    many = drawn().replace('(0 "F.Cu" signal)', f'(0 "F.Cu" signal) {inner}')
    assert many != drawn()
    assert looked(tmp_path, text=many)["fab-layers"].status == FAIL


def test_a_board_without_tracks_has_none_to_judge(tmp_path: Path) -> None:
    found = looked(tmp_path)
    not_run = {name for name, one in found.items() if one.status == NOT_RUN}
    assert not_run == {"fab-track", "board-layers"}
    assert {one.status for one in found.values()} == {NOT_RUN, PASS}
    assert "no slot" in found["fab-slot"].found


def test_of_several_fabs_the_narrowest_limit_holds(tmp_path: Path) -> None:
    """Of a fab that states no limit those of most fabs hold."""
    head = 'format = 1\ntitle = "A"\nbom = "kicad"\ncolumn = [{ title = "R", field = "reference" }]'
    limit = '\n[[limit]]\nof = "track"\nleast = 0.3\nsource = "its page"\n'
    (tmp_path / FABS).mkdir()
    own = tmp_path / FABS / "own.toml"
    own.write_text(head + limit, encoding="utf-8")
    folders = [tmp_path, *CATALOG.folders]
    both = fab_limits(["own", "jlcpcb"], folders)
    jlcpcb = fab_limits(["jlcpcb"], folders)
    assert both.least["track"] == 0.3
    assert "track" not in both.assumed
    assert both.least["silk-height"] == max(jlcpcb.least["silk-height"], 0.8)
    assert both.most["layers"] == generic().most["layers"]
    for wrong, field in ((limit + limit, "limit"), (limit.replace("least = 0.3", ""), "limit")):
        own.write_text(head + wrong, encoding="utf-8")
        with pytest.raises(InputError) as error:
            fab_limits(["own"], folders)
        assert field in str(error.value)


def test_a_board_of_another_thickness_than_the_design_s_is_caught(tmp_path: Path) -> None:
    for millimetres, status in ((0.8, FAIL), (1.6, PASS)):
        text = drawn().replace("(thickness 1.6)", f"(thickness {millimetres})")
        assert looked(tmp_path, text=text)["board-thickness"].status == status


def test_a_layer_that_nothing_lies_on_is_caught(tmp_path: Path) -> None:
    """A pad through the board is on every layer, and is no copper of a layer's own."""
    inner = drawn().replace('(0 "F.Cu" signal)', '(0 "F.Cu" signal) (4 "In1.Cu" signal)')
    both = TRACK.format(0.3) + TRACK.format(0.3).replace("F.Cu", "B.Cu")
    found = looked(tmp_path, both, inner)["board-layers"]
    assert found.status == FAIL
    assert "In1.Cu" in found.found
    third = both + TRACK.format(0.3).replace("F.Cu", "In1.Cu")
    assert looked(tmp_path, third, inner)["board-layers"].status == PASS


def test_a_missing_hole_for_a_screw_is_caught(tmp_path: Path) -> None:
    assert looked(tmp_path)["mounting-holes"].status == PASS
    small = drawn().replace("(drill 3.2)", "(drill 2.4)", 1)
    assert small != drawn()
    found = looked(tmp_path, text=small)["mounting-holes"]
    assert found.status == FAIL
    assert found.value == 3
