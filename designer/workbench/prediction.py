"""What the nominal board would show on a scope: the waves of its nets, and where its stops are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.base.arrays import Array, Mask
from designer.base.errors import InputError
from designer.check.synthesis_result import Synthesis
from designer.circuit.design import GeneratorSetting, settings
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.nominal import circuit_flow, nominal_reduction, on_circuit
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.drive_shape import SINE, has_harmonics
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit
from designer.model.find_responses import ModelResponse
from designer.model.response_table import Response
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from designer.verdicts.verdict import Question
from designer.workbench.board_prior import Prior
from designer.workbench.record import RecordedMotion

POINTS = 512
"""Points of a predicted wave in a drive period."""
DRAWN = 60
"""Boards that say how far the stops of one may be off."""
DRAWN_WITH = 1
"""Their seed."""
ASKED = 3
"""Wanted responses from which a board may have come to a recorded motion: the nearest ones."""
SAME_FREQUENCY = 1e-3
"""Of a setting's frequency: how far a scope's clock shows it elsewhere, with room to spare."""
SAME_AMPLITUDE = 0.06
"""Of a setting's amplitude: three standard deviations of a scope's gain."""
SHARE = 1e-6
"""Of the largest: a voltage that takes less part in a displacement takes none."""
LEVEL = 0.05
"""Of its range: how near its level inside the clearance an output rests."""


@dataclass(frozen=True)
class PredictedStop:
    """The stage of a clearance, or of another dead zone, as the nominal board has it."""

    clearance: str
    output: str
    """Net of its output."""
    displacement: Mapping[str, float]
    """Net by net what the displacement, or the velocity, is made of: {"v1": 1.0}, or {"v1": 1.0,
    "v3": -1.0}."""
    ends: Mapping[int, float]
    """Where the stops are, by side, 1 upper and -1 lower [V of the displacement]."""
    inside: tuple[float, float]
    """Output inside the clearance: volts at no displacement, and per volt of it."""
    gains: Mapping[int, float]
    """Volts of output for each volt beyond the stop, by side, what ``inside`` adds left out."""

    def output_of(self, displacement: Array) -> Array:
        """(k,) output [V] at displacements (k,) [V]."""
        value = self.inside[0] + self.inside[1] * displacement
        for side, end in self.ends.items():
            beyond = side * np.maximum(side * (displacement - end), 0.0)
            value = value + self.gains[side] * beyond
        return np.asarray(value)

    @property
    def limits(self) -> bool:
        """Whether the output changes inside, and not beyond the ends."""
        return abs(self.inside[1]) > LEVEL * max(map(abs, self.gains.values()))

    @property
    def levels(self) -> tuple[float, ...]:
        """Where the output rests [V]: inside the clearance, or beyond the ends of a limiter."""
        if not self.limits:
            return (self.inside[0],)
        return tuple(float(self.output_of(np.array(end))) for end in self.ends.values())

    def force_of(self, displacement: Array) -> Array:
        """(k,) the output [V] at displacements (k,) [V] less what it has inside the clearance,
        which the linear part of the board has too."""
        inside = self.inside[0] + self.inside[1] * displacement
        return np.asarray(self.output_of(displacement) - inside)

    def resting(self, output: Array) -> Mask:
        """(k,) whether an output (k,) [V] is on a level where many of its values pile up though
        nothing cuts it off."""
        room = LEVEL * np.ptp(output)
        near = [np.abs(output - level) <= room for level in self.levels]
        return np.asarray(np.any(near, axis=0), dtype=bool)


@dataclass(frozen=True)
class PredictedResponse:
    """A wanted response of the nominal board."""

    spec: Response
    """As the model file asks for it."""
    setting: GeneratorSetting
    orbit: Orbit
    """On the exact circuit."""
    waves: Mapping[str, Array]
    """(n · POINTS,) voltage of each net [V], from drive phase 0 on, where the generator's voltage
    falls through its mean."""
    starts: tuple[Array, ...]
    """(states,) from where a board may come to it: its own start, and that of its mirror twin where
    every clearance has stops on both sides."""

    @property
    def question(self) -> Question:
        """What a board is asked of it."""
        return Question(self.spec, self.setting.excitation, self.orbit, None)


class BoardPrediction:
    """What is known of a design's boards before any is measured."""

    def __init__(self, synthesis: Synthesis) -> None:
        self.synthesis = synthesis
        self.reduction = nominal_reduction(synthesis.design)
        self.zones = _zones(self.reduction)

    @property
    def stops(self) -> tuple[PredictedStop, ...]:
        """The stages of the clearances, the first of ``zones``, which has every dead zone."""
        return self.zones[: len(self.circuit.stops)]

    @property
    def circuit(self) -> Circuit:
        return self.synthesis.design.circuit

    @property
    def generator(self) -> str:
        """Net of the generator."""
        return self.circuit.generator.net

    @property
    def nets(self) -> tuple[str, ...]:
        """Nets that a channel may show."""
        return (*self.circuit.outputs, self.generator)

    def check_drive(self) -> None:
        """InputError where the generator does not give one sine, for records are recognised by
        it."""
        shapes = self.synthesis.design.drive_shapes
        if len(shapes) > 1 or has_harmonics(*shapes):
            found = "a second channel" if len(shapes) > 1 else "another shape"
            expected = "records of a board that one sine drives"
            raise InputError(None, "--record", f"a board whose drive has {found}", expected)

    @cached_property
    def settings(self) -> tuple[GeneratorSetting, ...]:
        """The generator's setting for each wanted response. A record begins at any moment, so a
        sine of whatever phase is one of phase 0. Raises as ``check_drive``."""
        self.check_drive()
        every = settings(self.synthesis.design, self.synthesis.model_responses)
        return tuple(replace(setting, shape=SINE) for setting in every)

    @cached_property
    def responses(self) -> tuple[PredictedResponse, ...]:
        """Those wanted responses that have an orbit on the nominal board. Raises as
        ``check_drive``."""
        system = self.reduction.system()
        shown = []
        for setting, response in zip(self.settings, self.synthesis.model_responses, strict=True):
            orbit = on_circuit(system, self.synthesis.design, response)
            turned = self._from_phase_0(orbit, response, setting) if orbit.n else orbit
            # Another attractor's waves must not stand under the name of this one.
            if orbit.n and turned.counts == orbit.counts:
                waves = self.waves(turned, setting)
                starts = self._starts(turned, waves)
                shown.append(PredictedResponse(response.spec, setting, turned, waves, starts))
        return tuple(shown)

    def _from_phase_0(
        self, orbit: Orbit, response: ModelResponse, setting: GeneratorSetting
    ) -> Orbit:
        """The same orbit from where the sine of its drive has the phase 0."""
        system = self.reduction.system()
        ((_, sine, cosine),) = circuit_flow(system, self.synthesis.design, response).drive.shape
        if not cosine:
            return orbit
        flow = Flow(system, setting.excitation.drive)
        run = flow.to_strobe(orbit.start, float(np.arctan2(cosine, sine)))
        return settle(flow, run.strobes[-1])

    @property
    def twins(self) -> bool:
        """Whether every clearance has stops on both sides, so that orbits have mirror twins."""
        return all(len(zone.ends) == 2 for zone in self.zones)

    def _starts(self, orbit: Orbit, waves: Mapping[str, Array]) -> tuple[Array, ...]:
        if not self.twins:
            return (orbit.start,)
        later = np.array([waves[net][POINTS // 2] for net in self.circuit.state_nets])
        return orbit.start, -later

    def waves(self, orbit: Orbit, setting: GeneratorSetting) -> dict[str, Array]:
        """(n · POINTS,) voltage of each net [V] along an orbit of the nominal board."""
        drive = setting.excitation.drive
        flow = Flow(self.reduction.system(), drive)
        run = flow.run(orbit.start, orbit.n, mode=orbit.mode or None, points=POINTS)
        states = run.strobes[:-1]
        angle = 2.0 * np.pi * np.arange(len(states)) / POINTS
        waves = dict(zip(self.circuit.state_nets, states.T, strict=True))
        waves[self.generator] = drive.at(angle)
        for stop in self.zones:
            moved = sum(factor * waves[net] for net, factor in stop.displacement.items())
            waves[stop.output] = stop.output_of(np.asarray(moved))
        return waves

    @cached_property
    def fastest(self) -> float:
        """Highest natural frequency of the nominal board with its clearances open [Hz]."""
        roots = np.linalg.eigvals(self.reduction.system().mode(self.circuit.open).A)
        return float(np.abs(roots).max()) / (2.0 * np.pi)

    @cached_property
    def prior(self) -> Prior:
        """The boards of the model file's spread, as fits have them."""
        spread = spread_of(self.synthesis.modelfile, self.circuit, self.synthesis.catalog)
        return Prior(self.circuit, spread)

    def starts(self, frequency: float) -> list[Array]:
        """From where a board may have come to a motion at a frequency [Hz]: the starts of the
        nearest wanted responses."""
        near = nearest(self.responses, frequency)[:ASKED]
        return [start for response in near for start in response.starts]

    def setting_of(self, motion: RecordedMotion) -> Excitation | None:
        """The generator's setting: that for a wanted response where the record is of one, since it
        is known better than a scope shows it; else None, for what was recorded."""
        for response in nearest(self.responses, motion.frequency)[:ASKED]:
            setting = response.setting
            same = abs(motion.frequency / setting.frequency_hz - 1.0) < SAME_FREQUENCY
            louder = abs(motion.amplitude / setting.amplitude_v_peak - 1.0)
            if same and not louder > SAME_AMPLITUDE:  # nan: the generator was not recorded
                return setting.excitation
        return None

    @cached_property
    def end_errors(self) -> tuple[Mapping[int, float], ...]:
        """Standard deviation of where each clearance's stops are on the boards of the model file's
        spread [V], by side."""
        spread = spread_of(self.synthesis.modelfile, self.circuit, self.synthesis.catalog)
        boards = draw_many(self.circuit, spread, DRAWN_WITH, range(DRAWN))
        drawn = [_zones(Reduction(self.circuit, boards.board(k))) for k in range(DRAWN)]
        return tuple(
            {side: float(np.std([each[k].ends[side] for each in drawn])) for side in stop.ends}
            for k, stop in enumerate(self.stops)
        )


def _zones(reduction: Reduction) -> tuple[PredictedStop, ...]:
    """The stages of a board."""
    circuit, still = reduction.circuit, reduction.solution(reduction.circuit.open)
    zones = []
    for stop in circuit.dead_zones:
        largest = circuit.states.index(stop.state)
        net, sign = stop.difference or (circuit.state_nets[largest], 1)
        row = sign * still.voltage[net]
        least = SHARE * float(np.abs(row[:-2]).max())
        made_of = {
            net: float(row[k]) for k, net in enumerate(circuit.state_nets) if abs(row[k]) > least
        }
        ends = {
            side: float(row[-1] + row[largest] * reduction.threshold(stop, contact))
            for side, contact in stop.contacts
        }
        opened = still.voltage[stop.output]
        slope = float(opened[largest] / row[largest])
        gains = {}
        for side, contact in stop.contacts:
            carried = reduction.solution(circuit.carrying(contact)).voltage[stop.output]
            gains[side] = float(carried[largest] / row[largest]) - slope
        zones.append(
            PredictedStop(
                stop.clearance, stop.output, made_of, ends, (float(opened[-1]), slope), gains
            )
        )
    return tuple(zones)


def nearest(responses: Sequence[PredictedResponse], frequency: float) -> list[PredictedResponse]:
    """The responses by how far their drive frequency is from this one [Hz], the nearest first."""
    return sorted(responses, key=lambda r: abs(np.log(r.setting.frequency_hz / frequency)))
