"""Only what the scene requires: parts, modes, vectors and draws of models that lack something.

What is expected is counted by hand from the equations of motion; nothing here asks the rule that
made the circuit.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass

import numpy as np
import pytest

from designer.catalog.parts_catalog import load_catalog
from designer.circuit import build, paper_values, terms as matching
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit, Excitation, Resistor
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.clearance import Clearance
from designer.model.model import Dimensionless
from designer.model.response_table import Response
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings, write
from designer.spice.numerics_gate import GateSubject
from designer.spread.spread import Spread
from designer.verdicts.exact_circuit import block
from designer.verdicts.verdict import Question, StudyPlan
from tests.shared.stages import one_sided, rectifier, stage

CATALOG = load_catalog()
OPAMP = CATALOG.opamp("TL074C")
STOP = Clearance.even(0, 19.0, 0.25)
PAPER = {"m": 0.5, "k": 0.5, "k0": 0.95, "c": 0.5, "zeta": 0.1, "f20": 0.0, "b": 0.25}
FREQUENCY, AMPLITUDE = 355.88, 1.2346
LINEAR = {f"R{i}" for i in (1, 2, 3, 4, 5, 7, 8, 9, 10, 11)}
INVERTERS = {f"R{i}" for i in range(100, 108)}
SATURATING = {"R50", *(f"R{i}" for i in range(200, 211))}


@dataclass(frozen=True)
class Scene:
    """resistors, sections, diodes, references : what has to be there. modes : of the circuit;
    of_model : of the model."""

    model: Dimensionless
    circuit: Circuit
    resistors: frozenset[str]
    sections: int
    modes: int
    of_model: int
    diodes: int = 0
    references: int = 0
    free_ends: frozenset[str] = frozenset()
    """Outputs of the stage that reach one limit at the stop and must not reach the other."""


def of(**changed: object) -> Dimensionless:
    return Dimensionless(**(PAPER | changed))  # type: ignore[arg-type]


def plain(model: Dimensionless) -> Circuit:
    return paper_values.circuit(model, paper_values.way(model), OPAMP)


def scenes() -> dict[str, Scene]:
    """The paper's case and what is left of it without one thing after the other.

    Linear part: v1' and v3' take one resistor each, v2' and v4' one for each of four terms, the
    generator one. Signs: v2, v4 for the integrators, v3 and v1 for the coupling: four inverters of
    two resistors. Sections: four integrators, four inverters, the stage.
    """
    with_r6 = frozenset(LINEAR | INVERTERS | {"R6"})
    with_r12 = frozenset(LINEAR | INVERTERS | {"R12"})
    half = frozenset({"R50", "R200", "R201", "R202", "R206"})
    # The second half, and the two resistors that keep the halves apart: one alone needs none.
    other = frozenset({"R203", "R204", "R205", "R207", "R208", "R209"})
    return {
        "the paper's": Scene(of(), plain(of()), with_r6 | SATURATING, 12, 3, 3),
        "no damper from M2 to ground": Scene(
            of(c=0.0), plain(of(c=0.0)), with_r6 | SATURATING, 12, 3, 3
        ),
        "f20 = 1": Scene(of(f20=1.0), plain(of(f20=1.0)), with_r12 | SATURATING, 12, 3, 3),
        "k0 = 0": Scene(of(k0=0.0), plain(of(k0=0.0)), with_r6, 8, 1, 1),
        "k0 = 0 and f20 = 1": Scene(
            of(k0=0.0, f20=1.0), plain(of(k0=0.0, f20=1.0)), with_r12, 8, 1, 1
        ),
        "one stop": Scene(
            of(sides="upper"),
            stage("saturation", "upper", one_sided()),
            with_r6 | SATURATING | {"R211", "R212"},  # which shift the range to the stop
            12,
            2,
            2,
            free_ends=frozenset({"w2"}),
        ),
        "one stop, rectifier": Scene(
            of(sides="upper"),
            stage("rectifier", "upper", rectifier()),
            with_r6 | half,
            9,
            3,
            2,
            2,
            1,
        ),
        "rectifier": Scene(
            of(), stage("rectifier", "both", rectifier()), with_r6 | half | other, 10, 5, 3, 4, 2
        ),
    }


NAMES = tuple(scenes())


@pytest.mark.parametrize("name", NAMES)
def test_parts(name: str) -> None:
    scene = scenes()[name]
    circuit = scene.circuit
    assert {r.name for r in circuit.resistors} == scene.resistors
    assert [c.name for c in circuit.capacitors] == ["C1", "C2", "C3", "C4"]
    assert len(circuit.sections) == scene.sections
    assert len(circuit.packages) == -(-scene.sections // 4)
    assert len(circuit.diodes) == scene.diodes
    assert len(circuit.references) == scene.references
    counted = sum(map(len, (circuit.resistors, circuit.capacitors, circuit.sections)))
    assert len(circuit.parts) == counted + scene.diodes + scene.references
    met = Counter(net for part in circuit.parts for net in part.nets)
    met.update([circuit.generator.net, *(rail.net for rail in circuit.rails)])
    assert {net for net in circuit.nets if met[net] < 2} == set()


def test_a_damping_that_is_zero_has_no_part() -> None:
    """M1 to ground only: neither coupling nor damping on M2, so R3, R8 and R9 are not there."""
    terms = matching.terms([[0.2, 0.0], [0.0, 0.0]], [[1.0, -1.0], [-1.0, 2.0]], [1.0, 0.0])
    values = paper_values.corrected()
    circuit = build.build(terms, values, OPAMP, supply=15.0, saturation=13.0, clearances=(STOP,))
    wanted = (LINEAR - {"R3", "R8", "R9"}) | INVERTERS | SATURATING | {"R6"}
    assert {r.name for r in circuit.resistors} == wanted
    into = [r for r in circuit.resistors if "s4" in (r.a, r.b)]
    assert {r.name for r in into} == {"R10", "R11"}


def test_a_sign_that_nothing_needs_has_no_inverter() -> None:
    """Without a coupling spring from M2 to M1 (a matrix that is not a mechanism's, but a rule is a
    rule) nothing takes -v3."""
    terms = matching.terms([[0.2, -0.2], [-0.2, 0.4]], [[1.0, 0.0], [-1.0, 2.0]], [1.0, 0.0])
    circuit = build.build(terms, paper_values.corrected(), OPAMP, supply=15.0, saturation=13.0)
    names = {r.name for r in circuit.resistors}
    assert {"R104", "R105"}.isdisjoint(names)
    assert "R5" not in names
    assert "v3n" not in circuit.nets
    assert len(circuit.sections) == 4 + 3


def drive(scene: Scene) -> tuple[Excitation, Drive]:
    excitation = Excitation(FREQUENCY * 1.55, AMPLITUDE)
    return excitation, excitation.drive


@pytest.mark.parametrize("name", NAMES)
def test_modes_that_are_built(name: str) -> None:
    """From rest to the attractor: no mode of a stop that is not there, none of a clipped op-amp."""
    scene = scenes()[name]
    system = scene.model.second_order().piecewise_linear()
    settle(Flow(system, Drive(1.55)), np.zeros(4))
    assert system.built == scene.of_model
    circuit = Reduction(scene.circuit, nominal_board(scene.circuit)).system()
    flow = Flow(circuit, Drive(2.0 * np.pi * 300.0, -1e-3))
    flow.run(np.zeros(4), 5)
    resting = circuit.built
    assert resting <= scene.modes
    assert not any(mode.clipped for mode in circuit._modes.values())
    sides = {side for mode in circuit._modes.values() for side in mode.sides}
    there = {"both": {-1, 0, 1}, "upper": {0, 1}}[scene.model.sides] if scene.model.k0 else set()
    assert sides <= there
    assert len(circuit.working) == (scene.modes if scene.model.k0 else 1)


@pytest.mark.parametrize("name", NAMES)
def test_vectors_that_ngspice_keeps(name: str) -> None:
    """A study asks for the four states, the generator and what clips where the scene has no limit:
    the four inverters, and the end of a one-sided stage that is no stop."""
    scene = scenes()[name]
    reduction = Reduction(scene.circuit, nominal_board(scene.circuit))
    excitation, on = drive(scene)
    orbit = settle(Flow(reduction.system(), on), np.zeros(4))
    settings = SolverSettings("trap", 1e-5)
    job = numerics_gate.job(GateSubject(reduction, excitation, orbit), settings)
    judged = {"v1", "v2", "v3", "v4", "vg", "v1n", "v2n", "v3n", "v4n"} | scene.free_ends
    assert set(job.signals) == saved(job.netlist) == judged
    text = write(
        scene.circuit, reduction.board, excitation, settings, title="a deck", stop_time=1.0
    )
    stages = {"fv"} if scene.model.k0 else set()
    assert saved(text) - {"v1", "v2", "v3", "v4", "vg"} == stages
    top = text[: text.index(".subckt")]
    words = [line.split()[0] for line in top.splitlines() if line[0].isalpha()]
    rails = {"VCC", "VEE"} if scene.references or "R211" in scene.resistors else set()
    assert set(words) >= {p.name for p in scene.circuit.parts if isinstance(p, Resistor)}
    assert {w for w in words if w.startswith("V")} - {"VM1", "VR1", "VR2"} <= rails


def saved(text: str) -> set[str]:
    (line,) = (one for one in text.splitlines() if one.startswith(".save"))
    return set(re.findall(r"v\((\w+)\)", line))


@pytest.mark.parametrize("name", NAMES)
def test_numbers_that_are_drawn(name: str) -> None:
    """One for each passive part and reference, three for each section; none for what is not
    there."""
    scene = scenes()[name]
    spread = Spread.bench_1(OPAMP, 0.01, 0.01)
    drawn = spread.coordinates(scene.circuit)
    passives = len(scene.resistors) + 4 + scene.references
    assert len(drawn) == len(set(drawn)) == passives + 3 * scene.sections
    known = {p.name for p in scene.circuit.parts}
    assert {each.split(".")[0] for each in drawn} <= known


def test_a_question_costs_one_answer_a_board() -> None:
    """Without stops too: as many answers as boards, and no run beyond the first settling."""
    scene = scenes()["k0 = 0"]
    excitation, on = drive(scene)
    orbit = settle(
        Flow(Reduction(scene.circuit, nominal_board(scene.circuit)).system(), on), np.zeros(4)
    )
    spec = Response(1.55)
    plan = StudyPlan(
        scene.circuit,
        Spread.bench_1(OPAMP, 0.01, 0.01),
        1,
        5,
        (Question(spec, excitation, orbit, None),),
    )
    answers = block(plan, range(5), 1)
    assert [(a.sample, a.question) for a in answers] == [(i, 0) for i in range(5)]
    assert {a.response for a in answers} == {"1-0-0"}
