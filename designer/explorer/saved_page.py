"""The page of one design as one file that needs no server and no network: its responses along ω and
its yields, recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from designer.base import progress
from designer.base.atomic_write import appearing
from designer.base.errors import DesignerError, InputError
from designer.base.si_unit import value_text
from designer.base.threads import parallel
from designer.bifurcations import window_ends
from designer.bifurcations.continuation import End
from designer.bifurcations.windows import BranchWindow, WindowEnd, window
from designer.centering import stage_choice
from designer.check import checked_design
from designer.dynamics.orbit import SETTLED, Orbit
from designer.explorer.controls import Control, controls
from designer.explorer.explorer_page import recorded_page
from designer.explorer.folder_losses import folder_losses
from designer.explorer.omega_strip import COURSE, piece
from designer.explorer.place import OMEGA, ModelPlace, first_place
from designer.explorer.response_view import (
    Detail,
    facts,
    reached,
    shown_motions,
    summary,
    view_of,
)
from designer.explorer.wire import Message, short_columns
from designer.jobs.options import Options
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile
from designer.model.swept_model import ModelSubject
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import Answer, StudyPlan
from designer.yields.study_plan import plan_study
from designer.yields.yield_count import Yield, all_on_one, count

PIECE = 10
"""Boards between two steps of the progress."""


@dataclass(frozen=True)
class RecordedYield:
    """What becomes of one wanted response on real parts."""

    omega: float | None
    """Drive frequency in the model's units; None of all responses on one board."""
    summary: str
    """The response in words."""
    words: str
    """How many boards keep it, or what the nominal circuit shows instead."""

    def message(self) -> Message:
        """What the page writes of it."""
        return {"omega": self.omega, "summary": self.summary, "words": self.words}


@dataclass(frozen=True)
class RecordedYields:
    """The yields of a file, or why there are none."""

    words: str
    """What the yields stand on, or why there are none."""
    rows: tuple[RecordedYield, ...] = ()
    """One for each wanted response, then all of them on one board."""


def yields(modelfile: ModelFile, options: Options) -> RecordedYields:
    """Parts for all wanted responses of the file, and its yields on the exact circuit."""
    if not modelfile.responses:
        return RecordedYields("the model file wants no response")
    try:
        return _counted(modelfile, options)
    except DesignerError as error:
        return RecordedYields(str(error))


def _counted(modelfile: ModelFile, options: Options) -> RecordedYields:
    progress.stage("parts for the wanted responses")
    synthesis = stage_choice.synthesise(modelfile, all_found=False, jobs=options.workers)
    design, responses = synthesis.design, synthesis.model_responses
    checked = checked_design.check(design, responses, None)
    asked = [each for each in checked if each.circuit.status in SETTLED]
    studied = modelfile, design, asked, synthesis.catalog
    plan = plan_study(*studied, samples=options.samples, seed=options.seed)
    answers = _answers(plan, options)
    rows = []
    for each in checked:
        words = f"the circuit shows: {each.circuit.response}"
        if each in asked:
            question = asked.index(each)
            words = _words(count(a for a in answers if a.question == question))
        rows.append(RecordedYield(each.model.omega, _summary(each.model), words))
    if len(asked) == len(checked) > 1:
        rows.append(RecordedYield(None, "all of them on one board", _words(all_on_one(answers))))
    words = f"{plan.samples} boards under the spread of the file, seed {plan.seed}"
    return RecordedYields(words, tuple(rows))


def _answers(plan: StudyPlan, options: Options) -> list[Answer]:
    """The answers of every board on the exact circuit."""
    step, answers = progress.stage("boards", plan.samples), []
    for indices in plan.blocks(PIECE) if plan.questions else ():
        answers += exact_circuit.block(plan, indices, options.workers)
        for _ in indices:
            step()
    return answers


def _summary(response: ModelResponse) -> str:
    shown = "any response" if response.spec.expect is None else str(response.spec.expect)
    return f"{shown} at {response.spec.place_text(6)}"


def _words(counted: Yield) -> str:
    low, high = counted.interval
    rate = 100.0 * counted.rate
    return f"{rate:.1f} % keep it ({100.0 * low:.1f} to {100.0 * high:.1f} %)"


DETAIL = Detail(points=512, fewest=40, most=256, long=12, strobes=120)
"""The detail of a recorded picture: a page of a hundred of them can still be mailed."""
MOTIONS = 4
"""Displacements that are recorded, those in the clearances first."""
ROOM, PER_VIEW, PER_MOTION = 1_250_000, 1_600, 5_000
"""Bytes for all places, and about how many a place takes and each of its displacements."""
MOST_PLACES = 150
LEAST_STEPS = 2
"""Places in a row that show a response whose window is located."""


@dataclass(frozen=True)
class RecordedWindow:
    """The window of a response, and where in it the page goes."""

    omega: float
    """Drive frequency of a recorded place that shows the response."""
    orbit: Orbit
    """The response there."""
    window: BranchWindow
    """The window, its ends located by continuation."""
    in_hertz: bool = False
    """Whether people read the drive frequency in hertz, since it is in rad/s."""

    def message(self) -> Message:
        """What the page writes of it."""
        return {
            "omega": self.omega,
            "summary": summary(self.orbit),
            "words": f"{self._end(self.window.low)} to {self._end(self.window.high)}",
        }

    def _end(self, end: WindowEnd) -> str:
        why = "end of the slider" if end.why == End.LIMIT else end.why
        place = f"{end.value:.6g}"
        if self.in_hertz:
            place = value_text(end.value / (2.0 * np.pi), "Hz", 6)
        return f"{place} ({why})"


@dataclass(frozen=True)
class BranchRecording:
    """What each place along ω shows from rest."""

    omegas: tuple[float, ...]
    """Drive frequencies of the places, ascending, in the model's units."""
    views: tuple[Message, ...]
    """For each place the figures, and under "motions" a picture of each displacement."""
    strip: Message
    """The bifurcation diagram of all places."""
    windows: tuple[RecordedWindow, ...]
    """Windows of the responses, ascending."""


def places(modelfile: ModelFile) -> tuple[float, ...]:
    """Drive frequencies along the slider of ω that a page has room for, and those of the file."""
    (control,) = (each for each in controls(modelfile) if each.name == OMEGA)
    own = {r.omega for r in modelfile.responses if r.omega is not None}
    own.add(first_place(modelfile).omega)
    motions = min(len(shown_motions(modelfile.model.second_order())), MOTIONS)
    count = min(MOST_PLACES, ROOM // (PER_VIEW + motions * PER_MOTION)) - len(own)
    return tuple(sorted(own | set(_along(control, max(count, 2)))))


def record(modelfile: ModelFile, omegas: Sequence[float], jobs: int) -> BranchRecording:
    """The places from rest, in parallel, and the windows of what they show.

    omegas : drive frequencies, ascending, in the model's units.
    """
    first = first_place(modelfile)

    def visit(omega: float) -> tuple[Orbit, Message]:
        orbit, view = _visit(replace(first, omega=omega))
        step()
        return orbit, view

    step = progress.stage("what each drive frequency shows", len(omegas))
    visits = list(parallel(visit, omegas, jobs))
    orbits = [orbit for orbit, _ in visits]
    settings = ModelSubject(first.model).settings([{OMEGA: omega} for omega in omegas])
    drawn = [k for k, orbit in enumerate(orbits) if len(orbit.start)]
    steps = [settings[k].steady(orbits[k].start, COURSE) for k in drawn]
    return BranchRecording(
        tuple(omegas),
        tuple(view for _, view in visits),
        piece([omegas[k] for k in drawn], steps),
        tuple(_windows(modelfile, omegas, orbits, jobs)),
    )


def _along(control: Control, count: int) -> list[float]:
    """Values along a slider, with the digits that it shows."""
    return [control.rounded(w, 6) for w in np.geomspace(control.low, control.high, count)[1:-1]]


def _visit(place: ModelPlace) -> tuple[Orbit, Message]:
    flow, orbit = reached(place)
    motions = shown_motions(place.model.second_order())[:MOTIONS]
    views = [view_of(place, flow, orbit, motion, DETAIL) for motion in motions]
    return orbit, {
        "words": {OMEGA: repr(place.omega)},
        "response": orbit.response,
        "summary": summary(orbit),
        "facts": facts(orbit, place),
        "motions": [view.picture(short_columns) for view in views],
    }


def _windows(
    modelfile: ModelFile,
    omegas: Sequence[float],
    orbits: Sequence[Orbit],
    jobs: int,
) -> list[RecordedWindow]:
    middles = _middles(orbits)
    step = progress.stage("windows of the responses", len(middles))
    span = omegas[0], omegas[-1]

    def locate(k: int) -> RecordedWindow | None:
        recorded = _window(modelfile, omegas[k], orbits[k], span)
        step()
        return recorded

    each = [recorded for recorded in parallel(locate, middles, jobs) if recorded is not None]
    return _distinct(sorted(each, key=lambda recorded: recorded.window.low.value))


def _middles(orbits: Sequence[Orbit]) -> list[int]:
    """The middle place of each row of places that show one response of short period."""

    def shown(k: int) -> tuple[str, bool | None]:
        return orbits[k].response, orbits[k].symmetric

    rows = [list(row) for _, row in groupby(range(len(orbits)), shown)]
    rows = [row for row in rows if 0 < orbits[row[0]].n <= window_ends.LONGEST]
    return [row[len(row) // 2] for row in rows if len(row) >= LEAST_STEPS]


def _window(
    modelfile: ModelFile, omega: float, orbit: Orbit, span: tuple[float, float]
) -> RecordedWindow | None:
    """None where continuation does not follow the orbit."""
    first = first_place(modelfile)
    family = ModelSubject(first.model, omega).family(OMEGA)
    try:
        found = window(family, orbit, omega, *span)
    except ArithmeticError:
        return None
    return RecordedWindow(omega, orbit, found, first.in_si)


def _distinct(windows: Sequence[RecordedWindow]) -> list[RecordedWindow]:
    """The first of the windows that were located from two of their places."""
    out: list[RecordedWindow] = []
    for each in windows:
        low, response = each.window.low.value, each.window.response
        if not any(
            other.window.response == response
            and abs(other.window.low.value - low) <= window_ends.SAME * abs(low)
            for other in out
        ):
            out.append(each)
    return out


FIELD = "--save"


def save_page(
    modelfile: ModelFile,
    path: Path,
    options: Options,
) -> None:
    """Write the page of a model with the views along ω, the windows and the yields in it: as many
    views along the slider as 3 MB have room for.

    Raises
    ------
    InputError : the file is there and is not to be replaced, or cannot be written; an option that
    cannot be.
    """
    options.check()
    _check_place(path, options.overwrite)
    losses = folder_losses(modelfile, progress.note)
    branch = record(modelfile, places(modelfile), options.workers)
    counted = yields(modelfile, options)
    page = recorded_page(modelfile, message_of(branch, counted), losses)
    with appearing(path, FIELD) as partial:
        partial.write_text(page, encoding="utf-8")
    progress.note(f"{path} shows {modelfile.title} at {len(branch.omegas)} drive frequencies")


def message_of(branch: BranchRecording, counted: RecordedYields) -> Message:
    """What a saved page has in place of a server's answers."""
    return {
        "omegas": branch.omegas,
        "views": branch.views,
        "strip": branch.strip,
        "windows": [each.message() for each in branch.windows],
        "yields": {
            "words": counted.words,
            "rows": [each.message() for each in counted.rows],
        },
    }


def _check_place(path: Path, overwrite: bool) -> None:
    """Refuse before minutes of work what could not be written after them."""
    if path.is_dir() or not path.parent.is_dir():
        raise InputError(path, FIELD, "no place for a file", "a file in a folder that is there")
    if path.exists() and not overwrite:
        raise InputError(path, FIELD, "a file", "a name that is free, or --overwrite")
