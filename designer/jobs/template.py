"""The model files that ``designer new`` writes."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Literal

from designer.base import atomic_write
from designer.base.errors import InputError
from designer.base.plain_json import dumps
from designer.jobs.second_format import second_format
from designer.model.ascii_sketch import sketch
from designer.model.model_file import json_schema, read_model_file

_SKETCH = "\n".join(f"# {line}" for line in sketch().splitlines())

_CIRCUIT = """\
[circuit]
opamp = "TL074C"                # `designer catalog` lists what there is
supply = 15.0                   # V, both rails
saturation = 13.0               # V; without it the catalogue's figure for the op-amp
resistors = "E96"               # a series, or several: ["E24", "E96"]
capacitors = "E12"
resistor_grade = 0.01           # 1 %
capacitor_grade = 0.01
# resistor_family = "Yageo RC0603FR-07" # bought from this family alone; or from a list of them
# capacitor_family = ["!KEMET C0603 F 50 V"] # with "!" in front of each: from every other one
resistor_range = ["1k", "1M"]
capacitor_range = ["1nF", "1µF"]
frequency = [50, 1000]          # Hz, where omega = 1 may lie
# dead_zone = "rectifier"       # or "saturation"; without it the one whose boards do better
# diode = "1N4148"              # of the rectifier
# reference = "LM4040C50"       # of the rectifier
objective = "margin"            # or "match": the least error; or "yield": a search
composites = false              # true or ["R50", …]: resistors of two parts, where that helps
side_conditions = true          # false: the match alone; or a list of those to keep:
# side_conditions = ["swing", "level", "load", "noise_gain", "bandwidth", "resistors", "generator"]
# matched = [["R1", "R7"]]      # groups of parts with equal values
# preferred = ["10k", "10n"]    # values that do not count among the distinct ones
# most_values = 12              # at most so many distinct values
# max_error = 0.01              # a design with a larger coefficient error is refused
# slack = 1e-4                  # how much the error may exceed its least for fewer distinct values

# How the boards of a tolerance study differ; without it as the reference spread says. More keys:
# docs/spread.md
# [spread]
# resistors = "normal"          # within their grade; or "uniform"
# temperature = [10, 40]        # °C
# supply = 0.02                 # each rail within ± 2 %
# measured = "measured.csv"     # part,value[,tolerance][,board]
"""

SCHEMA = "designer.schema.json"
"""The file beside a model file from which an editor knows the keys."""

TEXT = (
    f"""\
#:schema ./{SCHEMA}
# A model file for designer. `designer run THIS_FILE --out FOLDER` makes a design folder.
# Numbers may carry units as text: "22.1k", "100nF", "1 kHz".

format = 1
title = "My model"

# Two masses in a row: M1 moves between stops, M2 stands on a spring. Displacements count to the
# right; the right stop is the upper one. K: springs, C: dampers, K0: springs of the stops.
#
{_SKETCH}
#
# M1 X1'' + C1 (X1' - X2') + K1 (X1 - X2) + F(X1) = P1 sin(Omega T)
# M2 X2'' + C1 (X2' - X1') + C2 X2' + K1 (X2 - X1) + K2 X2 = P2 sin(Omega T)
# F(X) = K0 (X - clip(X, -B, B))
#
# The same dimensionless, with t = T sqrt(K1/M1), x = X K1/(P1 + P2), omega = Omega sqrt(M1/K1):
#
# x1'' + 2 zeta (x1' - x2') + (x1 - x2) + f(x1) = (1 - f20) sin(omega t)
# m/(1 - m) x2'' + 2 zeta (x2'/(1 - c) - x1') + (x2/(1 - k) - x1) = f20 sin(omega t)
# f(x) = k0/(1 - k0) (x - clip(x, -b, b))
#
# Dimensionless parameters; or a table [mechanical] with M1, M2, C1, C2, K0, K1, K2, B, P1, P2 in
# SI units instead.
[model]
m = 0.5         # M2/(M1 + M2), in (0, 1)
k = 0.5         # K2/(K1 + K2), in (0, 1)
k0 = 0.95       # K0/(K0 + K1), in [0, 1): stiffness of the stops; 0: no stops
c = 0.5         # C2/(C1 + C2), in [0, 1)
zeta = 0.1      # damping, > 0
f20 = 0.0       # share of the force that acts on M2, in [0, 1]
b = 0.25        # clearance, > 0
sides = "both"  # stops on both sides

# The responses that the board shall show: n-p-q, with n periods of the force, p impacts on the
# upper stop and q on the lower one in that time. Leave `expect` out to take what comes. With
# [mechanical] the frequency may be given as Omega = 340 (rad/s) or frequency = "54 Hz" too.
[[response]]
omega = 1.55
expect = "1-1-1"

[[response]]
omega = 0.85
expect = "1-2-2"
# symmetric = true              # only a symmetric orbit (false: only an asymmetric one) will do
# twin = "exact"                # 1-1-2 only, not its mirror twin 1-2-1
# b = 0.3                       # at a clearance of its own

"""
    + _CIRCUIT
)
"""A file of format 1."""

SECOND = (
    f"#:schema ./{SCHEMA}\n"
    """\
# A model file for designer. `designer run THIS_FILE --out FOLDER` makes a design folder.
# Numbers may carry units as text: "22.1k", "100nF", "1 kHz". Texts with units become SI; plain
# numbers are any consistent units, and omega is in them. docs/model-file.md says more.

format = 2
title = "My model"

# Any masses in a line; each moves along it.
#
# ground ---/\\/\\/\\--- casing ---/\\/\\/\\--- hammer --> force
#        ----[=-----        ----[=-----    | lower stop | hammer | upper stop |
[[mass]]
name = "hammer"
mass = "2 kg"

[[mass]]
name = "casing"
mass = "3 kg"

# Springs and dampers join two masses, or a mass and "ground". Springs hold every mass to ground.
[[spring]]
between = ["hammer", "casing"]
stiffness = "60 kN/m"

[[spring]]
between = ["casing", "ground"]
stiffness = "40 kN/m"

[[damper]]
between = ["hammer", "casing"]
damping = "56 N s/m"

[[damper]]
between = ["casing", "ground"]
damping = "24 N s/m"

# Gaps to the stops of a mass, or between two masses. Leave upper or lower out where there is no
# stop; a negative gap is a preloaded stop, in contact at rest.
[[clearance]]
name = "A"
between = ["hammer", "ground"]
upper = "0.5 mm"
lower = "0.5 mm"
stiffness = "540 kN/m"          # or upper_stiffness and lower_stiffness
# damping = "10 N s/m"          # in contact only
# restitution = 0.8             # in its place: speed after a contact over that before
# preload = "5 N"               # push of a stop that is held short, there at once
# preload_over = "0.01 mm"      # or rising from 0 over this depth
# law = "hertz"                 # constant * depth^1.5, in straight pieces, instead of a stiffness
# constant = 3e10               # N/m^1.5
# depth = "0.3 mm"              # down to which it holds
# pieces = 4
# of = { hammer = 1.0, casing = -0.5 } # in the place of between: of a sum of displacements

# A force that is straight from point to point, [x, force] by rising x; above 0 it pulls back.
# [[law]]
# name = "bumper"
# between = ["hammer", "casing"] # or of = {...}
# points = [["-2 mm", "-300 N"], ["-1 mm", "-60 N"], ["1 mm", "60 N"], ["2 mm", "300 N"]]
# quantity = "displacement"     # or "velocity", in m/s

# The force k1 x + k3 x^3, in straight pieces up to its range.
# [[cubic_spring]]
# between = ["casing", "ground"]
# k1 = "2 kN/m"                 # below 0: two wells
# k3 = 2e9                      # N/m^3
# range = "2 mm"
# error = 0.01                  # of the largest force in the range; or points = 8

# Dry friction: the force rises in proportion up to this velocity, then it slides.
# [[friction]]
# between = ["casing", "ground"]
# force = "2 N"
# velocity = "2 mm/s"
# static = "3 N"                # larger until it slides,
# stribeck = "20 mm/s"          # and down to force at this velocity
# speed = "0.1 m/s"             # of a belt on which it slides

# Masses, springs and dampers may be given as matrices in their place ([matrices]).

# amplitude * sin(omega t) + constant
[[force]]
on = "hammer"
amplitude = "80 N"              # negative: in antiphase
# constant = "-19.6 N"          # a weight or a preload
# phase = "90 deg"              # ahead of the other forces
# waveform = "square"           # or "triangle", "sawtooth": of its first harmonics
# terms = 5
# harmonics = [[2, "10 N", "0 deg"]] # 10 N sin(2 omega t) beside it

# The ground moves by amplitude * sin(omega t).
# [base]
# amplitude = "0.1 mm"          # or its acceleration: "0.5 g", "5 m/s²"; phase, waveform as above
# stops = "base"                # stops to ground move with it; "fixed": they stay

# The responses that the board shall show: n-p-q, with n periods of the force, p impacts on the
# upper stop and q on the lower one in that time; of two clearances "1-2-2;0-1". "aperiodic" and
# "quasi-periodic" can be wanted too. Leave `expect` out to take what comes. The frequency:
# frequency = "54 Hz", Omega = 340 (rad/s), or omega in the file's own units.
[[response]]
frequency = "54 Hz"
expect = "1-1-1"
# symmetric = true              # only a symmetric orbit (false: only an asymmetric one) will do
# twin = "exact"                # of 1-2-1 its mirror twin 1-1-2 will not do
# b = 1.2                       # with every gap and constant force 1.2 times as large

"""
    + _CIRCUIT.replace(
        "saturation = 13.0               # V; ", "# saturation = 13.0             # V; "
    ).replace(
        "where omega = 1 may lie", "where the first mass's own frequency may lie on the board"
    )
)
"""A file of format 2."""


def write_model_file(
    place: Path, from_: Path | str | None = None, *, format: Literal[1, 2] | None = None
) -> Path:
    """Write a model file to start from, and beside a commented one ``SCHEMA``, for editors; its
    path.

    ``from_`` : a model file to begin with: one of format 1 is rewritten in format 2
    (``second_format``), one of format 2 copied. format : of the commented file, 1 unless given.

    Raises
    ------
    InputError : there is a file of this name, which is left alone, or none can be written there;
        both ``from_`` and ``format``; a file that cannot be read or rewritten.
    """
    text = _text(from_, format)
    try:
        with place.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(place, "PATH", "a file", "a name that is free") from None
    except OSError as error:
        expected = "a file that can be written"
        raise InputError(place, "PATH", error.strerror or str(error), expected) from None
    if from_ is None:
        _write_schema(place.with_name(SCHEMA))
    return place


def _write_schema(place: Path) -> None:
    """Write the JSON Schema of model files, or renew one that an older version wrote."""
    schema = json_schema()
    with contextlib.suppress(OSError):  # the model file is good without it
        if not place.exists() or f'"{schema["title"]}"' in place.read_text("utf-8", "replace"):
            atomic_write.write(place, dumps(schema))


def _text(from_: Path | str | None, format: Literal[1, 2] | None) -> str:
    if from_ is None:
        return SECOND if format == 2 else TEXT
    if format is not None:
        raise InputError(
            None, "--format", format, "none beside --from, whose file becomes format 2"
        )
    return second_format(read_model_file(Path(from_)))
