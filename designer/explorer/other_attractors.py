"""The attractors that exist side by side at a place, found one start after the other."""

from __future__ import annotations

from collections.abc import Iterator

from designer.dynamics.attractors import same, settle, starts
from designer.dynamics.orbit import ANSWERS, Orbit
from designer.dynamics.step_budget import Budget
from designer.explorer.place import ModelPlace, start_text
from designer.explorer.response_view import STEPS, summary
from designer.explorer.wire import Message
from designer.model.driven import model_flow
from designer.model.find_responses import STARTS, scale_of


def others(place: ModelPlace, shown: Orbit) -> Iterator[Message]:
    """After each start all attractors so far, the shown one first, with how many starts of those so
    far lead to each. The starts are those of ``model.find_responses``: rest, then a Sobol set."""
    flow = model_flow(place.model, place.omega)
    known = [shown] if shown.status in ANSWERS else []
    counts = [0] * len(known)
    for tried, start in enumerate(starts(scale_of(place.model, place.omega), STARTS), start=1):
        orbit = settle(flow, start, budget=Budget(STEPS))
        if orbit.status in ANSWERS:
            which = next((k for k, each in enumerate(known) if same(flow, orbit, each)), None)
            if which is None:
                which = len(known)
                known.append(orbit)
                counts.append(0)
            counts[which] += 1
        yield _message(known, counts, tried)


def _message(known: list[Orbit], counts: list[int], tried: int) -> Message:
    attractors = [
        {"summary": summary(orbit), "starts": count, "start": start_text(tuple(orbit.start))}
        for orbit, count in zip(known, counts, strict=True)
    ]
    return {"kind": "others", "attractors": attractors, "tried": tried, "of": STARTS}
