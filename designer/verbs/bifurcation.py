"""The verb ``bifurcation``."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from designer.base.defaults import CURVE_DEPTH, SEED
from designer.base.errors import InputError
from designer.base.progress import Progress, reported
from designer.base.si_unit import Unit, quantity_text, span_text, suffix, value_text
from designer.verbs.console import say, table
from designer.verbs.declared import Jobs, Kind, Out, Overwrite, Resume, Seed, Source, Verb, option
from designer.verbs.tables import YES_NO, files

if TYPE_CHECKING:
    from designer.answers.bifurcation_answer import (
        BasinsAnswer,
        CurveRow,
        EndRow,
        MapAnswer,
        MeetingRow,
        PointRow,
        SweepAnswer,
        WindowRow,
    )
    from designer.jobs.bifurcation_job import BifurcationResult

LONGEST = 40
"""Lines of a table; the JSON object has them all."""


@reported
def bifurcation(
    model: Source,
    *,
    over: Annotated[
        str | None,
        option(
            "--over",
            "NAME",
            "omega (default), b, k0, zeta, m, k, c or f20; of format 2 a number of an element, "
            "such as A.upper, F.x2 of a law or stiffness.a.b of matrices; with --circuit frequency "
            "in Hz (default), omega, amplitude or offset in V; with --basins a state.",
        ),
    ] = None,
    from_: Annotated[
        float | str | None,
        option(
            "--from",
            "A",
            "One end of the sweep. A plain number has the unit of the model: ω in rad/s where "
            'the values of a format 2 file have units. Of a file with SI values also "10 Hz" or '
            '"0.5 mm".',
            reads=str | None,
        ),
    ] = None,
    to: Annotated[
        float | str | None, option("--to", "B", "The other end.", reads=str | None)
    ] = None,
    steps: Annotated[int | None, option("--steps", "N", "Values, both ends included.")] = None,
    omega: Annotated[
        float | None, option("--omega", "W", "The drive's frequency where it is not swept.")
    ] = None,
    frequency: Annotated[
        str | None,
        option(
            "--frequency",
            "F",
            'The same in units, such as "10 Hz"; with --circuit the generator\'s.',
        ),
    ] = None,
    down: Annotated[
        bool, option("--down", None, "Follow the attractor downwards (the default).")
    ] = False,
    up: Annotated[bool, option("--up", None, "Follow it upwards; with --down both.")] = False,
    starts: Annotated[
        int | None, option("--starts", "K", "From K starts at every value, rest first.")
    ] = None,
    periods: Annotated[
        int | None, option("--periods", "N", "Drive periods left out [500; maps 134].")
    ] = None,
    keep: Annotated[int | None, option("--keep", "N", "Drive periods shown [30; maps 16].")] = None,
    map_: Annotated[
        tuple[str, float | str, float | str, int] | None,
        option(
            "--map",
            "NAME A B N",
            "A map over this parameter too.",
            reads=tuple[str, str, str, int] | None,
        ),
    ] = None,
    and_: Annotated[
        tuple[str, float | str, float | str] | None,
        option(
            "--and",
            "NAME A B",
            "Continue the points as curves over this parameter too.",
            reads=tuple[str, str, str] | None,
        ),
    ] = None,
    depth: Annotated[
        int | None,
        option(
            "--depth",
            "K",
            "With --and: K times in a row, begin the other curves where curves meet "
            f"[{CURVE_DEPTH}].",
        ),
    ] = None,
    region: Annotated[
        float | str | None,
        option(
            "--region",
            "V",
            "With --and: where the response at this value of --over lives.",
            reads=str | None,
        ),
    ] = None,
    basins: Annotated[
        bool, option("--basins", None, "Where starts on a plane of states end.")
    ] = False,
    circuit: Annotated[
        bool, option("--circuit", None, "The design folder's circuit, in Hz and volts.")
    ] = False,
    points: Annotated[
        bool, option("--points/--no-points", None, "Locate the bifurcation points.")
    ] = True,
    shares: Annotated[
        int | None,
        option("--shares", "K", "Count on which attractor K random starts end at every value."),
    ] = None,
    box: Annotated[
        Iterable[str | tuple[str, float | str, float | str]],
        option(
            "--box",
            "STATE=A:B",
            "Draw a state of these starts from A to B; may be repeated.",
            reads=list[str],
        ),
    ] = (),
    seed: Seed = SEED,
    out: Out = None,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    resume: Resume = False,
    progress: Progress | None = None,
) -> BifurcationResult:
    """Draw bifurcation diagrams, maps of n-p-q over two parameters, or basins of attraction.

    Values are numbers, or texts with a unit. ``map_`` : (name, from, to, steps) of the other axis.
    ``and_`` : (name, from, to) of the second parameter. box : (state, least, greatest), or a text
    such as "x1=-0.5:0.5". Without ``out`` nothing is written (docs/bifurcations.md).

    Raises
    ------
    InputError : the words do not fit together, or a value lies outside its domain.
    """
    words = dict(locals())
    from designer.jobs.bifurcation_job import requested
    from designer.jobs.bifurcation_request import Request
    from designer.jobs.options import Options

    words["box"] = tuple(_limits(each) for each in box)
    request = Request(**{each.name: words[each.name] for each in fields(Request)})
    options = Options(seed, jobs, overwrite=overwrite, resume=resume)
    place = None if out is None else Path(out)
    return requested(model, request, place, options)


def _limits(
    box: str | tuple[str, float | str, float | str],
) -> tuple[str, float | str, float | str]:
    """State, least and greatest value of an option such as "x1=-0.5:0.5", or as they are.

    Raises
    ------
    InputError : it has no "=" or no ":".
    """
    if not isinstance(box, str):
        return box
    state, equals, limits = box.partition("=")
    low, colon, high = limits.partition(":")
    if not equals or not colon:
        raise InputError(None, "--box", box, "STATE=A:B, such as x1=-0.5:0.5")
    return state.strip(), low.strip(), high.strip()


def show(result: BifurcationResult) -> None:
    """What the verb found, and where it was written."""
    answer = result.answer
    if answer["kind"] == "sweep":
        _sweep(answer, result.ends)
    elif answer["kind"] == "map":
        _map(answer)
    else:
        _basins(answer)
    if result.folder is not None:
        files(result.folder, result.reused)


def _sweep(answer: SweepAnswer, ends: tuple[str, str]) -> None:
    from designer.check.curved_laws import misfits_in

    unit = f" [{answer['unit']}]" if answer["unit"] else ""
    windows = answer["windows"]
    in_si = "si_unit" in answer and any(_in_si_unit(end, answer["si_unit"]) for end in ends)
    widest = sorted(windows, key=lambda w: -w["steps"])[:LONGEST]
    si = answer.get("si_unit")
    chaos = any("lyapunov" in w for w in widest)
    followed = any("from_end" in w for w in widest)
    members = Counter(w["family"] for w in windows if w.get("family")).values()
    families = any(count > 1 for count in members)
    table(
        f"Windows{_taken(answer)}",
        (
            {
                "track": w["track"],
                **_ends(w, unit, si, in_si=in_si),
                "response": w["response"],
                "symmetric": YES_NO[w["symmetric"]],
                "steps": str(w["steps"]),
                **({"family": _family(w)} if families else {}),
                **(_located(w, answer["unit"], si, in_si=in_si) if followed else {}),
                **({f"λ{' [1/s]' if unit else ''}": _exponents(w)} if chaos else {}),
            }
            for w in sorted(widest, key=lambda w: (w["track"], w["from"]))
        ),
    )
    if families:
        say("windows of one family show one motion that goes on from each to the next")
    for w in widest:
        for misfit in misfits_in(w):
            place = " to ".join(_ends(w, answer["unit"], si, in_si=in_si).values())
            say(f"{place}: {misfit.text(w['response'], in_si=bool(unit))}")
    left_out = {end["reason"] for w in widest for end in _not_sought(w)}
    if left_out:
        say(f"-: the ends of a window are not looked for where {' or '.join(sorted(left_out))}")
    if _narrow(windows):
        say("more --steps, or --from and --to close about a narrow window, find its ends")
    if len(windows) > len(widest):
        say(f"and {len(windows) - len(widest)} narrower ones (--json has them all)")
    if answer["points"]:
        say("\nBifurcation points")
        for text in _points(answer["points"][:LONGEST], answer["unit"], si, in_si=in_si):
            say(text)
    first = _written(answer, in_si=in_si)
    if "shares" in answer:
        _shares(answer, first)
    if "curves" in answer:
        both = (first, _written(answer["and"], in_si=in_si))
        _curves(answer, both)
        if "region" in answer:
            for text in _region(answer, both):
                say(text)


def _taken(answer: SweepAnswer) -> str:
    """What was swept, with the unit that its numbers were taken in; "" of older answers."""
    if "from" not in answer:
        return ""
    from designer.plots.titles import NAMES

    name, si = answer["parameter"], answer.get("si_unit")
    unit = None if si is None else Unit(si, answer["si_scale"])
    span = span_text(answer["from"], answer["to"], answer["unit"], unit)
    return f", {NAMES.get(name, name)} {span}"


Written = Callable[[float], str]
"""How a value of a parameter is written."""


def _written(axis: Mapping[str, Any], *, in_si: bool) -> Written:
    """Of a model in SI, or one that was asked in SI units, with the unit that people write: hertz
    and millimetres. Else, and of answers of older versions, a plain number.

    axis : the keys ``unit``, ``si_unit`` and ``si_scale``, where there are any.
    """
    unit, si, scale = axis.get("unit", ""), axis.get("si_unit"), axis.get("si_scale")
    if si and scale and (unit or in_si):
        return lambda value: value_text(value * scale, si, digits=6)
    if unit:
        return lambda value: quantity_text(value, unit, 6)
    return lambda value: f"{value:.6g}"


def _shares(answer: SweepAnswer, written: Written) -> None:
    """Every attractor that random starts ended on, the largest share of all starts first."""
    shares, steps = answer["shares"], answer["steps"]
    attractors = sorted(shares["attractors"], key=lambda a: -sum(s["count"] for s in a["steps"]))
    largest = [max(a["steps"], key=lambda s: s["count"]) for a in attractors]
    table(
        f"Attractors of {shares['starts']} starts at each value",
        (
            {
                "number": str(a["number"]),
                "responses": ", ".join(dict.fromkeys(s["response"] for s in a["steps"])),
                "from": written(a["steps"][0]["value"]),
                "to": written(a["steps"][-1]["value"]),
                "share of all": f"{sum(s['share'] for s in a['steps']) / steps:.2%}",
                "largest share": f"{top['share']:.1%} ({top['low']:.1%} to {top['high']:.1%})",
                "at": written(top["value"]),
            }
            for a, top in zip(attractors[:LONGEST], largest, strict=False)
        ),
    )
    if len(attractors) > LONGEST:
        say(f"and {len(attractors) - LONGEST} rarer ones (--json has them all)")


def _curves(answer: SweepAnswer, written: tuple[Written, Written]) -> None:
    """Every curve, and below them the points of codimension two."""
    first, second = answer["parameter"], answer["and"]["name"]
    switched = any(c.get("begun_at") for c in answer["curves"])
    table(
        f"Bifurcation curves over {first} and {second}",
        (
            {
                "curve": str(number),
                "kind": c["kind"],
                "response": c["response"],
                "points": str(len(c["points"])),
                **{
                    f"{end} ({first}, {second})": f"({_both(at, written)}): {why}"
                    for end, at, why in zip(
                        ("from", "to"), (c["points"][0], c["points"][-1]), c["ends"], strict=True
                    )
                },
                **({"begun at": _begun_at(c)} if switched else {}),
            }
            for number, c in enumerate(answer["curves"][:LONGEST], 1)
        ),
    )
    for number, c in enumerate(answer["curves"][:LONGEST], 1):
        for met in c["codimension_two"]:
            a, b = (write(v) for write, v in zip(written, met["values"], strict=True))
            text = f"curve {number}: {met['kind']} at {first} = {a}, {second} = {b}"
            say(text + _other_curve(met))


def _begun_at(curve: CurveRow) -> str:
    """Where a curve was switched to."""
    at = curve.get("begun_at")
    return f"curve {at['curve']}, {at['kind']}" if at else ""


def _other_curve(met: MeetingRow) -> str:
    """What became of the other curve at a point of codimension two; "" in older answers."""
    if not met.get("status"):
        return ""
    kind = "other curve" if met["other"] is None else met["other"]["kind"]
    return f" ({kind}: " + (f"curve {met['curve']})" if met["curve"] else f"{met['status']})")


def _both(values: Sequence[float], written: tuple[Written, Written]) -> str:
    return ", ".join(write(value) for write, value in zip(written, values, strict=True))


def _region(answer: SweepAnswer, written: tuple[Written, Written]) -> Iterator[str]:
    """What bounds the region of a response, and where to sit in it."""
    region, names = answer["region"], (answer["parameter"], answer["and"]["name"])

    def place(values: Sequence[float]) -> str:
        rows = zip(names, written, values, strict=True)
        return ", ".join(f"{name} = {write(value)}" for name, write, value in rows)

    kinds = Counter(end["kind"] for end in region["border"])
    rays = ", ".join(f"{kind} ({count})" for kind, count in kinds.most_common())
    yield f"\nRegion of {region['response']} about {place(region['at'])}"
    yield f"rays end by: {rays}"
    ellipse = region["ellipse_around"]["share"]
    yield (
        f"each parameter may be off by {region['around']['share']:.2%} there whatever the other "
        f"does, by {ellipse:.2%} in an ellipse: the less, the more the other is off"
    )
    best = region["best"]
    yield f"most room at {place(best['centre'])}: {best['share']:.2%} of the nominal values"
    spread = region["spread"]
    if spread is not None:
        yield (
            f"{spread['share']:.0%} of {spread['boards']} boards act as if set from "
            f"{place(spread['from'])} to {place(spread['to'])}; "
            f"{spread['inside']:.1%} of them lie inside what is seen"
        )


def _exponents(window: WindowRow) -> str:
    """Least and greatest exponent of an aperiodic window, with the largest standard error."""
    if "lyapunov" not in window:
        return ""
    low, high = window["lyapunov"]
    return f"{low:.2g} to {high:.2g} (± {window['lyapunov_error']:.1g})"


def _in_si_unit(asked: str, si: str) -> bool:
    """Whether an end of the sweep was asked for as a text in this SI unit, with or without a
    prefix, such as "4.5 Hz"."""
    text = str(asked).strip()
    return text.endswith(si) and not text.endswith("rad/s")


def _ends(window: WindowRow, unit: str, si: str | None, *, in_si: bool) -> dict[str, str]:
    """The ends of a window in the swept parameter's own unit and in the SI unit, if it has one.

    in_si : whether the SI unit comes first.
    """
    ends = {"from": window["from"], "to": window["to"]}
    if unit and not si:
        return {end: quantity_text(value, unit.strip(" []"), 6) for end, value in ends.items()}
    own = {f"{end}{unit}": f"{value:.6g}" for end, value in ends.items()}
    other = {f"{end} [{si}]": _si(window, end, si) for end in ends} if si else {}
    return {**other, **own} if in_si else {**own, **other}


def _family(window: WindowRow) -> str:
    """The number of a periodic window's family."""
    return "-" if window["family"] is None else str(window["family"])


def _narrow(windows: Iterable[WindowRow]) -> bool:
    """Whether ends were not looked for because too few steps show a window."""
    from designer.bifurcations.window_ends import LEAST_STEPS

    return any(_not_sought(w) and w["steps"] < LEAST_STEPS for w in windows)


def _not_sought(window: WindowRow) -> list[EndRow]:
    """The ends of a window that were not looked for."""
    from designer.bifurcations.window_ends import NOT_SOUGHT

    ends = window.get("from_end"), window.get("to_end")
    return [end for end in ends if end is not None and end["kind"] == NOT_SOUGHT]


def _located(window: WindowRow, unit: str, si: str | None, *, in_si: bool) -> dict[str, str]:
    """What ends a window on the branch that its response lies on, and where."""
    from designer.bifurcations.continuation import End
    from designer.bifurcations.window_ends import NOT_SOUGHT
    from designer.bifurcations.windows import NOT_LOCATED

    out = {}
    ends = {"lower end": window.get("from_end"), "upper end": window.get("to_end")}
    for column, end in ends.items():
        kind = "" if end is None else str(end["kind"])
        text = "-" if kind == NOT_SOUGHT else kind.replace("-", " ")
        if end is not None and kind not in (End.LIMIT, NOT_SOUGHT):
            value = end["value"]
            assert value is not None
            own = quantity_text(value, unit, 6) if unit else f"{value:.6g}"
            place = _si(end, "value", si) if si and in_si else own
            text += f", known to {place}" if kind == NOT_LOCATED else f" {place}"
        out[column] = text
    return out


def _points(points: Sequence[PointRow], unit: str, si: str | None, *, in_si: bool) -> Iterator[str]:
    """What happens at each point on its branch, and below it what the sweep's tracks show.

    in_si : whether the place comes in the SI unit first.
    """
    for p in points:
        # Folders of older versions have no caption.
        text = p.get("caption", f"{p['kind']} at {p['value']:.9g}: {p['before']} → {p['after']}")
        number = re.escape(f"{p['value']:.9g}{' ' + unit if unit else ''}")
        place = re.search(rf"(\S+ = )?{number}(?=:)", text)
        if si and place:
            own, shown = place[0], _si(p, "value", si)
            both = f"{shown} ({own})" if in_si else f"{own} ({shown})"
            text = text.replace(own, both, 1)
        elif unit and place:
            shown = f"{place[1] or ''}{quantity_text(p['value'], unit, 9)}"
            text = text.replace(place[0], shown, 1)
        yield text
        for c in p.get("changes", []):
            if c["track"] is not None:
                yield f"  {c['track']}: {c['text']}"


def _si(row: Mapping[str, Any], key: str, unit: str) -> str:
    """A value in its SI unit, with more digits than elsewhere: ends of windows lie close."""
    return value_text(row[f"{key}_{suffix(unit)}"], unit, digits=6)


def _map(answer: MapAnswer) -> None:
    total = answer["x"]["steps"] * answer["y"]["steps"]
    counts = list(answer["counts"].items())[:LONGEST]
    table(
        f"Map over {answer['x']['name']} and {answer['y']['name']}",
        ({"response": name, "share": f"{count / total:.2%}"} for name, count in counts),
    )


def _basins(answer: BasinsAnswer) -> None:
    table(
        "Attractors",
        (
            {
                "number": str(a["number"]),
                "response": a["response"],
                "symmetric": YES_NO[a["symmetric"]],
                "twin": "-" if a["twin"] is None else str(a["twin"]),
                "share of starts": f"{a['share']:.2%}",
            }
            for a in answer["attractors"][:LONGEST]
        ),
    )


_EVERY = "model over from_ to steps omega frequency periods keep circuit out jobs overwrite resume"
_SWEEP = f"{_EVERY} down up starts points"
_LINE = "designer bifurcation"
_SWEPT = (
    "omega (default), b, k0, zeta, m, k, c or f20; of format 2 a number of an element, such as "
    "A.upper, F.x2 of a law or stiffness.a.b of matrices; with --circuit frequency in Hz "
    "(default), omega, amplitude or offset in V."
)
_OF_SWEEP = {
    "over": _SWEPT,
    "periods": "Drive periods left out [500].",
    "keep": "Drive periods shown [30].",
}
VERB = Verb(
    bifurcation,
    "Explore",
    f"{_LINE} model.toml --over omega --from 0.2 --to 1 --steps 200 --out out/sweep",
    show=show,
    kinds=(
        Kind(
            "sweep",
            "Draw the bifurcation diagram over one parameter: what is reached at each value, and "
            "where responses are born and die.",
            _SWEEP,
            f"{_LINE} sweep model.toml --from 0.2 --to 1 --steps 200 --down --up --out out/sweep",
            texts=_OF_SWEEP,
        ),
        Kind(
            "curves",
            "Sweep one parameter and continue each bifurcation point as a curve over a second one.",
            f"{_SWEEP} and_! depth",
            f"{_LINE} curves model.toml --from 0.5 --to 0.9 --steps 81 --and b 0.2 0.4",
            texts=_OF_SWEEP,
        ),
        Kind(
            "region",
            "Show where in two parameters a response lives, what ends it, and where it has most "
            "room.",
            f"{_SWEEP} and_! depth region! seed",
            f"{_LINE} region model.toml --from 0.5 --to 1 --steps 81 --and b 0.2 0.4 --region 0.7",
            texts=_OF_SWEEP,
        ),
        Kind(
            "map",
            "Draw a map of the responses that are reached from rest over two parameters.",
            f"{_EVERY} map_!",
            f"{_LINE} map model.toml --from 0.2 --to 1.8 --steps 200 --map b 0.05 0.5 200",
            texts={
                "over": _SWEPT,
                "from_": 'One end of the horizontal axis; of a file with SI values also "10 Hz".',
                "map_": "The other parameter, its ends and its number of values.",
                "periods": "Drive periods left out [134].",
                "keep": "Drive periods looked at [16].",
            },
        ),
        Kind(
            "basins",
            "Draw the basins of attraction: where the starts on a plane of two states end.",
            f"{_EVERY} map_",
            f"{_LINE} basins model.toml --omega 0.85 --over x1 --map x2 -1 1 200 --steps 200",
            {"basins": True},
            {
                "over": "The state along the horizontal axis [x1].",
                "from_": "One end of the horizontal axis [a few static deflections].",
                "map_": "The other state, its ends and its number of values [x1'].",
                "steps": "Values along the horizontal axis [200].",
                "omega": "The drive's frequency [the first response's].",
                "periods": "Drive periods left out [500].",
                "keep": "Drive periods looked at [30].",
            },
        ),
        Kind(
            "shares",
            "Sweep one parameter and count on which attractor random starts end at each value.",
            f"{_SWEEP} shares! box seed",
            f"{_LINE} shares model.toml --from 0.5 --to 0.9 --steps 41 --shares 200",
            texts=_OF_SWEEP,
        ),
    ),
)
