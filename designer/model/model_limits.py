"""What a model file cannot say: why, and what comes nearest, from one table (`LIMITS`).

A key that the format does not know, or a value that its key does not accept, is looked up here
before anything else is checked, so that nobody looks for a misspelt key where there is none. A key
or a value that is read is never refused, whatever stands here. docs/model-file.md prints the table.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from designer.base.errors import MISSING, InputError
from designer.base.schema import (
    FileTable,
    accepts_value,
    expected_of,
    keys_of,
    literal,
    nested_table,
)
from designer.laws.law_elements import KINDS

WHERE = "docs/model-file.md#limits"
MODELS = ("model", "mechanical")
"""The two tables that a model of format 1 may be given in."""
LAWS = tuple(kind.TABLE for kind in KINDS)
ELEMENTS = ("mass", "spring", "damper", "clearance", "force", "base", *LAWS, "matrices")
"""Tables of the elements of format 2."""
_REWRITTEN = "designer new FILE --from OLD rewrites a file in it"


@dataclass(frozen=True)
class ModelLimit:
    """One thing that is not modelled."""

    feature: str
    example: str
    """Keys or values by which a file asks for it, in Markdown."""
    nearest: str
    """What to write in its place, or why there is nothing."""
    formats: tuple[int, ...] = (1, 2)
    """Formats that do not know it."""
    tables: str = ""
    """Pattern of names at the top level of a file that are not read."""
    keys: str = ""
    """Pattern of keys of the model that are not read; with ``value`` of those that are."""
    of: tuple[str, ...] = (*MODELS, *ELEMENTS)
    """Tables in which ``keys`` count."""
    value: Callable[[object], bool] | None = None
    """Values of ``keys`` that are meant; None: any."""

    def refusal(self, number: int, accepted: str) -> str:
        """What a file of this format is told. accepted : in the place of what was found."""
        where = "" if len(self.formats) > 1 else f" in format {number}"
        text = f"not modelled{where}: {self.feature}; nearest: {self.nearest} ({WHERE})"
        return f"{accepted}; {text}"


def _is_negative(value: object) -> bool:
    if isinstance(value, str):
        return value.lstrip().startswith("-")
    return isinstance(value, int | float) and value < 0


def _is_acceleration(value: object) -> bool:
    unit = r"[-+\d.e]+\s*[mk]?\s*(g|gn|g_n|g0|m/s2|m/s\^2|m/s\*\*2|m/s²)\s*"
    return isinstance(value, str) and re.fullmatch(unit, value[:100].lstrip()) is not None


def _is_matrix(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, list) for row in value)


def _is_list(value: object) -> bool:
    return isinstance(value, list)


LIMITS = (
    ModelLimit(
        "elements in lists, for any number of masses",
        "`[[mass]]`, `[[spring]]`, `[[clearance]]`",
        f"format = 2, which has [[mass]], [[spring]], [[damper]], [[clearance]] and [[force]]; "
        f"{_REWRITTEN}",
        (1,),
        tables=r"mass(es)?|springs?|dampers?|clearances?|stops?|forces?|" + "|".join(LAWS),
    ),
    ModelLimit(
        "a third mass",
        "`M3`, `K3`, `C3`, `P3`",
        f"format = 2, a [[mass]] for each; {_REWRITTEN}",
        (1,),
        keys=r"[A-Za-z]+_?([3-9]|[1-9]\d+)",
    ),
    ModelLimit(
        "a second clearance, or stops at unequal distances",
        "`B2`, `B_upper`, `K02`",
        f"format = 2, a [[clearance]] for each, with upper and lower; {_REWRITTEN}",
        (1,),
        keys=r"[Bb]_?[12]|[Bb]_?(upper|lower)|gap\w*|clearances?|[Kk]_?0_?([12]|upper|lower)",
    ),
    ModelLimit(
        "base motion",
        "`[base]`, `Y`, `base_amplitude`",
        f"format = 2, [base] with an amplitude; {_REWRITTEN}",
        (1,),
        tables="base",
        keys=r"base\w*|[YZ]0?|[xy]_?base|[xy]_?g(round)?",
    ),
    ModelLimit(
        "damping in the stops",
        "`C0`",
        f"format = 2, damping or restitution of a [[clearance]]; {_REWRITTEN}",
        (1,),
        keys=r"[Cc]_?0",
    ),
    ModelLimit(
        "a constant force, a weight or a preload",
        "`preload`, `constant`, `gravity`",
        "format = 2, constant of a [[force]], or preload or a negative gap of a [[clearance]]; "
        f"{_REWRITTEN}",
        (1,),
        tables=r"gravity|preloads?",
        keys=r"[Ff]_?0|preload\w*|constant|gravity|weight|g",
    ),
    ModelLimit(
        "a weight by its own key, or a preload of anything but a stop",
        "`[gravity]`, `[[mass]] weight`, `[[spring]] preload`",
        "constant of a [[force]] on the mass (a weight is 9.81 m/s² times the mass), or preload or "
        "a negative gap of a [[clearance]]",
        (2,),
        tables=r"gravity|preloads?",
        keys=r"gravity|weight|g|preload\w*|free_length|rest_length",
    ),
    ModelLimit(
        "an acceleration by its own key",
        "`[base] acceleration`",
        'amplitude of [base] with a unit of acceleration, such as amplitude = "0.5 g"',
        (2,),
        keys=r"acc\w*|g\w*",
        of=("base",),
    ),
    ModelLimit(
        "the tables of format 1",
        "`[model]`, `[mechanical]`",
        f"format = 1, or elements; {_REWRITTEN}",
        (2,),
        tables="|".join(MODELS),
    ),
    ModelLimit(
        "friction, but as a [[friction]] of format 2",
        "`friction`, `mu`",
        "[[friction]] of format 2, whose force rises with the velocity until it slides; the force "
        "is stated, no coefficient of a normal force",
        tables=r"frictions|coulomb|stribeck|dry_friction",
        keys=r"\w*friction\w*|mu|mu_\w+|coulomb\w*|stribeck\w*|stick\w*",
    ),
    ModelLimit(
        "a coefficient of restitution, but as restitution of a [[clearance]] of format 2",
        "`restitution`",
        "restitution of a [[clearance]] of format 2, whose stops have a stiffness, or their "
        "damping",
        tables=r"restitution|impacts?",
        keys=r"\w*restitution\w*|cor|e|rigid",
    ),
    ModelLimit(
        "a spring that is not linear, but as a [[law]] or a [[cubic_spring]] of format 2",
        "`cubic`, `k3`, `exponent`",
        "[[cubic_spring]] of format 2, or a [[law]] point by point; a circuit makes up to eight "
        "corners on each side of rest",
        tables=r"laws|cubics?|cubic_?springs|cubicspring|nonlinear\w*|duffing\w*|characteristics?",
        keys=r"cubic\w*|\w*_cubic|[Kk]_?3|[Kk]_?nl|nonlinear\w*|alpha|beta|gamma|duffing\w*|law|"
        r"exponent|power|points|curve|stiffness_?[2-9]",
    ),
    ModelLimit(
        "a damper that is not linear, but as a [[law]] of format 2",
        "`drag`, `quadratic`",
        'a [[law]] of format 2 with quantity = "velocity", point by point; or a linear damper that '
        "takes the same energy from a period, 8 d ω X/(3π) for the force d v² at amplitude X",
        tables=r"drags?",
        keys=r"drag\w*|quadratic\w*|damping_?[2-9]",
    ),
    ModelLimit(
        "another phase, but as phase of a [[force]] of format 2",
        "`[base] phase`, `phi`",
        "phase of a [[force]] of format 2, which counts from the drive's sine, that of a [base]",
        keys=r"\w*phase\w*|phi\w?|angle|lag|lead",
    ),
    ModelLimit(
        "more than one drive frequency",
        '`[[force]] frequency`, `[[response]] frequency = ["20 Hz", "30 Hz"]`',
        "one frequency for all forces, that of a [[response]]; a [[response]] for each frequency "
        "asks for them one by one",
        tables=r"frequenc(y|ies)|omega|Omega",
        keys=r"frequenc\w*|freq|omega\w*|Omega\w*|hz|Hz|period",
    ),
    ModelLimit(
        "more than one drive frequency",
        "",
        "one frequency; a [[response]] for each frequency asks for them one by one",
        keys=r"(frequency|omega|Omega)_?(\d+|second)|second_\w+|frequencies|omegas",
        of=("response",),
    ),
    ModelLimit(
        "more than one drive frequency",
        "",
        "one frequency; a [[response]] for each frequency asks for them one by one",
        keys="frequency|omega|Omega",
        of=("response",),
        value=_is_list,
    ),
    ModelLimit(
        "a drive by a table of its own",
        "`[drive]`, `[excitation]`",
        "a [[force]] on a mass or a [base] in format = 2, P1 and P2 of [mechanical] or f20 of "
        "[model] in format = 1, and a [[response]] for each drive frequency",
        tables=r"drives?|excitations?|inputs?|loads?",
    ),
    ModelLimit(
        "a drive that is no sine, but as waveform or harmonics of a force or base of format 2",
        "`pulse`, `noise`, `[[waveform]]`",
        "waveform with terms, or harmonics, of a [[force]] or [base] of format 2",
        tables=r"waveforms?|harmonics?|signals?|sweep|chirp|noise",
        keys=r"waveform\w*|harmonics?|shape|square|triangle|sawtooth|pulse\w*|terms|noise|"
        r"random\w*|signal|chirp|sweep",
    ),
    ModelLimit(
        "a delay",
        "`delay`, `tau`",
        "at one frequency, and where both are positive, a spring and a damper: the force of a "
        "spring k after a delay τ is that of k cos ωτ and -(k/ω) sin ωτ",
        tables=r"delays?",
        keys=r"\w*delay\w*|tau\w?",
    ),
    ModelLimit(
        "matrices as keys of an element",
        "`stiffness_matrix`, `mass = [[…], […]]` of a [mechanical]",
        "the table [matrices] of format = 2: names, mass, damping, stiffness",
        tables=r"matrix|\w+_matrix|[MCK]",
        keys=r"matri(x|ces)|\w+_matrix",
    ),
    ModelLimit(
        "matrices as keys of an element",
        "",
        "the table [matrices] of format = 2: names, mass, damping, stiffness",
        tables=r"\w+",
        keys=r"\w+",
        of=(*MODELS, "mass", "spring", "damper", "clearance", "base"),
        value=_is_matrix,
    ),
    ModelLimit(
        "rotation, or motion in more than one direction",
        "`inertia`, `torque`, `[[rotor]]`",
        "masses along one line: an inertia J with a moment M at the radius r is a mass J/r² with a "
        "force M/r; a beam is the mass and the stiffness of its mode",
        tables=r"inertias?|torques?|rotors?|gears?|beams?|levers?|joints?|bod(y|ies)",
        keys=r"inertia\w*|J\w?|torque\w*|moment\w*|radius|direction|axis|position|[xyz]",
    ),
    ModelLimit(
        "parameters that change with time",
        "`parametric`, `modulation`",
        "none: masses, springs and dampers are constant",
        tables=r"parametric\w*|modulations?",
        keys=r"parametric\w*|modulation\w*|time_?var\w*|stiffness_amplitude",
    ),
    ModelLimit(
        "initial conditions",
        "`[initial]`, `x0`, `v0`",
        "none: a response is what a motion settles on; simulate --start STATE=VALUE begins at one "
        "start, --starts N asks N",
        tables=r"initial\w*|start|state",
        keys=r"initial\w*|[xv]_?0|start",
    ),
    ModelLimit(
        "negative stiffness",
        '`stiffness = "-5 kN/m"`',
        "a [[law]] or a [[cubic_spring]] of format 2, which may fall as long as it rises far out",
        keys=r"\w*stiffness|[Kk][0-2]?|constant",
        of=(*MODELS, "spring", "clearance"),
        value=_is_negative,
    ),
    ModelLimit(
        "negative damping",
        "`damping = -1.0`",
        'a [[law]] of format 2 with quantity = "velocity", which may fall as long as it does not '
        "far out",
        keys=r"damping|[Cc][12]?|zeta",
        of=(*MODELS, "damper", "clearance"),
        value=_is_negative,
    ),
    ModelLimit(
        "an acceleration, in g or m/s², in the place of a force or a length",
        '`[[force]] amplitude = "0.5 g"`',
        "of a force, the mass times it (9.80665 m/s² is 1 g), in N; the amplitude of a [base] may "
        "be an acceleration",
        keys=r"\w+",
        of=tuple(name for name in (*MODELS, *ELEMENTS) if name != "base"),
        value=_is_acceleration,
    ),
)  # fmt: skip
"""What is not modelled, by what a file would say of it; the first that fits is told."""


def check(data: Mapping[str, object], formats: Sequence[type[FileTable]], file: str | None) -> None:
    """Refuse a model file of an unknown format, or one that asks for what is not modelled.

    formats : the top level of each format, the first for format 1.

    Raises
    ------
    InputError : says what is not modelled, what comes nearest, and the page with the limits.
    """
    number = data.get("format", MISSING)
    if type(number) is not int or not 1 <= number <= len(formats):
        raise InputError(
            file,
            "format",
            number if number is MISSING else literal(number),
            "1 or 2, the formats that this version reads; a newer version of designer may know "
            f"more; {_meant(data, formats)} ({WHERE})",
        )
    top = formats[number - 1]
    for place, table, record, key, value in _entries(data, top):
        known = keys_of(record)
        for limit in LIMITS:
            pattern = limit.keys if table else limit.tables
            if number not in limit.formats or (table and table not in limit.of):
                continue
            if not pattern or not _compiled(pattern).fullmatch(key):
                continue
            if limit.value is not None and not limit.value(value):
                continue
            if key in known and (limit.value is None or accepts_value(record, key, value)):
                continue
            found, accepted = f"unknown key {key!r}", "no such key"
            if key in known:
                found, accepted = literal(value), expected_of(record, (key,))
            raise InputError(file, f"{place}{key[:60]}", found, limit.refusal(number, accepted))


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    """Compiled once: a file may have 100,000 keys."""
    return re.compile(pattern, re.ASCII)


def _entries(
    data: Mapping[str, object], top: type[FileTable]
) -> Iterator[tuple[str, str, type[FileTable], str, object]]:
    """Each key of the top level and of the tables of a model: its place, the table ("" of the top
    level) with its record, the key and its value."""
    for key, value in data.items():
        yield "", "", top, key, value
    for table in (*MODELS, *ELEMENTS, "response"):
        content, annotation = data.get(table), keys_of(top).get(table)
        record = nested_table(annotation)
        if record is None:
            continue
        listed = isinstance(content, list)
        for index, each in enumerate(content if isinstance(content, list) else [content], start=1):
            place = f"{table}[{index}]." if listed else f"{table}."
            for key, value in each.items() if isinstance(each, Mapping) else ():
                yield place, table, record, key, value


def _meant(data: Mapping[str, object], formats: Sequence[type[FileTable]]) -> str:
    """Which format the tables of a file are of."""
    own = {key for key in data if key in MODELS or key in ELEMENTS}
    fits = [n for n, top in enumerate(formats, start=1) if own and own <= keys_of(top).keys()]
    if fits:
        listed = ", ".join(f"[{key}]" for key in data if key in own)
        return f"with {listed} it is format = {fits[0]}"
    return "format = 1 has [model] or [mechanical], format = 2 any [[mass]] and what joins them"
