"""Rules on the parts of a board: each is caught in another part, and passes its near miss."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from designer.board.component import Component
from designer.board.sexpr import Expression, expression_text, read
from designer.catalog.design_rule import FAIL, NOT_RUN, PASS, RuleOutcome
from designer.design_rules import on_board
from tests.design_rules.test_rules_board import (
    OF_PARTS,
    board_of,
    by_id,
    custom,
    drawn,
    edited,
    reference,
)
from tests.shared.rule_cases import base, generic

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

Change = Callable[[str], str]


def part(name: str) -> Component:
    return next(c for c in base().components if c.reference == name)


def number(name: str) -> str:
    """What is ordered for a part."""
    bought = part(name).bought
    assert bought is not None
    return bought.part_number


def footprint(name: str) -> Expression:
    whole = read(drawn())
    return next(f for f in whole.all("footprint") if reference(f) == name)


def field(name: str, key: str) -> str:
    return next(p.text(1) for p in footprint(name).all("property") if p.text(0) == key)


def changed(name: str, change: Change) -> str:
    """The exported board with the text of one footprint changed."""

    def turn(item: Expression) -> Expression:
        if item.name != "footprint" or reference(item) != name:
            return item
        before = expression_text(item)
        after = change(before)
        assert after != before
        return read(after)

    return edited(turn)


def written(name: str, key: str, text: str) -> str:
    """The exported board with another text in one field."""
    old = field(name, key)
    return changed(name, lambda t: t.replace(f'"{key}" "{old}"', f'"{key}" "{text}"'))


def looked(text: str, folder: Path) -> dict[str, RuleOutcome]:
    """What the rules say of a board of the design, without KiCad."""
    found = on_board.on_board(
        board_of(text, folder), base().components, custom(), {}, "no KiCad in this test", generic()
    )
    return by_id(found)


def caught(text: str, id_: str, words: str, folder: Path) -> None:
    """One rule on parts fails, and no other does."""
    found = looked(text, folder)
    assert found[id_].status == FAIL, found[id_].found
    assert found[id_].found == f"1; {words}"
    assert {o for o in OF_PARTS if found[o].status != PASS} == {id_}


def passes(text: str, folder: Path) -> None:
    found = looked(text, folder)
    assert {o: found[o].found for o in OF_PARTS if found[o].status != PASS} == {}


def test_the_exported_board_has_the_design_s_parts(tmp_path: Path) -> None:
    passes(drawn(), tmp_path)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("R4", "47k", "R4 is 47k, not 36kΩ"),
        ("R4", "36.1k", "R4 is 36.1k, not 36kΩ"),
        ("C903", "10k", "C903 is 10k, not 100nF"),
        ("C1", "", "C1 is nothing, not "),
        ("U1", "LM358", "U1 is LM358, not TL074C"),
        ("D200", "BAT54", "D200 is BAT54, not 1N4148"),
        ("R4", "\u202e47k", "R4 is ?47k, not 36kΩ"),
    ],
)
def test_another_value_is_caught(tmp_path: Path, name: str, text: str, words: str) -> None:
    if not words.split("not ")[1]:
        words += part(name).value
    caught(written(name, "Value", text), "part-value", words, tmp_path)


@pytest.mark.parametrize("words", ["36k", "36 kΩ", "36000", "36K"])
def test_another_way_to_write_it_is_not(tmp_path: Path, words: str) -> None:
    passes(written("R4", "Value", words), tmp_path)


def test_another_spelling_of_a_name_is_not(tmp_path: Path) -> None:
    assert part("U1").value == "TL074C"
    passes(written("U1", "Value", " tl074c"), tmp_path)


def test_another_part_number_is_caught_and_the_substitute_s_is_not(tmp_path: Path) -> None:
    wanted = number("R4")
    text = written("R4", "MPN", "XYZ-1")
    caught(text, "part-number", f"R4 is ordered as XYZ-1, not {wanted}", tmp_path)
    bought = part("R4").bought
    assert bought is not None
    maker, _, other = bought.substitute.partition(" ")
    assert maker
    assert other not in ("", wanted)
    passes(written("R4", "MPN", other), tmp_path)
    # A piece of a part number is none.
    text = written("R4", "MPN", other[3:])
    caught(text, "part-number", f"R4 is ordered as {other[3:]}, not {wanted}", tmp_path)


def test_a_board_without_part_numbers_passes_none(tmp_path: Path) -> None:
    """Drawn by hand, or in a KiCad that has no fields on the board."""
    bare = looked(drawn().replace('(property "MPN"', '(property "Other"'), tmp_path)
    assert bare["part-number"].status == NOT_RUN
    assert "MPN" in bare["part-number"].found
    one = changed("R4", lambda t: t.replace('"MPN"', '"Other"'))
    words = f"R4 is ordered as nothing, not {number('R4')}"
    caught(one, "part-number", words, tmp_path)


def test_another_footprint_is_caught_and_kicad_s_own_is_not(tmp_path: Path) -> None:
    own = footprint("R4").text(0)
    library, name = own.split(":")
    assert library == "designer"
    theirs = part("R4").footprint
    assert theirs == f"Resistor_SMD:{name}"

    def lies_in(other: str) -> str:
        return changed("R4", lambda t: t.replace(f'"{own}"', f'"{other}"', 1))

    other = "designer:R_0805_2012Metric"
    words = f"R4 is in R_0805_2012Metric, not in {name}"
    caught(lies_in(other), "part-footprint", words, tmp_path)
    words = "R4 is of the library mine, not of designer or Resistor_SMD"
    caught(lies_in(f"mine:{name}"), "part-footprint", words, tmp_path)
    passes(lies_in(theirs), tmp_path)


def test_a_needed_part_that_is_left_out_is_caught(tmp_path: Path) -> None:
    left_out = changed("R4", lambda t: t.replace("(attr smd", "(attr smd dnp"))
    caught(left_out, "part-fitted", "R4 is marked DNP", tmp_path)
    # Another mark of a footprint is not that one.
    passes(changed("R4", lambda t: t.replace("(attr smd", "(attr smd board_only")), tmp_path)


def left_out_of(mark: str) -> Callable[[str], str]:
    return lambda text: text.replace("(attr smd", f"(attr smd exclude_from_{mark}")


def test_a_part_that_an_order_s_files_leave_out_is_caught(tmp_path: Path) -> None:
    """Such a one was fitted by hand, said the read-me of an order that had no place for it."""
    for mark, file in (("pos_files", "the position file"), ("bom", "the bill")):
        text = changed("R4", left_out_of(mark))
        caught(text, "part-fitted", f"R4 is left out of {file}", tmp_path)


def test_a_part_that_the_design_leaves_out_is_caught_where_it_is_fitted(tmp_path: Path) -> None:
    assert not part("R911").fitted
    text = changed("R911", lambda t: t.replace(" dnp", ""))
    words = "R911 is not marked DNP, and the design leaves it out"
    caught(text, "part-fitted", words, tmp_path)


def test_many_differences_are_counted_and_the_first_are_named(tmp_path: Path) -> None:
    found = looked(drawn().replace("(attr smd", "(attr smd dnp"), tmp_path)["part-fitted"]
    smd = drawn().count("(attr smd")
    already = sum(" dnp" in line for line in drawn().splitlines() if "(attr smd" in line)
    assert smd - already > 5
    assert found.value == smd - already
    assert found.found.endswith(f"and {smd - already - 5} more")


def test_a_hole_that_a_square_pin_does_not_go_through_is_caught(tmp_path: Path) -> None:
    """A pin of 0.64 mm has a diagonal of 0.91 mm, and a hole comes out up to 0.08 mm too small."""
    as_exported = looked(drawn(), tmp_path)["pin-hole"]
    assert as_exported.status == PASS
    narrow = changed("J2", lambda t: t.replace("(drill 1)", "(drill 0.98)", 1))
    found = looked(narrow, tmp_path)["pin-hole"]
    assert found.status == FAIL
    assert found.where == "J2.1"
    assert found.value == pytest.approx(0.98 - 0.91)
    just = changed("J2", lambda t: t.replace("(drill 1)", "(drill 0.99)", 1))
    assert looked(just, tmp_path)["pin-hole"].status == PASS
