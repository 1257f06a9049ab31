"""Side conditions: loads and noise gains against the reduction, each named when it binds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

from designer.base.errors import Unreachable
from designer.catalog.parts_catalog import load_catalog
from designer.check.synthesis_result import synthesise as synthesise_file
from designer.circuit import build
from designer.circuit.board_values import nominal_board
from designer.circuit.dead_zone_parts import dead_zone_stage, idle_limits
from designer.circuit.design import ConditionCheck, Design
from designer.circuit.netlist import Circuit
from designer.circuit.noise_gains import stages
from designer.circuit.reduction import Reduction
from designer.dynamics.flow import Flow
from designer.dynamics.harmonics import fastest
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.circuit_table import SIDE_CONDITIONS, CircuitSpec
from designer.model.find_responses import Peaks, Reach, find, peaks
from designer.model.model import Dimensionless
from designer.model.model_file import parse_model_file, read_model_file
from designer.model.response_table import Response
from designer.synthesis import limits, parts_choice, side_conditions
from designer.synthesis.limits import GENERATOR_PEAK, LOAD, bandwidth_limit, output_gain
from designer.synthesis.output_loads import Load, Loads

# What each side condition costs is asked where a test is about it: it doubles the time.
synthesise = partial(parts_choice.synthesise, binding=False)

CATALOG = load_catalog()
PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
PEAKS = Peaks(np.array([0.452, 0.787, 0.571, 0.877]), (Reach(0.202, 0.0),), 36.0)
E12 = CircuitSpec(resistors=("E12",))
TL074C = CATALOG.opamp("TL074C")


def circuit(kind: str, **changed: float) -> Circuit:
    """A circuit of the paper's model with unlike values."""
    names = [f"R{i}" for i in (*range(1, 13), 50, *range(100, 108), *range(200, 211))]
    values = {name: 5e3 + 1.3e3 * i for i, name in enumerate(names)}
    values |= {"C1": 1e-8, "C2": 2.2e-8, "C3": 3.3e-8, "C4": 4.7e-8}
    return build.circuit_of(
        PAPER,
        values | changed,
        TL074C,
        supply=15.0,
        saturation=13.0,
        stage=dead_zone_stage(PAPER, CircuitSpec(dead_zone=kind), CATALOG),  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("kind", ["saturation", "rectifier"])
def test_noise_gain_is_what_a_stage_makes_of_its_own_offset(kind: str) -> None:
    """One volt at a section's input, in the mode in which it drives the stop."""
    made = circuit(kind)
    board = nominal_board(made, ideal=True)
    upper = made.stops[0].upper
    assert upper is not None
    mode = made.carrying(upper) if kind == "rectifier" else made.rest
    for stage in stages(made):
        s = stage.section
        if stage.integrates or (kind == "rectifier" and s.name == "U3B"):
            continue
        shifted = replace(board, offset={**board.offset, s.name: 1.0})
        output = "fv" if kind == "rectifier" and s.name == "U3A" else s.output
        moved = [Reduction(made, b).solution(mode).voltage[output][-1] for b in (board, shifted)]
        assert abs(moved[1] - moved[0]) == pytest.approx(stage.gain, rel=1e-9), s.name


def test_an_integrator_s_noise_gain_falls_with_frequency() -> None:
    made = circuit("saturation")
    by_name = {s.section.name: s for s in stages(made)}
    values = made.values
    siemens = sum(1.0 / values[f"R{i}"] for i in (2, 3, 4, 5, 6, 50))
    stage = by_name["U2C"]
    for frequency in (100.0, 1e4):
        gain = 1.0 + siemens / (2.0 * np.pi * frequency * values["C2"])
        assert stage.bandwidth(frequency) == pytest.approx(gain * frequency, rel=1e-12)


def test_loads_count_every_resistor_at_an_output() -> None:
    made = circuit("saturation")
    by_name = {s.section.name: s for s in stages(made)}
    v = made.values

    def parallel(*ohms: float) -> float:
        return 1.0 / sum(1.0 / r for r in ohms)

    assert by_name["U1A"].load == pytest.approx(parallel(v["R4"], v["R100"], v["R200"], v["R206"]))
    assert by_name["U3D"].load == pytest.approx(parallel(v["R50"], v["R210"]))
    divider = v["R204"] + parallel(v["R205"], v["R208"])
    assert by_name["U3C"].load == pytest.approx(parallel(v["R203"], divider))


def test_series_composites_count_as_one_resistor() -> None:
    plain = {s.section.name: s for s in stages(circuit("saturation", R50=3e4))}
    made = build.circuit_of(
        PAPER,
        circuit("saturation").values | {"R50A": 1e4, "R50B": 2e4},
        TL074C,
        supply=15.0,
        saturation=13.0,
        composites={"R50": "series"},
    )
    for stage in stages(made):
        other = plain[stage.section.name]
        assert (stage.load, stage.gain) == pytest.approx((other.load, other.gain))
        assert stage.corner == pytest.approx(other.corner)


@cache
def design() -> Design:
    return synthesise(PAPER, E12, CATALOG, PEAKS)


def test_what_is_found_is_what_the_circuit_has() -> None:
    made = design()
    loads = Loads((Load("U3D", -3.0, 10.0, 2e-3, "a", "a", "a"),), {})
    kept = frozenset(SIDE_CONDITIONS)
    found = {
        c.quantity: c for c in side_conditions.verify(made, kept, TL074C, PEAKS, [1.0, 4.0], loads)
    }
    volts = made.errors.scales.volts * PEAKS.states
    assert found["swing_v"].found == pytest.approx(max(*volts, 10.0))
    assert found["swing_v"].limit == pytest.approx(0.85 * 13.5)
    assert (found["guaranteed_swing_v"].found, found["guaranteed_swing_v"].where) == (10.0, "U3D")
    assert found["signal_share_ratio"].found == pytest.approx(max(volts) / volts[0])
    assert found["signal_offset_ratio"].found == pytest.approx(volts[0] / 10e-3)
    assert (found["output_current_a"].found, found["output_current_a"].limit) == (2e-3, 10e-3)
    assert found["generator_peak_v"].found == 4.0
    assert found["noise_gain_bandwidth_hz"].limit == pytest.approx(0.05 * 2.5e6)
    assert {c.name for c in found.values()} == kept
    only = side_conditions.verify(made, frozenset({"load"}), TL074C, PEAKS, [1.0], loads)
    assert {c.name for c in only} == {"load"}


@pytest.mark.parametrize("section", ["U3B", "U3C"])
def test_sections_that_are_meant_to_saturate_keep_no_swing(section: str) -> None:
    loads = Loads((Load(section, -13.5, 13.5, 1e-3, "a", "a", "a"),), {})
    made = side_conditions.verify(design(), frozenset({"swing"}), TL074C, PEAKS, [1.0], loads)
    assert [check.quantity for check in made] == ["swing_v"]
    assert made[0].holds
    assert side_conditions.saturating(circuit("saturation")) == {"U3B", "U3C"}
    assert side_conditions.saturating(circuit("rectifier")) == frozenset()


def test_a_check_holds_to_its_limit_and_says_when_it_is_near() -> None:
    for least in (False, True):
        at = {r: ConditionCheck("load", "x", 10.0, 10.0 * (r if not least else 1 / r), "", least)
              for r in (0.9, 0.995, 1.0, 1.01)}  # fmt: skip
        assert [at[r].holds for r in at] == [True, True, True, False]
        assert [at[r].at_limit for r in at] == [False, True, True, True]


CHANGES: dict[str, set[str]] = {
    "swing": set(),
    "level": {"level", "share"},
    "load": {"load"},
    "noise_gain": {"noise_gain"},
    "bandwidth": {"seconds"},
    "resistors": {"signal"},
    "generator": set(),
}


@pytest.mark.parametrize("name", SIDE_CONDITIONS)
def test_each_condition_limits_its_own_quantities_alone(name: str) -> None:
    every = frozenset(SIDE_CONDITIONS)
    on, off = (
        limits.limits(CircuitSpec(), kept, TL074C, 13.0, 400.0) for kept in (every, every - {name})
    )
    differ = {f.name for f in fields(on) if getattr(on, f.name) != getattr(off, f.name)}
    assert differ == CHANGES[name] | {"conditions"}


# Each binds somewhere, is named there, and leaving it out frees what it held.


def refused(model: Dimensionless, spec: CircuitSpec, held: Peaks = PEAKS) -> str:
    with pytest.raises(Unreachable) as caught:
        synthesise(model, spec, CATALOG, held)
    assert caught.value.exit_status == 2
    return str(caught.value)


def without(*names: str) -> tuple[str, ...]:
    return tuple(name for name in SIDE_CONDITIONS if name not in names)


def test_load_binds_where_the_stop_is_stiff() -> None:
    # Least R4 = least R50 · mu/gain: above 500 kΩ for 2 kΩ, below for the catalogue's 1 kΩ.
    stiff = replace(PAPER, k0=0.9985)
    assert LOAD * stiff.mu / output_gain(PEAKS) > 500e3 > 1e3 * stiff.mu / output_gain(PEAKS)
    message = refused(stiff, E12)
    assert "binds: stop stiffness; side condition: load, resistors" in message
    assert "side_conditions without load or resistors" in message
    made = synthesise(stiff, replace(E12, side_conditions=without("load")), CATALOG, PEAKS)
    assert made.circuit.values["R50"] < LOAD


@pytest.mark.slow
def test_bandwidth_binds_where_harmonics_are_fast() -> None:
    fast = replace(PEAKS, fastest=4e4)
    # Even an inverter is too slow for it in the slowest time scale of the band.
    slowest = 1.0 / (2.0 * np.pi * E12.frequency[0])
    assert 2.0 * fast.fastest / (2.0 * np.pi * slowest) > bandwidth_limit(TL074C)
    assert "binds: frequency; side condition: bandwidth" in refused(PAPER, E12, fast)
    made = synthesise(PAPER, replace(E12, side_conditions=without("bandwidth")), CATALOG, fast)
    assert made.circuit.values == design().circuit.values


def test_bandwidth_slows_the_circuit_down() -> None:
    quick = Peaks(PEAKS.states, (Reach(PEAKS.penetration, 0.0),), 300.0)
    bare = synthesise(PAPER, replace(E12, side_conditions=without("bandwidth")), CATALOG, quick)
    limit = bandwidth_limit(TL074C)
    kept = frozenset({"bandwidth"})
    (missed,) = side_conditions.verify(bare, kept, TL074C, quick, [1.0], None)
    assert missed.found > limit
    made = synthesise(PAPER, replace(E12, side_conditions=("bandwidth", "level")), CATALOG, quick)
    (held,) = side_conditions.verify(made, kept, TL074C, quick, [1.0], None)
    assert held.holds


@pytest.mark.slow
def test_noise_gain_binds(monkeypatch: pytest.MonkeyPatch) -> None:
    """No dead zone does with a noise gain of 1.5: an inverter alone has 2."""
    for module in (limits, side_conditions):
        monkeypatch.setattr(module, "NOISE_GAIN", 1.5)
    assert "side condition: noise_gain" in refused(PAPER, E12)
    made = synthesise(PAPER, replace(E12, side_conditions=without("noise_gain")), CATALOG, PEAKS)
    assert made.errors.max_error == pytest.approx(design().errors.max_error)


@pytest.mark.slow
def test_level_binds_where_the_clearance_is_never_reached() -> None:
    wide = replace(PAPER, b=1e6)
    assert "binds: level" in refused(wide, E12)
    free = synthesise(wide, replace(E12, side_conditions=without("level")), CATALOG, PEAKS)
    assert free.volts()[0] * PEAKS.states[0] < 10.0 * TL074C.offset_limit


@pytest.mark.slow
@pytest.mark.parametrize("composites", [(), ("R4",)])
def test_what_costs_error_is_named_with_what_it_costs(composites: tuple[str, ...]) -> None:
    """E12 without a stop between 200 kΩ and 1 MΩ: both conditions leave worse ratios. The parts
    stand before these are sought."""
    spec = replace(E12, resistor_range=(2e5, 1e6), composites=composites)
    model = replace(PAPER, k0=0.0)
    told: list[Design] = []
    made = parts_choice.synthesise(model, spec, CATALOG, PEAKS, stand=told.append)
    assert set(made.binding) == {"level", "resistors"}
    assert told == [replace(made, binding={}, seconds=0.0)]
    for name, error in made.binding.items():
        freer = replace(spec, side_conditions=without(name))
        again = synthesise(model, freer, CATALOG, PEAKS)
        assert again.errors.max_error == pytest.approx(error, abs=1e-9)
        assert error < made.errors.max_error - 1e-6


def test_the_generator_limits_the_amplitude() -> None:
    spec = replace(E12, resistor_range=(2e5, 1e6))
    model = replace(PAPER, k0=0.0)
    made = synthesise(model, spec, CATALOG, PEAKS)
    free = synthesise(model, replace(spec, side_conditions=without("generator")), CATALOG, PEAKS)
    assert made.amplitude() <= GENERATOR_PEAK * 1.002 < free.amplitude()
    assert any(c.name == "generator" and c.at_limit for c in made.checks)
    assert made.errors.max_error == pytest.approx(free.errors.max_error)


@pytest.mark.slow
def test_swing_is_kept_by_the_outputs_of_the_finished_circuit() -> None:
    """An aim that real outputs miss is lowered until they keep it."""
    file = read_model_file(Path(__file__).parents[2] / "examples" / "drill.toml")
    found = find(file.model, file.responses)
    held = peaks(file.model, found)
    # Half of the true peaks, so that the first circuit is twice too loud.
    low = replace(held, states=0.5 * held.states, reaches=(Reach(0.5 * held.penetration),))
    made = synthesise(file.model, replace(file.circuit, resistors=("E24",)), CATALOG, low, found)
    check = next(c for c in made.checks if c.name == "swing")
    assert check.holds
    quiet = (made.errors.scales.volts * held.states).max()
    assert quiet <= check.limit * 1.005


# Harmonics.


def test_the_highest_harmonic_of_a_kinked_response_is_where_its_spectrum_says() -> None:
    """Against the Fourier integral of the impacting orbit itself, line by line."""
    (one,) = find(PAPER, [Response(0.85)])
    flow = Flow(PAPER.second_order().piecewise_linear(), Drive(0.85))
    found = fastest(flow, one.orbit)
    n, points = one.orbit.n, 4096
    run = flow.run(one.orbit.start, n, mode=one.orbit.mode or None, points=points)
    phase = 2.0 * np.pi * np.arange(n * points) / (n * points)
    last = 0
    for column in (1, 3):
        v = run.strobes[:-1, column]
        lines = [abs(np.mean(v * np.exp(-1j * k * phase))) for k in range(1, 400 * n)]
        last = max(last, *(k + 1 for k, a in enumerate(lines) if a > 1e-3 * max(lines)))
    assert found == pytest.approx(0.85 * last / n)
    assert found > 5.0 * 0.85


def test_a_response_without_a_period_has_a_highest_harmonic_too() -> None:
    flow = Flow(PAPER.second_order().piecewise_linear(), Drive(1.0))
    rest = Orbit(OrbitStatus.APERIODIC, start=np.zeros(4))
    assert 1.0 <= fastest(flow, rest) < 512.0


def test_how_far_a_rectifier_may_drive_its_output() -> None:
    """The idle half's clamp carries what both thresholds ask of its input resistor, by Kirchhoff's
    law, and two drops come on top; the driving section is a drop beyond fv, and what it holds while
    idle does not count."""
    halves = dict.fromkeys(("R200", "R203"), 1e4) | dict.fromkeys(("R202", "R205"), 2e4)
    made = circuit("rectifier", **halves, R201=1.2e4, R204=1e4, R208=1.2e4, R209=9e3)
    volts = {r.name: r.volts for r in made.references}
    drop = made.diodes[0].model.drop
    reach = idle_limits(made, made.values)
    assert {section: diode for section, (diode, _) in reach.items()} == {
        "U3A": "D202",
        "U3B": "D200",
    }
    assert reach["U3A"][1] == pytest.approx((0.9 + 0.75) * volts["VR2"] + 2.0 * drop)
    assert reach["U3B"][1] == pytest.approx(-(1.0 + 1.2) * volts["VR1"] - 2.0 * drop)
    assert idle_limits(circuit("saturation"), circuit("saturation").values) == {}
    design_ = replace(design(), circuit=made)
    for low, high, diode, fv in (
        (-10.7, 9.0, "D202", 9.0 - drop),
        (-30.0, 11.0, "D202", 11.0 - drop),
        (-10.7, 1.0, "D200", 8.0 - drop),
    ):
        loads = Loads((Load("U3A", low, high, 1e-3, "a", "a", "a"),
                       Load("U3B", -8.0, 10.7, 1e-3, "a", "a", "a")), {})  # fmt: skip
        kept = frozenset({"swing"})
        found = {
            c.quantity: c for c in side_conditions.verify(design_, kept, TL074C, PEAKS, [], loads)
        }
        check = found["rectifier_fv_v"]
        assert check.where == diode
        assert check.found == pytest.approx(fv)
        assert check.holds is (fv < abs(reach["U3A" if diode == "D202" else "U3B"][1]))


@pytest.mark.slow
def test_a_rectifier_on_high_rails_is_scaled_down(monkeypatch: pytest.MonkeyPatch) -> None:
    """On ± 18 V the swing alone would let fv pass what two 5 V references allow."""
    path = Path(__file__).resolve().parents[2] / "examples" / "paper.toml"
    text = path.read_text(encoding="utf-8")
    text = text[: text.index("[[response]]")] + text[text.index("[circuit]") :]
    text = text.replace("b = 0.25", "b = 0.2")
    text = text.replace("[circuit]", "[[response]]\nomega = 0.85\n\n[circuit]")
    text = text.replace('"saturation"', '"rectifier"').replace('"TL074C"', '"OPA4192"')
    text = text.replace("supply = 15.0", "supply = 18.0")
    text = "\n".join(line for line in text.splitlines() if not line.startswith("saturation"))
    modelfile = parse_model_file(text)

    def fv() -> ConditionCheck:
        made = synthesise_file(modelfile, CATALOG).design
        return next(c for c in made.checks if c.quantity == "rectifier_fv_v")

    def lower(circuit: Circuit, values: Mapping[str, float]) -> dict[str, tuple[str, float]]:
        # So low that whichever circuit comes first is beyond it.
        return {at: (name, 0.7 * end) for at, (name, end) in idle_limits(circuit, values).items()}

    monkeypatch.setattr("designer.synthesis.side_conditions.idle_limits", lower)
    assert fv().holds
    monkeypatch.setattr(
        "designer.synthesis.limits.ConditionLimits.tightened", lambda self, *_, **__: self
    )
    with pytest.raises(Unreachable, match="swing"):
        fv()


def test_what_hangs_behind_a_diode_loads_a_section() -> None:
    """No resistor stands on the output of a rectifier with one stop; R50 does, behind the diode."""
    model, spec = replace(PAPER, sides="upper"), CircuitSpec(dead_zone="rectifier")
    made = build.circuit_of(
        model,
        circuit("rectifier").values,
        TL074C,
        supply=15.0,
        saturation=13.0,
        stage=dead_zone_stage(model, spec, CATALOG),
    )
    within = limits.limits(spec, frozenset({"load"}), TL074C, 13.0, 400.0)
    broken = ConditionCheck("load", "load_ohm", 2e3, 1e3, "U3A", least=True)
    tighter = within.tightened([broken], replace(design(), circuit=made), slower=False)
    assert tighter.load == pytest.approx(made.values["R50"], rel=2e-3)


BY = 1.25 * (1.0 + limits.MARGIN)
"""What a limit is tightened by where a check is 25 % beyond its own."""


@pytest.mark.parametrize(
    ("name", "quantity", "slower", "changes"),
    [
        ("noise_gain", "noise_gain", False, {"noise_gain": limits.NOISE_GAIN / BY}),
        ("level", "signal_level_ratio", False, {"level": limits.LEVEL_RATIO / BY}),
        ("level", "signal_share_ratio", False, {"share": limits.SHARE / BY}),
        ("swing", "swing_v", False, {"swing": 0.85 * 13.0 / BY}),
        ("generator", "generator_peak_v", True, {"swing": 0.85 * 13.0 / BY}),
        ("level", "signal_offset_ratio", True, {}),
    ],
)
def test_what_is_broken_is_tightened_by_how_much_it_is(
    name: str, quantity: str, slower: bool, changes: dict[str, float]
) -> None:
    within = limits.limits(CircuitSpec(), frozenset(SIDE_CONDITIONS), TL074C, 13.0, 400.0)
    far = replace(design(), checks=(ConditionCheck("swing", "swing_v", 99.0, 99.0),))
    tighter = within.tightened([ConditionCheck(name, quantity, 4.0, 5.0)], far, slower=slower)
    assert tighter == replace(within, **changes)  # type: ignore[arg-type]


def test_a_stage_that_is_too_fast_is_slowed_down_or_loses_gain() -> None:
    """By the time scale, or, where that is not to change, by the gain of the stage itself."""
    made = design()
    within = limits.limits(CircuitSpec(), frozenset(SIDE_CONDITIONS), TL074C, 13.0, 400.0)
    stage = max((s for s in stages(made.circuit) if not s.integrates), key=lambda s: s.gain)
    broken = ConditionCheck("bandwidth", "noise_gain_bandwidth_hz", 1e5, 1.25e5, stage.section.name)
    slow = within.tightened([broken], made, slower=True)
    assert slow == replace(within, seconds=(slow.seconds[0], within.seconds[1]))
    assert slow.seconds[0] == pytest.approx(made.errors.scales.seconds * BY)
    flat = within.tightened([broken], made, slower=False)
    assert flat == replace(within, noise_gain=stage.gain / BY)
