"""Does the netlist compute the model's equation? Asked of ngspice, by ``.ac`` and ``.dc``.

The deck is the one that is simulated in time, but for the generator's line, the analysis, and
op-amps without finite gain and bias, as the matching conditions and the coefficient errors assume.
A constant force decides where the mass rests, so the clearance is open or closed without a change
of the circuit:

- ``.ac`` from generator to v1 over a decade around resonance, the clearance open (no force) and
  closed at each stop, against the model's transfer function at the design's scales;
- ``.dc`` of the generator, slowly as it were: v1 and the nonlinear stage's output fv follow the
  statics. Straight lines through the dead zone and each contact give slope, thresholds and what
  slope is left, against Eq. (20).

A response function may differ from the model's by what the coefficient errors explain, to first
order in each, and by `FLOOR` beside it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array
from designer.base.progress import doing
from designer.circuit.design import Design
from designer.circuit.netlist import Excitation, nominal_board
from designer.circuit.noise_gains import conductance
from designer.circuit.reduction import Reduction
from designer.model.find_responses import ModelResponse, peaks
from designer.model.mechanics import SecondOrderSystem
from designer.spice import deck
from designer.spice.convergence_aids import did_not_converge
from designer.spice.deck import SolverSettings
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed, SpiceJob, Waveforms

Complex = NDArray[np.complex128]

FLOOR = 1e-3
"""What may differ beside the coefficient errors."""
POINTS = 50
"""Points of an ``.ac`` analysis; a decade. Of each stretch of a ``.dc`` analysis likewise."""
DEPTH = 0.5
"""Penetration at the far end of a contact's line, over the clearance, where the responses go as
deep; the near end lies at `NEAR` of that."""
NEAR = 0.1
INSIDE = 0.9
"""Of the force that closes the clearance: how far the dead zone's line goes."""
ROOM = 0.8
"""Of the saturation: how far any state may be pushed by the constant force."""
STAGE = "fv"
"""Net of the nonlinear stage's output."""


@dataclass(frozen=True)
class EquationFinding:
    """One comparison."""

    name: str
    """What is compared; see ``EquationCheck``."""
    deviation: float
    """Dimensionless deviation; nan where ngspice gave no answer."""
    bound: float
    """Largest deviation that passes, dimensionless."""
    reason: str = ""
    """Why ngspice gave no answer; the finding is then no."""

    @property
    def passed(self) -> bool:
        return bool(self.deviation <= self.bound)

    def __str__(self) -> str:
        return f"{self.name}: {self.reason or f'{self.deviation:.2g}, bound {self.bound:.2g}'}"


@dataclass(frozen=True)
class EquationCheck:
    """Whether ngspice's circuit obeys the wanted equations."""

    findings: tuple[EquationFinding, ...]
    """"transfer, open", "transfer, upper contact" … are the largest |H/H_model - 1| over the decade
    from ``low`` to ``high``; "slope …" |ln(realised/wanted)| of fv against v1 in contact;
    "threshold …" |realised/wanted - 1|; "leftover slope" that of the dead zone in units of K1."""
    low: float = field(default=float("nan"))
    """Lower end of the decade [Hz]."""
    high: float = field(default=float("nan"))
    """Upper end of the decade [Hz]."""

    @property
    def passed(self) -> bool:
        return all(f.passed for f in self.findings)

    @property
    def open(self) -> bool:
        """Whether all that speaks against it is that ngspice gave no answer."""
        return not self.passed and all(f.passed or f.reason for f in self.findings)

    @property
    def worst(self) -> EquationFinding:
        """The finding nearest to its bound, or past it; one without an answer first."""
        return max(self.findings, key=lambda f: np.inf if f.reason else f.deviation / f.bound)

    @property
    def problem(self) -> str:
        """What did not pass, in words; empty where all did."""
        if self.passed:
            return ""
        verdict = "the netlist does not compute the model's equation"
        if self.open:
            verdict = "whether the netlist computes the model's equation is not to be trusted here"
        return f"{verdict}: {'; '.join(str(f) for f in self.findings if not f.passed)}"

    @classmethod
    def read(cls, record: Mapping[str, Any]) -> EquationCheck:
        """From what `as_dict` made, in JSON."""

        def number(value: float | None) -> float:
            return float("nan") if value is None else value

        return cls(
            tuple(
                EquationFinding(f["name"], number(f["deviation"]), number(f["bound"]), f["reason"])
                for f in record["findings"]
            )
        )

    def as_dict(self) -> dict[str, Any]:
        return {
            "passed": self.passed,
            "low_hz": self.low,
            "high_hz": self.high,
            "findings": [{**f.__dict__, "passed": f.passed} for f in self.findings],
        }


@dataclass(frozen=True)
class _Rest:
    """Where the mass rests: contact 0, 1, -1 and the force [model] on the way there."""

    contact: int
    near: float
    far: float


def check(design: Design, found: Sequence[ModelResponse], pool: SpicePool) -> EquationCheck:
    """Compare the design's deck, in ngspice, with its model.

    found : responses that the model shows; they say how deep contacts are.

    Raises
    ------
    EnvironmentMissing : see `SpicePool.map`.
    """
    model = design.model.second_order()
    rests = _rests(design, model, found)
    centre = _resonance(model)
    low, high = (design.errors.scales.frequency(centre * 10.0**e) for e in (-0.5, 0.5))
    curve = rests if design.circuit.stops else ()

    def jobs(*, nodeset: bool) -> list[SpiceJob[Waveforms]]:
        ac = [_ac(design, rest, low, high, nodeset=nodeset) for rest in rests]
        return ac + [_dc(design, rest, nodeset=nodeset) for rest in curve]

    answers = {}
    first = jobs(nodeset=True)
    for number, answer in pool.map(first):
        answers[number] = answer
        doing(f"{len(answers)} of {len(first)} runs")
    # From the nodeset where a rectifier rests, its diodes' drop a constant, ngspice may end in vain
    # where it finds the operating point by itself.
    again = [i for i, answer in answers.items() if _unconverged(answer)]
    bare = jobs(nodeset=False)
    answers |= {again[k]: answer for k, answer in pool.map(bare[i] for i in again)}
    findings = [_transfer(design, model, rest, answers[i]) for i, rest in enumerate(rests)]
    lines = {rest.contact: answers[len(rests) + i] for i, rest in enumerate(curve)}
    return EquationCheck((*findings, *(_curve(design, model, lines) if lines else ())), low, high)


# ---------------------------------------------------------------------------------------------
# What the model says


def transfer(model: SecondOrderSystem, omega: Array, contact: int) -> Complex:
    """(k,) displacement of M1 per unit of drive at ``omega`` (k,), resting in this contact."""
    return np.array([_impedance(model, w, contact)[1][0] for w in omega])


def explained(model: SecondOrderSystem, omega: Array, contact: int) -> Array:
    """(k,) largest |dH/H| for a relative change of 1 in every coefficient of the equations.

    Each term of the impedance Z counts with |L_i Z_ij R_j/H|, where H = R_1, R = Z⁻¹ force and L
    is the first row of Z⁻¹; K1 twice, since the dead zone's leftover slope is measured in it, and
    damping twice, since a displacement's integrator has an error of its own: with v = x'/κ the
    equation is x''/κ + d v + … = force.
    """
    out = np.zeros(len(omega))
    for k, w in enumerate(omega):
        terms, right = _impedance(model, w, contact)
        left = np.linalg.inv(sum(terms))[0]
        size = sum(float((np.abs(left)[:, None] * np.abs(t) * np.abs(right)).sum()) for t in terms)
        size += abs(left[0] * model.stiffness[0, 1] * right[0])
        size += float((np.abs(left)[:, None] * np.abs(terms[1]) * np.abs(right)).sum())
        out[k] = size / abs(right[0])
    return out


def _drive_error(design: Design, model: SecondOrderSystem, omega: Array, contact: int) -> Array:
    """(k,) |dH/H| that the drive explains: R6 and R12 share the force in a ratio of their own,
    which is no coefficient of the equations and not in their error."""
    wanted = model.force
    error = np.abs(np.where(wanted, design.errors.drive_gain * design.amplitude() - wanted, 0.0))
    out = np.zeros(len(omega))
    for k, w in enumerate(omega):
        terms, right = _impedance(model, w, contact)
        out[k] = float(np.abs(np.linalg.inv(sum(terms))[0]) @ error) / abs(right[0])
    return out


def _impedance(
    model: SecondOrderSystem, omega: float, contact: int
) -> tuple[list[Complex], Complex]:
    """Terms of Z = -ω²M + iωC + K + contact, and the displacements Z⁻¹ force."""
    terms = [
        -(omega**2) * np.diag(model.mass).astype(complex),
        1j * omega * model.damping.astype(complex),
        model.stiffness.astype(complex),
    ]
    if contact:
        stop = model.clearances[0]
        spring = np.zeros_like(terms[0])
        spring[stop.mass, stop.mass] = stop.first.stiffness
        terms.append(spring)
    return terms, np.linalg.solve(sum(terms), model.force.astype(complex))


def _resonance(model: SecondOrderSystem) -> float:
    """ω at which the open system's M1 moves most."""
    omega = np.geomspace(1e-2, 1e2, 4001)
    return float(omega[np.argmax(np.abs(transfer(model, omega, 0)))])


def _rests(
    design: Design, model: SecondOrderSystem, found: Sequence[ModelResponse]
) -> tuple[_Rest, ...]:
    """The dead zone and each contact, with constant forces that hold the mass there."""
    if not design.circuit.stops:
        return (_Rest(0, 0.0, 0.0),)
    stop, side = model.clearances[0], model.clearances[0].first
    volts, limit = design.errors.scales.volts, ROOM * design.circuit.saturation
    closed = model.stiffness.copy()
    closed[stop.mass, stop.mass] += side.stiffness
    by_force = np.linalg.solve(closed, model.force)
    by_stop = np.linalg.solve(closed, side.stiffness * side.gap * np.eye(model.size)[stop.mass])
    reach = peaks(design.model, found).penetration
    depth = min(DEPTH * side.gap, reach) if reach > 0.0 else NEAR * side.gap

    def force(depth: float) -> float:
        return float((side.gap + depth - by_stop[stop.mass]) / by_force[stop.mass])

    def pushed(depth: float) -> float:
        return float((np.abs(force(depth) * by_force + by_stop) * volts[0::2]).max())

    if pushed(depth) > limit > pushed(0.0):
        depth *= (limit - pushed(0.0)) / (pushed(depth) - pushed(0.0))
    zone = INSIDE * abs(force(0.0))
    contacts = [_Rest(s, s * force(NEAR * depth), s * force(depth)) for s in stop.positions]
    return (_Rest(0, -zone, zone), *contacts)


# ---------------------------------------------------------------------------------------------
# What ngspice is asked


def _deck(
    design: Design,
    source: str,
    analysis: str,
    generator: float,
    contact: int,
    *,
    nodeset: bool,
    turned: bool = False,
) -> str:
    """The deck that is simulated in time, with another generator line and analysis.

    generator, contact : at the first operating point [V]. nodeset : ngspice looks for that point
    from where the reduction says it is. Neither from there nor from zero does it find every point.
    turned : the generator's poles are exchanged, so that its voltage counts negative.
    """
    circuit = design.circuit
    board = nominal_board(circuit, ideal=True)
    try:
        known = rest(Reduction(circuit, board), generator, contact) if nodeset else []
    except ArithmeticError:  # a floating net: ngspice shall say it
        known = []
    resting = [".nodeset " + " ".join(f"v({n})={v!r}" for n, v in known)] if known else []
    text = deck.write(
        circuit,
        board,
        Excitation(1.0, 1.0),
        SolverSettings("trap", 1.0, reltol=1e-6, abstol=1e-14, vntol=1e-9),
        title="equation check",
        stop_time=1.0,
    )
    lines = []
    for line in text.splitlines():
        word = line.split(maxsplit=1)[0]
        if word == circuit.generator.name:
            poles = f"0 {circuit.generator.net}" if turned else f"{circuit.generator.net} 0"
            line = f"{circuit.generator.name} {poles} {source}"
        elif word == ".tran":
            line = "\n".join([*resting, analysis])
        lines.append(line)
    return "\n".join(lines) + "\n"


def rest(reduction: Reduction, generator: float, contact: int) -> list[tuple[str, float]]:
    """Every net with its voltage [V] where the circuit rests, in this contact, at a constant
    generator voltage; exact, since a mode is linear."""
    circuit = reduction.circuit
    key = circuit.rest
    if contact:
        key = circuit.carrying(dict(circuit.stops[0].contacts)[contact])
    mode = reduction.system().mode(key)
    x = np.linalg.solve(mode.A, -(mode.B * generator + mode.d))
    voltage = reduction.solution(key).voltage
    known = np.concatenate([x, [generator, 1.0]])
    return [(net, float(voltage[net] @ known)) for net in circuit.nets]


def _volts(design: Design, force: float) -> float:
    """Generator voltage of a model force: the integrators invert."""
    return -force * design.amplitude()


def _ac(
    design: Design, resting: _Rest, low: float, high: float, *, nodeset: bool
) -> SpiceJob[Waveforms]:
    held = 0.0 if resting.contact == 0 else _volts(design, 0.5 * (resting.near + resting.far))
    source, card = f"DC {held!r} AC 1", f".ac dec {POINTS} {low!r} {high!r}"
    text = _deck(design, source, card, held, resting.contact, nodeset=nodeset)
    return SpiceJob(text, (design.circuit.state_nets[0],), high * (1.0 - 1e-6), _whole, "ac")


def _dc(design: Design, resting: _Rest, *, nodeset: bool) -> SpiceJob[Waveforms]:
    """From the near end, where the stage carries least; upwards, as every sweep goes."""
    near, far = _volts(design, resting.near), _volts(design, resting.far)
    turned = far < near
    first, last = (-near, -far) if turned else (near, far)
    step = (last - first) / POINTS
    # Half a step more: the last point is not lost to rounding.
    card = f".dc {design.circuit.generator.name} {first!r} {last + 0.5 * step!r} {step!r}"
    nets = (design.circuit.state_nets[0], STAGE)
    text = _deck(design, "DC 0", card, near, resting.contact, nodeset=nodeset, turned=turned)
    return SpiceJob(text, nets, last - 0.01 * step, _whole, "dc")


def _unconverged(answer: Waveforms | SimulationFailed) -> bool:
    return isinstance(answer, SimulationFailed) and did_not_converge(answer)


def _whole(sweep: Waveforms) -> Waveforms:
    return sweep


# ---------------------------------------------------------------------------------------------
# What the two say of each other


def _transfer(
    design: Design, model: SecondOrderSystem, resting: _Rest, answer: Waveforms | SimulationFailed
) -> EquationFinding:
    name = f"transfer, {_place(resting.contact)}"
    bound = FLOOR
    if isinstance(answer, SimulationFailed):
        return EquationFinding(name, float("nan"), bound, answer.reason)
    scales = design.errors.scales
    omega = 2.0 * np.pi * answer.axis * scales.seconds
    unit = -scales.volts[0] / design.amplitude()
    wanted = unit * transfer(model, omega, resting.contact)
    deviation = np.abs(answer.signals[design.circuit.state_nets[0]] / wanted - 1.0)
    known = design.errors.max_error * explained(model, omega, resting.contact)
    bounds = np.expm1(known + _drive_error(design, model, omega, resting.contact)) + FLOOR
    worst = int(np.argmax(deviation / bounds))
    return EquationFinding(name, float(deviation[worst]), float(bounds[worst]))


def _curve(
    design: Design, model: SecondOrderSystem, answers: dict[int, Waveforms | SimulationFailed]
) -> list[EquationFinding]:
    """Slope, threshold, leftover slope from straight lines through the stretches."""
    bound = design.errors.max_error + FLOOR
    lines: dict[int, Array] = {}
    findings = []
    for contact, sweep in answers.items():
        if isinstance(sweep, SimulationFailed):
            findings.append(
                EquationFinding(f"curve, {_place(contact)}", float("nan"), bound, sweep.reason)
            )
            continue
        v1, fv = (sweep.signals[n].real for n in (design.circuit.state_nets[0], STAGE))
        lines[contact] = np.polyfit(v1, fv, 1)
    if 0 not in lines:
        return findings
    wanted = _wanted_slope(design, model)
    leftover, level = lines.pop(0)
    for contact, (slope, offset) in lines.items():
        place = _place(contact)
        error = abs(np.log(slope / wanted)) if slope > 0.0 else np.inf
        findings.append(EquationFinding(f"slope, {place}", float(error), bound))
        threshold = contact * (level - offset) / (slope - leftover)
        # Both stops need not lie at the same distance: an offset of the generator centres them.
        stated = design.errors.scales.threshold_lower if contact < 0 else float("nan")
        gap = model.clearances[0].first.gap * design.errors.scales.volts[0]
        gap = stated if np.isfinite(stated) else gap
        findings.append(
            EquationFinding(f"threshold, {place}", float(abs(threshold / gap - 1.0)), bound)
        )
    share = float(abs(leftover / wanted) * model.relative_stiffness(model.clearances[0]))
    return [*findings, EquationFinding("leftover slope", share, bound)]


def _wanted_slope(design: Design, model: SecondOrderSystem) -> float:
    """fv per volt of v1 in contact: the model's stop at the design's scales, through R50."""
    circuit, scales, stop = design.circuit, design.errors.scales, model.clearances[0]
    velocity = 2 * stop.mass + 1
    capacitor = next(c for c in circuit.capacitors if c.name == circuit.states[velocity])
    rate = stop.first.stiffness / model.mass[stop.mass] / scales.seconds
    per_volt = scales.volts[velocity] / scales.volts[velocity - 1]
    return float(rate * per_volt * capacitor.value / conductance(circuit, STAGE, capacitor.minus))


def _place(contact: int) -> str:
    return {0: "open", 1: "upper contact", -1: "lower contact"}[contact]
