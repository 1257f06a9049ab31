"""Rules on a board by what its maker makes. They are read from the board file, without KiCad."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from designer.board.board_facts import BoardFacts
from designer.catalog.design_rule import Finding, NotRun
from designer.catalog.fab import FabLimits, Measure


def track(facts: BoardFacts, fab: FabLimits) -> Iterator[Finding]:
    """The finest track [mm]."""
    yield _least(facts.finest_track, "track", fab, "the board has no track yet")


def ring(facts: BoardFacts, fab: FabLimits) -> Iterator[Finding]:
    """The thinnest ring of vias, and that of pads [mm]."""
    rings: tuple[tuple[float | None, Measure, str], ...] = (
        (facts.via_ring, "via-ring", "a via"),
        (facts.pad_ring, "pad-ring", "a pad"),
    )
    for value, measure, where in rings:
        if value is not None:
            yield _least(value, measure, fab, "", where)


def slot(facts: BoardFacts, fab: FabLimits) -> Iterator[Finding]:
    """How far the narrowest slot is outside what is milled [mm]."""
    if facts.narrowest_slot is None:
        yield Finding(0.0, more="the board has no slot")
    else:
        yield _outside(facts.narrowest_slot, "slot", fab)


def silk(facts: BoardFacts, fab: FabLimits) -> Iterator[Finding]:
    """The lowest letters and the finest line in silk [mm]."""
    if facts.silk_height is not None:
        yield _least(facts.silk_height, "silk-height", fab, "", "the lowest letters")
    if facts.silk_stroke is not None:
        yield _least(facts.silk_stroke, "silk-stroke", fab, "", "the finest line")


def hole(facts: BoardFacts, fab: FabLimits) -> Iterator[Finding]:
    """How far the smallest and the largest hole are outside what is drilled [mm]."""
    for value in (facts.smallest_hole, facts.largest_hole):
        if value is not None:
            yield _outside(value, "hole", fab)


def thickness(facts: BoardFacts, fab: FabLimits) -> Iterator[Finding]:
    """How far the board's thickness is outside what is made [mm]."""
    yield _outside(facts.thickness, "thickness", fab)


def layers(facts: BoardFacts, fab: FabLimits) -> Iterator[Finding]:
    """The number of copper layers."""
    if "layers" not in fab.most:
        raise NotRun(f"{fab.title} states no number of layers")
    yield Finding(facts.layers, limit=fab.most["layers"], more=_by(fab, "layers"))


READ: Mapping[str, Callable[[BoardFacts, FabLimits], Iterator[Finding]]] = {
    "fab-track": track,
    "fab-hole": hole,
    "fab-ring": ring,
    "fab-slot": slot,
    "fab-silk": silk,
    "fab-layers": layers,
    "fab-thickness": thickness,
}
"""By the id of the rule."""


def _least(
    value: float | None, measure: Measure, fab: FabLimits, without: str, where: str = ""
) -> Finding:
    """A value against the least that is made. without : why there is no value.

    Raises
    ------
    NotRun : there is none, or no limit.
    """
    if value is None:
        raise NotRun(without)
    if measure not in fab.least:
        raise NotRun(f"{fab.title} states no least {measure}")
    return Finding(value, where, fab.least[measure], _by(fab, measure))


def _outside(value: float, measure: Measure, fab: FabLimits) -> Finding:
    """How far a value is outside what is made; 0 inside."""
    low, high = fab.least.get(measure, 0.0), fab.most.get(measure, float("inf"))
    return Finding(
        max(low - value, value - high, 0.0),
        limit=0.0,
        more=f"{value:g} mm, made are {low:g} to {high:g} mm; {_by(fab, measure)}",
    )


def _by(fab: FabLimits, measure: Measure) -> str:
    return f"{fab.title}{', assumed' if measure in fab.assumed else ''}"
