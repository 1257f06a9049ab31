"""Where constant forces of the drive hold the masses: all dead zones open, or in each contact.

A dead zone of velocities is open wherever the masses are held.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_values import nominal_board
from designer.circuit.design import Design
from designer.circuit.reduction import Reduction
from designer.model.find_responses import ModelResponse, Reach, peaks
from designer.model.mechanics import SecondOrderSystem

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
