"""The rectifying dead zone: its reduction against formulas done by hand, and as a system."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from designer.base.errors import InputError
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.dead_zone_parts import dead_zone_stage
from designer.circuit.netlist import Circuit
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.circuit.resistors import composites_of
from designer.dynamics.attractors import describe, settle, twin
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.circuit_table import CircuitSpec
from designer.model.clearance import Sides
from tests.shared.stages import CATALOG, PAPER, SATURATION, VREF, model, rectifier, stage
from tests.shared.symmetric_shooting import shoot_symmetric

NOMINAL = rectifier()
BOTH = stage("rectifier", "both", NOMINAL)


def spread(circuit: Circuit, seed: int, by: float = 0.05, offset: float = 5e-3) -> Board:
    """A board whose parts are off by up to ``by``, with offsets and references of its own."""
    rng = np.random.default_rng(seed)
    return replace(
        nominal_board(circuit),
        values={n: v * (1.0 + by * rng.uniform(-1, 1)) for n, v in circuit.values.items()},
        offset={s.name: float(rng.uniform(-offset, offset)) for s in circuit.sections},
        reference={r.name: r.volts * (1 + 0.01 * rng.uniform(-1, 1)) for r in circuit.references},
    )


def fv_by_hand(v: float, board: Board) -> float:
    """fv at voltage v on C1: each half by Kirchhoff's law at its summing node, ideal op-amps.

    The half that asks for more than the dead zone's leftover drives fv; there is never both.
    """
    R, os, ib = board.values, board.offset, board.bias.get("U1A", 0.0)
    v1 = v + os["U1A"]
    inverse = os["U2A"] + R["R101"] * ((os["U2A"] - v1) / R["R100"] + ib)

    def half(o: float, reference: float, a: str, b: str, c: str) -> float:
        return o + R[c] * (ib + (o - inverse) / R[a] + (o - reference) / R[b])

    upper = half(os["U3A"], board.reference["VR1"], "R200", "R201", "R202")
    lower = half(os["U3B"], -board.reference["VR2"], "R203", "R204", "R205")
    nodes = {"R202": os["U3A"], "R205": os["U3B"], "R50": os["U2C"]}
    rest = sum(o / R[n] for n, o in nodes.items()) / sum(1.0 / R[n] for n in nodes)
    return max(rest, upper) if upper - rest > rest - lower else min(rest, lower)


@settings(max_examples=80)
@given(seed=st.integers(0, 10**6), v=st.floats(-5.5, 5.5))
def test_output_is_kirchhoff_s(seed: int, v: float) -> None:
    """Slope, threshold and leftover of both halves, with offsets, bias and spread."""
    board = replace(
        spread(BOTH, seed), inverse_gain=1e-10, bias={s.name: 1e-7 for s in BOTH.sections}
    )
    want = fv_by_hand(v, board)
    assume(abs(want) < 9.0)
    reduction = Reduction(BOTH, board)
    x = np.array([v, 0.0, 0.0, 0.0])
    key = reduction.system().mode_at(x, 0.0)
    got = reduction.output(key, "fv", x[None, :], np.zeros(1))[0]
    assert got == pytest.approx(want, rel=1e-6, abs=1e-6)


@settings(max_examples=60)
@given(seed=st.integers(0, 10**6))
def test_dead_zone_is_flat_whatever_the_mismatch(seed: int) -> None:
    """d(fv)/d(v1) in units of K1 below 1e-4 for parts 5 % off, while slopes and ends move."""
    board = spread(BOTH, seed)
    R = board.values
    reduction = Reduction(BOTH, board)
    system = reduction.system()
    leftover = reduction.solution(system.start).voltage["fv"][0] / R["R50"] * R["R4"]
    assert abs(leftover) < 1e-4
    gain = R["R101"] / R["R100"]
    stop = BOTH.stops[0]
    rows = system.contact_rows(0)
    for side, source, level, feedback, contact in (
        (1, "R200", "R201", "R202", stop.upper),
        (-1, "R203", "R204", "R205", stop.lower),
    ):
        assert contact is not None
        steep = reduction.solution(BOTH.carrying(contact)).voltage["fv"][0]
        assert steep == pytest.approx(gain * R[feedback] / R[source], rel=1e-3)
        volts = board.reference["VR1" if side > 0 else "VR2"] * R[source] / R[level] / gain
        end = -side * rows[side][-1] / rows[side][0] * side
        # The ends move by offsets, in the worst case as the sum of all that stand before.
        assert abs(end - side * volts) < 0.1
    moved = spread(BOTH, seed + 1)
    other = Reduction(BOTH, moved).system().contact_rows(0)
    assert rows[1][-1] != other[1][-1]


@pytest.mark.parametrize("sides", ["both", "upper", "lower"])
def test_exact_values_have_no_error(sides: Sides) -> None:
    circuit = stage("rectifier", sides, NOMINAL)
    found = coefficient_errors(circuit, model(sides).second_order())
    assert found.max_error < 1e-9
    slopes = {"both": {"upper stop slope", "lower stop slope"}}.get(sides, {"stop slope"})
    assert {n for n in found.errors if n.endswith("stop slope")} == slopes
    assert found.errors["dead-zone null"] == pytest.approx(0.0, abs=1e-12)
    assert ("dead-zone bias" in found.errors) is (sides != "both")
    scales = found.scales
    assert scales.threshold == pytest.approx(2.0, rel=1e-9)
    assert scales.volts[0] == pytest.approx(8.0, rel=1e-9)
    assert math.isnan(scales.threshold_lower) is (sides == "upper")
    assert scales.offcentre == pytest.approx(0.0, abs=1e-12)


def test_each_half_has_a_slope_and_a_threshold_of_its_own() -> None:
    values = {**NOMINAL, "R205": NOMINAL["R205"] * 1.02, "R204": NOMINAL["R204"] / 1.05}
    found = coefficient_errors(stage("rectifier", "both", values), PAPER.second_order())
    # The errors share every scale, so 2 % between the slopes is 1 % for each at best.
    apart = found.errors["lower stop slope"] - found.errors["upper stop slope"]
    assert apart == pytest.approx(math.log(1.02), rel=1e-6)
    assert found.max_error == pytest.approx(math.log(1.02) / 2.0, rel=1e-6)
    assert found.scales.threshold == pytest.approx(2.0)
    assert found.scales.threshold_lower == pytest.approx(2.1)
    assert found.scales.offcentre == pytest.approx(-0.1 / 4.1)


def test_parts_that_carry_no_signal_change_nothing() -> None:
    """Feeds of the references, the clamps' resistors."""
    other = {**NOMINAL, "R206": 1e3, "R207": 5e3, "R208": 33e3, "R209": 47e3}
    one, two = (
        Reduction(c, nominal_board(c, ideal=True)).system().mode(c.rest)
        for c in (BOTH, stage("rectifier", "both", other))
    )
    assert two.A.ravel() == pytest.approx(one.A.ravel(), rel=1e-9, abs=1e-6)


def test_clamp_resistors_follow_the_thresholds_where_none_is_given() -> None:
    values = {n: v for n, v in NOMINAL.items() if n not in ("R208", "R209")}
    circuit = stage("rectifier", "both", values)
    assert circuit.values["R208"] == values["R201"]
    assert circuit.values["R209"] == values["R204"]


@pytest.mark.parametrize(("v1", "on"), [(6.0, False), (6.55, True)])
def test_the_idle_half_stays_off_as_far_as_its_clamp_lifts_it(v1: float, on: bool) -> None:
    """fv up to 2 Vref R209/R204 and two drops: 11.2 V. Past that D202 conducts."""
    reduction = Reduction(BOTH, nominal_board(BOTH))
    system = reduction.system()
    x = np.array([v1, 0.0, 0.0, 0.0])
    key = system.mode_at(x, 0.0)
    fv, w2 = (reduction.output(key, net, x[None, :], np.zeros(1))[0] for net in ("fv", "w2"))
    drop = BOTH.diodes[0].model.drop
    assert fv == pytest.approx(2.49 * (v1 - 2.0), rel=1e-3)
    # The clamp's current is 2 Vref/R204, whatever the depth of the contact.
    resistance = BOTH.diodes[0].model.resistance * 2.0 * VREF / NOMINAL["R204"]
    if not on:
        assert w2 == pytest.approx(2.0 * VREF + drop + resistance, rel=1e-3)
    assert bool(key[BOTH.switches.index("D202")]) is on
    assert bool(fv > 2.0 * VREF + 2.0 * drop) is on


def test_a_clamp_that_lifts_past_the_limit_spoils_the_dead_zone() -> None:
    """U3B clips inside the clearance where 2 Vref R209/R204 and a drop pass its limit."""
    drop = BOTH.diodes[0].model.drop
    most = (SATURATION - drop) / (2.0 * VREF) * NOMINAL["R204"]
    fine = stage("rectifier", "both", {**NOMINAL, "R208": 0.999 * most, "R209": 0.999 * most})
    assert coefficient_errors(fine, PAPER.second_order()).max_error < 1e-9
    for name, section in (("R208", "U3A"), ("R209", "U3B")):
        spoilt = stage("rectifier", "both", {**NOMINAL, name: 1.001 * most})
        with pytest.raises(ArithmeticError, match=section):
            coefficient_errors(spoilt, PAPER.second_order())


def test_without_gain_only_the_hand_over_has_no_answer() -> None:
    reduction = Reduction(BOTH, nominal_board(BOTH, ideal=True))
    system = reduction.system()
    assert system.mode(BOTH.rest).sides == (0,)
    assert BOTH.stops[0].upper is not None
    assert system.mode(BOTH.carrying(BOTH.stops[0].upper)).sides == (1,)
    handing = list(BOTH.rest)
    handing[BOTH.switches.index("D201")] = 0
    with pytest.raises(FloatingCircuit):
        system.mode(tuple(handing))


def test_hand_over_is_nanoseconds_and_four_mode_changes_a_contact() -> None:
    reduction = Reduction(BOTH, nominal_board(BOTH))
    system = reduction.system()
    handing = list(BOTH.rest)
    handing[BOTH.switches.index("D201")] = 0
    between = system.mode(tuple(handing))
    series = next(g for g in between.guards if g.target[BOTH.switches.index("D200")])
    begins, ends = system.contact_rows(0)[1], np.append(series.C, [series.D, series.e])
    width = -ends[-1] / ends[0] + begins[-1] / begins[0]
    # Two drops at the output, over the gain and the attenuation from v1 to the summing node.
    drops = 2.0 * BOTH.diodes[0].model.drop
    R = NOMINAL
    output = 1.0 / (1.0 / R["R50"] + 1.0 / R["R205"])
    other = 1.0 / R["R201"] + 1.0 / (R["R202"] + output)
    attenuation = (1.0 / R["R200"]) / (1.0 / R["R200"] + other)
    assert width == pytest.approx(drops * reduction.board.inverse_gain / attenuation, rel=0.02)
    speed = 8.0 * 0.2 / 6e-4  # V/s: a slow contact, x1' = 0.2
    assert width / speed < 2e-8
    errors = coefficient_errors(BOTH, PAPER.second_order())
    drive = Drive(2 * np.pi * errors.scales.frequency(1.55), -1.0 / errors.drive_gain[0])
    flow = Flow(system, drive)
    run = flow.run(np.zeros(4), 40)
    count = flow.run(run.strobes[-1], 1, mode=run.mode).counts.sum()
    few = flow.run(run.strobes[-1], 1, mode=run.mode, max_events=4 * int(count))
    assert few.status is FlowStatus.DONE


@pytest.mark.parametrize("omega", [1.55, 0.85, 0.54, 0.337, 0.215])
def test_exact_values_follow_the_model(omega: float) -> None:
    """n-p-q, states, impacts, penetration and miss of the model's own orbit, in volts."""
    found = coefficient_errors(BOTH, PAPER.second_order())
    on_model = settle(Flow(PAPER.second_order().piecewise_linear(), Drive(omega)), np.zeros(4))
    drive = Drive(2 * np.pi * found.scales.frequency(omega), -1.0 / found.drive_gain[0])
    board = replace(nominal_board(BOTH), inverse_gain=1e-9, bias={})
    on_circuit = settle(
        Flow(Reduction(BOTH, board).system(), drive), on_model.start * found.scales.volts
    )
    assert on_circuit.response == on_model.response
    volts, peak = found.scales.volts, np.abs(on_model.extremes).max(axis=1)
    assert (np.abs(on_circuit.start / volts - on_model.start) < 2e-6 * peak).all()
    for name in ("penetration", "miss"):
        here, there = (getattr(o, name) for o in (on_circuit, on_model))
        assert here / volts[0] == pytest.approx(there, rel=1e-5, abs=1e-6)
    assert on_circuit.impact_sides == pytest.approx(on_model.impact_sides)
    assert on_circuit.impact_velocities / volts[1] == pytest.approx(
        on_model.impact_velocities, rel=1e-4, abs=1e-5
    )


@pytest.mark.parametrize("sides", ["upper", "lower"])
@pytest.mark.parametrize("omega", [1.55, 0.54, 0.41])
def test_one_stop_follows_the_model(sides: Sides, omega: float) -> None:
    circuit, wanted = stage("rectifier", sides, rectifier(0.6)), model(sides)
    assert len(circuit.diodes) == 2
    assert len(circuit.references) == 1
    assert {s.net for s in circuit.supplies} == {"vcc" if sides == "upper" else "vee"}
    found = coefficient_errors(circuit, wanted.second_order())
    on_model = settle(Flow(wanted.second_order().piecewise_linear(), Drive(omega)), np.zeros(4))
    drive = Drive(2 * np.pi * found.scales.frequency(omega), -1.0 / found.drive_gain[0])
    board = replace(nominal_board(circuit), inverse_gain=1e-9, bias={})
    reduction = Reduction(circuit, board)
    orbit = settle(Flow(reduction.system(), drive), on_model.start * found.scales.volts)
    assert on_model.status is OrbitStatus.PERIODIC
    assert orbit.response == on_model.response
    assert (orbit.p == 0) is (sides == "lower")
    peak = np.abs(on_model.extremes).max(axis=1)
    assert (np.abs(orbit.start / found.scales.volts - on_model.start) < 1e-5 * peak).all()
    assert reduction.system().mirror is None


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6))
def test_the_mode_of_a_state_from_anywhere(seed: int) -> None:
    """Any start, any mode to begin with, consistent or not: one answer, and it holds."""
    rng = np.random.default_rng(seed)
    board = spread(BOTH, seed)
    system = Reduction(BOTH, board).system()
    x = rng.uniform(-12.0, 12.0, 4) * rng.choice([0.01, 0.1, 0.3, 1.0])
    u = float(rng.uniform(-5, 5))
    sections = len(BOTH.sections)
    free = [i for i, s in enumerate(BOTH.sections) if s.limits]
    found = set()
    for _ in range(8):
        near = [0] * sections + [int(rng.integers(0, 2)) for _ in BOTH.diodes]
        for i in free:
            near[i] = int(rng.integers(-1, 2))
        key = system.mode_at(x, u, tuple(near))
        mode = system.mode(key)
        for g in mode.guards:
            size = np.abs(g.C) @ np.abs(x) + abs(g.D * u) + abs(g.e)
            assert g.C @ x + g.D * u + g.e <= 1e-12 * size
        found.add(key)
    assert len(found) == 1
    assert found == {system.mode_at(x, u)}


def test_vector_field_is_continuous_across_every_boundary() -> None:
    """Diodes are continuous as limits are: the saltation matrix is the identity."""
    rng = np.random.default_rng(3)
    system = Reduction(BOTH, spread(BOTH, 7)).system()
    met, todo, seen = {system.start}, [system.start], 0
    stage_only = {i for i, s in enumerate(BOTH.switches) if s[:2] in ("U3", "D2")}
    while todo and len(met) < 40:
        key = todo.pop()
        mode = system.mode(key)
        for g in mode.guards:
            changed = [i for i, (a, b) in enumerate(zip(key, g.target, strict=True)) if a != b]
            if not set(changed) <= stage_only or not np.abs(g.C).any():
                continue
            there = system.mode(g.target)
            x = rng.standard_normal(4)
            x -= g.C * (g.C @ x + g.e) / (g.C @ g.C)
            back = [h for h in there.guards if h.target == key]
            assert len(back) == 1
            here, other = mode.A @ x + mode.d, there.A @ x + there.d
            scale = np.abs(mode.A @ np.diag(np.abs(x))).max() + np.abs(mode.d).max()
            assert other == pytest.approx(here, rel=1e-6, abs=1e-7 * scale)
            seen += 1
            if g.target not in met:
                met.add(g.target)
                todo.append(g.target)
    assert seen > 40


def test_the_halves_change_places_under_the_mirror() -> None:
    board = replace(nominal_board(BOTH), bias={})
    system = Reduction(BOTH, board).system()
    assert system.mirror is not None
    errors = coefficient_errors(BOTH, PAPER.second_order())
    drive = Drive(2 * np.pi * errors.scales.frequency(0.85), -1.0 / errors.drive_gain[0])
    flow = Flow(system, drive)
    rng = np.random.default_rng(2)
    x = rng.uniform(-1.0, 1.0, 4) * errors.scales.volts * 0.3
    # The drive turns its sign in half a period, so half a period on the image is the state.
    direct = flow.run(x, 2, points=2).strobes
    there = flow.run(direct[1] @ system.mirror.T, 1, points=2).strobes
    assert there == pytest.approx(direct[1:4] @ system.mirror.T, abs=1e-9)
    orbit = settle(flow, np.zeros(4))
    found = shoot_symmetric(flow, orbit.start, orbit.n)
    assert found is not None
    symmetric = describe(flow, found[0], orbit.n, found[1])
    assert symmetric.asymmetry < 1e-9
    other = twin(flow, orbit)
    assert other is not None
    assert (other.n, other.p, other.q) == (orbit.n, orbit.q, orbit.p)


@pytest.mark.parametrize("part", ["R200", "R204", "R205", "VR2", "D203", "offset"])
def test_no_mirror_where_the_halves_differ(part: str) -> None:
    board = replace(nominal_board(BOTH), bias={})

    def moved(name: str, values: Mapping[str, float]) -> dict[str, float]:
        return {**values, **({name: values[name] * 1.001} if name in values else {})}

    changed = replace(
        board,
        values=moved(part, board.values),
        reference=moved(part, board.reference),
        drop=moved(part, board.drop),
        offset={**board.offset, "U3A": 1e-6 if part == "offset" else 0.0},
    )
    assert Reduction(BOTH, changed).system().mirror is None
    irrelevant = replace(board, values=moved("R206", board.values))
    assert Reduction(BOTH, irrelevant).system().mirror is not None


def test_clipped_is_what_the_dead_zone_has_no_part_in() -> None:
    """U3A at its limit is a soft stop; an integrator at its limit is clipping."""
    system = Reduction(BOTH, nominal_board(BOTH)).system()
    names = BOTH.switches
    deep = system.mode_at(np.array([8.5, 0.0, 0.0, 0.0]), 0.0)
    assert deep[names.index("U3A")] == 1
    assert system.mode(deep).sides == (1,)
    assert not system.mode(deep).clipped
    over = system.mode_at(np.array([0.0, 14.0, 0.0, 0.0]), 0.0)
    assert over[names.index("U2C")] == 1
    assert system.mode(over).clipped


def test_composites_are_two_parts_and_one_resistance() -> None:
    values = {**NOMINAL}
    total = {n: values.pop(n) for n in ("R50", "R201", "R4")}
    values |= {"R50A": 0.3 * total["R50"], "R50B": 0.7 * total["R50"]}
    values |= {"R4A": 0.9 * total["R4"], "R4B": 0.1 * total["R4"]}
    values |= {"R201A": 4.0 * total["R201"], "R201B": total["R201"] / 0.75, "R208": 25e3}
    kinds = {"R50": "series", "R4": "series", "R201": "parallel"}
    circuit = stage("rectifier", "both", values, kinds)  # type: ignore[arg-type]
    assert {"r50m", "r4m"} <= set(circuit.nets)
    assert "r201m" not in circuit.nets
    assert composites_of(circuit) == kinds
    assert composites_of(BOTH) == {}
    assert set(circuit.values) == {*values, "R209"} - {"R12"}
    found = coefficient_errors(circuit, PAPER.second_order())
    assert found.max_error < 1e-9
    assert found.scales.threshold == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("composites", "field"),
    [({"R77": "series"}, "composites"), ({"C1": "parallel"}, "composites"),
     ({"R50": "both"}, "composites.R50")],
)  # fmt: skip
def test_composites_of_nothing_are_refused(composites: dict[str, str], field: str) -> None:
    values = {**NOMINAL, "R50A": 1e3, "R50B": 1e3}
    with pytest.raises(InputError) as raised:
        stage("rectifier", "both", values, composites)  # type: ignore[arg-type]
    assert raised.value.field == field


def test_an_unknown_diode_or_reference_is_refused() -> None:
    spec = CircuitSpec(dead_zone="rectifier")
    with pytest.raises(InputError, match="1N4148"):
        dead_zone_stage(model(), replace(spec, diode="1N4184"), CATALOG)
    with pytest.raises(InputError, match="LM4040"):
        dead_zone_stage(model(), replace(spec, reference="LM4041"), CATALOG)
