"""The table [spread] against what it says: who depends on what, moments, tracking, temperature."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.board_arrays import Boards
from designer.circuit.netlist import Circuit
from designer.model.distributions import Binned, Normal, Split, Uniform
from designer.model.model_file import ModelFile, parse_model_file
from designer.report.spread_words import words_of
from designer.spread.part_rules import spread_of
from designer.spread.random_streams import cube
from designer.spread.spread import BOARD, Group, Spread, draw, draw_many, part_of
from tests.circuit.test_reduction import EXACT, circuit_of
from tests.shared.stages import bought, rectifier, stage

ROOT = Path(__file__).resolve().parents[2]
CATALOG = load_catalog()
CIRCUIT = circuit_of(EXACT)
RECTIFIER = stage("rectifier", "both", rectifier())
SOLD = stage("rectifier", "both", bought(rectifier()))
BENCH = Spread(0.01, 0.05, 3e-3, 10e-3)
N = 20_000
PAPER = (ROOT / "examples" / "paper.toml").read_text(encoding="utf-8")
EVERYTHING = replace(
    BENCH,
    resistor_shape=Normal(1.0 / 3.0),
    bias=Split(2e-11, 6.5e-11, 2e-10),
    gain_bandwidth=Uniform(2.5e6, 4e6),
    supply=0.02,
    grades={"R203": 0.001, "VR1": 0.002},
    shapes={"C1": Binned(0.2)},
    temperature=(30.0, 60.0),
    tempco={name: Uniform(-1e-4, 2e-4) for name in ("R1", "R203", "R204", "C1", "VR1")},
    ageing={name: Uniform(-0.01, 0.0) for name in ("R2", "R203", "R204")},
    groups=(Group("network:1", ("R203", "R204"), 0.7), Group("reel:R:1k", ("R1", "R2"), 0.5, True)),
)


def of(table: str, circuit: Circuit = CIRCUIT) -> Spread:
    return spread_of(modelfile(table), circuit, CATALOG)


def modelfile(table: str) -> ModelFile:
    return parse_model_file(f"{PAPER}\n[spread]\n{table}\n")


def quantities(boards: Boards) -> dict[str, Array]:
    """Every array of the boards, by kind and name."""
    kinds = ("values", "offset", "low", "high", "bias", "reference", "supply", "gain_bandwidth")
    return {
        f"{kind} {name}": column for kind in kinds for name, column in getattr(boards, kind).items()
    }


def test_a_file_without_the_table_means_bench_1() -> None:
    spread = spread_of(parse_model_file(PAPER), CIRCUIT, CATALOG)
    assert spread == Spread.bench_1(CATALOG.opamp("TL074C"), 0.01, 0.01) == of("")
    assert spread.name == "bench-1"
    assert of("supply = 0.01").name != "bench-1"


def test_each_number_moves_what_it_is_named_after_and_nothing_else() -> None:
    """One column of the cube moved at a time."""
    names = EVERYTHING.coordinates(RECTIFIER)
    assert len(set(names)) == len(names)
    middle = np.full((1, len(names)), 0.4)
    base = quantities(EVERYTHING.from_cube(RECTIFIER, middle))
    members = {"network:1": {"R203", "R204"}, "reel:R:1k": {"R1", "R2"}}
    seen = set()
    for k, name in enumerate(names):
        moved = middle.copy()
        moved[0, k] = 0.9
        now = quantities(EVERYTHING.from_cube(RECTIFIER, moved))
        changed = {which for which in base if now[which][0] != base[which][0]}
        what = name.rpartition(".")[2]
        owner = part_of(name)
        sections = [s.name for s in RECTIFIER.sections]
        if name == "temperature":
            wanted = {f"values {p}" for p in EVERYTHING.tempco if p != "VR1"} | {"reference VR1"}
        elif owner in members:
            # Of a group's tempco and ageing only the parts that have them know.
            has = {"tempco": EVERYTHING.tempco, "ageing": EVERYTHING.ageing}.get(what)
            wanted = {f"values {p}" for p in members[owner] if has is None or p in has}
        elif name in ("VCC", "VEE"):
            side = "high" if name == "VCC" else "low"
            wanted = {f"supply {name}"} | {f"{side} {s}" for s in sections}
        elif owner in sections:
            kind = "gain_bandwidth" if what == "gbw" else what
            wanted = {f"{kind} {owner}"}
        else:
            wanted = {f"{'reference' if owner.startswith('VR') else 'values'} {owner}"}
        assert changed == wanted, name
        seen |= changed
    assert seen == set(base)


@pytest.mark.slow
def test_no_two_coordinates_are_related() -> None:
    numbers = cube(5, EVERYTHING.coordinates(RECTIFIER), range(N))
    assert numbers.min() >= 0.0
    assert numbers.max() < 1.0
    related = np.array(np.corrcoef(numbers.T))
    pairs = related[np.triu_indices(len(related), 1)]
    assert len(pairs) > 5_000
    assert np.abs(pairs).max() < 5.5 / math.sqrt(N)  # 4e-8 a pair
    # Nor is one the other at another place in the study.
    both = np.array(np.corrcoef(numbers[1:].T, numbers[:-1].T))
    later = both[: len(related), len(related) :]
    assert np.abs(later).max() < 5.5 / math.sqrt(N)


def test_no_two_names_share_a_stream() -> None:
    from zlib import crc32

    names = [f"R{i}{half}" for i in range(1, 1000) for half in ("", "A", "B")]
    names += [f"{letter}{i}" for letter in ("C", "VR") for i in range(1, 100)]
    names += [
        f"U{i}{s}.{what}"
        for i in range(1, 20)
        for s in "ABCD"
        for what in ("offset", "low", "high", "bias", "gbw")
    ]
    names += [f"{name}.{what}" for name in names[:3200] for what in ("tempco", "ageing")]
    names += ["VCC", "VEE", "temperature", "board", *(f"network:{i}" for i in range(1, 20))]
    assert len({crc32(name.encode()) for name in names}) == len(names)


def test_boards_are_those_of_their_numbers() -> None:
    names = EVERYTHING.coordinates(RECTIFIER)
    drawn = quantities(draw_many(RECTIFIER, EVERYTHING, 9, range(50)))
    by_cube = quantities(EVERYTHING.from_cube(RECTIFIER, cube(9, names, range(50))))
    block = quantities(draw_many(RECTIFIER, EVERYTHING, 9, range(20, 30)))
    for which, column in drawn.items():
        assert np.array_equal(column, by_cube[which])
        assert np.array_equal(column[20:30], block[which])
    boards = draw_many(RECTIFIER, EVERYTHING, 9, range(50))
    assert draw(RECTIFIER, EVERYTHING, 9, 27) == boards.board(27)
    with pytest.raises(ValueError, match="coordinates"):
        EVERYTHING.from_cube(RECTIFIER, np.zeros((3, 4)))


def test_a_part_keeps_its_number_in_another_design_and_another_spread() -> None:
    ours = draw_many(CIRCUIT, BENCH, 4, range(100))
    other = draw_many(RECTIFIER, BENCH, 4, range(100))
    nominal, theirs = CIRCUIT.values, RECTIFIER.values
    common = set(nominal) & set(theirs)
    assert len(common) > 30
    for name in common:
        assert ours.values[name] / nominal[name] == pytest.approx(
            other.values[name] / theirs[name], rel=1e-15
        )
    for section in set(ours.offset) & set(other.offset):
        assert np.array_equal(ours.offset[section], other.offset[section])
    more = replace(BENCH, supply=0.1, bias=Uniform(0.0, 1e-9))
    assert np.array_equal(draw_many(CIRCUIT, more, 4, range(100)).values["R50"], ours.values["R50"])


def test_grades_scale_the_same_draws() -> None:
    """Distances from nominal go with the grade, part for part, whatever the distribution."""
    for shape in (Uniform(-1.0, 1.0), Normal(0.25), Binned(0.2)):
        coarse = replace(BENCH, resistor_shape=shape, grades={"R7": 0.002})
        fine = coarse.with_grades(resistor=0.001, capacitor=0.02)
        a, b = (draw_many(CIRCUIT, s, 4, range(100)).values for s in (coarse, fine))
        for name, value in CIRCUIT.values.items():
            ratio = {"R": 0.1, "C": 0.4}[name[0]] if name != "R7" else 1.0
            assert b[name] / value - 1.0 == pytest.approx(
                ratio * (a[name] / value - 1.0), abs=1e-15
            )
    assert BENCH.with_grades() == BENCH


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 0.9, 1.0])
def test_parts_that_track(share: float) -> None:
    """Common c and own d: s·c + (1 - s)·d. Variance (s² + (1-s)²) g²/3, covariance s² g²/3."""
    spread = replace(BENCH, groups=(Group("network:1", ("R203", "R204", "R205"), share),))
    boards = draw_many(CIRCUIT, spread, 8, range(N))
    off = np.array([boards.values[n] / CIRCUIT.values[n] - 1.0 for n in ("R203", "R204", "R1")])
    variance = (share**2 + (1.0 - share) ** 2) * 0.01**2 / 3.0
    assert off[0].var() == pytest.approx(variance, rel=0.05)
    wanted = share**2 / (share**2 + (1.0 - share) ** 2)
    assert np.corrcoef(off)[0, 1] == pytest.approx(wanted, abs=4.0 / math.sqrt(N))
    assert np.corrcoef(off)[0, 2] == pytest.approx(0.0, abs=4.0 / math.sqrt(N))
    assert np.abs(off).max() <= 0.01 * (1.0 + 1e-12)
    assert np.abs(off[0] - off[1]).max() <= 2.0 * 0.01 * (1.0 - share) + 1e-12
    assert np.abs(off[0] - off[1]).max() >= 1.9 * 0.01 * (1.0 - share)


@pytest.mark.slow
def test_temperature_and_ageing_by_their_second_moments() -> None:
    """Value = (1 + d)(1 + a)(1 + t·ΔT), four independent draws; ΔT is the board's."""
    low, high = 1e-4, 4e-4
    spread = replace(
        BENCH,
        temperature=(-15.0, 85.0),
        tempco={"R1": Uniform(low, high), "R2": Uniform(low, high), "R3": Uniform(-high, high)},
        ageing={"R1": Uniform(-0.02, 0.0)},
    )
    count = 400_000
    boards = draw_many(CIRCUIT, spread, 21, range(count))
    r1, r2, r3 = (boards.values[n] / CIRCUIT.values[n] for n in ("R1", "R2", "R3"))

    def second(a: float, b: float) -> float:
        return (a * a + a * b + b * b) / 3.0

    warm, warm2 = 10.0, second(-40.0, 60.0)  # about 25 °C
    tc, tc2 = (low + high) / 2.0, second(low, high)
    deviation2 = 1.0 + 0.01**2 / 3.0
    slow = 1.0 + 2.0 * tc * warm + tc2 * warm2
    aged = second(0.98, 1.0)
    assert r1.mean() == pytest.approx(0.99 * (1.0 + tc * warm), rel=1e-4)
    assert (r1**2).mean() == pytest.approx(deviation2 * aged * slow, rel=1e-4)
    variance = deviation2 * aged * slow - (0.99 * (1.0 + tc * warm)) ** 2
    assert r1.var() == pytest.approx(variance, rel=0.01)
    variance2 = deviation2 * slow - (1.0 + tc * warm) ** 2
    assert r2.var() == pytest.approx(variance2, rel=0.01)
    # Parts warm up together: covariance 0.99 · E[t]² · var ΔT; without a sign, none.
    covariance = 0.99 * tc**2 * (100.0**2 / 12.0)
    assert np.cov(r1, r2)[0, 1] == pytest.approx(covariance, rel=0.03)
    assert abs(np.corrcoef(r2, r3)[0, 1]) < 5.0 / math.sqrt(count)
    assert r3.var() == pytest.approx(
        deviation2 * (1.0 + second(-high, high) * warm2) - 1.0, rel=0.01
    )


def test_output_limits_move_with_their_rail() -> None:
    spread = replace(BENCH, supply=0.1)
    boards = draw_many(CIRCUIT, spread, 3, range(N))
    exact = draw_many(CIRCUIT, BENCH, 3, range(N))
    vcc, vee = boards.supply["VCC"], boards.supply["VEE"]
    assert vcc.min() < 13.6
    assert vcc.max() > 16.4
    assert abs(np.corrcoef(vcc, vee)[0, 1]) < 4.0 / math.sqrt(N)
    for s in ("U1A", "U3D"):
        assert boards.high[s] == pytest.approx(exact.high[s] + (vcc - 15.0), abs=1e-12)
        assert boards.low[s] == pytest.approx(exact.low[s] + (vee + 15.0), abs=1e-12)
    wide = draw_many(CIRCUIT, replace(spread, saturation=0.3), 3, range(N))
    assert np.all(wide.high["U1A"] <= wide.supply["VCC"])
    assert np.any(wide.high["U1A"] == wide.supply["VCC"])


def test_the_data_sheet_s_figures() -> None:
    """TL074C: bias typically 65 pA, 200 pA at most; gain-bandwidth 2.5 MHz at least, typically 3:
    what is not given mirrors what is."""
    spread = of('bias = "data sheet"\ngain_bandwidth = "data sheet"')
    assert spread.bias == Split(65e-12**2 / 200e-12, 65e-12, 200e-12)
    assert spread.gain_bandwidth == Split(2.5e6, 3e6, 3e6**2 / 2.5e6)
    boards = draw_many(CIRCUIT, spread, 3, range(N))
    for s in CIRCUIT.sections:
        assert np.mean(boards.bias[s.name] < 65e-12) == pytest.approx(0.5, abs=0.02)
        assert boards.gain_bandwidth[s.name].min() >= 2.5e6
    given_ = of('bias = ["10 pA", "1 nA"]\ngain_bandwidth = ["1 MHz", "2 MHz"]')
    assert (given_.bias, given_.gain_bandwidth) == (Uniform(10e-12, 1e-9), Uniform(1e6, 2e6))
    plain = draw_many(CIRCUIT, of(""), 3, range(3))
    assert set(plain.bias["U1A"]) == {CIRCUIT.bias}
    assert plain.gain_bandwidth == {}


def test_the_table_reaches_the_parts() -> None:
    spread = of(
        """\
resistors = { law = "binned", inner = 0.002 }
capacitors = "normal"
offset = 0
temperature = [0, 50]
ageing = 0.01
reference_grade = 0.003
[[spread.part]]
names = ["capacitors", "VR2"]
ageing = [-0.02, 0.0]
[[spread.part]]
names = "C2"
grade = 0.0
tempco = [-3e-4, -2e-4]
[[spread.part]]
names = ["R1", "R2"]
law = "uniform"
grade = 0.001
[[spread.network]]
parts = ["R1", "R2"]
share = 0.8
""",
        SOLD,
    )
    assert spread.resistor_shape == Binned(0.2)
    assert spread.capacitor_shape == Normal(1.0 / 3.0)
    assert spread.offset_sigma == 0.0
    assert spread.grades == {"C2": 0.0, "R1": 0.001, "R2": 0.001, "VR1": 0.003, "VR2": 0.003}
    assert spread.groups == (Group("network:1", ("R1", "R2"), 0.8),)
    assert spread.ageing["R3"] == Uniform(-0.01, 0.01)
    assert spread.ageing["C1"] == spread.ageing["VR2"] == Uniform(-0.02, 0.0)
    assert "VR1" not in spread.ageing
    # 100e-6/K thick film at 1 %, 25e-6/K thin film at 0.1 %, and the catalogue's LM4040.
    assert spread.tempco["R3"] == Uniform(-100e-6, 100e-6)
    assert spread.tempco["R1"] == Uniform(-25e-6, 25e-6)
    assert spread.tempco["C2"] == Uniform(-3e-4, -2e-4)
    assert spread.tempco["VR1"] == Uniform(-100e-6, 100e-6)
    assert spread.tempco["C1"] == Uniform(-30e-6, 30e-6)
    boards = draw_many(SOLD, spread, 1, range(2000))
    off = np.abs(boards.values["R3"] / SOLD.values["R3"] - 1.0)
    assert off.max() < 1.01 * 1.01 * 1.0025 - 1.0
    assert off.max() > 0.018
    # No offset at room temperature, the drift of the op-amp over 25 K at most.
    slope = CATALOG.opamp("TL074C").offset_drift
    assert slope is not None
    drift = 25.0 * slope.about_zero[1]
    assert 0.5 * drift < np.abs(boards.offset["U1A"]).max() <= drift
    for part in (
        "without those within ± 0.2 %",
        "normal with σ = 0.3333 %",
        "± 0.3 %",
        "0 to 50 °C",
        "from -2 to 0 %",
    ):
        assert part in words_of(spread, SOLD), part


def test_a_spread_of_the_bandwidth_says_that_no_yield_depends_on_it() -> None:
    said = words_of(of('gain_bandwidth = ["1 MHz", "2 MHz"]\nsupply = 0.02'), SOLD)
    (bandwidth,) = (part for part in said.split("; ") if "gain-bandwidth" in part)
    assert "1 MHz to 2 MHz" in bandwidth.replace("\N{NO-BREAK SPACE}", " ")
    assert "does not enter the yield" in bandwidth
    assert "does not enter" not in words_of(of("supply = 0.02"), SOLD)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.8, 1.0])
def test_tracking_narrows_each_part_by_itself(share: float) -> None:
    """By √(s² + (1 - s)²), as docs/spread.md says: the variance of a sum of two independent
    numbers."""
    grouped = of(f'[[spread.network]]\nparts = ["R1", "R2"]\nshare = {share}')
    drawn = draw_many(SOLD, grouped, 3, range(40_000)).values["R1"]
    alone = draw_many(SOLD, of(""), 3, range(40_000)).values["R1"]
    assert drawn.std() / alone.std() == pytest.approx(np.hypot(share, 1.0 - share), rel=0.02)


def test_an_exact_part_among_picked_ones() -> None:
    picked = 'resistors = { law = "binned", inner = 0.002 }\n'
    spread = of(f'{picked}[[spread.part]]\nnames = "R203"\ngrade = 0.0')
    boards = draw_many(CIRCUIT, spread, 1, range(50))
    assert set(boards.values["R203"]) == {CIRCUIT.values["R203"]}
    off = np.abs(boards.values["R204"] / CIRCUIT.values["R204"] - 1.0)
    assert (off >= 0.002 * (1.0 - 1e-9)).all()


def test_ageing_by_the_catalogue() -> None:
    """Thick film at 1 %: 1 % in the endurance test; the LM4040: typically 120e-6 in 1000 hours; the
    C0G capacitors' drift is in no sheet."""
    given_ = '[[spread.part]]\nnames = "capacitors"\nageing = 0.003'
    spread = of(f'ageing = "catalogue"\n{given_}', SOLD)
    assert spread.ageing["R3"] == Uniform(-0.01, 0.01)
    assert spread.ageing["C3"] == Uniform(-0.003, 0.003)
    assert spread.ageing["VR1"] == Normal(120e-6, 360e-6)
    with pytest.raises(InputError, match=r"C1, .* no drift"):
        of('ageing = "catalogue"', SOLD)


def test_parts_of_one_value_share_a_reel() -> None:
    spread = of('reels = 0.4\n[[spread.network]]\nparts = ["R208", "R209"]\nshare = 1.0')
    values = CIRCUIT.values
    tenk = {n for n, v in values.items() if n[0] == "R" and v == values["R210"]}
    groups = {group.name: group for group in spread.groups}
    assert groups["network:1"].parts == ("R208", "R209")
    (reel,) = [g for g in spread.groups if "R210" in g.parts]
    assert set(reel.parts) == tenk - {"R208", "R209"}
    assert (reel.share, reel.reel) == (0.4, True)
    for group in spread.groups:
        assert len(group.parts) > 1
        assert len({values[n] for n in group.parts}) == 1
    (caps,) = [g for g in spread.groups if "C2" in g.parts]
    assert caps.name == "reel:C:100n"
    picked = of('reels = 0.4\ncapacitors = { law = "binned", inner = 0.001 }')
    assert picked.groups
    assert not [g for g in picked.groups if "C2" in g.parts]


def test_both_halves_of_a_composite() -> None:
    values = {**EXACT, "R50A": EXACT["R50"] / 2, "R50B": EXACT["R50"] / 2}
    del values["R50"]
    circuit = stage_with_composite(values)
    spread = of('[[spread.part]]\nnames = "R50"\ngrade = 0.0', circuit)
    assert spread.grades == {"R50A": 0.0, "R50B": 0.0}


def stage_with_composite(values: dict[str, float]) -> Circuit:
    return stage("saturation", "both", values, composites={"R50": "series"})


def test_everything_that_decides_the_boards_is_in_the_dictionary() -> None:
    """A study's hash rests on it: it is JSON, and differs wherever the spreads do."""
    spreads = [
        EVERYTHING,
        replace(EVERYTHING, resistor=0.02),
        replace(EVERYTHING, resistor_shape=Normal(0.3)),
        replace(EVERYTHING, bias=None),
        replace(EVERYTHING, grades={"R203": 0.002, "VR1": 0.002}),
        replace(EVERYTHING, shapes={"C1": Binned(0.3)}),
        replace(EVERYTHING, temperature=(30.0, 61.0)),
        replace(EVERYTHING, tempco={}),
        replace(EVERYTHING, ageing={"R2": Uniform(-0.01, 0.01)}),
        replace(EVERYTHING, groups=EVERYTHING.groups[:1]),
        BENCH,
    ]
    texts = {json.dumps(s.as_dict(), sort_keys=True) for s in spreads}
    assert len(texts) == len(spreads)


@given(st.data())
@settings(max_examples=60)
def test_more_is_more(data: st.DataObject) -> None:
    """Every quantity rises (the lower limit falls) in each of its numbers; the board is warm."""
    names = EVERYTHING.coordinates(RECTIFIER)
    numbers = st.floats(0.0, 1.0, exclude_max=True)
    seed = data.draw(st.integers(0, 10_000))
    row = np.random.default_rng(seed).random(len(names))
    k = data.draw(st.sampled_from([k for k, n in enumerate(names) if n != "temperature"]))
    ends = sorted(data.draw(st.tuples(numbers, numbers)))
    both = np.tile(row, (2, 1))
    both[:, k] = ends
    for which, (before, after) in quantities(EVERYTHING.from_cube(RECTIFIER, both)).items():
        falls = which.startswith("low ") or which == "supply VEE"
        rise = before - after if falls else after - before
        assert rise >= -1e-12 * abs(after), which


def test_no_board_is_measured_here() -> None:
    assert BOARD not in EVERYTHING.coordinates(CIRCUIT)


def test_ageing_in_words_is_that_of_each_kind_of_part() -> None:
    """Blurred into one figure, -0.5 % of the capacitors would be taken for the resistors'."""
    resistors = {r.name: Uniform(-0.002, 0.002) for r in SOLD.resistors}
    capacitors = {c.name: Uniform(-0.005, 0.0) for c in SOLD.capacitors}
    spread = Spread(0.01, 0.01, 1e-3, 4e-3, ageing={**resistors, **capacitors})
    said = words_of(spread, SOLD)
    assert "resistors from -0.2 to 0.2 %" in said
    assert "capacitors from -0.5 to 0 %" in said
