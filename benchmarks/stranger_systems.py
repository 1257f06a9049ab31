"""Systems that no example names: drawn from a seed, each a model file with one wanted response.

What is drawn is without units: masses and springs within a factor of 4, damping ratios of joints
0.04 to 0.3, gaps of 0.1 to 0.6 of what the drive moves the masses by, stops of 4 to 30 of the
springs. Then it is written in plain numbers, or in the SI units of a size that machines have.
Of the family "laws" each system has a force that is no linear spring, damper or stop, in the place
of one clearance or in it. Of the family "linked" the stops have dampers, and of two masses and more
there are clearances of combinations of displacements, and mass matrices with couplings. Of the
family "driven" no drive is one sine: waveforms, harmonics, phases that differ, and forces beside a
moving base.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar, get_args

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.step_budget import Budget
from designer.model.driven import model_flow
from designer.model.model_file import ModelFile, parse_model_file

SHAPES = (
    ((1, 1), 6), ((1, 2), 1), ((1, 3), 1), ((2, 1), 5), ((2, 2), 4), ((2, 3), 1),
    ((3, 1), 3), ((3, 2), 3), ((3, 3), 1), ((4, 1), 2), ((4, 2), 2), ((4, 3), 1),
)  # fmt: skip
"""Masses and clearances, and how often of thirty; every thirty systems in a row have each so
often."""
FREQUENCIES, STEPS = 12, 3_000_000
"""Drive frequencies that a response is looked for at; steps of the engine that each may take."""
MOST_PERIODS, APERIODIC = 8, 0.15
"""Longest period of a wanted response; share of the aperiodic motions that are taken, with any
n-p-q wanted."""
WORD = {True: "upper", False: "lower"}
LAWS = (
    ("hardening", 2), ("two wells", 2), ("friction", 2), ("Stribeck friction", 1),
    ("points", 1), ("stop in steps", 1), ("rising preload", 1),
)  # fmt: skip
"""Kinds of laws, and how often of ten."""
IN_A_CLEARANCE = ("stop in steps", "rising preload")
"""Those that are stops."""
DAMPED, COMBINED, COUPLED = 0.7, 0.5, 0.5
"""Of the family "linked": shares of the clearances with a damper or a restitution, and of several
masses of those that are of a combination; of the systems of several masses with a mass matrix."""
DRIVES = (
    ("waveform", 2), ("harmonics", 2), ("two phases", 2), ("two shapes", 1),
    ("shaped base", 1), ("force beside base", 2),
)  # fmt: skip
"""Kinds of drives, and how often of ten; of one mass those of two masses are of one."""
OF_TWO = {"two phases": "waveform", "two shapes": "harmonics"}
"""What a system of one mass has in the place of a drive of two masses."""
Family = Literal["plain", "laws", "linked", "driven"]
FAMILIES: tuple[Family, ...] = get_args(Family)
Joint = tuple[str, str]
T = TypeVar("T")


@dataclass(frozen=True)
class Size:
    """Units that a kind of machine is of: what 1 of the drawn numbers is. hertz : range of 1/2π of
    the drawn unit of time; None: plain numbers."""

    name: str
    length: tuple[float, float]
    mass: tuple[float, float]
    hertz: tuple[float, float] | None


SIZES = (
    (Size("plain numbers", (1.0, 1.0), (1.0, 1.0), None), 4),
    (Size("mm, kg", (2e-4, 5e-3), (0.1, 20.0), (4.0, 200.0)), 3),
    (Size("µm, mg", (2e-7, 2e-5), (1e-8, 1e-5), (500.0, 5e4)), 2),
    (Size("m, t", (5e-3, 0.5), (3e2, 5e4), (0.1, 4.0)), 1),
)
"""Sizes, and how often of ten."""


@dataclass(frozen=True)
class Stranger:
    """A drawn system."""

    number: int
    """Its number in the population of the seed."""
    masses: int
    clearances: int
    kinds: tuple[str, ...]
    """What is unusual of it: "one-sided", "unequal", "preloaded", "between masses", "constant
    force", "base"."""
    size: str
    """Of which size it is written."""
    text: str
    """The model file."""

    @property
    def name(self) -> str:
        return f"{self.number:04d}"


def draw(seed: int, number: int, family: Family = "plain") -> Stranger:
    """The system of this number; every number is drawn for itself."""
    law = None
    if family == "laws":
        law = _one_of(LAWS, np.random.default_rng([seed, number // 10, 3]), number % 10)
    drive = None
    if family == "driven":
        drive = _one_of(DRIVES, np.random.default_rng([seed, number // 10, 4]), number % 10)
    size = _one_of(SIZES, np.random.default_rng([seed, number // 10, 2]), number % 10)
    rng = np.random.default_rng([seed, number])
    while True:  # a drawn system may be refused as a model, or never meet a stop
        drawn = _Drawn(rng, *shape(seed, number), size, law, linked=family == "linked", drive=drive)
        text = drawn.with_response(f"Stranger {seed}-{number}")
        if text is not None:
            return Stranger(number, *drawn.shape, drawn.kinds, size.name, text)


def shape(seed: int, number: int) -> tuple[int, int]:
    """Masses and clearances of the system of this number."""
    return _one_of(SHAPES, np.random.default_rng([seed, number // 30, 1]), number % 30)


def _one_of(choices: Sequence[tuple[T, int]], rng: np.random.Generator, place: int) -> T:
    """The choice at a place of a pack that was shuffled."""
    pack = [choice for choice, count in choices for _ in range(count)]
    return pack[int(rng.permutation(len(pack))[place])]


class _Drawn:
    """One draw of the elements, without a response yet."""

    def __init__(
        self,
        rng: np.random.Generator,
        masses: int,
        clearances: int,
        size: Size,
        law: str | None = None,
        *,
        linked: bool = False,
        drive: str | None = None,
    ) -> None:
        self._rng, self._size, self._law = rng, size, law
        clearances -= law is not None and law not in IN_A_CLEARANCE
        self.shape = masses, clearances
        self.kinds: tuple[str, ...] = ()
        self._kinds: set[str] = set() if law is None else {law}
        self._names = [f"m{i + 1}" for i in range(masses)]
        self._mass = np.exp(rng.uniform(-math.log(2.0), math.log(2.0), masses))
        self._springs = dict(self._joints(0.4))
        self._dampers = {
            pair: 2.0 * rng.uniform(0.04, 0.3) * math.sqrt(k * self._reduced(pair))
            for pair, k in self._springs.items()
            if "ground" in pair or rng.uniform() < 0.7
        }
        self._draw_drive()
        self._shapes: dict[str, dict[str, object]] = {}
        if drive is not None:
            self._shape_drive(OF_TWO.get(drive, drive) if masses == 1 else drive)
        self._flexibility = np.linalg.inv(self._matrix(self._springs))
        self._reach = np.abs(self._flexibility) @ np.maximum(self._force, 0.0)
        self._gaps = [self._gap(k) for k in range(clearances)]
        self._couplings = np.zeros((masses, masses))
        if linked:
            self._link()
        self._laws: list[tuple[str, dict[str, tuple[object, str]]]] = []
        if law in IN_A_CLEARANCE:
            self._bend_a_stop(law == "rising preload")
        elif law is not None:
            self._laws.append(self._drawn_law(law))
        self.kinds = tuple(sorted(self._kinds))
        length, mass = (_log_uniform(rng, *span) for span in (size.length, size.mass))
        second = 1.0
        if size.hertz is not None:
            second = 1.0 / (2.0 * math.pi * _log_uniform(rng, *size.hertz))
        self._units = {
            "kg": mass, "m": length, "N": mass * length / second**2,
            "N/m": mass / second**2, "N s/m": mass / second, "m/s": length / second,
            "": 1.0, "N/m³": mass / second**2 / length**2,
            "N/m^1.5": mass / second**2 / length**0.5,
        }  # fmt: skip
        self._second = second

    def _joints(self, more: float) -> Iterator[tuple[Joint, float]]:
        """A spring from each mass to one before it, the first to ground; others to ground too now
        and then."""
        for i, name in enumerate(self._names):
            other = self._names[int(self._rng.integers(i))] if i else "ground"
            yield (name, other), self._stiffness()
            if i and self._rng.uniform() < more:
                yield (name, "ground"), self._stiffness()

    def _stiffness(self) -> float:
        return _log_uniform(self._rng, 0.5, 2.0)

    def _reduced(self, pair: Joint) -> float:
        masses = [self._mass[self._names.index(n)] for n in pair if n != "ground"]
        return float(1.0 / sum(1.0 / m for m in masses))

    def _matrix(self, joints: dict[Joint, float]) -> Array:
        out = np.zeros((len(self._names), len(self._names)))
        for pair, value in joints.items():
            row = np.array([float(n == pair[0]) - float(n == pair[1]) for n in self._names])
            out += value * np.outer(row, row)
        return out

    def _draw_drive(self) -> None:
        """A moving base in a quarter; else a force on any mass, now and then on two. A third have
        constant forces."""
        rng, n = self._rng, len(self._names)
        self._constant = np.zeros(n)
        self._amplitude = np.zeros(n)
        self._base = 0.0
        if rng.uniform() < 0.25:
            self._base = float(rng.uniform(0.5, 1.5))
            self._kinds.add("base")
            self._force = self._base * self._mass
        else:
            for mass in rng.permutation(n)[: 2 if rng.uniform() < 0.2 else 1]:
                self._amplitude[mass] = rng.uniform(0.5, 1.5) * rng.choice([1.0, 1.0, -1.0])
            self._force = np.abs(self._amplitude)
        if rng.uniform() < 1.0 / 3.0:
            mass = int(rng.integers(n))
            self._constant[mass] = rng.uniform(0.05, 0.5) * self._force.max() * rng.choice([-1, 1])
            self._kinds.add("constant force")

    def _shape_drive(self, kind: str) -> None:
        """Another drive in the place of the sine: keys of the forces and of the base."""
        rng, n = self._rng, len(self._names)
        self._kinds -= {"base"}
        self._kinds.add(kind)
        shaken = kind in ("shaped base", "force beside base")
        self._base = float(rng.uniform(0.5, 1.5)) if shaken else 0.0
        self._amplitude[:] = 0.0
        many = {"two phases": 2, "two shapes": 2, "shaped base": 0}.get(kind, 1)
        one = self._shape(rng.choice(["waveform", "harmonics"]))
        for mass in rng.permutation(n)[:many]:
            self._amplitude[mass] = rng.uniform(0.5, 1.5) * rng.choice([-1.0, 1.0])
            phase = float(f"{rng.uniform(-math.pi, math.pi):.3g}")
            name = self._names[mass]
            if kind in ("waveform", "harmonics"):
                self._shapes[name] = self._shape(kind)
            elif kind == "two shapes":
                self._shapes[name] = self._shape(rng.choice(["waveform", "harmonics"]))
            elif kind == "force beside base" and rng.uniform() < 0.5:
                self._shapes[name] = one
            else:
                self._shapes[name] = {"phase": phase}
        if kind == "shaped base":
            self._shapes["ground"] = self._shape(rng.choice(["waveform", "harmonics"]))
        self._force = np.abs(self._amplitude) + self._base * self._mass

    def _shape(self, kind: str) -> dict[str, object]:
        """Keys of a waveform, or of harmonics; their amplitudes as shares of the first."""
        rng = self._rng
        if kind == "waveform":
            wave = str(rng.choice(["square", "triangle", "sawtooth"]))
            return {"waveform": wave, "terms": int(rng.integers(2, 6))}
        orders = sorted(rng.permutation(np.arange(2, 6))[: int(rng.integers(1, 3))].tolist())
        draws = rng.uniform(-1.0, 1.0, (len(orders), 2)).tolist()
        harmonics = [
            (n, 0.5 * size, math.pi * turn) for n, (size, turn) in zip(orders, draws, strict=True)
        ]
        return {"harmonics": harmonics}

    def _shaped(self, name: str, amplitude: float, unit: str) -> list[tuple[str, object]]:
        """The keys of a force or of the base beside its amplitude."""
        keys = dict(self._shapes.get(name, {}))
        harmonics = keys.get("harmonics")
        if isinstance(harmonics, list):
            keys["harmonics"] = [
                [n, self._value(share * amplitude, unit), float(f"{phase:.3g}")]
                for n, share, phase in harmonics
            ]
        return list(keys.items())

    def _joined(self) -> tuple[int, str]:
        """A mass, and what it is joined to: the ground, or another mass now and then."""
        rng, n = self._rng, len(self._names)
        i, other = int(rng.integers(n)), "ground"
        if n > 1 and rng.uniform() < 0.35:
            other = self._names[int(rng.choice([j for j in range(n) if j != i]))]
            self._kinds.add("between masses")
        return i, other

    def _gap(self, number: int) -> dict[str, object]:
        """A clearance: what stands in it, its gaps and its stops, in drawn units."""
        rng = self._rng
        i, other = self._joined()
        reach = float(max(self._reach[i], 0.3 * self._reach.max()))
        own = float(self._matrix(self._springs)[i, i])

        def gap() -> float:
            return reach * float(rng.uniform(0.1, 0.6))

        def stop() -> float:
            return own * _log_uniform(rng, 4.0, 30.0)

        out: dict[str, object] = {"name": "ABC"[number], "between": (self._names[i], other)}
        kind = rng.choice(["one-sided", "equal", "unequal", "preloaded"], p=[0.35, 0.3, 0.25, 0.1])
        if kind != "equal":
            self._kinds.add(str(kind))
        if kind == "one-sided":
            return out | {WORD[bool(rng.uniform() < 0.5)]: gap(), "stiffness": stop()}
        if kind == "equal":
            width = gap()
            return out | {"upper": width, "lower": width, "stiffness": stop()}
        if kind == "preloaded":
            side = bool(rng.uniform() < 0.5)
            held = -reach * float(rng.uniform(0.05, 0.3))
            out |= {WORD[side]: held, "stiffness": stop()}
            return out | ({WORD[not side]: 1.5 * reach - held} if rng.uniform() < 0.3 else {})
        out |= {"upper": gap(), "lower": gap(), "upper_stiffness": stop()}
        return out | {"lower_stiffness": stop()}

    def _link(self) -> None:
        """Dampers in the stops, combinations in the place of ends, and a mass matrix."""
        rng, n = self._rng, len(self._names)
        for gap in self._gaps:
            if n > 1 and rng.uniform() < COMBINED:
                factors = rng.uniform(0.3, 1.0, n) * rng.choice([-1.0, 1.0], n)
                factors[int(rng.integers(n))] = 1.0
                pairs = zip(self._names, factors.tolist(), strict=True)
                del gap["between"]
                gap["of"] = {name: float(f"{factor:.3g}") for name, factor in pairs}
                self._kinds.add("combination")
            alike = "upper_stiffness" not in gap
            if alike and rng.uniform() < DAMPED:
                if "of" in gap or rng.uniform() < 0.5:
                    stiffness, mass = float(str(gap["stiffness"])), float(self._mass.mean())
                    share = rng.uniform(0.05, 0.4)
                    gap["damping"] = 2.0 * share * math.sqrt(stiffness * mass)
                else:
                    gap["restitution"] = float(f"{rng.uniform(0.3, 0.95):.2g}")
                self._kinds.add("damped stops")
        if n > 1 and rng.uniform() < COUPLED:
            shares = np.triu(rng.uniform(-0.3, 0.3, (n, n)), 1)
            self._couplings = (shares + shares.T) * np.sqrt(np.outer(self._mass, self._mass))
            self._kinds.add("mass matrix")

    def _bend_a_stop(self, preload: bool) -> None:
        """The first clearance with a Hertz contact in the place of its stiffness, or with a preload
        that rises."""
        rng, gap = self._rng, self._gaps[0]
        stiffness = float(gap.pop("stiffness", None) or gap.pop("upper_stiffness"))  # type: ignore[arg-type]
        gap.pop("lower_stiffness", None)
        depth = float(self._reach.max()) * float(rng.uniform(0.2, 0.5))
        if preload:
            gap |= {"stiffness": stiffness, "preload": stiffness * depth * rng.uniform(0.2, 1.0)}
            gap["preload_over"] = depth * float(rng.uniform(0.1, 0.3))
        else:
            gap |= {"law": "hertz", "constant": stiffness / math.sqrt(depth), "depth": depth}
            gap["pieces"] = int(rng.integers(2, 5))

    def _drawn_law(self, law: str) -> tuple[str, dict[str, tuple[object, str]]]:
        """Its table and its keys, each with the unit of its value."""
        rng = self._rng
        i, other = self._joined()
        own, reach = float(self._matrix(self._springs)[i, i]), float(self._reach.max())
        fast = reach * math.sqrt(own / self._mass[i])
        force = float(self._force.max())
        keys: dict[str, tuple[object, str]] = {"between": ([self._names[i], other], "")}
        if "friction" in law:
            slow, slides = fast * rng.uniform(0.03, 0.15), force * rng.uniform(0.05, 0.3)
            keys |= {"force": (slides, "N"), "velocity": (slow, "m/s")}
            if law == "Stribeck friction":
                keys["static"] = slides * rng.uniform(1.2, 1.6), "N"
                keys["stribeck"] = slow * rng.uniform(3.0, 8.0), "m/s"
            return "friction", keys
        if law == "points":
            count = int(rng.integers(2, 5))
            x = np.sort(reach * rng.uniform(-0.8, 0.8, count + 2))
            slopes = own * rng.uniform(-0.8, 2.0, count + 1)
            slopes[[0, -1]] = np.abs(slopes[[0, -1]])
            f = np.concatenate([[0.0], np.cumsum(slopes * np.diff(x))])
            f -= np.interp(0.0, x, f) + force * rng.uniform(-0.1, 0.1)
            points = [[(a, "m"), (b, "N")] for a, b in zip(x.tolist(), f.tolist(), strict=True)]
            return "law", {"name": ("K", ""), **keys, "points": (points, "points")}
        k1 = 0.0 if law == "hardening" else -own * float(rng.uniform(1.2, 1.8))
        wide = own * _log_uniform(rng, 0.3, 3.0) / reach**2
        if law == "two wells":  # where spring and law together hold it
            wide = -(own + k1) / (reach * float(rng.uniform(0.3, 0.8))) ** 2
        keys |= {"k1": (k1, "N/m"), "k3": (wide, "N/m³"), "range": (1.6 * reach, "m")}
        return "cubic_spring", keys | {"error": (0.02, "")}

    def with_response(self, title: str) -> str | None:
        """The file with a response that the model shows from rest, in which a stop is hit; None
        where there is none, or where the model is refused."""
        rng, elements = self._rng, self._elements(title)
        own = np.sqrt(np.linalg.eigvals(self._matrix(self._springs) / self._mass[:, None]).real)
        for _ in range(FREQUENCIES):
            omega = float(rng.choice(own)) * _log_uniform(rng, 0.6, 1.6)
            key: tuple[str, object] = ("omega", float(f"{omega:.4g}"))
            if self._size.hertz is not None:
                key = "frequency", f"{omega / (2.0 * math.pi * self._second):.4g} Hz"
            response = _table("[[response]]", [key])
            try:
                modelfile = parse_model_file(elements + response)
            except InputError:
                return None
            orbit = _from_rest(modelfile)
            met = _hits(orbit) or not self._gaps
            if orbit.status is OrbitStatus.PERIODIC and orbit.n <= MOST_PERIODS and met:
                return elements + _table("[[response]]", [key, ("expect", str(orbit.counts))])
            if orbit.status is OrbitStatus.APERIODIC and rng.uniform() < APERIODIC:
                return elements + response
        return None

    def _elements(self, title: str) -> str:
        """The file without its response."""
        lines = ["format = 2\n", f'title = "{title}"\n']
        lines += self._matrices() if self._couplings.any() else self._links()
        for gap in self._gaps:
            keys = [(k, self._of_gap(k, value)) for k, value in gap.items()]
            lines.append(_table("[[clearance]]", keys))
        for kind, own in self._laws:
            keys = [(k, self._value_of(value, unit)) for k, (value, unit) in own.items()]
            lines.append(_table(f"[[{kind}]]", keys))
        for name, *values in zip(self._names, self._amplitude, self._constant, strict=True):
            forces = zip(("amplitude", "constant"), values, strict=True)
            keys = [(k, self._value(float(v), "N")) for k, v in forces if v]
            if keys:
                keys += self._shaped(name, values[0], "N")
                lines.append(_table("[[force]]", [("on", name), *keys]))
        if self._base:
            keys = [("amplitude", self._value(self._base, "m"))]
            keys += self._shaped("ground", self._base, "m")
            lines.append(_table("[base]", keys))
        lines.append(_table("[circuit]", [("dead_zone", "rectifier")]))
        return "".join(lines)

    def _links(self) -> Iterator[str]:
        """The tables of masses, springs and dampers."""
        for name, mass in zip(self._names, self._mass, strict=True):
            yield _table("[[mass]]", [("name", name), ("mass", self._value(mass, "kg"))])
        for kind, key, unit, joints in (
            ("spring", "stiffness", "N/m", self._springs),
            ("damper", "damping", "N s/m", self._dampers),
        ):
            for pair, value in joints.items():
                joint = ("between", list(pair)), (key, self._value(value, unit))
                yield _table(f"[[{kind}]]", joint)

    def _matrices(self) -> Iterator[str]:
        """The same as one table of matrices, in plain numbers: those of a file in SI are SI."""
        keys: list[tuple[str, object]] = [("names", self._names)]
        for key, matrix, unit in (
            ("mass", np.diag(self._mass) + self._couplings, "kg"),
            ("stiffness", self._matrix(self._springs), "N/m"),
            ("damping", self._matrix(self._dampers), "N s/m"),
        ):
            sized = (matrix * self._units[unit]).tolist()
            keys.append((key, [[float(f"{entry:.6g}") for entry in row] for row in sized]))
        yield _table("[matrices]", keys)

    def _of_gap(self, key: str, value: object) -> object:
        if key == "restitution":
            return value
        if isinstance(value, float):
            units = {"preload": "N", "constant": "N/m^1.5", "damping": "N s/m"}
            unit = "N/m" if key.endswith("stiffness") else units.get(key, "m")
            return self._value_of(value, unit)
        return list(value) if isinstance(value, tuple) else value

    def _value_of(self, value: object, unit: str) -> object:
        """As ``_value``; points by their own units, and plain numbers where a file has these."""
        if unit == "points":
            assert isinstance(value, list)
            return [[self._value(a, "m"), self._value(b, "N")] for (a, _), (b, _) in value]
        if not isinstance(value, float) or not unit:
            return value
        if unit in ("N/m³", "N/m^1.5"):
            return float(f"{value * self._units[unit]:.3g}")
        return self._value(value, unit)

    def _value(self, drawn: float, unit: str) -> object:
        """As a file has it: three digits, with a unit where it is of a size."""
        digits = f"{drawn * self._units[unit]:.3g}"
        return float(digits) if self._size.hertz is None else f"{digits} {unit}"


def _table(head: str, keys: Sequence[tuple[str, object]]) -> str:
    lines = [f"{key} = {_toml(value)}" for key, value in keys]
    return "\n".join(["", head, *lines, ""])


def _toml(value: object) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {each}" for key, each in value.items()) + " }"
    return json.dumps(value)


def _from_rest(modelfile: ModelFile) -> Orbit:
    (wanted,) = modelfile.responses
    assert wanted.omega is not None
    flow = model_flow(modelfile.model, wanted.omega)
    return settle(flow, np.zeros(flow.system.size), budget=Budget(STEPS))


def _hits(orbit: Orbit) -> bool:
    """Whether it hits a stop, deeper than a touch."""
    return any(p + q for p, q in orbit.counts.impacts) and bool(np.isfinite(orbit.radius))


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))
