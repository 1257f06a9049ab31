"""Does the netlist compute the model's equation? Asked of ngspice, by ``.ac`` and ``.dc``.

The deck is the one that is simulated in time, but for the generator's line, the analysis, and
op-amps of gain `GAIN` and without bias, as matching conditions and coefficient errors assume.
A constant force decides where the masses rest, so each clearance is open or closed without a change
of the circuit (`static_rests`); a dead zone of velocities is open wherever the masses are held.
At rest a capacitor carries no current, which leaves ngspice all
integrators in one loop without a gain that it could follow, and often no operating point. So
beside each capacitor lies a source of the voltage that it has at rest, behind an inductor
(`HOLDING`): the operating point falls apart into single stages, and no frequency sees it.

- ``.ac`` from generator to the displacement of the first mass that it moves, over a decade around
  resonance, all clearances open and in each contact, against the model's transfer function at the
  design's scales;
- ``.dc`` of the generator, slowly as it were: the displacement in a clearance and its stage's
  output fv follow the statics. Straight lines through the dead zone and each contact give slope,
  thresholds and what slope is left, against Eq. (20).

A response function may differ from the model's by what the coefficient errors explain, to first
order in each, and by `FLOOR` beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array
from designer.base.progress import doing
from designer.circuit.board_values import nominal_board
from designer.circuit.design import Design
from designer.circuit.netlist import Excitation, Stop
from designer.circuit.noise_gains import conductance
from designer.circuit.reduction import Reduction
from designer.model.find_responses import ModelResponse, Reach, peaks
from designer.model.mechanics import SecondOrderSystem
from designer.spice import deck
from designer.spice.deck import SolverSettings
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed, SpiceJob, Waveforms

if TYPE_CHECKING:
    from designer.answers.study_answer import EquationCheckRow

DEPTH = 0.5
"""Penetration at the far end of a contact's line, over the clearance, where the responses go as
deep; the near end lies at `NEAR` of that."""
NEAR = 0.1
INSIDE = 0.9
"""Share of the force that closes the clearance up to which the dead zone's line goes."""
ROOM = 0.8
"""Share of the saturation up to which the constant force may push any state."""
STILL = 1e-9
"""Share of the largest displacement below which a displacement is none."""
ROUNDS = 8
"""How often the contacts of a rest are corrected before it counts as none."""


@dataclass(frozen=True)
class StaticRest:
    """Where the masses rest over a stretch of constant forces."""

    sides: tuple[int, ...]
    """The side of each dead zone that is in contact, 1 or -1; 0 where none is."""
    zone: int | None
    """Index of the dead zone whose contact is looked at; None where all are open."""
    near: float
    """The least force, over the drive's amplitude."""
    far: float
    """The greatest force, likewise."""

    @property
    def side(self) -> int:
        """The side of the contact that is looked at; 0 where all are open."""
        return 0 if self.zone is None else self.sides[self.zone]

    def place(self, model: SecondOrderSystem) -> str:
        """The contacts in words: "open", "upper contact", of several dead zones "upper contact
        A"."""
        word = {0: "open", 1: "upper contact", -1: "lower contact"}[self.side]
        if self.zone is None or len(model.dead_zones) == 1:
            return word
        return f"{word} {model.dead_zones[self.zone].name}"


def drive_of(model: SecondOrderSystem, channel: int = 0) -> Array:
    """(n,) forces of a channel of the drive at the model's own frequency, by which the generator is
    set."""
    return model.drive_force(model.own_frequency, channel)


def static_rests(
    design: Design, model: SecondOrderSystem, responses: Sequence[ModelResponse]
) -> tuple[StaticRest, ...]:
    """The dead zone and each contact, with constant forces that hold the masses there. A contact
    that no such force reaches, or a state that it would drive too far, is left out."""
    if not design.circuit.dead_zones:
        return (StaticRest((), None, 0.0, 0.0),)
    statics = _Statics(design, model, peaks(design.model, responses).reaches)
    still = statics.open()
    contacts = [
        statics.contact(k, side)
        for k, zone in enumerate(model.dead_zones)
        for side in zone.positions
        if zone.quantity == "displacement"
    ]
    return tuple(rest for rest in (still, *contacts) if rest is not None)


@dataclass(frozen=True)
class _Statics:
    """The statics of a model under multiples of its drive."""

    design: Design
    model: SecondOrderSystem
    reaches: tuple[Reach, ...]

    def displaced(self, sides: tuple[int, ...]) -> tuple[Array, Array]:
        """(n,) displacements per unit of drive and without it, in these contacts."""
        model = self.model
        closed, push = model.stiffness.copy(), model.constant.copy()
        for zone, side in zip(model.dead_zones, sides, strict=True):
            if side:
                back, stop = model.push(zone), dict(zone.sides)[side]
                closed += stop.stiffness * np.outer(back, model.displacement(zone))
                push = push + side * stop.stiffness * stop.gap * back
        by_force = np.asarray(np.linalg.solve(closed, drive_of(model)))
        return by_force, np.asarray(np.linalg.solve(closed, push))

    def _moved(self, sides: tuple[int, ...], zone: int) -> float:
        """A dead zone's displacement per unit of drive, in these contacts; 0 for rounding."""
        row, by_force = (
            self.model.displacement(self.model.dead_zones[zone]),
            self.displaced(sides)[0],
        )
        moved = float(row @ by_force)
        return moved if abs(moved) > STILL * float(np.abs(by_force).max()) else 0.0

    def force(self, sides: tuple[int, ...], zone: int, side: int, depth: float) -> float:
        """The force at which a displacement is so far past a stop, in these contacts."""
        row = self.model.displacement(self.model.dead_zones[zone])
        gap = dict(self.model.dead_zones[zone].sides)[side].gap
        by_force, without = self.displaced(sides)
        return float((side * (gap + depth) - row @ without) / (row @ by_force))

    def holds(self, sides: tuple[int, ...], force: float) -> tuple[int, ...]:
        """The contacts that there are where these would put the masses."""
        by_force, without = self.displaced(sides)
        x = force * by_force + without
        out = []
        for zone in self.model.dead_zones:
            z = float(self.model.displacement(zone) @ x)
            met = [side for side, stop in zone.sides if side * z > stop.gap]
            out.append(met[0] if met and zone.quantity == "displacement" else 0)
        return tuple(out)

    def leaves(self, sides: tuple[int, ...], force: float) -> bool:
        """Whether the circuit cannot rest in these contacts: an output would have to pass its
        limit, or a diode would turn, as that of a stage's other half does far past its clearance.
        """
        circuit, volts = self.design.circuit, -force * self.design.amplitude()
        reduction = Reduction(circuit, nominal_board(circuit, ideal=True))
        key = circuit.in_contact(sides)
        try:
            mode = reduction.system().mode(key)
        except ArithmeticError:  # a floating net: ngspice shall say it
            return False
        x = np.linalg.solve(mode.A, -(mode.B * volts + mode.d))
        by_state, by_drive, constant = mode.guard_rows
        if (by_state @ x + by_drive * volts + constant > 0.0).any():
            return True
        limits = circuit.output_limits()
        known, voltage = np.concatenate([x, [volts, 1.0]]), reduction.solution(key).voltage
        tops = [
            abs(float(voltage[section.output] @ known)) / limits[section.name]
            for section, position in zip(circuit.sections, key, strict=False)
            if not position
        ]
        return max(tops) > 1.0

    def open(self) -> StaticRest | None:
        """The rest with all dead zones open: up to near the force that closes the first one, either
        way, as far as the circuit rests there."""
        sides = (0,) * len(self.model.dead_zones)
        ends = []
        for k, zone in enumerate(self.model.dead_zones):
            moved = self._moved(sides, k)
            if zone.quantity == "velocity" or not moved:
                continue
            for side, _ in zone.sides:
                own = tuple(side * (j == k) for j in range(len(sides)))
                turn = side * np.sign(moved)
                ends.append((float(turn), self.force(own, k, side, 0.0)))
        high = min((end for turn, end in ends if turn > 0.0), default=None)
        low = max((end for turn, end in ends if turn < 0.0), default=None)
        if low is None and high is None:  # no constant force of the drive moves any displacement
            rests = self.holds(sides, 0.0) == sides and not self.leaves(sides, 0.0)
            return StaticRest(sides, None, 0.0, 0.0) if rests else None
        if low is None:
            low = -high if high > 0.0 else 2.0 * high  # type: ignore[operator]
        if high is None:
            high = -low if low < 0.0 else 2.0 * low
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        if half <= 0.0:
            return None
        near, far = middle - INSIDE * half, middle + INSIDE * half
        least = float(np.clip(0.0, near, far))
        near, far = (self._resting(sides, least, end) for end in (near, far))
        return StaticRest(sides, None, near, far)

    def _resting(self, sides: tuple[int, ...], least: float, force: float) -> float:
        """A force on the way from the least one to this at which the circuit rests."""
        for _ in range(ROUNDS):
            if not self.leaves(sides, force):
                break
            force = least + 0.5 * (force - least)
        return force

    def contact(self, zone: int, side: int) -> StaticRest | None:
        """The rest in contact with one stop, and with whichever others that takes."""
        zones = self.model.dead_zones
        stop = dict(zones[zone].sides)[side]
        size = abs(stop.gap) or max(reach.peak for reach in self.reaches)
        reach = self.reaches[zone].penetration
        wanted = min(DEPTH * size, reach) if reach > 0.0 else NEAR * size
        sides = tuple(side * (j == zone) for j in range(len(zones)))
        for _ in range(ROUNDS):
            if not self._moved(sides, zone):
                return None
            depth = self._held_back(sides, zone, side, wanted)
            near, far = (self.force(sides, zone, side, d) for d in (NEAR * depth, depth))
            ends = {self.holds(sides, near), self.holds(sides, far)}
            if ends == {sides} and not self.leaves(sides, far):
                return StaticRest(sides, zone, near, far)
            sides = self.holds(sides, far)
            if sides[zone] != side:
                return None
            if len(ends) > 1 or ends == {sides}:
                wanted = 0.5 * depth  # on the way another contact changes, or the circuit leaves
        return None

    def _held_back(self, sides: tuple[int, ...], zone: int, side: int, depth: float) -> float:
        """A depth at which no state is pushed past its room."""
        volts = self.design.errors.scales.volts
        limit = ROOM * self.design.circuit.saturation
        by_force, without = self.displaced(sides)

        def pushed(depth: float) -> float:
            force = self.force(sides, zone, side, depth)
            return float((np.abs(force * by_force + without) * volts[0::2]).max())

        if pushed(depth) > limit > pushed(0.0):
            depth *= (limit - pushed(0.0)) / (pushed(depth) - pushed(0.0))
        return depth


Complex = NDArray[np.complex128]

FLOOR = 1e-3
"""What may differ beside the coefficient errors."""
POINTS = 50
"""Points of an ``.ac`` analysis; a decade. Of each stretch of a ``.dc`` analysis likewise."""
DEEPEST = 5
"""The deepest points of a contact's line, which always count."""
GAIN = 1e8
"""Open-loop gain of the op-amps, with which ngspice finds more operating points than with an
endless one; it errs by the noise gain over it, a tenth of `FLOOR` at a noise gain of 10 000."""
HOLDING = 1e15
"""Inductance [H] beside each integrator's capacitor: a wire at rest, nothing at any frequency."""


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
    "threshold …" |realised/wanted - 1|; "leftover slope" that of the dead zone in units of K1. Of
    several clearances each is named. A contact in which no constant force of the drive holds the
    masses has none."""
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
    def read(cls, record: EquationCheckRow) -> EquationCheck:
        """The check that ``as_dict`` wrote."""

        def number(value: float | None) -> float:
            return float("nan") if value is None else value

        return cls(
            tuple(
                EquationFinding(f["name"], number(f["deviation"]), number(f["bound"]), f["reason"])
                for f in record["findings"]
            )
        )

    def as_dict(self) -> EquationCheckRow:
        return {
            "passed": self.passed,
            "low_hz": self.low,
            "high_hz": self.high,
            "findings": [
                {
                    "name": f.name,
                    "deviation": f.deviation,
                    "bound": f.bound,
                    "reason": f.reason,
                    "passed": f.passed,
                }
                for f in self.findings
            ],
        }


def check(design: Design, responses: Sequence[ModelResponse], pool: SpicePool) -> EquationCheck:
    """Compare the design's deck, in ngspice, with its model.

    responses : those of the model; their amplitudes give the depth of contacts.

    Raises
    ------
    EnvironmentMissing : see `SpicePool.map`.
    """
    model = design.model.second_order()
    rests = static_rests(design, model, responses)
    centre = _resonance(model)
    low, high = (design.errors.scales.frequency(centre * 10.0**e) for e in (-0.5, 0.5))
    curve = [rest for rest in rests if rest.near != rest.far and _seen(design)]

    looks = [(rest, 0) for rest in rests]
    looks += [
        (rest, channel)
        for rest in rests[:1]
        for channel in range(1, len(design.circuit.generators))
    ]
    jobs = [_ac(design, rest, low, high, channel) for rest, channel in looks]
    jobs += [_dc(design, rest) for rest in curve]
    answers = {}
    for number, answer in pool.map(jobs):
        answers[number] = answer
        doing(f"{len(answers)} of {len(jobs)} runs")
    findings = [_transfer(design, model, *look, answers[i]) for i, look in enumerate(looks)]
    sweeps = [(rest, answers[len(looks) + i]) for i, rest in enumerate(curve)]
    return EquationCheck((*findings, *_curve(design, model, sweeps)), low, high)


def transfer(
    model: SecondOrderSystem,
    omega: Array,
    sides: tuple[int, ...],
    mass: int = 0,
    channel: int = 0,
) -> Complex:
    """(k,) displacement of a mass per unit of a channel of the drive at ``omega`` (k,), each dead
    zone in contact with this side or open (0)."""
    return np.array([_impedance(model, w, sides, channel)[1][mass] for w in omega])


def _moved(model: SecondOrderSystem, omega: float, sides: tuple[int, ...], channel: int = 0) -> int:
    """Index of the first mass that a channel of the drive moves: while a clearance is open, nothing
    else may join the others to it."""
    displacements = np.abs(_impedance(model, omega, sides, channel)[1])
    return int(np.flatnonzero(displacements > STILL * displacements.max())[0])


def explained(
    model: SecondOrderSystem,
    omega: Array,
    sides: tuple[int, ...],
    mass: int = 0,
    channel: int = 0,
) -> Array:
    """(k,) largest |dH/H| for a relative change of 1 in every coefficient of the equations.

    Each term of the impedance Z counts with |L_i Z_ij R_j/H|, where H is that of the mass, R =
    Z⁻¹ force and L is its row of Z⁻¹; the springs on the mass of each clearance twice, since the
    dead zone's leftover slope is measured in them, and damping twice, since a displacement's
    integrator has an error of its own: with v = x'/κ the equation is x''/κ + d v + … = force.
    """
    out = np.zeros(len(omega))
    rows = [
        (model.displacement(z), model.push(z), z.quantity, model.own_slope(z))
        for z in model.dead_zones
    ]
    first = np.eye(model.size)[0]
    rows = rows or [(first, first, "displacement", float(model.stiffness[0, 0]))]
    for k, w in enumerate(omega):
        terms, right = _impedance(model, w, sides, channel)
        left = np.linalg.inv(sum(terms))[mass]
        size = sum(float((np.abs(left)[:, None] * np.abs(t) * np.abs(right)).sum()) for t in terms)
        for row, push, quantity, slope in rows:
            rate = w if quantity == "velocity" else 1.0
            size += abs((left @ push) * rate * slope * (row @ right))
        size += float((np.abs(left)[:, None] * np.abs(terms[1]) * np.abs(right)).sum())
        out[k] = size / abs(right[mass])
    return out


def _drive_error(
    design: Design,
    model: SecondOrderSystem,
    omega: Array,
    sides: tuple[int, ...],
    mass: int,
    channel: int,
) -> Array:
    """(k,) |dH/H| that the drive explains: the driven masses share the force in a ratio of their
    own, which is no coefficient of the equations and not in their error."""
    wanted = drive_of(model, channel)
    gain = design.errors.second_gain if channel else design.errors.drive_gain
    made = gain * design.amplitude(channel=channel)
    error = np.abs(np.where(wanted, made - wanted, 0.0))
    out = np.zeros(len(omega))
    for k, w in enumerate(omega):
        terms, right = _impedance(model, w, sides, channel)
        out[k] = float(np.abs(np.linalg.inv(sum(terms))[mass]) @ error) / abs(right[mass])
    return out


def _impedance(
    model: SecondOrderSystem, omega: float, sides: tuple[int, ...], channel: int
) -> tuple[list[Complex], Complex]:
    """Terms of Z = -ω²M + iωC + K + contacts, and the displacements Z⁻¹ force."""
    terms = [
        -(omega**2) * np.diag(model.mass).astype(complex),
        1j * omega * model.damping.astype(complex),
        model.stiffness.astype(complex),
    ]
    for zone, side in zip(model.dead_zones, sides, strict=True):
        if side:
            both = np.outer(model.push(zone), model.displacement(zone))
            terms.append((dict(zone.sides)[side].stiffness * both).astype(complex))
            terms.append(1j * omega * zone.damping * both)
    return terms, np.linalg.solve(sum(terms), drive_of(model, channel).astype(complex))


def _resonance(model: SecondOrderSystem) -> float:
    """ω at which the first mass that the open system moves does so most, near the model's own
    frequency."""
    omega = model.own_frequency * np.geomspace(1e-2, 1e2, 4001)
    still = (0,) * len(model.dead_zones)
    mass = _moved(model, model.own_frequency, still)
    return float(omega[np.argmax(np.abs(transfer(model, omega, still, mass)))])


def _deck(
    design: Design,
    source: str,
    analysis: str,
    generator: float,
    sides: tuple[int, ...],
    *,
    turned: bool = False,
    second: str = "DC 0",
) -> str:
    """The deck that is simulated in time, with another generator line and analysis, held at rest.

    generator [V], sides : at the first operating point; ngspice looks for it from where the
    reduction says it is. turned : the generator's poles are exchanged, so that its voltage counts
    negative. second : of the generator's second channel.
    """
    circuit = design.circuit
    board = replace(nominal_board(circuit, ideal=True), inverse_gain=1.0 / GAIN)
    reduction = Reduction(circuit, board)
    try:
        volts = rest(reduction, generator, sides)
        resting = [*_holding(reduction, sides)]
        resting.append(".nodeset " + " ".join(f"v({net})={v!r}" for net, v in volts))
    except ArithmeticError:  # a floating net: ngspice shall say it
        resting = []
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
        elif circuit.second is not None and word == circuit.second.name:
            line = f"{word} {circuit.second.net} 0 {second}"
        elif word == ".tran":
            line = "\n".join([*resting, analysis])
        elif word == ".save":
            zones = circuit.dead_zones
            between = [zone.difference[0] for zone in zones if zone.difference is not None]
            line = " ".join([line, *(f"v({net})" for net in between)])
        lines.append(line)
    return "\n".join(lines) + "\n"


def rest(reduction: Reduction, generator: float, sides: tuple[int, ...]) -> list[tuple[str, float]]:
    """Every net with its voltage [V] where the circuit rests, in these contacts, at a constant
    generator voltage; exact, since a mode is linear."""
    circuit = reduction.circuit
    x = _resting_states(reduction, generator, sides)
    voltage = reduction.solution(circuit.in_contact(sides)).voltage
    inputs = np.concatenate([x, [generator, 1.0]])
    return [(net, float(voltage[net] @ inputs)) for net in circuit.nets]


def _resting_states(reduction: Reduction, generator: float, sides: tuple[int, ...]) -> Array:
    """(n,) states where the circuit rests in these contacts."""
    mode = reduction.system().mode(reduction.circuit.in_contact(sides))
    return np.asarray(np.linalg.solve(mode.A, -(mode.B * generator + mode.d)))


def _holding(reduction: Reduction, sides: tuple[int, ...]) -> Iterator[str]:
    """Sources that hold each capacitor, behind an inductor, at its voltage at rest, which follows
    the generator. The first states are the capacitors' voltages."""
    circuit = reduction.circuit
    without = _resting_states(reduction, 0.0, sides)
    by_generator = _resting_states(reduction, 1.0, sides) - without
    capacitors = {c.name: c for c in circuit.capacitors}
    for name, volts, gain in zip(circuit.states, without, by_generator, strict=False):
        c = capacitors[name]
        yield f"Lhold{name} {c.plus} hold{name} {HOLDING!r}"
        yield f"Vhold{name} hold{name} follow{name} {float(volts)!r}"
        yield f"Ehold{name} follow{name} {c.minus} {circuit.generator.net} 0 {float(gain)!r}"


def _volts(design: Design, force: float) -> float:
    """Generator voltage of a model force: the integrators invert."""
    return -force * design.amplitude()


def _ac(
    design: Design, resting: StaticRest, low: float, high: float, channel: int
) -> SpiceJob[Waveforms]:
    generator = _volts(design, 0.5 * (resting.near + resting.far))
    card = f".ac dec {POINTS} {low!r} {high!r}"
    first, second = (f" AC {int(channel == k)}" for k in range(2))
    source = f"DC {generator!r}{first}"
    text = _deck(design, source, card, generator, resting.sides, second=f"DC 0{second}")
    nets = design.circuit.displacements
    return SpiceJob(text, nets, high * (1.0 - 1e-6), _whole, "ac")


def _dc(design: Design, resting: StaticRest) -> SpiceJob[Waveforms]:
    """The DC sweep of a rest from its near end, where the stage carries least, upwards."""
    near, far = _volts(design, resting.near), _volts(design, resting.far)
    turned = far < near
    first, last = (-near, -far) if turned else (near, far)
    step = (last - first) / POINTS
    # Half a step more: the last point is not lost to rounding.
    card = f".dc {design.circuit.generator.name} {first!r} {last + 0.5 * step!r} {step!r}"
    zones = design.circuit.dead_zones
    pairs = [(_moving(design, zones[k]), zones[k].output) for k in _seen(design)]
    nets = tuple(dict.fromkeys(net for pair in pairs for net in pair))
    text = _deck(design, "DC 0", card, near, resting.sides, turned=turned)
    return SpiceJob(text, nets, last - 0.01 * step, _whole, "dc")


def _whole(sweep: Waveforms) -> Waveforms:
    return sweep


def _transfer(
    design: Design,
    model: SecondOrderSystem,
    resting: StaticRest,
    channel: int,
    answer: Waveforms | SimulationFailed,
) -> EquationFinding:
    name = f"transfer, {resting.place(model)}" + (", second channel" if channel else "")
    bound = FLOOR
    if isinstance(answer, SimulationFailed):
        return EquationFinding(name, float("nan"), bound, answer.reason)
    scales, sides = design.errors.scales, resting.sides
    omega = 2.0 * np.pi * answer.axis * scales.seconds
    mass = _moved(model, float(omega[len(omega) // 2]), sides, channel)
    unit = -scales.volts[2 * mass] / design.amplitude(channel=channel)
    wanted = unit * transfer(model, omega, sides, mass, channel)
    deviation = np.abs(answer.signals[design.circuit.displacements[mass]] / wanted - 1.0)
    explained_error = design.errors.max_error * explained(model, omega, sides, mass, channel)
    driven = _drive_error(design, model, omega, sides, mass, channel)
    bounds = np.expm1(explained_error + driven) + FLOOR
    worst = int(np.argmax(deviation / bounds))
    return EquationFinding(name, float(deviation[worst]), float(bounds[worst]))


def _curve(
    design: Design,
    model: SecondOrderSystem,
    sweeps: Sequence[tuple[StaticRest, Waveforms | SimulationFailed]],
) -> list[EquationFinding]:
    """Slope, threshold, leftover slope from straight lines through the stretches."""
    bound = design.errors.max_error + FLOOR
    zones, seen = design.circuit.dead_zones, _seen(design)
    still: dict[int, tuple[float, float]] = {}
    out: list[EquationFinding] = []
    for resting, sweep in sweeps:
        if isinstance(sweep, SimulationFailed):
            name = f"curve, {resting.place(model)}"
            out.append(EquationFinding(name, float("nan"), bound, sweep.reason))
        elif resting.zone is None:
            still = {k: _line(design, zones[k], sweep) for k in seen}
        elif still:
            out += _contact(design, model, resting, sweep, still[resting.zone], bound)
    for index, (leftover, _) in still.items():
        zone = model.dead_zones[index]
        if zone.limits:  # the contacts say it
            continue
        share = abs(leftover / _wanted_slope(design, model, index, zone.sides[0][0]))
        name = "leftover slope" + ("" if len(zones) == 1 else f" {zone.name}")
        deviation = float(share * model.relative_stiffness(zone))
        out.append(EquationFinding(name, deviation, bound))
    return out


def _contact(
    design: Design,
    model: SecondOrderSystem,
    resting: StaticRest,
    sweep: Waveforms,
    inside: tuple[float, float],
    bound: float,
) -> list[EquationFinding]:
    """Slope and threshold of one contact. inside : the line through the dead zone."""
    index, side = resting.zone, resting.side
    assert index is not None
    leftover, level = inside
    slope, offset = _line(design, design.circuit.dead_zones[index], sweep, inside)
    wanted = _wanted_slope(design, model, index, side)
    place = resting.place(model)
    share = (slope - leftover if design.circuit.dead_zones[index].limits else slope) / wanted
    error = abs(np.log(share)) if share > 0.0 else np.inf
    findings = [EquationFinding(f"slope, {place}", float(error), bound)]
    zone = model.dead_zones[index]
    gap = dict(zone.sides)[side].gap
    if gap:
        threshold = side * (level - offset) / (slope - leftover)
        volts = gap * design.errors.scales.volts[zone.watched]
        # Both stops of an even clearance alone need not lie at the same distance: an offset of the
        # generator centres them.
        stated = design.errors.scales.threshold_lower if side < 0 else float("nan")
        alone = len(model.dead_zones) == 1 and zone.upper == zone.lower
        volts = stated if alone and np.isfinite(stated) else volts
        deviation = float(abs(threshold / (volts * design.dead_zone_gains[index]) - 1.0))
        findings.append(EquationFinding(f"threshold, {place}", deviation, bound))
    return findings


def _line(
    design: Design, stop: Stop, sweep: Waveforms, inside: tuple[float, float] | None = None
) -> tuple[float, float]:
    """Slope and level of a stage's output over the displacement in its clearance.

    inside : the line through the dead zone. Only where the output departs from it by more than half
    of the most is looked at, since a contact may close later than foretold, and not at once.
    """
    sign = 1 if stop.difference is None else stop.difference[1]
    moved = sign * sweep.signals[_moving(design, stop)].real
    output = sweep.signals[stop.output].real
    if inside is not None:
        departure = np.abs(output - np.polyval(inside, moved))
        closed = departure >= 0.5 * departure.max()
        closed[-DEEPEST:] = True
        moved, output = moved[closed], output[closed]
    slope, level = np.polyfit(moved, output, 1)
    return float(slope), float(level)


def _seen(design: Design) -> tuple[int, ...]:
    """Indices of the dead zones whose displacement a constant force of the drive moves."""
    model = design.model.second_order()
    by_force = np.linalg.solve(model.stiffness, drive_of(model))
    least = STILL * float(np.abs(by_force).max())
    return tuple(
        k
        for k, zone in enumerate(model.dead_zones)
        if zone.quantity == "displacement" and abs(model.displacement(zone) @ by_force) > least
    )


def _moving(design: Design, stop: Stop) -> str:
    """The net that carries the displacement in a clearance, or its negative."""
    circuit = design.circuit
    if stop.difference is not None:
        return stop.difference[0]
    return circuit.state_nets[circuit.states.index(stop.state)]


def _wanted_slope(design: Design, model: SecondOrderSystem, index: int, side: int) -> float:
    """fv per volt of displacement in contact: the model's stop at the design's scales, through the
    force resistor."""
    circuit, scales, stop = design.circuit, design.errors.scales, model.dead_zones[index]
    velocity = 2 * stop.mass + 1
    capacitor = next(c for c in circuit.capacitors if c.name == circuit.states[velocity])
    rate = dict(stop.sides)[side].stiffness / model.mass[stop.mass] / scales.seconds
    per_volt = scales.volts[velocity] / scales.volts[velocity - 1]
    force = conductance(circuit, circuit.dead_zones[index].driving, capacitor.minus)
    return float(rate * per_volt * capacitor.value / force) / float(design.dead_zone_gains[index])
