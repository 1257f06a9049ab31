"""Amplifiers in packages of one to eight: how many, which together, and the same circuit."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from designer.base.defaults import Fidelity
from designer.board.board_parts import fitted
from designer.board.component import components
from designer.catalog.entries import OpAmp, SectionPins as PinTable
from designer.circuit.board_values import nominal_board
from designer.circuit.dead_zone_parts import idle_limits
from designer.circuit.netlist import Circuit, Excitation, Section
from designer.circuit.packing import assignment, packed
from designer.circuit.reduction import Reduction
from designer.folders.design_source import read_design
from designer.model.board_table import BoardChoice
from designer.spice import deck
from designer.spice.deck import SolverSettings
from designer.spice.worker import open_simulator
from designer.spread.spread import Spread, draw
from tests.circuit.test_reduction import EXACT
from tests.shared.chains import chain, chain_circuit
from tests.shared.quick_folders import quick_folder
from tests.shared.stages import CATALOG, bought, one_sided, rectifier, stage
from tests.shared.system_text import table

pytestmark = pytest.mark.usefixtures("figures_are_blank")

QUAD, DUAL, SINGLE = (CATALOG.opamp(name) for name in ("TL074C", "TL072C", "TL071C"))
TRIPLE = replace(QUAD, name="three", pins=QUAD.pins[:3])
EIGHT = replace(
    QUAD, name="eight", pins=tuple(PinTable(n, f"{n}1", f"{n}2", f"{n}3") for n in "ABCDEFGH")
)
SHAPES = {
    "saturation": ("saturation", "both", bought(EXACT)),
    "rectifier": ("rectifier", "both", bought(rectifier(5.0))),
    "one stop": ("saturation", "upper", bought(one_sided())),
    "half a rectifier": ("rectifier", "lower", bought(rectifier(5.0))),
}


def of(name: str, opamp: str = "TL074C") -> Circuit:
    kind, sides, values = SHAPES[name]
    return stage(kind, sides, values, opamp=opamp)  # type: ignore[arg-type]


def by_output(circuit: Circuit) -> dict[str, str]:
    return {s.output: s.name for s in circuit.sections}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("opamp", [DUAL, SINGLE, TRIPLE, EIGHT], ids=lambda o: o.name)
def test_as_few_packages_as_hold_the_amplifiers(name: str, opamp: OpAmp) -> None:
    circuit = packed(of(name), opamp)
    count = len(circuit.sections)
    assert len(circuit.packages) == math.ceil(count / opamp.sections)
    assert circuit.packages == tuple(f"U{i + 1}" for i in range(len(circuit.packages)))
    assert len({s.name for s in circuit.sections}) == count
    # Only the last of the packages that take what was left over has room.
    filled = [sum(s.package == p for s in circuit.sections) for p in circuit.packages]
    assert sorted(filled)[1:] == [opamp.sections] * (len(filled) - 1)
    for package, number in zip(circuit.packages, filled, strict=True):
        used = sorted(s.name for s in circuit.sections if s.package == package)
        assert used == [f"{package}{letter}" for letter in "ABCDEFGH"[:number]]


def test_a_quad_keeps_the_names_of_the_paper() -> None:
    """Fig. 4 and Fig. 5 of the paper."""
    names = by_output(of("saturation"))
    assert names == {
        "v1": "U1A", "v2": "U2C", "v3": "U1C", "v4": "U2D",
        "v1n": "U2A", "v2n": "U1B", "v3n": "U2B", "v4n": "U1D",
        "w1": "U3B", "w2": "U3C", "v12": "U3A", "fv": "U3D",
    }  # fmt: skip


def test_a_quad_with_other_letters_keeps_the_places() -> None:
    letters = dict(zip("ABCD", "EFGH", strict=True))
    other = replace(QUAD, pins=tuple(replace(p, name=letters[p.name]) for p in QUAD.pins))
    names = assignment(of("rectifier"), other)
    assert names["U2C"] == "U2G"
    assert all(new == old[:-1] + letters[old[-1]] for old, new in names.items())


def test_stages_that_belong_together_share_a_package() -> None:
    names = by_output(of("saturation", "TL072C"))
    pairs = [("v1", "v1n"), ("v2", "v2n"), ("v3", "v3n"), ("v4", "v4n"), ("w1", "w2")]
    for number, (first, second) in enumerate([*pairs, ("v12", "fv")], start=1):
        assert (names[first], names[second]) == (f"U{number}A", f"U{number}B")


def test_singles_are_numbered_in_the_same_order() -> None:
    """The table of docs/catalogue.md."""
    order = "v1 v1n v2 v2n v3 v3n v4 v4n w1 w2 v12 fv".split()
    wanted = {net: f"U{number}A" for number, net in enumerate(order, start=1)}
    assert by_output(of("saturation", "TL071C")) == wanted


def test_integrators_without_an_inverter_share_a_package() -> None:
    """Neither is left alone with a spare section beside it."""
    quad = of("rectifier")
    without = [p for p in quad.parts if p.name not in ("U1B", "U1D")]
    bare = replace(quad, parts=tuple(without))
    names = by_output(packed(bare, DUAL))
    assert (names["v2"], names["v4"]) == ("U2A", "U2B")
    assert names["v3"] == "U3A"
    assert names["v3n"] == "U3B"


def test_the_amplifiers_of_a_mass_share_a_quad() -> None:
    """Three masses and a rectifier's two halves: U1 to U3 have a mass each, U4 the dead zone."""
    stops = table("clearance", name="A", between=("m1", "ground"), upper=1, lower=1, stiffness=9)
    names = by_output(chain_circuit(chain(3, stops), "rectifier"))
    of_mass = [("v1", "v1n", "v2", "v2n"), ("v3", "v3n", "v4", "v4n"), ("v5", "v5n", "v6", "v6n")]
    wanted = {
        net: f"U{number}{letter}"
        for number, nets in enumerate([*of_mass, ("w1", "w2")], start=1)
        for net, letter in zip(nets, "ABCD", strict=False)
    }
    assert names == wanted


def test_one_mass_without_a_clearance_is_one_quad() -> None:
    names = by_output(chain_circuit(chain(1)))
    assert names == {"v1": "U1A", "v2": "U1B", "v2n": "U1C"}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("opamp", ["TL072C", "TL071C"])
def test_the_packages_do_not_change_the_equations(name: str, opamp: str) -> None:
    """The same matrices in every mode of the working ones, bit for bit."""
    quad, other = of(name), of(name, opamp)
    assert quad.values == other.values
    systems = [Reduction(c, nominal_board(c)).system() for c in (quad, other)]
    assert systems[0].start == systems[1].start
    keys = [quad.rest, *(quad.carrying(c) for stop in quad.stops for _, c in stop.contacts)]
    theirs = [other.rest, *(other.carrying(c) for stop in other.stops for _, c in stop.contacts)]
    assert keys == theirs
    assert len(set(keys)) == 1 + sum(len(stop.contacts) for stop in quad.stops)
    for key in keys:
        ours, same = (system.mode(key) for system in systems)
        np.testing.assert_array_equal(ours.A, same.A)
        np.testing.assert_array_equal(ours.B, same.B)
    limits = [idle_limits(c, c.values) for c in (quad, other)]
    assert list(limits[0].values()) == list(limits[1].values())
    assert set(limits[1]) <= {s.name for s in other.sections}


def test_every_section_of_every_package_has_an_offset_of_its_own() -> None:
    spread = Spread.bench_1(DUAL, 0.01, 0.01)
    circuit = of("saturation", "TL072C")
    board = draw(circuit, spread, 7, 0)
    assert list(board.offset) == [s.name for s in circuit.sections]
    assert len(set(board.offset.values())) == 12
    quad = draw(of("saturation"), Spread.bench_1(QUAD, 0.01, 0.01), 7, 0)
    assert board.values == quad.values, "resistors and capacitors are drawn by their own names"
    assert board.offset["U1A"] == quad.offset["U1A"], "and so are the sections"


@pytest.mark.parametrize(("opamp", "spare"), [("TL074C", 3), ("TL072C", 1), ("TL071C", 0)])
def test_a_board_has_whole_packages(opamp: str, spare: int) -> None:
    """Half a rectifier has nine amplifiers: what a package has besides is tied off, and each
    package has its two capacitors and both rails."""
    board = fitted(of("half a rectifier", opamp), BoardChoice(), CATALOG)
    found = components(board, CATALOG, BoardChoice())
    entry = CATALOG.opamp(opamp)
    cased = [c for c in found if c.kind == "op-amp"]
    assert len(cased) == math.ceil(9 / entry.sections)
    tied = [p for p in board.fittings if isinstance(p, Section)]
    assert len(tied) == spare
    assert all(p.inverting == p.output and p.noninverting == "0" for p in tied)
    for package in cased:
        assert package.footprint == entry.footprint
        assert {package.nets[n] for n in entry.supply_pins} == {"vcc", "vee"}
        assert package.nets[entry.supply_pins[0]] == "vcc"
        assert len([c for c in found if c.near == package.reference]) == 2


@pytest.mark.parametrize("fidelity", ["ideal", "dynamic"])
def test_the_deck_of_duals_runs_as_that_of_quads(fidelity: Fidelity) -> None:
    """ngspice itself: the same waves, whatever the sections are called."""
    waves = []
    for opamp in ("TL074C", "TL072C", "TL071C"):
        circuit = of("saturation", opamp)
        text = deck.write(
            circuit, nominal_board(circuit), Excitation(400.0, 1.0),
            SolverSettings("trap", 1.0 / 400.0 / 200.0),
            title=opamp, stop_time=2.0 / 400.0, fidelity=fidelity,
        )  # fmt: skip
        assert f"\nX{circuit.sections[-1].name} " in text
        waves.append(open_simulator("batch").run(text, circuit.state_nets, 2.0 / 400.0))
    assert np.ptp(waves[0].signals["v1"]) > 0.1
    for other in waves[1:]:
        for net in ("v1", "v2", "v3", "v4"):
            np.testing.assert_allclose(
                np.interp(waves[0].axis, other.axis, other.signals[net]),
                waves[0].signals[net],
                atol=1e-4 * np.ptp(waves[0].signals[net]),
            )


LINEAR = """\
format = 1
title = "Linear pair of duals"
[model]
m = 0.5
k = 0.5
k0 = 0.0
c = 0.5
zeta = 0.1
f20 = 0.0
b = 0.25
[circuit]
opamp = "TL072C"
resistors = "E24"
"""


@pytest.mark.slow
def test_a_design_folder_of_duals_is_written_and_read_again(tmp_path: Path) -> None:
    """Four integrators and their inverters: four duals on the bill, in the deck and as read."""
    folder = quick_folder(LINEAR, tmp_path / "design")
    read = read_design(folder).design.circuit
    assert read.packages == ("U1", "U2", "U3", "U4")
    assert len(read.sections) == 8
    deck_text = (folder / "circuit.cir").read_text(encoding="utf-8")
    in_deck = {line.split()[0] for line in deck_text.splitlines() if line.startswith("XU")}
    assert in_deck == {f"XU{number}{letter}" for number in range(1, 5) for letter in "AB"}
    with (folder / "bom.csv").open(encoding="utf-8", newline="") as stream:
        (line,) = (row for row in csv.DictReader(stream) if row["part_number"] == "TL072CDR")
    assert (line["quantity"], line["designators"]) == ("4", "U1 U2 U3 U4")
    supply = (folder / "board.md").read_text(encoding="utf-8")
    assert "The 8 amplifiers draw 11.2mA from each rail" in supply, "1.4 mA each"
