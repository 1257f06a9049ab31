"""The circuit of any system: with exact values its reduction is the model, matrix for matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.circuit.board_arrays import Boards
from designer.circuit.board_modes import BoardModes, at_rest, resting_voltages
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.dead_zone_parts import DeadZoneStage, half_parts, idle_limits
from designer.circuit.netlist import Circuit, Section
from designer.circuit.reduction import Reduction
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive, ModeKey
from designer.laws.force_law import ForceLaw
from designer.model.clearance import Clearance, Side, combined
from designer.model.mechanics import SecondOrderSystem
from tests.shared.exact_circuits import STAGE, Scale, exact_circuit, unit_volts
from tests.shared.exploring import seeds


def random_system(seed: int) -> SecondOrderSystem:
    """1 to 3 masses, some with inertial couplings, 0 to 2 clearances of any kind, some of them of
    combinations, in steps or with damping, 0 to 2 laws that rise and fall, forces of both signs or
    a moving base."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    mass = rng.uniform(0.5, 2.0, n)

    def chain(least: float, most: float) -> Array:
        ends = rng.uniform(least, most, n)
        out = np.diag(ends)
        for i in range(n - 1):
            out[i, i] += ends[i + 1]
            out[i, i + 1] = out[i + 1, i] = -ends[i + 1]
        return out

    clearances = []
    for name in "AB"[: int(rng.integers(0, 3))]:
        first = int(rng.integers(0, n))
        other = int(rng.integers(0, n))
        sides = [Side(float(rng.uniform(0.2, 0.6)), float(rng.uniform(3.0, 12.0))) for _ in "ul"]
        shape = rng.integers(0, 4)
        if shape == 1:  # preloaded on one side
            sides[0] = replace(sides[0], gap=float(-rng.uniform(0.05, 0.15)))
        clearances.append(
            Clearance(
                name,
                first,
                None if other == first else other,
                None if shape == 2 else sides[0],
                None if shape == 3 else sides[1],
            )
        )
    clearances = [_in_steps(stop) if rng.integers(0, 4) == 0 else stop for stop in clearances]
    clearances = [
        _of_many(stop, n, rng) if rng.integers(0, 4) == 0 else stop for stop in clearances
    ]
    clearances = [_damped(stop, rng) if rng.integers(0, 3) == 0 else stop for stop in clearances]
    laws = tuple(_random_law(f"L{k}", n, rng) for k in range(max(int(rng.integers(-2, 3)), 0)))
    moving = bool(rng.integers(0, 2))
    force = np.zeros(n) if moving else rng.uniform(0.5, 1.0, n) * rng.choice([-1.0, 0.0, 1.0], n)
    force[0] += 0.0 if moving else 1.5
    matrices = {"displacement": chain(0.8, 2.0), "velocity": chain(0.05, 0.3)}
    constant = rng.uniform(-0.3, 0.3, n) * rng.integers(0, 2, n)
    for law in laws:
        row = np.array(law.row)
        matrices[law.quantity] += law.slope * np.outer(row, row)
        constant -= law.offset * row
    system = SecondOrderSystem(
        mass=mass,
        damping=matrices["velocity"],
        stiffness=matrices["displacement"],
        force=force,
        clearances=tuple(clearances),
        constant=constant,
        base=0.4 if moving else 0.0,
        laws=laws,
    )
    if rng.integers(0, 3):
        return system
    shares = np.triu(rng.uniform(-0.3, 0.3, (n, n)), 1)
    coupled = np.diag(mass) + (shares + shares.T) * np.sqrt(np.outer(mass, mass))
    system = system.with_couplings(coupled)
    try:
        _ = system.dead_zones
    except InputError:  # no mass that a combination watches and pushes alike
        return random_system(seed + 10**7)
    return system


def _random_law(name: str, n: int, rng: np.random.Generator) -> ForceLaw:
    """2 to 4 bends about rest, slopes of both signs, on one mass or between two."""
    row = np.zeros(n)
    row[int(rng.integers(0, n))] = rng.choice([-1.0, 1.0])
    if n > 1 and rng.integers(0, 2):
        row = np.zeros(n)
        row[:2] = rng.permutation([1.0, -1.0])
    if rng.integers(0, 4) == 0:
        row = row + rng.uniform(-0.5, 0.5, n)
    x = np.sort(rng.choice([-1.0, 1.0], 4) * rng.uniform(0.05, 0.6, 4))[: int(rng.integers(2, 5))]
    x = np.concatenate([[x[0] - 0.5], x, [x[-1] + 0.5]])
    velocity = bool(rng.integers(0, 2))
    force = np.cumsum(rng.uniform(-0.05 if velocity else -0.3, 0.4, len(x)) * np.diff(x, prepend=0))
    points = tuple(zip(x.tolist(), force.tolist(), strict=True))
    return ForceLaw(name, tuple(row.tolist()), "velocity" if velocity else "displacement", points)


def _in_steps(stop: Clearance) -> Clearance:
    """A further spring on each side, and a preload that rises on the upper one."""
    upper = stop.upper and replace(stop.upper, further=((0.2, 1.5),), preload=0.2, rise=0.1)
    lower = stop.lower and replace(stop.lower, further=((0.15, 2.5),))
    return replace(stop, upper=upper, lower=lower)


def _of_many(stop: Clearance, n: int, rng: np.random.Generator) -> Clearance:
    """Of a sum of all displacements, one factor above 0 at least."""
    row = rng.uniform(0.2, 2.0, n) * rng.choice([-1.0, 1.0], n)
    row[int(rng.integers(0, n))] = 1.3
    mass, other, combination = combined(row)
    return replace(stop, mass=mass, other=other, combination=combination)


def _damped(stop: Clearance, rng: np.random.Generator) -> Clearance:
    """With a damper in its stops, which begin with one stiffness."""
    if len({end.springs[0][1] for _, end in stop.sides}) > 1:
        upper, lower = (
            end and replace(end, stiffness=5.0, preload=0.0, rise=0.0)
            for end in (stop.upper, stop.lower)
        )
        stop = replace(stop, upper=upper, lower=lower)
    return replace(stop, damping=float(rng.uniform(0.1, 1.0)))


def engaged(system: SecondOrderSystem, levels: Sequence[int]) -> tuple[int, ...]:
    """The side of each dead zone that carries, where so many springs of each clearance, and bends
    of each law, are met; negative on the lower side."""
    chains: dict[str, tuple[int, float, dict[int, float]]] = {}
    for stop, level in zip(system.clearances, levels, strict=False):
        springs = dict(stop.sides)[int(np.sign(level))].springs if level else ()
        place = springs[abs(level) - 1][0] if level else 0.0
        chains[stop.name] = (int(np.sign(level)), place, dict(stop.terms))
    for law, level in zip(system.laws, levels[len(system.clearances) :], strict=True):
        side = int(np.sign(level))
        place = law.bends[side][abs(level) - 1][0] if level else 0.0
        turned = 1 if max(law.row) > 0.0 else -1  # of -x alone the upper bends lie below rest
        chains[law.name] = (side * turned, place, dict(enumerate(law.row)))
    out = []
    for zone in system.dead_zones:
        side, place, row = chains[zone.bend_of or zone.name]
        place /= abs(row[zone.mass])
        met = side in zone.positions and dict(zone.sides)[side].gap <= place + 1e-12
        out.append(side if met else 0)
    return tuple(out)


def all_levels(system: SecondOrderSystem) -> list[tuple[int, ...]]:
    """Each number of springs and bends that can be met at once."""
    ranges = [
        range(-len(low), len(high) + 1)
        for high, low in [
            *(
                tuple(dict(stop.sides)[s].springs if s in dict(stop.sides) else () for s in (1, -1))
                for stop in system.clearances
            ),
            *(tuple(law.bends.get(s, ()) for s in (1, -1)) for law in system.laws),
        ]
    ]
    return list(product(*ranges))


def volts_in(system: SecondOrderSystem, k: int, scale: Scale) -> float:
    """Volts of a unit of displacement in a clearance."""
    zone, stop = system.dead_zones[k], system.clearances[k]
    return unit_volts(zone, scale) / dict(stop.terms)[zone.mass]


def random_scale(system: SecondOrderSystem, seed: int) -> Scale:
    rng = np.random.default_rng(seed + 1)
    return Scale(1e-3, rng.uniform(2.0, 6.0, 2 * system.size), 1.3)


def keys(circuit: Circuit, sides: tuple[int, ...]) -> ModeKey:
    """The circuit's mode with each dead zone in contact with this side, or open."""
    moved = dict(zip(circuit.switches, circuit.open, strict=True))
    for stop, side in zip(circuit.dead_zones, sides, strict=True):
        if side:
            contact = dict(stop.contacts)[side]
            moved |= dict([(contact.switch, contact.position), *contact.others])
    return tuple(moved.values())


def both_sided(system: SecondOrderSystem) -> frozenset[int]:
    """Dead zones with two stops, whose halves can be apart."""
    zones = enumerate(system.dead_zones)
    return frozenset(i for i, zone in zones if len(zone.sides) == 2 and not zone.limits)


@settings(max_examples=len(seeds(8)))
@given(seed=st.integers(0, 10**6), apart=st.booleans())
def test_every_mode_has_the_model_s_matrices(seed: int, apart: bool) -> None:
    system = random_system(seed)
    scale = random_scale(system, seed)
    stage = replace(STAGE, apart=both_sided(system) if apart else frozenset())
    circuit = exact_circuit(system, scale, stage)
    board = replace(nominal_board(circuit, ideal=True), drop={d.name: 0.6 for d in circuit.diodes})
    reduced = Reduction(circuit, board).system()
    model = system.piecewise_linear(system.own_frequency)
    volts, seconds = scale.volts, scale.seconds
    for levels in all_levels(system):
        key = keys(circuit, engaged(system, levels))
        ours, wanted = reduced.mode(key), model.mode(levels)
        assert ours.sides == wanted.sides
        size = np.abs(wanted.A).max()
        assert seconds * ours.A / volts[:, None] * volts == pytest.approx(wanted.A, abs=1e-9 * size)
        drive = -ours.B * scale.generator * seconds / volts
        assert drive == pytest.approx(wanted.B, abs=1e-9 * size)
        assert seconds * ours.d / volts == pytest.approx(wanted.d, abs=1e-9 * size)
    # Without gain the hand-over from clamp to series diode has no answer.
    reduced = Reduction(circuit, replace(board, inverse_gain=1e-8)).system()
    for k, clearance in enumerate(system.clearances):
        rows, theirs = reduced.contact_rows(k), model.contact_rows(k)
        assert rows.keys() == theirs.keys() == set(clearance.positions)
        for side, row in rows.items():
            unit = volts_in(system, k, scale)
            assert row[:-2] * volts / unit == pytest.approx(theirs[side][:-2], abs=1e-5)
            assert row[-1] / unit == pytest.approx(theirs[side][-1], abs=1e-5)


@settings(max_examples=len(seeds(8)))
@given(seed=st.integers(0, 10**6))
def test_exact_values_have_no_error(seed: int) -> None:
    """Each kind of coefficient is counted, and none of an exact circuit has an error."""
    system = random_system(seed)
    scale = random_scale(system, seed)
    circuit = exact_circuit(system, scale)
    peaks = np.ones(2 * system.size)
    found = coefficient_errors(circuit, system, swing=(float(scale.volts.max()), peaks))
    assert found.max_error < 1e-8
    for i in np.flatnonzero(system.constant).tolist():
        assert f"constant x{i + 1}" in found.errors
    zones = system.dead_zones
    if len(zones) > 1:
        assert {n for n in found.errors if n.startswith("dead-zone null")} == {
            f"dead-zone null {zone.name}" for zone in zones
        }
    places = sum(len(zone.positions) for zone in zones) - 1
    assert sum(n.startswith(("gap ", "bend ")) and "slope" not in n for n in found.errors) == max(
        places, 0
    )
    if zones:
        assert found.scales.volts == pytest.approx(scale.volts, rel=1e-7)
        wanted = system.drive_force(system.own_frequency) / scale.generator
        assert found.drive_gain == pytest.approx(wanted, rel=1e-7, abs=1e-9)


@settings(max_examples=len(seeds(8)))
@given(seed=st.integers(0, 10**6), apart=st.booleans())
def test_orbits_agree(seed: int, apart: bool) -> None:
    """Three periods from a common start, as long as no half is driven past where both drive; with
    halves apart there is no such limit."""
    system = random_system(seed)
    scale = random_scale(system, seed)
    stage = replace(STAGE, apart=both_sided(system) if apart else frozenset())
    circuit = exact_circuit(system, scale, stage)
    assert not (apart and idle_limits(circuit, circuit.values))
    board = replace(nominal_board(circuit), inverse_gain=1e-7, bias={})
    omega = 1.1 * system.own_frequency
    size = system.drive_force(omega)[0] / system.drive_force(system.own_frequency)[0]
    rng = np.random.default_rng(seed)
    x = rng.uniform(-0.2, 0.2, 2 * system.size)
    theirs = Flow(system.piecewise_linear(omega), Drive(omega), fast=False).run(x, 3)
    drive = Drive(omega / scale.seconds, -scale.generator * size)
    ours = Flow(Reduction(circuit, board).system(), drive, fast=False).run(x * scale.volts, 3)
    peak = np.abs(theirs.strobes).max()
    for k in range(len(system.clearances)):
        wanted = system.piecewise_linear(omega)
        reduced = Reduction(circuit, board).system()
        mass = system.dead_zones[k].mass
        unit = scale.volts[2 * mass : 2 * mass + 2]
        unit = unit * volts_in(system, k, scale) / unit[0]
        moved, moving = reduced.displacement[k][:-2], reduced.velocity[k][:-1]
        theirs_moved, theirs_moving = wanted.displacement[k][:-2], wanted.velocity[k][:-1]
        assert moved * scale.volts / unit[0] == pytest.approx(theirs_moved, abs=1e-4)
        assert moving * scale.volts / unit[1] == pytest.approx(theirs_moving, abs=1e-4)
    uneven = any(c.upper and c.lower and c.upper.stiffness != c.lower.stiffness
                 for c in system.dead_zones)  # fmt: skip
    if apart or not uneven:
        assert ours.strobes / scale.volts == pytest.approx(theirs.strobes, abs=2e-4 * peak)


@settings(max_examples=len(seeds(5)))
@given(seed=st.integers(0, 10**6))
def test_how_far_unequal_halves_drive_their_output(seed: int) -> None:
    """The idle half's series diode conducts where ``idle_limits`` says, by the exact circuit."""
    rng = np.random.default_rng(seed)
    preload = -0.1 if rng.integers(0, 2) else 0.3
    sides = [Side(preload, float(rng.uniform(3, 12))), Side(0.4, float(rng.uniform(3, 12)))]
    upper, lower = sides[:: int(rng.choice([1, -1]))]
    system = two(clearances=(Clearance("A", 0, None, upper, lower),))
    circuit = exact_circuit(system, SCALE)
    limits = idle_limits(circuit, circuit.values)
    board = replace(nominal_board(circuit), inverse_gain=1e-7, bias={})
    reduction = Reduction(circuit, board)
    flow = reduction.system()
    ends = dict(limits.values())
    begin = 0.3 * SCALE.volts[0] if preload > 0 else 0.05
    for side in (1, -1):
        idle = half_parts(0, -side).series
        limit, at = ends.get(idle), circuit.switches.index(idle)

        def conducts(v: float, at: int = at) -> tuple[bool, float]:
            x = np.array([v, 0.0, 0.0, 0.0])
            key = flow.mode_at(x, 0.0)
            fv = reduction.output(key, "fv", x[None, :], np.zeros(1))[0]
            return bool(key[at]), float(fv)

        if limit is None:
            in_contact = np.geomspace(0.5 * SCALE.volts[0], 2e3, 12)  # of the driving half
            assert not any(conducts(v * side)[0] for v in in_contact)
        elif abs(limit) <= 500.0:
            low, high = begin * np.sign(limit), 2e3 * np.sign(limit)
            for _ in range(50):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if conducts(middle)[0] else (middle, high)
            assert conducts(low)[1] == pytest.approx(limit, rel=2e-3, abs=0.05)  # diodes resist


def two(**changes: object) -> SecondOrderSystem:
    base = SecondOrderSystem(
        mass=np.array([1.0, 1.0]),
        damping=np.array([[0.2, -0.2], [-0.2, 0.4]]),
        stiffness=np.array([[1.0, -1.0], [-1.0, 2.0]]),
        force=np.array([1.0, -1.0]),
        clearances=(
            Clearance("A", 0, None, Side(0.3, 5.0), Side(0.4, 8.0)),
            Clearance("B", 0, 1, Side(0.5, 6.0), None),
        ),
    )
    return replace(base, **changes)  # type: ignore[arg-type]


SCALE = Scale(1e-3, np.array([4.0, 5.0, 3.0, 4.0]), 1.0)


def test_names_follow_the_rule() -> None:
    circuit = exact_circuit(two(), SCALE)
    assert [stop.output for stop in circuit.stops] == ["fv_A", "fv_B"]
    names = set(circuit.values)
    assert {"R50", "R60", "R61", "R200", "R205", "R300", "R320", "R321", "R322"} <= names
    assert {"R190", "R191"} <= names  # the force on M2 is in antiphase
    assert {d.name for d in circuit.diodes} == {
        "D200", "D201", "D202", "D203", "D300", "D301"
    }  # fmt: skip
    into = {r.name: {r.a, r.b} for r in circuit.resistors}
    assert into["R60"] == {"fv_B", "s2"}
    assert into["R61"] == {"fvn_B", "s4"}
    assert len(circuit.packages) == -(-len(circuit.sections) // 4)
    assert circuit.packages == tuple(f"U{i + 1}" for i in range(len(circuit.packages)))
    assert all(isinstance(s, Section) for s in circuit.sections)


def test_each_error_is_named() -> None:
    """2 % on one part shows in the coefficient that it makes."""
    clearances = two().clearances
    damped = (clearances[0], replace(clearances[1], damping=0.4))
    system = two(constant=np.array([0.2, 0.0]), clearances=damped)
    circuit = exact_circuit(system, SCALE)
    for part, name in (
        ("R304", None),
        ("R301", "gap B upper"),
        ("R204", "gap A lower"),
        ("R205", "lower stop slope A"),
        ("R61", "stop slope B x2' x1"),
        ("C60", "stop damping B"),
        ("C61", "stop damping B x2' x1'"),
        ("R160", "constant x1"),
    ):
        if name is None:
            assert part not in circuit.values
            continue
        board = nominal_board(circuit, ideal=True)
        off = replace(board, values={**circuit.values, part: 1.02 * circuit.values[part]})
        errors = coefficient_errors(circuit, system, off).errors
        assert max(abs(e) for e in errors.values()) > 2e-3
        assert abs(errors[name]) > 2e-3


@pytest.mark.parametrize(
    ("clearance", "text"),
    [
        (Clearance("A", 0, None, Side(0.3, 5.0), Side(0.4, 5.0)), "unequal stops"),
        (Clearance("A", 0, None, Side(-0.1, 5.0), None), "in contact at rest"),
        (Clearance("A", 0, None, Side(0.3, 5.0), None, bend_of="L"), "bends of L"),
    ],
)
def test_what_the_saturating_stage_cannot_make_is_refused(clearance: Clearance, text: str) -> None:
    system = two(clearances=(clearance,), force=np.array([1.0, 0.0]))
    with pytest.raises(InputError) as caught:
        exact_circuit(system, SCALE, DeadZoneStage())
    assert text in str(caught.value)


def test_a_board_rests_in_each_clearance_by_its_own_amplifier() -> None:
    """A constant force moves the masses; between two of them the difference amplifier shows it."""
    system = two(constant=np.array([-0.1, -0.02]))
    circuit = exact_circuit(system, SCALE)
    boards = Boards.of(circuit, [replace(nominal_board(circuit), inverse_gain=1e-9, bias={})])
    x = np.linalg.solve(system.stiffness, system.constant)
    for k, clearance in enumerate(system.clearances):
        unit = unit_volts(clearance, SCALE)
        rest, ends = at_rest(boards, k)
        assert rest[0] == pytest.approx(unit * (system.displacement(clearance) @ x), rel=1e-5)
        assert {side: v[0] for side, v in ends.items()} == pytest.approx(
            {side: side * unit * stop.gap for side, stop in clearance.sides}, rel=1e-5
        )


def test_a_preloaded_board_rests_against_its_stop() -> None:
    """Where the springs and the stop balance; contact begins and ends at the gaps."""
    stops = Clearance("A", 0, None, Side(-0.1, 5.0), Side(0.4, 5.0))
    system = two(clearances=(stops,))
    circuit = exact_circuit(system, SCALE)
    ideal = replace(nominal_board(circuit), inverse_gain=1e-9, bias={})
    rest, ends = at_rest(Boards.of(circuit, [ideal]))
    stiffness = system.stiffness.copy()
    stiffness[0, 0] += 5.0
    x1 = float(np.linalg.solve(stiffness, np.array([-0.5, 0.0]))[0])
    assert rest[0] == pytest.approx(x1 * SCALE.volts[0], rel=1e-5)
    assert ends[1][0] == pytest.approx(-0.1 * SCALE.volts[0], rel=1e-5)
    assert ends[-1][0] == pytest.approx(-0.4 * SCALE.volts[0], rel=1e-5)


def test_a_board_without_clearances_rests_where_its_springs_do() -> None:
    system = two(clearances=(), constant=np.array([-0.1, -0.02]))
    circuit = exact_circuit(system, SCALE)
    ideal = replace(nominal_board(circuit), inverse_gain=1e-9, bias={})
    rest, ends = at_rest(Boards.of(circuit, [ideal]))
    x1 = float(np.linalg.solve(system.stiffness, system.constant)[0])
    assert rest[0] == pytest.approx(x1 * SCALE.volts[0], rel=1e-5)
    assert ends == {}


def test_of_boards_together_some_rest_open_and_some_against_a_stop() -> None:
    """The constant force of one is four times as large, by its resistor: the stop carries it."""
    stops = Clearance("A", 0, None, Side(0.3, 5.0), None)
    system = two(clearances=(stops,), constant=np.array([0.1, 0.0]))
    circuit = exact_circuit(system, SCALE)
    ideal = replace(nominal_board(circuit), inverse_gain=1e-9, bias={})
    pushed = replace(ideal, values={**ideal.values, "R160": circuit.values["R160"] / 4.0})
    boards = Boards.of(circuit, [pushed, ideal, pushed, ideal])
    free = np.linalg.solve(system.stiffness, system.constant)
    stiffer = system.stiffness + np.diag([5.0, 0.0])
    held = np.linalg.solve(stiffer, [0.4 + 5.0 * 0.3, 0.0])
    assert free[0] < 0.3 < held[0]
    wanted = np.array([held[0], free[0], held[0], free[0]]) * SCALE.volts[0]
    assert np.abs(resting_voltages(boards, ["v1"])[:, 0]) == pytest.approx(wanted, rel=1e-5)


@settings(max_examples=len(seeds(3)))
@given(seed=st.integers(0, 10**6))
def test_modes_that_some_boards_enter_are_those_of_all(seed: int) -> None:
    """Taken from many boards and added to, they are what those boards have for themselves."""
    system = random_system(seed)
    circuit = exact_circuit(system, random_scale(system, seed))
    parts = nominal_board(circuit)
    boards = Boards.of(circuit, [replace(parts, inverse_gain=g) for g in (1e-5, 1e-6, 1e-7)])
    which = np.array([0, 2])
    some, alone = BoardModes(boards).take(which), BoardModes(boards.take(which))
    for modes in (some, alone):
        modes.enter_all()
    assert some.targets.keys == alone.targets.keys
    for ours, theirs in zip(some.modes, alone.modes, strict=True):
        np.testing.assert_array_equal(ours, theirs)
