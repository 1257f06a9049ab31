"""``designer search DIR --yield Y``: the cheapest repair of a design folder, and what is written.

``cure.json`` with everything that was found, the front of yield against price in
``cure-front.csv``, ``.png`` and ``.svg``, and ``cure-studies.json``, the verdicts of every board
that was asked, from which interrupted work goes on. With ``out`` the repaired design is a design
folder of its own.
"""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.csv_tables import csv_text
from designer.base.defaults import SEED
from designer.base.design_folder import Folder, is_design_folder
from designer.base.errors import MISSING, InputError
from designer.base.frames import flat_frame, table_html
from designer.base.keyed_store import Lines
from designer.base.manifest import Stages
from designer.base.plain_json import FORMAT, dumps
from designer.base.progress import Progress, note, reported, stage, watched, whole
from designer.base.schema import one_of
from designer.base.second_process import other_process
from designer.centering.repair_branch import KINDS, kind_named, repaired
from designer.centering.repair_measure import VerdictCache, is_rare
from designer.centering.repair_search import find_repair
from designer.centering.repair_trial import Repair, Trial
from designer.centering.repair_upgrade import Upgrades
from designer.centering.response_windows import need_periods
from designer.check.synthesis_result import Synthesis
from designer.folders.design_source import design_inputs, design_stage, grade_inputs, read_design
from designer.folders.model_source import design_inputs_of
from designer.folders.origin import provenance
from designer.folders.report_sections import renew_report
from designer.jobs import fidelity_choice, folder_numbers, usual_times
from designer.jobs.options import Options, stated_options
from designer.jobs.stage_runner import write_design
from designer.linear_network.milp import SOLVER
from designer.model.model_file import ModelFile, errors_in, need_responses
from designer.model.si_units import hertz_json

if TYPE_CHECKING:
    import pandas as pd

    from designer.answers.cure_answer import CureAnswer, CuredResponse, TrialRow
    from designer.answers.shared_rows import ProvenanceRow

REPAIR, STUDIES = "cure.json", "cure-studies.json"
_LINES = Lines("studies", "verdicts")
"""How the studies are written: each by its hash, which says all that decides it."""
FRONT = ("cure-front.csv", "cure-front.png", "cure-front.svg")
FEWEST_LOST = 8
"""Boards of a million, the fewest that may be asked for: ``repair_measure.MOST_PLAIN`` boards show
as much where none of them is lost."""
RULES = 9
"""Raised whenever the same inputs are to give another answer."""


@dataclass(frozen=True)
class CureResult:
    """What a repair answers."""

    answer: CureAnswer
    """The JSON object."""
    reached: bool
    """Whether every response has the yield that was asked for, within the budget."""
    reused: bool
    """Whether the folder held the answer already."""

    @property
    def satisfied(self) -> bool:
        """Whether the answer is yes: the yield is reached."""
        return self.reached

    def front(self) -> pd.DataFrame:
        """The front of yield against price, a row for each choice of upgrades."""
        return flat_frame(self.answer["front"])

    def responses(self) -> pd.DataFrame:
        """A row for each response, before and with the repair."""
        return flat_frame(self.answer["responses"])

    def _repr_html_(self) -> str:
        rows = [{"upgrade": text} for text in self.answer["said"]]
        title = f"Yield {self.answer['target']:g}: {'reached' if self.reached else 'not reached'}"
        return table_html(title, rows, f"price {self.answer['price']:.4g}")


@reported
def cure(
    folder: Path | str,
    *,
    yield_: float | None = None,
    ppm: float | None = None,
    budget: float | None = None,
    without: Collection[str] = (),
    out: Path | str | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
) -> CureResult:
    """The verb ``search --yield``: the cheapest repair of a design folder, which is written there.

    ``yield_`` : of every wanted response, as built (trimmed where the repair says so): the lower
    end of its 95 % interval on fresh boards. ppm : the same as the boards of a million that may
    lose a response; losses that are too rare to be counted are estimated (``rare_losses``).
    budget : most that the upgrades may cost, in euro by the catalogue's price classes. without :
    kinds of upgrades that are not wanted; a hyphen may stand for a space. out : folder for the
    repaired design. What is not given is that of the folder's own repair, if there is one; with
    ``overwrite`` its budget and its kinds are not taken over.

    Raises
    ------
    InputError : no yield is given and the folder has no repair, or it is given twice; the yield or
        the budget is none; an unknown kind; the folder is no design folder, or holds a repair of
        other inputs, or ``out`` holds a design, and nothing is said about what to do.
    """
    path = Path(folder)
    yield_ = target_of(yield_, ppm)
    limits = () if overwrite else ("budget", "without")
    defaults: dict[str, Any] = {}
    if is_design_folder(path):
        defaults = folder_numbers.stage_numbers(Folder(path), "cure", ("yield", "seed"), limits)
    settings = defaults | stated_options(
        {"yield": yield_, "budget": budget, "without": without or None, "seed": seed}
    )
    if "yield" not in settings:
        raise InputError(None, "--yield", MISSING, "the yield that the cure shall reach")
    with whole(usual_times.REPAIRED):
        return repair_into(
            path,
            target=settings["yield"],
            budget=settings.get("budget"),
            out=None if out is None else Path(out),
            without=settings.get("without", ()),
            options=Options(settings.get("seed", SEED), jobs, overwrite=overwrite, resume=resume),
        )


def repair_into(
    path: Path,
    *,
    target: float,
    budget: float | None = None,
    out: Path | None = None,
    without: Collection[str] = (),
    options: Options | None = None,
) -> CureResult:
    """As ``cure``, with nothing taken over from an earlier one. target : the yield."""
    options = Options() if options is None else options
    options.check()
    unwanted = _checked(target, budget, without)
    if out is not None:
        if out.resolve() == path.resolve():
            raise InputError(None, "--out", str(out), "another folder than the one that is cured")
        Folder(out)  # refuses a place where something else stands
    base = read_design(path, progress=watched())
    refuse_unreachable(base.modelfile, target, budget, without)
    folder = Folder(path)
    inputs = {
        "design": design_inputs_of(folder),
        "catalogue": base.catalog.hash,
        "rules": RULES,
        "yield": target,
        "budget": budget,
        "without": sorted(unwanted),
        "seed": options.seed,
        **grade_inputs(base.modelfile, base.catalog),
    }
    stages: Stages = {"cure": (inputs, [REPAIR, STUDIES, *FRONT])}
    todo = folder.decide(stages, overwrite=options.overwrite, resume=options.resume)
    if todo:
        if out is not None:
            _check_room(base, out, options)
        choice = fidelity_choice.choose(folder)
        if choice.rung == "ngspice":
            note(
                f"{choice.reason}; a cure is decided on the exact circuit all the same: ask "
                "ngspice about the cured design (tolerance --rung ngspice)"
            )
        _find_and_write(folder, stages, base, target, budget, unwanted, options)
    answer: CureAnswer = folder.json(REPAIR)
    renew_report(folder)
    if out is not None:
        _write_design(base, answer, out, options)
    return CureResult(answer, bool(answer["reached"]), not todo)


def _find_and_write(
    folder: Folder,
    stages: Stages,
    base: Synthesis,
    target: float,
    budget: float | None,
    unwanted: frozenset[str],
    options: Options,
) -> None:
    """Find the cheapest repair of the design ``base`` and write it into its folder."""
    began = time.perf_counter()
    studies_before = {}
    if folder.manifest and STUDIES in folder.manifest.files:
        studies_before = _LINES.load(folder / STUDIES, note, folder.vouches)
    origin = provenance(
        base.modelfile, base.catalog.hash, seed=options.seed, settings={"highs": SOLVER}
    )
    with folder.working(stages, origin):
        guard = folder.watch()

        def save(studies: dict[str, Any]) -> None:
            guard()
            folder.write(STUDIES, _LINES.text(studies["studies"]))

        with errors_in(base.modelfile):
            best = find_repair(
                base,
                target,
                budget=budget,
                trim=base.modelfile.tuning.offset,
                without=unwanted,
                seed=options.seed,
                jobs=options.jobs,
                verdict_cache=VerdictCache(studies_before, save),
            )
        stage("report of the cure")
        from designer.base.figure_style import to_png, to_svg
        from designer.centering.repair_plots import front_chart  # matplotlib is not needed before

        chart = front_chart(best)
        guard()
        folder.write(REPAIR, dumps(repair_json(best, origin, time.perf_counter() - began)))
        table_name, png_name, svg_name = FRONT
        folder.write(table_name, front_csv(best))
        folder.write(png_name, to_png(chart))
        folder.write(svg_name, to_svg(chart))


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
    # The repaired design's files have the names of this one's.
    inputs = design_inputs(base.modelfile, base.catalog)
    folder.decide(design_stage(base.modelfile, inputs), overwrite=True, resume=False)


def _write_design(base: Synthesis, answer: CureAnswer, out: Path, options: Options) -> None:
    """The repaired design as a design folder; nothing where there is no repair."""
    if not answer["reached"]:
        note("no cure: no design is written")
        return
    stage("cured design")
    synthesis = repaired(base, Upgrades.of_dict(answer["upgrades"]))
    folder = Folder(out)
    stages = design_stage(
        synthesis.modelfile, design_inputs(synthesis.modelfile, synthesis.catalog)
    )
    if folder.decide(stages, overwrite=options.overwrite, resume=options.resume):
        with other_process(options.workers) as other:
            write_design(folder, synthesis, stages, options, other)


def is_out_of_reach(folder: Folder) -> bool:
    """Whether the folder has a finished repair that does not reach its yield."""
    stage = None if folder.manifest is None else folder.manifest.stages.get("cure")
    return stage is not None and stage.complete and not folder.json(REPAIR)["reached"]


def refuse_unreachable(
    modelfile: ModelFile, target: float, budget: float | None, without: Collection[str]
) -> None:
    """Refuse what no repair of a design of this model file can reach.

    Raises
    ------
    InputError : as of ``cure``, but for what concerns a folder.
    """
    _checked(target, budget, without)
    need_responses(modelfile)
    listed = modelfile.measured
    if listed is not None and listed.labels and is_rare(target):
        expected = "no list of measured boards, which are as many as there are"
        raise InputError(
            modelfile.source, "spread.measured", f"{len(listed.labels)} boards", expected
        )
    with errors_in(modelfile):
        need_periods(modelfile.responses)


def target_of(yield_: float | None, ppm: float | None) -> float | None:
    """The yield that is wanted, None where nothing is said. ppm : the boards of a million that may
    be lost, instead.

    Raises
    ------
    InputError : both are given, or so few boards that none can be counted.
    """
    if ppm is None:
        return yield_
    if yield_ is not None:
        raise InputError(None, "--ppm", ppm, "no --yield beside it: both say what may be lost")
    if not FEWEST_LOST <= ppm < 1e6:
        expected = f"boards of a million that may be lost, from {FEWEST_LOST}, such as 10"
        raise InputError(None, "--ppm", ppm, expected)
    return 1.0 - 1e-6 * ppm


def _checked(target: float, budget: float | None, without: Collection[str]) -> frozenset[str]:
    """The kinds that are not wanted, by their own names."""
    if not 0.0 < target < 1.0:
        raise InputError(None, "--yield", target, "a share above 0 and below 1, such as 0.99")
    if target > 1.0 - 1e-6 * FEWEST_LOST * (1.0 - 1e-9):
        expected = f"at most {1.0 - 1e-6 * FEWEST_LOST:.8g}: more takes boards than are drawn"
        raise InputError(None, "--yield", target, expected)
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


COLUMNS = ("price_euro", "predicted", "yield", "low", "high", "samples", "upgrades", "failed")


def repair_json(repair: Repair, provenance: ProvenanceRow, seconds: float) -> CureAnswer:
    """Everything that was found. Prices are over the design as it is, in euro."""
    best, file = repair.best, repair.base.modelfile
    responses: list[CuredResponse] = [
        {
            "omega": r.omega,
            **hertz_json(r.omega, file.si),
            "b": r.b,
            "expected": r.expected,
            "before": before.as_dict(),
            "after": after.as_dict(),
            "reached": after.reached,
            "limit": limit,
        }
        for r, before, after, limit in zip(
            repair.base.model_responses,
            repair.before.measured,
            best.measured,
            repair.limits,
            strict=True,
        )
    ]
    return {
        "format": FORMAT,
        "reached": repair.reached,
        "why": repair.why,
        "target": repair.target,
        "budget": repair.budget,
        "price": best.price,
        "branch": best.branch,
        "upgrades": best.upgrades.as_dict(),
        "said": best.upgrades.in_words(file),
        "responses": responses,
        "rounds": [_trial(t, file) for t in repair.rounds],
        "front": [_trial(t, file) for t in repair.front],
        "refused": [{"upgrades": r.upgrades.in_words(file), "why": r.why} for r in repair.refused],
        "provenance": provenance,
        "cost": {"seconds": seconds},
    }


def front_csv(repair: Repair) -> str:
    """The front of yield against price: the yield is that of the worst response."""
    rows = []
    for t in repair.front:
        low, high = t.worst.interval
        asked, rare = t.worst.counts, t.worst.rare
        digits = 9 if is_rare(repair.target) else 5
        rows.append(
            {
                "price_euro": f"{t.price:.4g}",
                "predicted": f"{min(t.predicted):.{digits}g}",
                "yield": f"{t.worst.rate:.{digits}g}",
                "low": f"{low:.{digits}g}",
                "high": f"{high:.{digits}g}",
                "samples": str(asked.samples if rare is None else rare.boards),
                "upgrades": "; ".join(t.upgrades.in_words(repair.base.modelfile)),
                "failed": str(t.worst.counts.failed),
            }
        )
    return csv_text(COLUMNS, rows)


def _trial(t: Trial, file: ModelFile) -> TrialRow:
    return {
        "branch": t.branch,
        "price": t.price,
        "said": t.upgrades.in_words(file),
        "upgrades": t.upgrades.as_dict(),
        "predicted": list(t.predicted),
        "measured": [m.as_dict() for m in t.measured],
        "reached": t.reached,
    }
