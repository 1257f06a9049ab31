"""Footprints against the cases' own dimensions, and every case of the catalogue."""

from __future__ import annotations

import itertools
from collections import Counter
from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.board.footprints import EXAMPLES, FootprintShape, footprint
from designer.board.kicad_footprint import module
from designer.board.sexpr import expression_text, read
from designer.catalog.parts_catalog import load_catalog

CATALOG = load_catalog()
KICAD = Path("/usr/share/kicad/footprints")
"""KiCad's own libraries of footprints."""


def catalogued() -> set[str]:
    """Every footprint that the catalogue names, in whichever case; arrays stand on bills alone."""
    found = {family.footprint for family in CATALOG.families if family.use != "array"}
    for entries in (
        CATALOG.opamps, CATALOG.diodes, CATALOG.references, CATALOG.supply_diodes, CATALOG.trimmers,
    ):  # fmt: skip
        found |= {case.footprint for entry in entries for case in (entry, *entry.cases)}
    found |= {jack.footprint for jack in CATALOG.coaxial_jacks}
    return found | {CATALOG.header(ways).place(ways) for ways in range(2, 8)}


@pytest.mark.parametrize("name", sorted({*catalogued(), *EXAMPLES}))
def test_pads_are_apart_and_inside_the_courtyard(name: str) -> None:
    made = footprint(name)
    assert made.name == name.rpartition(":")[2]
    counts = Counter(pad.number for pad in made.pads)
    assert {n for n, k in counts.items() if k > 1} == ({"2"} if made.plug else set())
    for a, b in itertools.combinations(made.pads, 2):
        across = abs(a.x - b.x) - (a.width + b.width) / 2.0
        down = abs(a.y - b.y) - (a.height + b.height) / 2.0
        assert max(across, down) >= 0.2, (a, b)
    left, top, right, bottom = made.courtyard
    for pad in made.pads:
        assert left < pad.x - pad.width / 2.0 < pad.x + pad.width / 2.0 < right
        assert top < pad.y - pad.height / 2.0 < pad.y + pad.height / 2.0 < bottom
        copper = min(pad.width, pad.height) - pad.drill
        assert copper > 0.3 if pad.plated else copper == 0.0


@pytest.mark.parametrize(
    ("name", "length", "width", "terminal"),
    [("R_0603_1608Metric", 1.6, 0.8, (0.1, 0.5)), ("C_1206_3216Metric", 3.2, 1.6, (0.25, 0.75))],
)
def test_a_chip_stands_on_its_pads(
    name: str, length: float, width: float, terminal: tuple[float, float]
) -> None:
    """Bodies and terminals of EIA sizes: solder at the ends, none under the middle."""
    first, second = footprint(name).pads
    assert second.x + second.width / 2.0 >= length / 2.0 + 0.3
    assert first.width > terminal[1]
    inner = 2.0 * (second.x - second.width / 2.0)
    assert length - 2.0 * terminal[1] - 0.2 <= inner <= length - 2.0 * terminal[0]
    assert first.height >= width


def pins(made: FootprintShape) -> dict[str, tuple[float, float]]:
    return {pad.number: (pad.x, pad.y) for pad in made.pads}


def test_a_dual_in_line_package_is_counted_round_from_the_upper_left() -> None:
    at = pins(footprint("Package_DIP:DIP-14_W7.62mm"))
    assert at["1"] == pytest.approx((-3.81, -7.62))
    assert at["7"] == pytest.approx((-3.81, 7.62))
    assert at["8"] == pytest.approx((3.81, 7.62))
    assert at["14"] == pytest.approx((3.81, -7.62))


def test_the_feet_of_a_small_outline_package_are_on_its_pads() -> None:
    """JEDEC MS-012: 5.8 mm to 6.2 mm over the leads, feet of 0.4 mm to 1.27 mm."""
    made = footprint("Package_SO:SOIC-14_3.9x8.7mm_P1.27mm")
    for pad in made.pads:
        inner, outer = abs(pad.x) - pad.width / 2.0, abs(pad.x) + pad.width / 2.0
        assert outer >= 3.1 + 0.15
        assert inner <= 2.9 - 1.27
    at = pins(made)
    assert at["2"][1] - at["1"][1] == pytest.approx(1.27)
    assert at["8"][0] == -at["7"][0]
    assert at["8"][1] == at["7"][1]


def test_holes_are_as_far_apart_as_the_name_says() -> None:
    for name, pitch in (
        ("R_Axial_DIN0207_L6.3mm_D2.5mm_P10.16mm_Horizontal", 10.16),
        ("C_Rect_L7.2mm_W5.5mm_P5.00mm_FKS2_FKP2_MKS2_MKP2", 5.0),
        ("D_DO-35_SOD27_P7.62mm_Horizontal", 7.62),
        ("D_DO-41_SOD81_P10.16mm_Horizontal", 10.16),
        ("CP_Radial_D5.0mm_P2.00mm", 2.0),
        ("C_Axial_L22.0mm_D9.5mm_P27.50mm_Horizontal", 27.5),
    ):
        at = pins(footprint(name))
        assert at["2"][0] - at["1"][0] == pytest.approx(pitch)


@pytest.mark.parametrize("name", ["Other:QFN-16", "R_0603_9999Metric", "D_SOD-999", ""])
def test_a_case_that_is_not_known_is_refused_by_name(name: str) -> None:
    with pytest.raises(InputError) as caught:
        footprint(name)
    assert caught.value.found == name
    assert "SOIC-14" in str(caught.value)


@pytest.mark.kicad
@pytest.mark.parametrize("name", sorted(catalogued()))
def test_bodies_stand_on_their_pads_as_in_kicads_libraries(name: str) -> None:
    """KiCad's footprint of the name refers to the same body, and has its pads about the body where
    ours are."""
    library, _, own = name.partition(":")
    theirs = read((KICAD / f"{library}.pretty" / f"{own}.kicad_mod").read_text("utf-8"))
    shape = footprint(name)
    body, kicads = (e.get("model") for e in (module(shape), theirs))
    assert body.text(0) == kicads.text(0)
    for key in ("scale", "rotate"):
        assert body.get(key) == read(expression_text(kicads.get(key)))
    x, y, _ = (body.get("offset").get("xyz").number(i) for i in range(3))
    assert kicads.get("offset").get("xyz").atoms == ("0", "0", "0")
    for pad in theirs.all("pad"):
        if pad.text(0):
            place = pad.get("at").number(0) + x, pad.get("at").number(1) - y
            ours = [(p.x, p.y) for p in shape.pads if p.number == pad.text(0)]
            assert any(place == pytest.approx(own, abs=0.15) for own in ours), place
