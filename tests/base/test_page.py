"""A page as Markdown: nothing in its text is markup, and what it does not have leaves no trace."""

from __future__ import annotations

from markupsafe import Markup

from designer.base.page import (
    Columns,
    Gallery,
    Items,
    Page,
    PageSection,
    Picture,
    SmallPrint,
    Table,
    Verbatim,
    bullets,
    markdown,
    table,
)


def test_every_block_has_its_form() -> None:
    page = Page(
        "A *title*",
        ["one\nparagraph", Markup("`code`"), Items((("3", "of 3"), ("", "_bare_")))],
        [
            PageSection(
                "Above",
                [
                    SmallPrint("a | b"),
                    Table(("name", "value"), (("R1", "5"),), (1,)),
                    Verbatim(("run  this",)),
                    Columns((PageSection("Left", ["left"]), PageSection("Right", ["right"]))),
                    Picture("shows", "caption", "a.png"),
                    Picture("", "drawn", sketch=("[--]",)),
                ],
            ),
        ],
    )
    assert markdown(page).split("\n\n") == [
        "# A \\*title\\*",
        "one paragraph",
        "`code`",
        "- **3**: of 3\n- \\_bare\\_",
        "## Above",
        "a \\| b",
        "| name | value |\n| ---- | ----: |\n| R1   |     5 |",
        "    run this",
        "### Left",
        "left",
        "### Right",
        "right",
        "![shows](a.png)",
        "caption",
        "    [--]",
        "drawn\n",
    ]


def test_what_is_not_there_leaves_no_trace() -> None:
    gallery = Gallery("pictures", Picture(), (Picture(svg="<svg></svg>"),))
    sections = [
        PageSection("Of HTML alone", [gallery, Picture(svg="<svg></svg>", caption="c")]),
        PageSection("Empty", [None, bullets([]), PageSection("Also", [table(("a",), [])])]),
    ]
    assert markdown(Page("t", [None], sections)) == "# t\n"


def test_a_last_column_stands_where_a_row_says_something_in_it() -> None:
    rows = [("a", "1", ""), ("b", "2", "")]
    short, whole = table(("x", "y", "note"), rows), table(("x", "y", "note"), [*rows, "c3!"])
    assert short is not None
    assert short.columns == ("x", "y")
    assert whole is not None
    assert whole.columns == ("x", "y", "note")


def test_rows_that_say_the_same_fold_into_a_sentence() -> None:
    alike: list[tuple[str, ...]] = [(f"board {k}", "ok", "ok") for k in range(9)]
    other = ("board 9", "ok", "lost")

    def folded(rows: list[tuple[str, ...]], names: int = 1) -> Table:
        whole = table(("board", "A", "B"), rows, names=names)
        assert whole is not None
        return whole

    every = folded(alike).folded
    assert every is not None
    assert (every.sentence, every.shown) == ("All 9 agree: ok.", None)
    most = folded([other, *alike]).folded
    assert most is not None
    assert most.sentence == "9 of 10 agree: ok."
    assert most.shown is not None
    assert most.shown.rows == (other,)
    assert most.hidden.rows == tuple(alike)
    text = markdown(Page("t", [folded([other, *alike])], []))
    assert "| board 9 | ok  | lost |" in text
    assert "9 of 10 agree: ok." in text
    assert "board 3" not in text
    for rows, names in ((alike[:5], 1), (alike, 0), ([*alike[:6], *([other] * 6)], 1)):
        assert folded(rows, names).folded is None
    pair = folded([(f"b{k}", "3", "4") for k in range(6)]).folded
    assert pair is not None
    assert pair.sentence == "All 6 agree: A 3, B 4."
