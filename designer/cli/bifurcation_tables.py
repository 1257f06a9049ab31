"""Windows, points, maps and basins as tables for people, on standard error."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from designer.base.si_unit import quantity_text, suffix, value_text
from designer.bifurcations import window_ends
from designer.bifurcations.continuation import End
from designer.bifurcations.windows import NOT_LOCATED
from designer.cli.console import say, table
from designer.cli.tables import YES_NO, files

LONGEST = 40
"""Lines of a table; the JSON object has them all."""


def show(
    answer: Mapping[str, Any],
    out: Path | None,
    reused: bool,
    ends: tuple[str, str] = ("", ""),
) -> None:
    """What the verb found, and where it was written. ends : of the sweep, as they were asked for,
    which say the unit that comes first."""
    if answer["kind"] == "sweep":
        _sweep(answer, ends)
    else:
        {"map": _map, "basins": _basins}[answer["kind"]](answer)
    if out is not None:
        files(out, reused)


def _sweep(answer: Mapping[str, Any], ends: tuple[str, str]) -> None:
    unit = f" [{answer['unit']}]" if answer["unit"] else ""
    windows = answer["windows"]
    in_si = "si_unit" in answer and any(_in_si_unit(end, answer["si_unit"]) for end in ends)
    widest = sorted(windows, key=lambda w: -w["steps"])[:LONGEST]
    si = answer.get("si_unit")
    chaos = any("lyapunov" in w for w in widest)
    followed = any("from_end" in w for w in widest)
    table(
        "Windows",
        (
            {
                "track": w["track"],
                **_ends(w, unit, si, in_si=in_si),
                "response": w["response"],
                "symmetric": YES_NO[w["symmetric"]],
                "steps": str(w["steps"]),
                **(_located(w, answer["unit"], si, in_si=in_si) if followed else {}),
                **({f"λ{' [1/s]' if unit else ''}": _exponents(w)} if chaos else {}),
            }
            for w in sorted(widest, key=lambda w: (w["track"], w["from"]))
        ),
    )
    left_out = {end["reason"] for w in widest for end in _not_sought(w)}
    if left_out:
        say(f"-: the ends of a window are not looked for where {' or '.join(sorted(left_out))}")
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


def _shares(answer: Mapping[str, Any], written: Written) -> None:
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


def _curves(answer: Mapping[str, Any], written: tuple[Written, Written]) -> None:
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


def _begun_at(curve: Mapping[str, Any]) -> str:
    """Where a curve was switched to."""
    at = curve.get("begun_at")
    return f"curve {at['curve']}, {at['kind']}" if at else ""


def _other_curve(met: Mapping[str, Any]) -> str:
    """What became of the other curve at a point of codimension two; "" in older answers."""
    if not met.get("status"):
        return ""
    kind = "other curve" if met["other"] is None else met["other"]["kind"]
    return f" ({kind}: " + (f"curve {met['curve']})" if met["curve"] else f"{met['status']})")


def _both(values: Sequence[float], written: tuple[Written, Written]) -> str:
    return ", ".join(write(value) for write, value in zip(written, values, strict=True))


def _region(answer: Mapping[str, Any], written: tuple[Written, Written]) -> Iterator[str]:
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


def _exponents(window: Mapping[str, Any]) -> str:
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


def _ends(window: Mapping[str, Any], unit: str, si: str | None, *, in_si: bool) -> dict[str, str]:
    """The ends of a window in the swept parameter's own unit and in the SI unit, if it has one.

    in_si : whether the SI unit comes first.
    """
    names = ("from", "to")
    if unit and not si:
        return {end: quantity_text(window[end], unit.strip(" []"), 6) for end in names}
    own = {f"{end}{unit}": f"{window[end]:.6g}" for end in names}
    other = {f"{end} [{si}]": _si(window, end, si) for end in names} if si else {}
    return {**other, **own} if in_si else {**own, **other}


def _not_sought(window: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The ends of a window that were not looked for."""
    ends = [window[key] for key in ("from_end", "to_end") if key in window]
    return [end for end in ends if end["kind"] == window_ends.NOT_SOUGHT]


def _located(
    window: Mapping[str, Any], unit: str, si: str | None, *, in_si: bool
) -> dict[str, str]:
    """What ends a window on the branch that its response lies on, and where."""
    out = {}
    for column, key in (("lower end", "from_end"), ("upper end", "to_end")):
        end = window.get(key)
        kind = "" if end is None else str(end["kind"])
        text = "-" if kind == window_ends.NOT_SOUGHT else kind.replace("-", " ")
        if end is not None and kind not in (End.LIMIT, window_ends.NOT_SOUGHT):
            own = quantity_text(end["value"], unit, 6) if unit else f"{end['value']:.6g}"
            place = _si(end, "value", si) if si and in_si else own
            text += f", known to {place}" if kind == NOT_LOCATED else f" {place}"
        out[column] = text
    return out


def _points(
    points: Sequence[Mapping[str, Any]], unit: str, si: str | None, *, in_si: bool
) -> Iterator[str]:
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


def _map(answer: Mapping[str, Any]) -> None:
    total = answer["x"]["steps"] * answer["y"]["steps"]
    counts = list(answer["counts"].items())[:LONGEST]
    table(
        f"Map over {answer['x']['name']} and {answer['y']['name']}",
        ({"response": name, "share": f"{count / total:.2%}"} for name, count in counts),
    )


def _basins(answer: Mapping[str, Any]) -> None:
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
