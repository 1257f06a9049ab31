"""The board's picture and the page that finds a part on it, the page in a real browser too."""

from __future__ import annotations

import json
import re
import subprocess
from functools import cache
from html import unescape
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from designer.board.bom import bill
from designer.board.kicad_reader import BoardFile
from designer.fabrication.board_picture import board_svg
from designer.fabrication.order import bom_page
from tests.fabrication.test_order import VIA, board_of, board_text, with_items
from tests.shared.kicad_cases import case

SVG = "{http://www.w3.org/2000/svg}"


@cache
def page(title: str = "A board") -> str:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        board = board_of(board_text(), Path(folder))
    return bom_page(title, board, bill(case("paper").components))


def parts(board: BoardFile, side: Any) -> dict[str, ElementTree.Element]:
    groups = ElementTree.fromstring(board_svg(board, side)).iter(f"{SVG}g")
    return {name: group for group in groups if (name := group.get("data-part")) is not None}


def dots(elements: ElementTree.Element) -> set[tuple[float, float]]:
    return {(float(c.get("cx", "")), float(c.get("cy", ""))) for c in elements.iter(f"{SVG}circle")}


def test_each_part_is_drawn_where_its_pads_are(tmp_path: Path) -> None:
    board = board_of(board_text(), tmp_path)
    top, bottom = parts(board, "top"), parts(board, "bottom")
    assert top.keys() == {f.reference for f in board.footprints}
    for footprint in board.footprints:
        paths = [p.get("d", "") for p in top[footprint.reference].iter(f"{SVG}path")]
        drawn = {
            tuple(map(float, pair.split(",")))
            for data in paths
            for pair in re.findall(r"-?[\d.]+,-?[\d.]+", data)
        }
        for pad in footprint.pads:
            assert {(round(x, 2), round(y, 2)) for x, y in pad.corners} <= drawn
    through = {f.reference for f in board.footprints if f.reference in bottom}
    assert "J1" in through, "holes are seen from below"
    assert not {"R1", "U1"} & through, "parts on the surface are not"
    assert top["R1"].find(f"{SVG}title") is not None
    assert (top["R1"].findtext(f"{SVG}title") or "").startswith("R1 ")


def test_a_via_is_seen_from_both_sides_and_a_track_from_its_own(tmp_path: Path) -> None:
    board = board_of(board_text(), tmp_path)
    pictures = {side: board_svg(board, side) for side in ("top", "bottom")}
    track = f"M{VIA[0]:g},{VIA[1]:g} 61,{VIA[1]:g}"
    assert [track in pictures[side] for side in ("top", "bottom")] == [False, True]
    for picture in pictures.values():
        assert VIA in dots(ElementTree.fromstring(picture))
    assert board_svg(board, "top") == pictures["top"]


def test_zones_arcs_and_texts_are_drawn(tmp_path: Path) -> None:
    from designer.board.sexpr import read

    items = [
        read('(zone (net 1) (net_name "GND") (layer "F.Cu") (filled_polygon (layer "F.Cu") '
             "(pts (xy 30 30) (xy 40 30) (xy 40 40))))"),
        read('(arc (start 50 50) (mid 51 51) (end 52 50) (width 0.3) (layer "F.Cu") (net 1))'),
        read('(gr_text "<REV> & 1" (at 45 28) (layer "F.SilkS") (effects (font (size 1 1) '
             "(thickness 0.1)) (justify left)))"),
    ]  # fmt: skip
    picture = board_svg(board_of(with_items(board_text(), *items), tmp_path), "top")
    assert "M30,30 40,30 40,40Z" in picture
    assert re.search(r"M50,50 [^\"]*51,51 [^\"]*52,50\"", picture)
    assert "&lt;REV&gt; &amp; 1</text>" in picture
    ElementTree.fromstring(picture)


def test_the_page_loads_nothing_and_no_text_is_markup() -> None:
    text = page("A <script>alert(1)</script>\n board")
    assert "<script>alert" not in text
    assert "A &lt;script&gt;alert(1)&lt;/script&gt; board" in text
    outside = re.sub(r"http://www\.w3\.org/2000/svg", "", text)
    assert not re.search(r"https?://|@import|url\(|<link|<img|src=", outside)
    assert text == page.__wrapped__("A <script>alert(1)</script>\n board")


def asked(tmp_path: Path, script: str, address: str = "") -> dict[str, Any]:
    """What a script that runs in the page finds, in Chromium without a display."""
    probe = f"<script>document.title = JSON.stringify((() => {{{script}}})());</script>"
    file = tmp_path / "page.html"
    file.write_text(page().replace("</body>", f"{probe}</body>"), encoding="utf-8")
    done = subprocess.run(
        ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
         "--window-size=500,900", f"--user-data-dir={tmp_path / 'profile'}",
         f"{file.as_uri()}{address}"],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    title = re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)
    assert title is not None
    found: dict[str, Any] = json.loads(unescape(title[1]))
    return found


STATE = """
const state = () => ({
  drawn: [...document.querySelectorAll("svg [data-part].on")].map((g) => g.dataset.part),
  row: [...document.querySelectorAll("tr.on [data-ref]")].map((b) => b.dataset.ref),
  marks: document.querySelectorAll(".mark").length,
  status: document.querySelector("[role=status]").textContent,
  shown: rows.filter((row) => !row.hidden).length,
});
const key = (name, target = document.body) =>
  target.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true }));
"""


@pytest.mark.browser
def test_a_part_is_found_both_ways_by_mouse_keys_and_address(tmp_path: Path) -> None:
    found = asked(
        tmp_path,
        STATE
        + """
        const out = { address: state() };
        document.querySelector('button[data-ref="R1"]').click();
        out.button = state();
        drawn("C1")[0].dispatchEvent(new MouseEvent("click", { bubbles: true }));
        out.picture = state();
        drawn("TP1")[0].dispatchEvent(new MouseEvent("click", { bubbles: true }));
        out.pad = state();
        key("Escape");
        out.cleared = state();
        key("ArrowDown"); key("ArrowDown");
        out.second = state();
        key("ArrowUp");
        out.first = state();
        key("/");
        out.focused = document.activeElement === search;
        search.value = "r50"; search.dispatchEvent(new Event("input"));
        out.searched = state();
        out.wide = document.documentElement.scrollWidth <= window.innerWidth;
        return out;
        """,
        "#R6",
    )
    lines = bill(case("paper").components)
    by_ref = {name: line for line in lines for name in line.designators}
    assert found["address"]["drawn"] == ["R6"]
    assert found["address"]["status"].startswith("R6 ")
    for where, name in (("button", "R1"), ("picture", "C1")):
        assert set(found[where]["drawn"]) == {name}
        assert found[where]["row"] == list(by_ref[name].designators)
        assert found[where]["marks"] >= 1
    assert found["pad"]["row"] == []
    assert found["pad"]["status"].startswith("TP1")
    assert (found["cleared"]["drawn"], found["cleared"]["marks"]) == ([], 0)
    assert found["second"]["row"] == list(lines[1].designators)
    assert found["first"]["row"] == list(lines[0].designators)
    assert found["focused"] is True
    assert 1 <= found["searched"]["shown"] < len(lines)
    assert found["wide"] is True
