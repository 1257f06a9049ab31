"""Wanted responses that no motion of a model can be: refused where that is certain, and only there.

What is merely not found on the model is no matter of the file (``model.find_responses``).
"""

from __future__ import annotations

from collections.abc import Iterator

from designer.base.errors import InputError
from designer.dynamics.counts import Counts
from designer.model.mechanics import MechanicalModel, SecondOrderSystem
from designer.model.response_table import Response

SIDES = {1: "upper", -1: "lower"}


def check_possible(
    response: Response, index: int, model: MechanicalModel, file: str | None
) -> None:
    """Refuse a response that the model cannot have, whatever its numbers.

    index : number of its table in the file, from 1.

    Raises
    ------
    InputError : n-p-q without a p-q for each clearance; impacts on a stop that is not there,
        whatever its mirror twin has; a period or a symmetry that such a motion cannot have.
    """
    expect, system = response.expect, model.second_order()
    if expect is None:
        return
    stops, field = system.clearances, f"response[{index}].expect"
    count = max(len(stops), 1)
    if len(expect.impacts) != count:
        shape = "1-" + ";".join(["p-q"] * count)
        listed = f", for the clearances {', '.join(s.name for s in stops)}" if count > 1 else ""
        raise InputError(file, field, str(expect), f"p-q for each clearance, as in {shape}{listed}")
    missing = list(_missing_stops(expect, system))
    if missing:
        none = f"there is no {' and no '.join(missing)}" if stops else "the model has no stops"
        expected = f"0 for a stop that is not there, as in {_near(expect, system)}: {none}"
        raise InputError(file, field, str(expect), expected)
    if expect.n > 1 and not expect.total and _is_linear_between(system):
        expected = "n = 1: a motion without impacts is linear, and has the period of its drive"
        raise InputError(file, field, str(expect), expected)
    if response.symmetric and expect.n % 2 == 0:
        field = f"response[{index}].symmetric"
        expected = f"none beside {expect}: of a symmetric motion n is odd"
        raise InputError(file, field, "true", expected)


def _missing_stops(counts: Counts, system: SecondOrderSystem) -> Iterator[str]:
    """Stops that are to be hit and are not there, in words."""
    for index, pair in enumerate(counts.impacts):
        stop = system.clearances[index] if system.clearances else None
        for side, hits in zip((1, -1), pair, strict=True):
            if hits and (stop is None or side not in stop.positions):
                yield "stop" if stop is None else f"{SIDES[side]} stop of {stop.name}"


def _near(counts: Counts, system: SecondOrderSystem) -> Counts:
    """What may have been meant: the mirror twin, or 0 for each stop that is not there."""
    if not list(_missing_stops(counts.mirrored, system)):
        return counts.mirrored
    impacts = list[tuple[int, int]]()
    for index, (p, q) in enumerate(counts.impacts):
        there = system.clearances[index].positions if system.clearances else ()
        impacts.append((p if 1 in there else 0, q if -1 in there else 0))
    return Counts(counts.n if any(map(any, impacts)) else 1, tuple(impacts))


def _is_linear_between(system: SecondOrderSystem) -> bool:
    """Whether nothing but the entry into contact, or its end, changes the equations."""
    flow = system.piecewise_linear(1.0)
    first = flow.mode(flow.start).guards
    entered = [guard for each in first for guard in flow.mode(each.target).guards]
    return all(guard.clearance >= 0 for guard in (*first, *entered))
