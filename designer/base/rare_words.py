"""Rare losses in words, of what a study's answer says of them (``rare``, ``any_lost``)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

PARTS = 2
"""Parts of a region that are named."""


def loss_words(rare: Mapping[str, Any]) -> str:
    """How many boards of a million lose a response, what most of these show, and which parts lead
    there: of its ``rare``."""
    value, low, high = rare["per_million"]
    if not rare["drawn_lost"]:
        return f"no board that was asked is lost, so at most {high:.3g} of a million are (95 %)"
    text = f"{value:.3g} of a million boards are lost ({low:.3g} to {high:.3g})"
    for region in rare["regions"][:1]:
        leading = f" by {', '.join(region['parts'][:PARTS])}" if region["parts"] else ""
        text += f", of them {100 * region['share']:.2g} %{leading}, which show {region['becomes']}"
    alone = [each for each in rare["margins"] if each["part"] and each["widening"] is not None]
    for nearest in alone[:1]:
        wide = f"{nearest['widening']:.2g} times its tolerance"
        text += f"; {nearest['part']} alone loses it at {wide}"
    return text


def any_lost_words(any_lost: Mapping[str, Any]) -> str:
    """How many boards of a million lose one of several responses at least: a sentence without its
    full stop."""
    least, most, low, high = (1e6 * any_lost[key] for key in ("least", "most", "low", "high"))
    return (
        f"At least one of the responses is lost on {least:.3g} to {most:.3g} of a million boards "
        f"({low:.3g} to {high:.3g} by the ends of the intervals)"
    )


def boards_at(temperature: Sequence[float] | None) -> str:
    """At which temperature boards are, such as "at 25 °C". temperature : the range that their
    spread states [°C]."""
    low, high = (25.0, 25.0) if temperature is None else temperature
    text = f"at {low:g} to {high:g} °C, each at its own" if low < high else f"at {low:g} °C"
    return text.replace("-", "−")
