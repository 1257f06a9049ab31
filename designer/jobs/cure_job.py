"""``designer search DIR --yield Y``: the cheapest cure of a design folder, and what is written.

``cure.json`` with everything that was found, the front of yield against price in
``cure-front.csv``, ``.png`` and ``.svg``, and ``cure-studies.json``, the verdicts of every board
that was asked, from which interrupted work goes on. With ``out`` the cured design is a design
folder of its own.
"""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.defaults import SEED
from designer.base.design_folder import Folder, is_design_folder
from designer.base.errors import MISSING, InputError
from designer.base.frames import flat_frame, table_html
from designer.base.keyed_store import Lines
from designer.base.manifest import StageName
from designer.base.plain_json import dumps
from designer.base.progress import Progress
from designer.base.schema import one_of
from designer.centering.cure_branch import KINDS, cured, kind_named
from designer.centering.cure_measure import Book
from designer.centering.cure_result_json import cure_json, front_csv
from designer.centering.cure_search import find_cure
from designer.centering.cure_upgrade import Upgrades
from designer.check.synthesis_result import Synthesis
from designer.jobs import design_files, folder_numbers, rung_choice
from designer.jobs.options import Options
from designer.jobs.origin import provenance
from designer.jobs.synthesise_job import design_inputs, grade_inputs, made_from, read_design
from designer.model.model_file import naming, need_responses
from designer.synthesis.tie_break import SOLVER

if TYPE_CHECKING:
    import pandas as pd

CURE, STUDIES = "cure.json", "cure-studies.json"
_LINES = Lines("studies", "verdicts")
"""How the studies are written: each by its hash, which says all that decides it."""
FRONT = ("cure-front.csv", "cure-front.png", "cure-front.svg")
RULES = 5
"""Raised whenever the same inputs are to give another answer."""


@dataclass(frozen=True)
class CureResult:
    """What a cure answers."""

    answer: dict[str, Any]
    """The JSON object."""
    reached: bool
    """Whether every response has the yield that was asked for, within the budget."""
    reused: bool
    """Whether the folder held the answer already."""

    def front(self) -> pd.DataFrame:
        """The front of yield against price, a row for each choice of upgrades."""
        return flat_frame(self.answer["front"])

    def responses(self) -> pd.DataFrame:
        """A row for each response, before and with the cure."""
        return flat_frame(self.answer["responses"])

    def _repr_html_(self) -> str:
        rows = [{"upgrade": text} for text in self.answer["said"]]
        title = f"Yield {self.answer['target']:g}: {'reached' if self.reached else 'not reached'}"
        return table_html(title, rows, f"price {self.answer['price']:.4g}")


def cure(
    folder: Path | str,
    *,
    yield_: float | None = None,
    budget: float | None = None,
    without: Collection[str] = (),
    out: Path | str | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
) -> CureResult:
    """The verb ``search --yield``: the cheapest cure of a design folder, which is written there.

    yield_, budget, without, out : as ``cure_into``. What is not given is that of the folder's own
    cure, if there is one; with ``overwrite`` its budget and its kinds are not taken over.

    Raises
    ------
    InputError : as ``cure_into``, or no yield is given and the folder has no cure.
    """
    path = Path(folder)
    limits = () if overwrite else ("budget", "without")
    known: dict[str, Any] = {}
    if is_design_folder(path):
        known = folder_numbers.own(Folder(path), "cure", ("yield", "seed"), limits)
    given = {"yield": yield_, "budget": budget, "without": without or None, "seed": seed}
    asked = known | {name: value for name, value in given.items() if value is not None}
    if "yield" not in asked:
        raise InputError(None, "--yield", MISSING, "the yield that the cure shall reach")
    return cure_into(
        path,
        target=asked["yield"],
        budget=asked.get("budget"),
        out=None if out is None else Path(out),
        without=asked.get("without", ()),
        options=Options(asked.get("seed", SEED), jobs, overwrite=overwrite, resume=resume),
        progress=progress,
    )


def cure_into(
    folder: Path,
    *,
    target: float,
    budget: float | None = None,
    out: Path | None = None,
    without: Collection[str] = (),
    options: Options | None = None,
    progress: Progress | None = None,
) -> CureResult:
    """Find the cheapest cure of the design in ``folder``, write it there, and say so.

    target : yield of every wanted response, as built (trimmed where the cure says so): the lower
    end of its 95 % interval on fresh boards. budget : most that the upgrades may cost, in euro by
    the catalogue's price classes. out : folder for the cured design. without : kinds of upgrades
    that are not wanted; a hyphen may stand for a space. options : seed, jobs, overwrite, resume.

    Raises
    ------
    InputError : the target or the budget is none; an unknown kind; the folder is no design folder,
        or holds a cure of other inputs, or ``out`` holds a design, and the options do not say what
        to do.
    """
    options = Options() if options is None else options
    said = Progress() if progress is None else progress
    options.check()
    unwanted = _checked(target, budget, without)
    if out is not None:
        if out.resolve() == folder.resolve():
            raise InputError(None, "--out", str(out), "another folder than the one that is cured")
        Folder(out)  # refuses a place where something else stands
    base = read_design(folder, progress=said)
    need_responses(base.modelfile)
    place = Folder(folder)
    inputs = {
        "design": made_from(place),
        "catalogue": base.catalog.hash,
        "rules": RULES,
        "yield": target,
        "budget": budget,
        "without": sorted(unwanted),
        "seed": options.seed,
        **grade_inputs(base.modelfile, base.catalog),
    }
    wanted: dict[StageName, tuple[dict[str, Any], list[str]]] = {
        "cure": (inputs, [CURE, STUDIES, *FRONT])
    }
    todo = place.decide(wanted, overwrite=options.overwrite, resume=options.resume)
    if not todo:
        answer = place.json(CURE)
        if out is not None:
            _write_design(base, answer, out, options, said)
        return CureResult(answer, bool(answer["reached"]), True)
    if out is not None:
        _check_room(base, out, options)
    rung = rung_choice.choose(place)
    if rung.rung == "ngspice":
        said.note(
            f"{rung.reason}; a cure is decided on the exact circuit all the same: ask ngspice "
            "about the cured design (tolerance --rung ngspice)"
        )
    began = time.perf_counter()
    known = {}
    if place.manifest and STUDIES in place.manifest.files:
        known = _LINES.load(place / STUDIES, said.note, place.vouches)
    provenance_ = provenance(
        base.modelfile, base.catalog.hash, seed=options.seed, settings={"highs": SOLVER}
    )
    place.begin(wanted, provenance_)
    guard = place.watch()

    def save(studies: dict[str, Any]) -> None:
        guard()
        place.write(STUDIES, _LINES.text(studies["studies"]))

    with naming(base.modelfile):
        found = find_cure(
            base,
            target,
            budget=budget,
            trim=base.modelfile.tuning.offset,
            without=unwanted,
            seed=options.seed,
            jobs=options.jobs,
            book=Book(known, save),
            progress=said,
        )
    said.stage("report of the cure")
    from designer.base.figure_style import to_png, to_svg
    from designer.centering.cure_plots import front_chart  # matplotlib is not needed before this

    answer = cure_json(found, provenance_, time.perf_counter() - began)
    guard()
    place.write(CURE, dumps(answer))
    place.write(FRONT[0], front_csv(found))
    chart = front_chart(found)
    place.write(FRONT[1], to_png(chart))
    place.write(FRONT[2], to_svg(chart))
    place.finish("cure")
    answer = place.json(CURE)
    if out is not None:
        _write_design(base, answer, out, options, said)
    return CureResult(answer, found.reached, False)


def _check_room(base: Synthesis, out: Path, options: Options) -> None:
    """Refuse before the work a folder that could not be written after it.

    Raises
    ------
    InputError : a design stands there, which is not to be overwritten; a file that the folder's
        manifest does not list stands in the way.
    """
    folder = Folder(out)
    if folder.manifest is not None and "design" in folder.manifest.stages and not options.overwrite:
        expected = "a folder without a design, or --overwrite to replace it by the cured one"
        raise InputError(None, "--out", str(out), expected)
    # The cured design's files have the names of this one's.
    folder.decide(design_inputs(base.modelfile, base.catalog), overwrite=True, resume=False)


def _write_design(
    base: Synthesis, answer: dict[str, Any], out: Path, options: Options, said: Progress
) -> None:
    """The cured design as a design folder; nothing where there is no cure."""
    if not answer["reached"]:
        said.note("no cure: no design is written")
        return
    said.stage("cured design")
    made = cured(base, Upgrades.of_dict(answer["upgrades"]))
    folder = Folder(out)
    wanted = design_inputs(made.modelfile, made.catalog)
    if not folder.decide(wanted, overwrite=options.overwrite, resume=options.resume):
        return
    files = design_files.texts(made)
    folder.begin(wanted, design_files.design_provenance(made))
    design_files.write(folder, made, files)
    folder.finish("design")


def _checked(target: float, budget: float | None, without: Collection[str]) -> frozenset[str]:
    """The kinds that are not wanted, by their own names."""
    if not 0.0 < target < 1.0:
        raise InputError(None, "--yield", target, "a share above 0 and below 1, such as 0.99")
    if budget is not None and not 0.0 <= budget < float("inf"):
        raise InputError(None, "--budget", budget, "a price >= 0, in euro")
    kinds = set()
    for name in without:
        kind = kind_named(name)
        if kind is None:
            names = [k.replace(" ", "-") for k in KINDS]
            raise InputError(None, "--without", name, one_of(name, names))
        kinds.add(kind)
    return frozenset(kinds)
