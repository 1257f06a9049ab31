"""Model files of format 2 for the independent integrator, by a reader of their own."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.shared.event_integrator import GROUND, Gap, Mechanism

PREFIXES = {"": 1.0, "k": 1e3, "m": 1e-3}
TEXT = re.compile(r"(-?[\d.]+) ([km]?)(?:kg|N/m|N s/m|m|N|Hz)")


def value_of(value: float | str) -> float:
    """A number, or one with a unit; a mass is in kg."""
    if isinstance(value, str):
        match = TEXT.fullmatch(value)
        assert match is not None, value
        kilo = "" if value.endswith("kg") else match[2]
        return float(match[1]) * PREFIXES[kilo]
    return float(value)


def omega_of(response: Mapping[str, Any]) -> float:
    """Drive frequency of a table [[response]]."""
    if "omega" in response:
        return float(response["omega"])
    return 2.0 * math.pi * value_of(response["frequency"])


def mechanism_of(path: Path, omega: float) -> tuple[Mechanism, list[Mapping[str, Any]]]:
    """The system of a file at a drive frequency, and the file's responses. Each force and each
    spring or damper to ground names its mass first."""
    data = tomllib.loads(path.read_text("utf-8"))
    names = [mass["name"] for mass in data["mass"]]

    def place(name: str) -> int:
        return GROUND if name == "ground" else names.index(name)

    def links(kind: str, key: str) -> list[tuple[int, int, float]]:
        return [(*map(place, t["between"]), value_of(t[key])) for t in data.get(kind, [])]  # type: ignore[misc]

    forces, constants = [0.0] * len(names), [0.0] * len(names)
    waves: list[tuple[int, int, float, float]] = []
    for force in data.get("force", []):
        mass, amplitude = place(force["on"]), value_of(force.get("amplitude", 0.0))
        constants[mass] += value_of(force.get("constant", 0.0))
        if "waveform" not in force:
            assert "phase" not in force
            forces[mass] += amplitude
            continue
        assert force["waveform"] == "square"
        turn = math.radians(float(force.get("phase", "0 deg").removesuffix(" deg")))
        odd = range(1, 2 * force["terms"], 2)
        waves += [(mass, n, 4.0 * amplitude / (math.pi * n), n * turn) for n in odd]
    base = data.get("base", {})
    masses = [value_of(mass["mass"]) for mass in data["mass"]]
    mechanism = Mechanism(
        masses=masses,
        springs=links("spring", "stiffness"),
        dampers=links("damper", "damping"),
        forces=forces,
        omega=omega,
        gaps=[_gap(table, masses, *map(place, table["between"])) for table in data["clearance"]],
        constants=constants,
        base=value_of(base.get("amplitude", 0.0)),
        fixed_stops=base.get("stops") == "fixed",
        waves=waves,
    )
    return mechanism, data["response"]


def _gap(table: Mapping[str, Any], masses: list[float], mass: int, other: int) -> Gap:
    def springs(side: str) -> tuple[tuple[float, float], ...]:
        stiffness = table.get(f"{side}_stiffness", table.get("stiffness"))
        if side not in table:
            return ()
        gap, own = value_of(table[side]), value_of(stiffness)
        if not rise:
            return ((gap, own),)
        # A preload that rises is a spring that takes itself back where it has risen.
        return (gap, own + preload / rise), (gap + rise, -preload / rise)

    preload, rise = (value_of(table.get(key, 0.0)) for key in ("preload", "preload_over"))

    damping = value_of(table.get("damping", 0.0))
    if "restitution" in table:
        # x'' + 2 d x' + w² x = 0 from the stop and back leaves exp(-d pi/sqrt(w² - d²)).
        assert other == GROUND
        decay = -math.log(table["restitution"]) / math.pi
        w = math.sqrt(value_of(table["stiffness"]) / masses[mass])
        damping = 2.0 * masses[mass] * w * decay / math.sqrt(1.0 + decay**2)
    return Gap(
        mass,
        other,
        springs("upper"),
        springs("lower"),
        damping,
        0.0 if rise else preload,
    )


HAMMER = """\
format = 2
title = "Hammer on anvil and pad"
[[mass]]
name = "hammer"
mass = "2 kg"
[[spring]]
between = ["hammer", "ground"]
stiffness = "8 kN/m"
[[damper]]
between = ["hammer", "ground"]
damping = "20 N s/m"
[[clearance]]
name = "anvil"
between = ["hammer", "ground"]
upper = "0.8 mm"
stiffness = "40 kN/m"
[[clearance]]
name = "pad"
between = ["hammer", "ground"]
lower = "1.5 mm"
stiffness = "6 kN/m"
[[force]]
on = "hammer"
amplitude = "12 N"
"""
"""A model file in SI units: one mass with two clearances of one stop each."""
