"""What a page asks, and the messages that answer it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, cast, get_args

from designer.base.guarded_reading import read_text
from designer.dynamics.attractors import same, settle, starts
from designer.dynamics.orbit import ANSWERS, Orbit
from designer.dynamics.step_budget import Budget
from designer.explorer.board_box import Choose, board_box, expected
from designer.explorer.job_processes import JobProcesses, JobVerb
from designer.explorer.omega_strip import strip
from designer.explorer.place import ModelPlace, read_place, start_text
from designer.explorer.response_map import borders, mapped, read_map
from designer.explorer.response_view import STEPS, respond, summary
from designer.explorer.saved_model import not_found, place_for, read_pins, save, saved_text
from designer.explorer.wire import Message
from designer.model.driven import model_flow
from designer.model.find_responses import STARTS, scale_of
from designer.model.model_file import MAX_BYTES, ModelFile, need_responses, parse_model_file


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


Kind = Literal["view", "map", "borders", "save", "run", "search", "board"]


@dataclass(frozen=True)
class PageQuestion:
    """What a page asks."""

    kind: Kind
    """A picture; a map, or the borders on it; a model file to be saved, and then a verb on it; or
    real parts."""
    number: int
    """The page's own number of the question, which the answers have as ``id``."""
    words: dict[str, object]
    """The place (``place.read_place``)."""
    more: dict[str, object]
    """Of what is saved: ``name``, ``pins`` and ``overwrite``; of real parts ``expect``; of maps and
    borders ``map``, which is None of a map that is put away."""


def read_question(text: str | bytes) -> PageQuestion | None:
    """The question in a message of a page; None where there is none."""
    try:
        asked: Any = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(asked, dict) or asked.get("kind") not in get_args(Kind):
        return None
    number, words = asked.get("id"), asked.get("words")
    if not isinstance(number, int) or not isinstance(words, dict):
        return None
    keys = ("name", "pins", "overwrite", "expect", "map")
    more = {key: asked[key] for key in keys if key in asked}
    return PageQuestion(cast("Kind", asked["kind"]), number, words, more)


def viewed(modelfile: ModelFile, question: PageQuestion) -> Iterator[Message]:
    """The view of a place, pieces of the strip around it, and its other attractors.

    Raises
    ------
    InputError : words that give no place.
    """
    place = read_place(modelfile, question.words)
    view = respond(place)
    yield view.message()
    if len(view.orbit.start):
        yield from strip(place, view.orbit.start)
    yield from others(place, view.orbit)


def planes(modelfile: ModelFile, question: PageQuestion) -> Iterator[Message]:
    """The map over two parameters around a place, or the borders on it.

    Raises
    ------
    InputError : words that give no place or no map.
    """
    words = question.more.get("map")
    if words is not None:
        request = read_map(modelfile, read_place(modelfile, question.words), words)
        yield from (mapped if question.kind == "map" else borders)(request)


def boards(modelfile: ModelFile, choose: Choose, question: PageQuestion) -> Iterator[Message]:
    """Real parts for the response that a page shows, and their yield.

    Raises
    ------
    InputError : words that give no place, or what no circuit makes.
    """
    place = read_place(modelfile, question.words)
    yield from board_box(modelfile, place, expected(question.more.get("expect")), choose)


def save_model(
    modelfile: ModelFile, root: Path, jobs: JobProcesses, question: PageQuestion
) -> Iterator[Message]:
    """A place saved as a model file in ``root``, and a job that is begun on it.

    A file that is there and says something else is replaced only with ``overwrite``; without it the
    answer is of kind "exists".

    Raises
    ------
    InputError : a name that is none, words that give no place, a file that cannot be written.
    """
    more = question.more
    path = place_for(root, more.get("name", ""))
    place = read_place(modelfile, question.words)
    text = saved_text(modelfile, place, read_pins(modelfile, more.get("pins", [])))
    saved = parse_model_file(text, path)
    if question.kind != "save":
        need_responses(saved, ": pin one")
    if not save(path, text, overwrite=more.get("overwrite") is True) and (
        read_text(path, "a model file", most=MAX_BYTES) != text
    ):
        yield {"kind": "exists", "name": path.name, "verb": question.kind}
        return
    yield {"kind": "saved", "name": path.name, "missing": not_found(saved)}
    if question.kind != "save":
        yield jobs.start(cast("JobVerb", question.kind), path).message()
