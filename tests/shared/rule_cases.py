"""For each rule on a circuit a design that breaks it, and a near miss that keeps it.

All of them start from one design for the paper's case, so each pair differs in one figure only.
Where the limit is a data sheet's figure, the op-amp's is moved to either side of what the circuit
needs; where it is the tool's own, the circuit is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from designer.board.board_parts import board_circuit
from designer.board.component import Component, components
from designer.board.pins import Pin
from designer.catalog.design_rule import RuleOutcome
from designer.catalog.fab import FabLimits, fab_limits
from designer.catalog.fields import Figure
from designer.check.synthesis_result import Synthesis
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.design import Certificate, Design
from designer.circuit.netlist import (
    GROUND,
    Capacitor,
    Circuit,
    Reference,
    Resistor,
    Section,
)
from designer.design_rules import run_rules
from designer.design_rules.rule_subject import RuleSubject
from designer.model.find_responses import find
from designer.model.mechanics import MechanicalModel
from designer.model.model_file import parse_model_file
from tests.shared.exact_circuits import Scale, exact_circuit
from tests.shared.model_text import PAPER_TABLE
from tests.shared.stages import CATALOG, PAPER, bought, rectifier, stage


@cache
def generic() -> FabLimits:
    """What most makers of boards make."""
    return fab_limits([], CATALOG.folders)


TEXT = (
    """
format = 1
title = "<b>rules</b> & ]]> ${X}"
"""
    + PAPER_TABLE
    + """\
[[response]]
omega = 1.55
expect = "1-1-1"
[circuit]
dead_zone = "rectifier"
"""
)
Look = Callable[[], RuleOutcome]
OF_THE_CIRCUIT = ("reduction", "operating", "stuck", "forces")


@cache
def base() -> RuleSubject:
    """The rectifying design, with one response."""
    return subject_of(stage("rectifier", "both", bought(rectifier())), PAPER, TEXT)


def subject_of(circuit: Circuit, model: MechanicalModel, text: str) -> RuleSubject:
    """What the rules look at of a circuit for this model, with the model file's responses."""
    modelfile = parse_model_file(text)
    design = Design(
        model=model,
        circuit=circuit,
        errors=coefficient_errors(circuit, model.second_order()),
        certificate=Certificate("bound", 0.0, "made by hand"),
        conditions={},
        solver={},
        seconds=0.0,
    )
    made = Synthesis(modelfile, CATALOG, find(model, modelfile.responses), design)
    fitted, choice = board_circuit(made)
    return RuleSubject(made, fitted, components(fitted, CATALOG, choice))


def with_circuit(circuit: Circuit) -> RuleSubject:
    """The same design on other parts."""
    return RuleSubject(base().synthesis, circuit, base().components)


def with_components(change: Callable[[Component], Component]) -> RuleSubject:
    """The same design with every component changed."""
    changed = RuleSubject(base().synthesis, base().circuit, tuple(map(change, base().components)))
    # The circuit is the same: what it does is not computed again.
    changed.__dict__.update({n: v for n, v in vars(base()).items() if n in OF_THE_CIRCUIT})
    return changed


def warm(celsius: float) -> RuleSubject:
    """The same design on boards from 25 °C to this temperature."""
    made = base().synthesis
    catalog = made.catalog.at((25.0, celsius))
    return RuleSubject(replace(made, catalog=catalog), base().circuit, base().components)


def with_figure(name: str, **bounds: float | None) -> RuleSubject:
    """The same design with another figure of the op-amp."""
    circuit = base().circuit
    assert circuit.figures is not None
    known = {"min": None, "typ": None, "max": None} | bounds
    figure = Figure(known["min"], known["typ"], known["max"], "a test")
    changed: dict[str, Any] = {name: figure, "swing_2k": None}
    figures = replace(circuit.figures, **changed)
    return with_circuit(replace(circuit, figures=figures))


def with_values(**values: float) -> RuleSubject:
    """The same design with other values of parts [Ω, F]."""
    return with_circuit(valued(base().circuit, values))


def valued(circuit: Circuit, values: Mapping[str, float]) -> Circuit:
    """A circuit with other values of parts."""
    parts = tuple(
        replace(p, value=values[p.name])
        if isinstance(p, Resistor | Capacitor) and p.name in values
        else p
        for p in circuit.parts
    )
    return replace(circuit, parts=parts)


def with_part(part: Resistor | Section) -> RuleSubject:
    """The same design with one part more, or in the place of the one of the same name."""
    circuit = base().circuit
    parts = tuple(p for p in circuit.parts if p.name != part.name)
    return with_circuit(replace(circuit, parts=(*parts, part)))


def rated(name: str, words: str) -> RuleSubject:
    """The same design with another rating of one component."""

    def change(c: Component) -> Component:
        if c.reference != name or c.bought is None:
            return c
        return replace(c, bought=replace(c.bought, rating=words))

    return with_components(change)


def rewired(pins: dict[tuple[str, str], str]) -> RuleSubject:
    """The same design with pins (reference, number) on other nets."""

    def change(c: Component) -> Component:
        def moved(pin: Pin) -> Pin:
            return replace(pin, net=pins.get((c.reference, pin.number), pin.net))

        return replace(c, pins=tuple(moved(pin) for pin in c.pins))

    return with_components(change)


def look(id_: str, subject: RuleSubject) -> RuleOutcome:
    """What the rule of this id says."""
    return run_rules.look(id_, subject)


def value(id_: str) -> float:
    """What the rule of this id finds on the design as it is."""
    return look(id_, base()).value


def _without_protection() -> Circuit:
    circuit = base().circuit
    kept = tuple(p for p in circuit.fittings if not p.name.startswith("D"))
    return replace(circuit, fittings=kept)


def _drive(ohms: float) -> RuleSubject:
    """The generator's resistor, without the diodes behind it."""
    return with_circuit(valued(_without_protection(), {"R6": ohms}))


def _kind(names: set[str], kind: str) -> RuleSubject:
    return with_components(lambda c: replace(c, kind=kind) if c.reference in names else c)


def _renamed(old: str, new: str) -> RuleSubject:
    return with_components(lambda c: replace(c, reference=new) if c.reference == old else c)


def _farads(reference: str, farads: float) -> RuleSubject:
    return with_components(lambda c: replace(c, quantity=farads) if c.reference == reference else c)


def _needing(times: float) -> RuleSubject:
    """The same with references that need so many times the current that they do."""
    circuit = base().circuit
    parts = tuple(
        replace(p, least=times * p.least) if isinstance(p, Reference) else p for p in circuit.parts
    )
    changed = with_circuit(replace(circuit, parts=parts))
    changed.__dict__.update({n: v for n, v in vars(base()).items() if n in OF_THE_CIRCUIT})
    return changed


def _on_v1(ohms: float) -> RuleSubject:
    """A resistor from v1 to ground, so that what v1 carries is this load in all [Ω]."""
    carried = next(
        1.0 / s.load for s in _stages() if s.section.output == "v1"
    )  # what is there already
    return with_part(Resistor("R999", "v1", GROUND, 1.0 / (1.0 / ohms - carried), "a load"))


def _stages() -> Any:
    from designer.circuit.noise_gains import stages

    return stages(base().circuit)


def _leaking(share: float) -> RuleSubject:
    """Rails that leak so much over the board, for the leakage alone: what saturates and what is
    driven stays. The diodes' part does not grow with the rails."""

    def on(volts: float) -> RuleSubject:
        return with_circuit(replace(base().circuit, supply=volts))

    once, twice = (look("leakage-force", on(volts)).value for volts in (1e3, 2e3))
    return on(1e3 + 1e3 * (share - once) / (twice - once))


def graded(grade: float) -> RuleSubject:
    made = base().synthesis
    spec = replace(made.modelfile.circuit, resistor_grade=grade)
    made = replace(made, modelfile=replace(made.modelfile, circuit=spec))
    # The saturating stage: the rectifier leaves next to nothing.
    from tests.circuit.test_reduction import EXACT

    circuit = stage("saturation", "both", EXACT)
    return RuleSubject(made, circuit, _of_grade(base().components, grade))


BENT = """
format = 2
[[mass]]
name = "a"
mass = 1.0
[[spring]]
between = ["a", "ground"]
stiffness = 1.0
[[damper]]
between = ["a", "ground"]
damping = 0.2
[[law]]
name = "K"
between = ["a", "ground"]
points = POINTS
[[force]]
on = "a"
amplitude = 1.0
[[response]]
omega = 2.3
[circuit]
dead_zone = "rectifier"
"""
"""A mass on a spring, and on a law."""
HOLDING = ((-1.0, -6.0), (0.5, 3.0), (1.0, 3.0))
"""A law that is six times as stiff as the spring beside it, and past 0.5 no more."""


@cache
def bent(grade: float, points: tuple[tuple[float, float], ...] = HOLDING) -> RuleSubject:
    """The exact circuit of ``BENT`` with a law through these points, of resistors of this grade."""
    text = BENT.replace("POINTS", str([list(point) for point in points]))
    model = parse_model_file(text).model
    circuit = exact_circuit(model.second_order(), Scale(1e-3, np.array([4.0, 3.0]), 2.0))
    circuit = valued(replace(circuit, saturation=13.0), bought(circuit.values))
    subject = subject_of(circuit, model, text)
    return RuleSubject(subject.synthesis, subject.circuit, _of_grade(subject.components, grade))


def _of_grade(parts: Iterable[Component], grade: float) -> list[Component]:
    return [
        replace(c, bought=replace(c.bought, grade=grade))
        if c.kind == "resistor" and c.bought
        else c
        for c in parts
    ]


def _deviation() -> float:
    return look("dead-zone-stiffness", graded(0.01)).value / 0.01


def _bent_deviation() -> float:
    return look("far-slope", bent(0.01)).value / 0.01


def _watts(rule: str, share: float) -> RuleSubject:
    """The resistor that has most of its rating, with a rating that makes it this share."""
    worst = look(rule, base())
    assert worst.value > 0.0
    name = worst.where.split()[0]
    return rated(name, f"{0.1 * worst.value / share:.12g}W, 75V")


def _volts(share: float) -> RuleSubject:
    worst = look("capacitor-voltage", base())
    name = worst.where.split()[0]
    known = next(c for c in base().components if c.reference == name)
    assert known.bought is not None
    rating = float(known.bought.rating.removesuffix("V"))
    return rated(name, f"{rating * worst.value / share:.12g}V")


def _absorbing(share: float) -> RuleSubject:
    worst = look("absorption-force", base())
    farads = base().circuit.values[worst.where]
    return with_values(**{worst.where: farads * share / worst.value})


INVERTER = Section("U1B", "i2", GROUND, "v2n", "inverter of v2")

PAIRS: dict[str, tuple[Look, Look]] = {
    "feedback": (
        # 1/101 and 1/98 of the output comes back.
        lambda: look("feedback", with_values(R102=1e3, R103=100e3)),
        lambda: look("feedback", with_values(R102=1e3, R103=97e3)),
    ),
    "drivers": (
        lambda: look("drivers", rewired({("U1", "7"): "v1"})),
        lambda: look("drivers", rewired({("R4", "1"): "v2"})),
    ),
    "floating-input": (
        lambda: look("floating-input", _kind({"R100", "R101"}, "capacitor")),
        lambda: look("floating-input", _kind({"R100"}, "capacitor")),
    ),
    "single-pin": (
        lambda: look("single-pin", rewired({("R4", "1"): "alone"})),
        lambda: look("single-pin", rewired({("R4", "1"): "pair", ("R5", "1"): "pair"})),
    ),
    "references": (
        lambda: look("references", _renamed("R4", "R5")),
        lambda: look("references", _renamed("R4", "R4A")),
    ),
    "supply-pins": (
        lambda: look("supply-pins", rewired({("U1", "4"): "vee", ("U1", "11"): "vcc"})),
        lambda: look("supply-pins", rewired({("J1", "1"): "vee", ("J1", "3"): "vcc"})),
    ),
    "decoupling": (
        lambda: look("decoupling", _farads("C903", 99e-9)),
        lambda: look("decoupling", _farads("C903", 101e-9)),
    ),
    "swing": (
        lambda: look("swing", with_figure("swing", min=0.999 * value("swing"))),
        lambda: look("swing", with_figure("swing", min=1.001 * value("swing"))),
    ),
    "load": (lambda: look("load", _on_v1(1.99e3)), lambda: look("load", _on_v1(2.01e3))),
    "output-current": (
        lambda: look(
            "output-current", with_figure("output_current", min=0.999 * value("output-current"))
        ),
        lambda: look(
            "output-current", with_figure("output_current", min=1.001 * value("output-current"))
        ),
    ),
    "fault-current": (
        # 10 V over it, and the 10 mA that the data sheet allows into an input.
        lambda: look("fault-current", _drive(0.99e3)),
        lambda: look("fault-current", _drive(1.01e3)),
    ),
    "power": (
        lambda: look("power", _watts("power", 0.501)),
        lambda: look("power", _watts("power", 0.499)),
    ),
    "power-stuck": (
        lambda: look("power-stuck", _watts("power-stuck", 1.001)),
        lambda: look("power-stuck", _watts("power-stuck", 0.999)),
    ),
    "capacitor-voltage": (
        lambda: look("capacitor-voltage", _volts(0.801)),
        lambda: look("capacitor-voltage", _volts(0.799)),
    ),
    "common-mode": (
        lambda: look("common-mode", _common_mode(0.999)),
        lambda: look("common-mode", _common_mode(1.001)),
    ),
    "bulk": (
        # At 15 V of 25 V the bulk keeps 52 %, over three packages' 100 nF at a rail.
        lambda: look("bulk", _farads("C901", 1.999 * 300e-9 / 0.52)),
        lambda: look("bulk", _farads("C901", 2.001 * 300e-9 / 0.52)),
    ),
    "reference-current": (
        lambda: look("reference-current", _needing(1.001 * value("reference-current"))),
        lambda: look("reference-current", _needing(0.999 * value("reference-current"))),
    ),
    "temperature": (
        lambda: look("temperature", warm(70.02)),
        lambda: look("temperature", warm(70.0)),
    ),
    "slew": (
        lambda: look("slew", with_figure("slew", min=8e6 * value("slew") / 0.201)),
        lambda: look("slew", with_figure("slew", min=8e6 * value("slew") / 0.199)),
    ),
    "gain-bandwidth": (
        lambda: look(
            "gain-bandwidth", with_figure("gbw", min=0.999 * value("gain-bandwidth") / 0.05)
        ),
        lambda: look(
            "gain-bandwidth", with_figure("gbw", min=1.001 * value("gain-bandwidth") / 0.05)
        ),
    ),
    "offset-force": (
        lambda: look("offset-force", with_figure("offset", max=10e-3 * _up("offset-force"))),
        lambda: look("offset-force", with_figure("offset", max=10e-3 * _down("offset-force"))),
    ),
    "bias-force": (
        lambda: look("bias-force", with_figure("bias", max=200e-12 * _up("bias-force"))),
        lambda: look("bias-force", with_figure("bias", max=200e-12 * _down("bias-force"))),
    ),
    "noise-force": (
        lambda: look("noise-force", with_figure("noise", typ=2e-3 * _quiet())),
        lambda: look("noise-force", with_figure("noise", typ=1.9e-3 * _quiet())),
    ),
    "leakage-force": (
        lambda: look("leakage-force", _leaking(0.01001)),
        lambda: look("leakage-force", _leaking(0.00999)),
    ),
    "absorption-force": (
        lambda: look("absorption-force", _absorbing(0.01001)),
        lambda: look("absorption-force", _absorbing(0.00999)),
    ),
    "dead-zone-stiffness": (
        lambda: look("dead-zone-stiffness", graded(0.51 / _deviation())),
        lambda: look("dead-zone-stiffness", graded(0.49 / _deviation())),
    ),
    "far-slope": (
        lambda: look("far-slope", bent(0.51 / _bent_deviation())),
        lambda: look("far-slope", bent(0.49 / _bent_deviation())),
    ),
}
"""By id: what breaks the rule, and what just keeps it."""


def _up(id_: str) -> float:
    """By how much something in proportion has to grow to be a thousandth past the limit."""
    found = look(id_, base())
    return 1.001 * found.limit / found.value


def _down(id_: str) -> float:
    found = look(id_, base())
    return 0.999 * found.limit / found.value


def _quiet() -> float:
    """Noise density [V/√Hz] per unit of force, of op-amps so noisy that no resistor counts."""
    return 1e-3 / look("noise-force", with_figure("noise", typ=1e-3)).value


def _common_mode(share: float) -> RuleSubject:
    """A range of this share of what the inputs need."""
    met = base().operating
    nets = [s.inverting for s in base().circuit.sections]
    most = max(max(met.high[n].value, met.low[n].value) for n in nets)
    return with_figure("common_mode", min=-share * most, max=share * most)
