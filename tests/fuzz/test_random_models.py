"""Whole model files drawn at random, most of them sound: each is simulated, and parts are looked
for, or it is refused by name.

The files of the examples are a few systems that somebody thought of. Here any number of masses,
laws, stops and drives meet, at sizes that a user may write, and now and then at the ends of what a
float holds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from random import Random
from typing import Any

import numpy as np
import pytest

from designer.base.errors import DesignerError, InputError
from designer.catalog.parts_catalog import load_catalog
from designer.check import simulation, synthesis_result
from designer.dynamics.attractors import settle
from designer.dynamics.harmonics import fastest
from designer.dynamics.orbit import ANSWERS
from designer.model import find_responses
from designer.model.driven import model_flow
from designer.model.mechanics import frequency_range
from designer.model.model_file import ModelFile, parse_model_file
from designer.synthesis import parts_choice
from tests.shared.damaged import toml_of
from tests.shared.exploring import EXPLORING, quick

EACH = 10
"""Files of one run."""
FEW, MANY = 1, 500 if EXPLORING else 5
"""Runs of the quick test, and of the slow one."""
SOUND = 0.4
"""Least share of the files that are no error: the test is of models."""
Table = dict[str, Any]
Body = str
GROUND = "ground"


class Drawn:
    """What one system is made of, drawn from one number."""

    def __init__(self, dice: Random) -> None:
        self.dice = dice
        self.wild = dice.random() < 0.15
        """Whether its numbers go to the ends of what a float holds."""

    def size(self, around: float = 1.0) -> float:
        """A number above 0."""
        decades = self.dice.uniform(-1.0, 1.0)
        if self.wild and self.dice.random() < 0.3:
            decades = self.dice.uniform(-200.0, 200.0)
        return float(f"{around * 10.0**decades:.4g}")

    def sign(self) -> float:
        return self.dice.choice((1.0, 1.0, -1.0))

    def often(self, share: float) -> bool:
        return self.dice.random() < share

    def pair(self, bodies: list[Body]) -> list[Body]:
        first = self.dice.choice(bodies)
        return [first, self.dice.choice([GROUND, *(b for b in bodies if b != first)])]


def first_format(drawn: Drawn) -> Table:
    """The table ``[model]`` or ``[mechanical]``."""
    dice = drawn.dice
    if drawn.often(0.6):
        model: Table = {
            key: dice.choice((0.5, dice.random(), dice.random())) for key in ("m", "k", "c")
        }
        model |= {"k0": dice.choice((0.0, 0.95, dice.random())), "zeta": drawn.size(0.1)}
        model |= {"f20": dice.choice((0.0, 1.0, dice.random())), "b": drawn.size(0.3)}
        model["sides"] = dice.choice(("both", "upper", "lower"))
        return {"format": 1, "model": model}
    si = {key: drawn.size(size) for key, size in SI.items()}
    si |= {key: 0.0 for key in ("K0", "C2", "P2") if drawn.often(0.2)}
    return {"format": 1, "mechanical": si}


SI = {"M1": 1.0, "M2": 1.0, "C1": 5.0, "C2": 5.0, "K0": 2e4, "K1": 1e3, "K2": 1e3, "B": 1e-3,
      "P1": 5.0, "P2": 5.0}  # fmt: skip


def second_format(drawn: Drawn) -> Table:
    """Masses on springs and dampers to each other and to ground, and any of the rest."""
    dice = drawn.dice
    names = [f"m{k}" for k in range(dice.choice((1, 1, 2, 2, 3, 4)))]
    chain = [*pairwise(names), (names[0], GROUND)]
    chain += [(name, GROUND) for name in names[1:] if drawn.often(0.4)]
    data: Table = {"format": 2}
    data["mass"] = [{"name": name, "mass": drawn.size()} for name in names]
    data["spring"] = [{"between": list(each), "stiffness": drawn.size()} for each in chain]
    data["damper"] = [{"between": list(each), "damping": drawn.size(0.1)} for each in chain]
    data["force"] = [force(drawn, names) for _ in range(dice.choice((1, 1, 2)))]
    for key, most, make in TABLES:
        made = [make(drawn, names, number) for number in range(dice.choice((0, 0, 1, most)))]
        data |= {key: made} if made else {}
    if drawn.often(0.2):
        data["base"] = {"amplitude": drawn.size(0.3), **shape(drawn)}
        data["base"] |= {"stops": "fixed"} if drawn.often(0.2) else {}
    return data


def force(drawn: Drawn, names: list[Body]) -> Table:
    amplitude = drawn.sign() * drawn.size()
    constant = {"constant": drawn.sign() * drawn.size(0.3)} if drawn.often(0.2) else {}
    return {"on": drawn.dice.choice(names), "amplitude": amplitude, **constant, **shape(drawn)}


def shape(drawn: Drawn) -> Table:
    """Of a drive: a phase, harmonics or a waveform."""
    dice = drawn.dice
    if not drawn.often(0.3):
        return {}
    if drawn.often(0.4):
        waveform = dice.choice(("square", "triangle", "sawtooth"))
        return {"waveform": waveform, "terms": dice.choice((1, 2, 5, 32))}
    orders = dice.sample(range(2, 12), dice.choice((1, 2)))
    waves = [[n, drawn.size(0.2), dice.uniform(-4.0, 4.0)] for n in orders]
    return {"harmonics": waves, **({"phase": "90 deg"} if drawn.often(0.3) else {})}


def clearance(drawn: Drawn, names: list[Body], number: int) -> Table:
    dice = drawn.dice
    sides = dice.choice((("upper",), ("lower",), ("upper", "lower"), ("upper", "lower")))
    gap = drawn.size(0.3)
    table: Table = {"name": f"A{number}"} | {
        side: gap if drawn.often(0.6) else drawn.size(0.3) for side in sides
    }
    if drawn.often(0.15):
        table[sides[0]] = -0.3 * gap
    if drawn.often(0.15):
        table["of"] = {name: dice.choice((1.0, -1.0, drawn.size())) for name in names}
    else:
        table["between"] = drawn.pair(names)
    if drawn.often(0.15):
        depth = drawn.size(0.3)
        return table | {"law": "hertz", "constant": drawn.size(20.0), "depth": depth}
    table["stiffness"] = drawn.size(20.0)
    if drawn.often(0.3):
        table |= dice.choice(({"damping": drawn.size(0.2)}, {"restitution": dice.uniform(0.2, 1)}))
    if drawn.often(0.15):
        table["preload"] = drawn.size(0.3)
        table |= {"preload_over": drawn.size(0.05)} if drawn.often(0.6) else {}
    return table


def law(drawn: Drawn, names: list[Body], number: int) -> Table:
    """Points through any forces, rising far out."""
    dice = drawn.dice
    places = sorted({drawn.sign() * drawn.size(0.5) for _ in range(dice.choice((2, 3, 5)))})
    forces = [x * drawn.size() for x in places]
    if drawn.often(0.3):
        dice.shuffle(forces)
    points = [[x, f] for x, f in zip(places, forces, strict=True)] or [[-1.0, -1.0], [1.0, 1.0]]
    kind = {"quantity": "velocity"} if drawn.often(0.3) else {}
    return {"name": f"L{number}", "points": points, "between": drawn.pair(names), **kind}


def cubic(drawn: Drawn, names: list[Body], number: int) -> Table:
    k1 = {"k1": drawn.sign() * drawn.size(0.3)} if drawn.often(0.5) else {}
    more = drawn.dice.choice(({}, {"points": 6}, {"error": 0.05}))
    cube = {"k3": drawn.size(), "range": drawn.size()}
    return {"between": drawn.pair(names), **cube, **k1, **more}


def friction(drawn: Drawn, names: list[Body], number: int) -> Table:
    table: Table = {"between": drawn.pair(names), "force": drawn.size(0.2)}
    table["velocity"] = drawn.size(0.05)
    if drawn.often(0.3):
        table["static"] = 1.5 * table["force"]
        table["stribeck"] = 3.0 * table["velocity"]
    return table | ({"speed": drawn.size(0.2)} if drawn.often(0.2) else {})


TABLES: tuple[tuple[str, int, Callable[[Drawn, list[Body], int], Table]], ...] = (
    ("clearance", 2, clearance),
    ("law", 2, law),
    ("cubic_spring", 1, cubic),
    ("friction", 1, friction),
)


def file(seed: int) -> tuple[str, Drawn]:
    """The text of a model file."""
    drawn = Drawn(Random(seed))
    data: Mapping[str, Any] = (first_format if drawn.often(0.25) else second_format)(drawn)
    stage = {"dead_zone": drawn.dice.choice(("rectifier", "saturation"))}
    coarse = {"resistors": "E12", "capacitors": "E6", **(stage if drawn.often(0.5) else {})}
    return toml_of({**data, "circuit": coarse}), drawn


class Chosen(Exception):
    """Parts would be looked for."""


@pytest.fixture
def short_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two starts and two frequencies where there are more, and no choice of parts."""

    def stop(*_: object) -> None:
        raise Chosen

    monkeypatch.setattr(parts_choice._Search, "best", stop)
    monkeypatch.setattr(find_responses, "STARTS", 2)
    monkeypatch.setattr(find_responses, "SCOUT", (0.6, 1.3))


def simulated(modelfile: ModelFile, drawn: Drawn) -> bool:
    """Whether a response is found near the first mass's own frequency."""
    low, high = frequency_range(modelfile.model)
    own = modelfile.model.second_order().own_frequency
    omega = min(max(own * drawn.dice.uniform(0.4, 2.0), low), high)
    try:
        (found,) = simulation.simulate(modelfile, (omega,), starts=0)
    except InputError:
        return False
    assert found.orbit.status
    assert found.orbit.response == found.orbit.response.strip()
    return True


def test_a_motion_that_no_flow_follows_has_the_drive_s_own_frequency() -> None:
    """A force 10³⁴ times as large as the springs': there is no sample to take a mean of."""
    model = parse_model_file(
        "format = 2\n"
        '[[mass]]\nname = "m"\nmass = 0.15\n'
        '[[spring]]\nbetween = ["m", "ground"]\nstiffness = 1.7\n'
        '[[damper]]\nbetween = ["m", "ground"]\ndamping = 1.4e-12\n'
        '[[force]]\non = "m"\namplitude = 1.0\nharmonics = [[5, 8e34, 2.4]]\n'
        '[[clearance]]\nname = "A"\nbetween = ["m", "ground"]\nlower = 1.8\nstiffness = 7.0\n'
    ).model
    omega = model.second_order().own_frequency
    flow = model_flow(model, omega)
    orbit = settle(flow, np.zeros(2))
    assert orbit.status not in ANSWERS
    assert fastest(flow, orbit) == omega


@pytest.mark.timeout(600)
@pytest.mark.usefixtures("short_work")
@pytest.mark.parametrize(
    "number",
    quick(range(FEW + MANY), FEW),
)
def test_any_model_is_simulated_and_designed_or_refused(number: int) -> None:
    catalog, sound = load_catalog(), 0
    for seed in range(number * EACH, (number + 1) * EACH):
        text, drawn = file(seed)
        try:
            modelfile = parse_model_file(text)
        except InputError:
            continue
        try:
            sound += simulated(modelfile, drawn)
            with pytest.raises((DesignerError, Chosen)):
                synthesis_result.synthesise(modelfile, catalog)
        except Exception as defect:
            raise AssertionError(f"{seed}:\n{text}") from defect
    assert sound >= SOUND * EACH
