"""S-expressions: round trips of anything, and where a file is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from designer.base.errors import InputError
from designer.board import sexpr
from designer.board.sexpr import (
    DEEPEST,
    Atom,
    Expression,
    expression,
    expression_text,
    lists,
    number_text,
    read,
    read_all,
    word,
    write_all,
)

texts = st.text(st.characters(codec="utf-8"))
bare = st.from_regex(r"[A-Za-z0-9_.+*-][A-Za-z0-9_.+*#;-]*", fullmatch=True)
atoms = st.builds(Atom, bare) | st.builds(Atom, texts, st.just(True))
expressions = st.recursive(
    st.builds(Expression, st.lists(atoms).map(tuple)),
    lambda inner: st.builds(Expression, st.lists(atoms | inner, max_size=5).map(tuple)),
    max_leaves=20,
)


@given(expressions)
def test_what_is_written_is_read_again(made: Expression) -> None:
    assert read(expression_text(made)) == made


def plainly(tree: Expression, depth: int = 0) -> str:
    """The text of a list, character by character."""
    out = "("
    for number, item in enumerate(tree.items):
        if isinstance(item, Expression):
            out += "\n" + "\t" * (depth + 1) + plainly(item, depth + 1)
        else:
            marks = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"}
            quoted = '"' + "".join(marks.get(c, c) for c in item.text) + '"'
            out += " " * (number > 0) + (quoted if item.quoted else item.text)
    return out + ("\n" + "\t" * depth if tree.children else "") + ")"


@given(expressions)
def test_lists_and_words_are_laid_out_as_one_by_one(made: Expression) -> None:
    assert expression_text(made) == plainly(made) + "\n"


@given(st.lists(expressions, max_size=4))
def test_several_expressions_are_read_again(made: list[Expression]) -> None:
    assert list(read_all(write_all(made))) == made


@given(expressions, st.data())
def test_a_file_that_is_cut_off_is_refused(made: Expression, data: st.DataObject) -> None:
    text = expression_text(made).rstrip()
    cut = data.draw(st.integers(0, len(text) - 1))
    with pytest.raises(InputError) as caught:
        read(text[:cut])
    assert caught.value.exit_status == 2


@given(st.floats(-1e6, 1e6))
def test_numbers_are_plain_decimals_within_half_a_millionth(value: float) -> None:
    text = number_text(value)
    assert set(text) <= set("-0123456789.")
    assert text != "-0"
    assert abs(float(text) - value) <= 0.5e-6 + 1e-9 * abs(value)


def test_a_list_of_atoms_stands_on_one_line_and_lists_in_it_are_indented() -> None:
    made = expression("a", 1.5, "two words", True, expression("b", word("c")), None)
    assert expression_text(made) == '(a 1.5 "two words" yes\n\t(b c)\n)\n'


def test_lists_by_name_are_those_written_out() -> None:
    """A value, a tuple of values, lists in a list, a list of its name alone, and one left out."""
    short = expression("a", "b", at=(1, 2), font={"size": (1.5, 2), "bold": True}, c=(), d=None)
    font = expression("font", expression("size", 1.5, 2), expression("bold", True))
    assert short == expression("a", "b", expression("at", 1, 2), font, expression("c"))
    assert lists(name="x") == (expression("name", "x"),)


def test_kicads_escapes_are_understood() -> None:
    assert read(r'(a "x\ny" "q\"\\")').atoms == ("x\ny", 'q"\\')


def test_a_comment_is_a_line_that_begins_with_a_hash() -> None:
    assert read_all('# (x)\n(a b#c)\n  # ) "\n(d)') == (
        expression("a", word("b#c")),
        expression("d"),
    )


def test_a_bare_atom_that_would_not_be_read_is_not_written() -> None:
    for text in ("", "two words", 'a"b', "(", "#a"):
        with pytest.raises(ValueError, match="quoted"):
            expression_text(expression("a", word(text)))


@pytest.mark.parametrize(
    ("text", "place", "found"),
    [
        ("", "line 1, column 1", "0 expressions"),
        ("(a)\n (b)", "line 2, column 2", "2 expressions"),
        ("(a\n  (b)\n", "line 1, column 1", "nothing closes"),
        ('(a\n "x', "line 2, column 2", "without an end"),
        ("(a))", "line 1, column 4", '")"'),
        ("x", "line 1, column 1", "x"),
        ('(a "\n\n" \n)\n]', "line 5, column 1", "]"),
        ("(" * (DEEPEST + 1), f"line 1, column {DEEPEST + 1}", "levels"),
    ],
)
def test_a_wrong_file_is_refused_with_the_place(text: str, place: str, found: str) -> None:
    with pytest.raises(InputError) as caught:
        read(text)
    assert caught.value.field == place
    assert found in str(caught.value.found)


def test_what_is_missing_in_a_list_is_said_with_its_place() -> None:
    made = read('(a\n (b 1 "x")\n (b nan))')
    places = [b.error("1", "2").field for b in made.all("b")]
    assert places == ["line 2, column 2", "line 3, column 2"]
    assert made.get("b").number() == 1.0
    assert made.get("b").text(1) == "x"
    assert made.find("c") is None
    assert [e.name for e in made.walk()] == ["a", "b", "b"]
    for ask in (
        lambda: made.get("c"),
        lambda: made.get("b").number(1),
        lambda: made.get("b").text(2),
        lambda: made.all("b")[1].number(),
    ):
        with pytest.raises(InputError, match=r"line [123], column [12]"):
            ask()


def test_more_lists_than_a_file_needs_are_refused_before_any_is_made() -> None:
    with pytest.raises(InputError, match=r"board: the file: found 1500002 lists"):
        read("(" + "()" * (sexpr.MOST_LISTS + 1) + ")", Path("board"))


def test_more_words_than_a_file_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Different ones count: a board repeats its words."""
    monkeypatch.setattr(sexpr, "MOST_WORDS", 5)
    assert len(read("(a b c d e " + "e " * 50 + ")").items) == 55
    with pytest.raises(InputError, match="line 2, column 5: found more than 5 different words"):
        read("(a b c\nd e f)")


@pytest.mark.parametrize("text", ["x" * 1_000_001, '"' + "\\n" * 500_001 + '"'])
def test_a_word_without_end(text: str) -> None:
    with pytest.raises(InputError, match="a word of more than 1000000 characters"):
        read(f"(a {text})")


@given(st.text(st.sampled_from('"\\ab \n'), max_size=40))
def test_a_quoted_word_ends_at_the_first_bare_quotation_mark(text: str) -> None:
    """By a walk over its characters."""
    end = at = 0
    while at < len(text) and not end:
        if text[at] == "\\":
            at += 1
        elif text[at] == '"':
            end = at + 1
        at += 1
    if not end:
        with pytest.raises(InputError):
            read(f'(a "{text}')
        return
    with_end = read(f'(a "{text[:end]})')
    assert len(with_end.items) == 2
    assert isinstance(with_end.items[1], Atom)
    assert with_end.items[1].quoted
