"""Rare losses in words, of what a study's answer says of them (``rare``, ``any_lost``)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from designer.base.si_unit import celsius_text

if TYPE_CHECKING:
    from designer.answers.study_answer import AnyLostRow, RareLossKeys

PARTS = 2
"""Parts of a region that are named."""


def boards_text(boards: float) -> str:
    """How many boards of a million, such as "12.3" or "200000"."""
    return _number(boards, 3)


def share_text(share: float) -> str:
    """A share in per cent, such as "8.1 %" or "100 %"."""
    return f"{_number(100.0 * share, 2)} %"


def _number(value: float, digits: int) -> str:
    """So many significant digits, of large numbers all whole ones; without an exponent."""
    if value == 0.0:
        return "0"
    text = f"{value:.{max(digits - 1 - math.floor(math.log10(abs(value))), 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def loss_words(rare: RareLossKeys) -> str:
    """How many boards of a million lose a response, what most of these show, and which parts lead
    there: of its ``rare``."""
    value, low, high = map(boards_text, rare["per_million"])
    if not rare["drawn_lost"]:
        return f"no board that was asked is lost, so at most {high} of a million are (95 %)"
    text = f"{value} of a million boards are lost ({low} to {high})"
    for region in rare["regions"][:1]:
        leading = f" by {', '.join(region['parts'][:PARTS])}" if region["parts"] else ""
        text += f", of them {share_text(region['share'])}{leading}, which show {region['becomes']}"
    alone = [each for each in rare["margins"] if each["part"] and each["widening"] is not None]
    for nearest in alone[:1]:
        wide = f"{nearest['widening']:.2g} times its tolerance"
        text += f"; {nearest['part']} alone loses it at {wide}"
    return text


def any_lost_words(any_lost: AnyLostRow) -> str:
    """How many boards of a million lose one of several responses at least: a sentence without its
    full stop."""
    shares = any_lost["least"], any_lost["most"], any_lost["low"], any_lost["high"]
    least, most, low, high = (boards_text(1e6 * share) for share in shares)
    return (
        f"At least one of the responses is lost on {least} to {most} of a million boards "
        f"({low} to {high} by the intervals and what may be unseen)"
    )


def boards_at(temperature: Sequence[float] | None) -> str:
    """At which temperature boards are, such as "at 25 °C". temperature : the range that their
    spread states [°C]."""
    low, high = (25.0, 25.0) if temperature is None else temperature
    return f"at {celsius_text(low, high)}{', each at its own' if low < high else ''}"
