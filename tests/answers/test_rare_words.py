"""How many boards of a million, in words."""

from __future__ import annotations

from typing import Any

import pytest

from designer.answers.rare_words import any_lost_words, boards_text, loss_words, share_text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (0.0123, "0.0123"), (12.0, "12"), (7.25, "7.25"), (99.96, "100"),
     (123.4, "123"), (1234.6, "1235"), (200_000.0, "200000"), (1e6, "1000000")],
)  # fmt: skip
def test_boards_of_a_million_are_whole_from_a_hundred_up(value: float, text: str) -> None:
    assert boards_text(value) == text


@pytest.mark.parametrize(
    ("share", "text"),
    [(1.0, "100 %"), (0.996, "100 %"), (0.8, "80 %"), (0.0815, "8.2 %"), (3e-7, "0.00003 %")],
)
def test_a_share_has_no_exponent(share: float, text: str) -> None:
    assert share_text(share) == text


def test_plenty_of_losses_are_said_in_whole_boards() -> None:
    region = {"becomes": "2-2-2", "share": 1.0, "parts": []}
    rare: Any = {"per_million": [2e5, 1.8e5, 2.234e5], "drawn_lost": 40, "regions": [region]}
    rare["margins"] = []
    assert loss_words(rare) == (
        "200000 of a million boards are lost (180000 to 223400), of them 100 %, which show 2-2-2"
    )
    none: Any = {"per_million": [0.0, 0.0, 1234.0], "drawn_lost": 0}
    assert "at most 1234 of a million" in loss_words(none)
    joint = any_lost_words({"least": 0.2, "most": 0.3, "low": 0.1, "high": 1.0})
    assert "200000 to 300000 of a million boards (100000 to 1000000 by" in joint
