"""The verb ``search``: the design of the highest yield, the cheapest repair of one, or both."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from designer.answers.rare_words import boards_text
from designer.base.defaults import SEARCH_SAMPLES, StudyEngine
from designer.base.design_folder import DESIGN, Folder
from designer.base.errors import MISSING, InputError
from designer.base.printed import tell
from designer.base.progress import Progress, note, reported, whole
from designer.base.si_unit import drive_text
from designer.verbs import next_steps
from designer.verbs.console import say, table
from designer.verbs.declared import Jobs, Out, Overwrite, OwnSeed, Resume, Source, Verb, option
from designer.verbs.tables import design_written, drive_cells, whole_job

if TYPE_CHECKING:
    from designer.answers.cure_answer import CureAnswer, MeasuredYieldRow, TrialRow
    from designer.answers.search_answer import ConfirmedCure, SearchAnswer
    from designer.jobs.job_outcome import JobOutcome
    from designer.jobs.options import Options
    from designer.jobs.repair_job import CureResult
    from designer.model.model_file import ModelFile


def repair_text(answer: CureAnswer) -> str:
    """The answer, yields before and after, rounds and the front, as lines of text.

    answer : the JSON object of ``repair_json``.
    """
    percent = f"{100.0 * answer['target']:.8g} %"
    digits = 4 if answer["target"] < 0.999 else 8
    lines = []
    if answer["reached"]:
        lines.append(f"every response at {percent} or better for {answer['price']:.2f} euro:")
        lines += [f"  {upgrade}" for upgrade in answer["said"]] or ["  nothing has to change"]
    else:
        lines.append(f"{percent} not reached: {answer['why']}")
        best = "; ".join(answer["said"]) or "the design as it is"
        lines.append(f"  best measured, {answer['price']:.2f} euro: {best}")
    lines += ["", "response            before                  after", *_responses(answer)]
    for number, trial in enumerate(answer["rounds"], start=1):
        lines += ["", f"round {number}, {trial['price']:.2f} euro: " + _upgrades(trial)]
        for r, (promised, m) in enumerate(
            zip(trial["predicted"], trial["measured"], strict=True), start=1
        ):
            lines.append(f"  response {r}: promised {promised:.{digits}f}, measured {_yield(m)}")
    lines += ["", "price     worst response          upgrades"]
    for trial in answer["front"]:
        worst = min(trial["measured"], key=lambda m: (_rate(m), m["low"]))
        lines.append(f"{trial['price']:<9.2f} {_yield(worst):<23} {_upgrades(trial)}")
    lines += [
        "",
        *(f"not built: {'; '.join(r['upgrades'])}: {r['why']}" for r in answer["refused"]),
    ]
    return "\n".join(lines).rstrip() + "\n"


def _responses(answer: CureAnswer) -> list[str]:
    out = []
    for r in answer["responses"]:
        place = drive_text(r["omega"], r.get("frequency_hz"))
        name = f"{place} {r['expected'] or ''}".strip()
        out.append(f"{name:<19} {_yield(r['before']):<23} {_yield(r['after'])}")
        if r["limit"]:
            out.append(f"    {r['limit']}")
    return out


def _upgrades(trial: TrialRow) -> str:
    return "; ".join(trial["said"]) or "as it is"


def _rate(m: MeasuredYieldRow) -> float:
    return 0.0 if m["rate"] is None else float(m["rate"])


def _yield(m: MeasuredYieldRow) -> str:
    if m["rate"] is None:
        return "not shown"
    if rare := m.get("rare"):
        shares = rare["lost"], rare["low"], rare["high"], rare["unseen"]
        lost, low, high, unseen = (boards_text(1e6 * share) for share in shares)
        return f"{lost} of a million lost ({low} to {high}; at most {unseen} that no search met)"
    text = f"{m['rate']:.4f} ({m['low']:.4f} to {m['high']:.4f})"
    return text + (f", {m['failed']} failed" if m["failed"] else "")


KINDS = ("grade", "network", "reference", "trimmer", "op-amp", "dead-zone", "place", "trim")
"""Kinds of upgrades; as ``repair_branch.KINDS``."""
CURED = "cured"
"""Folder of the repaired design, in that of the search whose design is repaired."""


@reported
def search(
    model: Source,
    out: Out = None,
    *,
    samples: Annotated[
        int | None, option("--samples", "N", f"Fresh boards at the end [{SEARCH_SAMPLES}].")
    ] = None,
    yield_: Annotated[
        float | None, option("--yield", "Y", "The cheapest repair (cure): the yield wanted.")
    ] = None,
    ppm: Annotated[
        float | None,
        option("--ppm", "N", "The cheapest repair (cure): boards of a million that may be lost."),
    ] = None,
    budget: Annotated[
        float | None, option("--budget", "PRICE", "The most that a repair may cost.")
    ] = None,
    without: Annotated[
        Sequence[str],
        option(
            "--without",
            "KIND",
            f"A repair without upgrades of this kind: {', '.join(KINDS)}; may be repeated.",
            reads=list[str],
        ),
    ] = (),
    rung: Annotated[
        StudyEngine | None,
        option(
            "--rung", None, "Fidelity of the final study; auto: by a trade in the folder. [auto]"
        ),
    ] = None,
    seed: OwnSeed = None,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    progress: Progress | None = None,
) -> JobOutcome | CureResult:
    """Find the design of the highest yield; with --yield or --ppm, its cheapest repair (cure).

    A model file is searched, and written into ``out``. With ``yield_`` or ``ppm`` the found design
    is then repaired at least cost: what comes of it is a design folder of its own, ``out``/cured,
    and the answer is whether it reaches the yield and ngspice confirms the boards of both designs.
    A design folder is repaired, as ``cure`` does it.

    Raises
    ------
    InputError : a word that the other of both has, no ``out`` of a search, or a folder that holds
        something else.
    EnvironmentMissing : a search, and no ngspice; said before any work.
    """
    from designer.model.model_file import ModelFile

    path = model if isinstance(model, ModelFile) else Path(model)
    if isinstance(path, Path) and not path.exists():
        raise InputError(path, "MODEL|DIR", MISSING, "a model file or a design folder")
    if isinstance(path, Path) and path.is_dir():
        _refuse({"--samples": samples, "--rung": rung}, "no such option with a design folder")
        from designer.jobs import repair_job

        return repair_job.cure(
            path,
            yield_=yield_,
            ppm=ppm,
            budget=budget,
            without=without,
            out=out,
            seed=seed,
            jobs=jobs,
            overwrite=overwrite,
            resume=resume,
        )
    from designer.folders.model_source import source
    from designer.jobs import folder_numbers, search_job, usual_times
    from designer.jobs.options import Options, stated_options

    if yield_ is None and ppm is None:
        _refuse({"--budget": budget, "--without": without}, "--yield or --ppm beside it")
    words = {"samples": samples, "seed": seed}
    options = Options(
        jobs=jobs,
        overwrite=overwrite,
        resume=resume,
        rung=rung or "auto",
        yield_=yield_,
        ppm=ppm,
        budget=budget,
        without=tuple(without),
    )
    options = replace(options, **{"samples": SEARCH_SAMPLES} | stated_options(words))
    options.check()
    place = None if out is None else Path(out)
    modelfile, folder = source(path, place)
    repair = _asked_repair(modelfile, folder, options)
    options = folder_numbers.of_search(folder, options, words)
    name = path if isinstance(path, Path) else path.source or folder / "model.toml"
    command = partial(VERB.command, model=name, out=place)
    usual = usual_times.SEARCH if repair is None else {**usual_times.SEARCH, **usual_times.REPAIRED}
    with whole(usual):
        found = search_job.search_into(modelfile, folder, options, command)
        confirmed, stood = None, True
        if repair is None:
            cured = None
        else:
            cured = repair(folder, out=folder / CURED, options=options)
            if cured.reached:
                confirm = search_job.confirmed_repair
                confirmed, stood = confirm(folder / CURED, options)
    is_another_s = not found.reused if cured is None else not cured.reached
    if is_another_s and (folder / CURED / DESIGN).exists():
        note(f"{folder / CURED} holds an earlier design, which is not of this search")
    if cured is None:
        return found
    repaired = {**cured.answer, "confirmation": confirmed}
    is_cured = confirmed is not None and search_job.all_confirmed(confirmed)
    return replace(
        found,
        answer={**found.answer, "cure": repaired},
        satisfied=found.satisfied and is_cured,
        reused=found.reused and cured.reused and stood,
    )


def _asked_repair(
    modelfile: ModelFile, folder: Path, options: Options
) -> Callable[..., CureResult] | None:
    """``repair_into`` with what is asked of the found design; None where nothing is.

    Raises
    ------
    InputError : no repair of a design of this model file can reach it; something else stands where
        the repaired design is to be written.
    EnvironmentMissing : no ngspice, which is to confirm the repaired design.
    """
    if options.yield_ is None and options.ppm is None:
        return None
    from designer.jobs import repair_job, search_job  # a search need not import the repair

    target = repair_job.target_of(options.yield_, options.ppm)
    asked: dict[str, Any] = {"target": target, "budget": options.budget, "without": options.without}
    repair_job.refuse_unreachable(modelfile, **asked)
    cured = Folder(folder / CURED)  # refuses a place where something else stands
    if options.overwrite or not repair_job.is_out_of_reach(Folder(folder)):
        search_job.need_ngspice(cured, options)
    return partial(repair_job.repair_into, **asked)


def _refuse(options: Mapping[str, object], expected: str) -> None:
    """InputError for the first of these options that has a value."""
    for name, value in options.items():
        if value not in (None, [], ()):
            raise InputError(None, name, value, expected)


def show(result: JobOutcome | CureResult) -> None:
    """The tables, where the files are, and what may be done next."""
    from designer.jobs.job_outcome import JobOutcome  # a search need not import the repair

    if isinstance(result, JobOutcome):
        design_written(result, result.answer, tables, _after)
    else:
        tell(repair_text(result.answer))


def _after(folder: Path, answer: SearchAnswer) -> Iterator[next_steps.Step]:
    """What may be done next: with the repaired design, where there is one."""
    cure = answer.get("cure")
    if cure is None or not cure["reached"]:
        yield from next_steps.after_study(folder, answer, repaired=cure is not None)
    else:
        yield from next_steps.after_repair(folder / CURED, cure)


def tables(answer: SearchAnswer) -> None:
    """A run; then the responses at their places, what limits them, what each lever is worth; then
    the repair, where one was asked for."""
    whole_job(answer)
    search = answer["search"]
    pairs = zip(search["final"]["responses"], answer["confirmation"]["responses"], strict=True)
    places = [(place["expected"] or "any", place, confirmed) for place, confirmed in pairs]
    table(
        "Places",
        (
            {
                "response": name,
                **drive_cells(place, search["final"]["responses"]),
                "b": f"{place['b']:.4g}",
                "distance": _sigmas(place["distance"]),
                "predicted": f"{place['predicted_yield']:.4f}",
                "confirmed": f"{confirmed['agreed']}/{confirmed['asked']}",
            }
            for name, place, confirmed in places
        ),
        gap=1,
    )
    for name, _, confirmed in places:
        if confirmed["limited_by"]:
            say(f"{name} is limited by {confirmed['limited_by']['line']}")
    if search["contributions"]:
        table(
            "Levers: smallest distance",
            (
                {
                    **{key: lever[key] for key in ("lever", "from", "to")},
                    **{k: _sigmas(lever[k]["smallest_distance"]) for k in ("alone", "without")},
                }
                for lever in search["contributions"]
            ),
            gap=1,
        )
    if "cure" in answer:
        say("")
        tell(repair_text(answer["cure"]))
        _show_confirmation(answer["cure"])


def _show_confirmation(cure: ConfirmedCure) -> None:
    """What ngspice says of the repaired design's boards, where there is one."""
    if (confirmation := cure.get("confirmation")) is not None:
        pairs = zip(cure["responses"], confirmation["responses"], strict=True)
        each = (f"{r['expected'] or 'any'} {c['agreed']}/{c['asked']}" for r, c in pairs)
        say(f"ngspice confirms of the cured boards: {', '.join(each)}")


def _sigmas(reliability_index: float | None) -> str:
    return "-" if reliability_index is None else f"{reliability_index:.2f} σ"


VERB = Verb(
    search,
    "Design",
    "designer search model.toml --out out/robust",
    show=show,
)
