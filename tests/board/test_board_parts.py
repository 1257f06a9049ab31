"""What a board has beside its circuit does nothing to it, and does what it is there for."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from designer.base.errors import InputError
from designer.base.views import View
from designer.board.board_parts import (
    GENERATOR_MOST,
    drive_resistance,
    driven_nodes,
    fault_current,
    fitted,
    probed_nets,
    protection_offset,
    trim_reach,
)
from designer.board.component import Component, components, joined
from designer.catalog.diode_curve import card
from designer.catalog.entries import mounting_of
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import (
    GROUND,
    NEGATIVE,
    POSITIVE,
    Circuit,
    Connector,
    Diode,
    Fitting,
    Generator,
    Resistor,
    Section,
    SupplyCapacitor,
    SupplyDiode,
    TestPoint,
    Trimmer,
)
from designer.circuit.reduction import Reduction
from designer.circuit.stage_title import stage_names
from designer.model.board_table import BoardChoice, BoardSpec, Trim
from designer.model.model_file import parse_model_file
from tests.base.test_views import CIRCUITS
from tests.shared.model_text import PAPER_TABLE
from tests.shared.stages import CATALOG

CHOICE = BoardChoice()
FITTED = replace(CHOICE, spec=replace(CHOICE.spec, dc_trim="fitted"))
MODEL = "format = 1\n" + PAPER_TABLE


def of(circuit: Circuit, kind: type[Fitting]) -> list[Fitting]:
    return [p for p in circuit.fittings if isinstance(p, kind)]


def start(circuit: Circuit) -> tuple[np.ndarray, np.ndarray]:
    """Matrix and drive of the circuit at rest, with ideal op-amps."""
    system = Reduction(circuit, nominal_board(circuit, ideal=True)).system()
    mode = system.mode(system.start)
    return mode.A, mode.B


@pytest.mark.parametrize("circuit", CIRCUITS.values(), ids=CIRCUITS)
def test_fittings_are_neutral_while_the_circuit_works(circuit: Circuit) -> None:
    """Probes, spare sections and a trim at 0 V, simulated too, change no coefficient."""
    board = fitted(circuit, FITTED, CATALOG)
    more: list[Resistor | Section] = []
    for p in board.fittings:
        if isinstance(p, Resistor):
            a = GROUND if p.name == "R911" else p.a  # the wiper at 0 V
            more.append(replace(p, a=a, views=View.EVERYWHERE))
        elif isinstance(p, Section):
            more.append(replace(p, views=View.EVERYWHERE))
    assert any(p.name == "R911" for p in more)
    whole = replace(circuit, parts=(*circuit.parts, *more))
    for got, wanted in zip(start(whole), start(circuit), strict=True):
        np.testing.assert_allclose(got, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


def test_the_trim_reaches_as_far_as_it_says() -> None:
    circuit = CIRCUITS["paper"]
    for wanted in (0.02, 0.25, 2.0):
        board = fitted(circuit, replace(FITTED, trim=wanted), CATALOG)
        series = next(p for p in board.fittings if p.name == "R911")
        assert isinstance(series, Resistor)
        # The generator moved to the wiper; what was its resistor goes to ground.
        parts = [
            replace(p, a=GROUND) if isinstance(p, Resistor) and p.name == "R6" else p
            for p in circuit.parts
        ]
        wiper = replace(
            circuit,
            parts=(*parts, replace(series, views=View.EVERYWHERE)),
            generator=Generator("VM1", "trim"),
        )
        _, of_wiper = start(wiper)
        _, of_generator = start(circuit)
        reach = circuit.supply * np.abs(of_wiper).max() / np.abs(of_generator).max()
        assert trim_reach(board) == pytest.approx(reach, rel=1e-9)
        assert reach >= wanted
        assert reach < 1.2 * wanted  # E24, rounded down


def test_a_trim_is_fitted_or_not_or_not_there() -> None:
    cases: list[tuple[Trim, View | None]] = [
        ("fitted", View.FITTED),
        ("unfitted", View.BOARD),
        ("none", None),
    ]
    for word, views in cases:
        choice = replace(CHOICE, spec=replace(CHOICE.spec, dc_trim=word))
        board = fitted(CIRCUITS["paper"], choice, CATALOG)
        trim = [p for p in board.fittings if p.name in ("RV901", "R911")]
        assert [p.views for p in trim] == ([] if views is None else [views, views])
        found = {c.reference: c for c in components(board, CATALOG, choice)}
        if views is not None:
            assert found["RV901"].fitted is (word == "fitted")


def test_every_supply_pin_has_its_capacitor() -> None:
    board = fitted(CIRCUITS["paper"], CHOICE, CATALOG)
    found = components(board, CATALOG, CHOICE)
    for package in (c for c in found if c.kind == "op-amp"):
        near = [c for c in found if c.near == package.reference]
        rails = {pin.net for c in near for pin in c.pins} - {GROUND}
        supplied = {pin.net for pin in package.pins if pin.electrical == "power_in"}
        assert rails == supplied
        assert len(near) == 2
    bulk = [c for c in found if c.kind == "capacitor" and c.stage == "supply" and not c.near]
    assert len(bulk) == 2


@pytest.mark.parametrize("circuit", CIRCUITS.values(), ids=CIRCUITS)
def test_outputs_are_shown_through_a_resistor_and_summing_nodes_are_not(circuit: Circuit) -> None:
    board = fitted(circuit, CHOICE, CATALOG)
    nets = joined(components(board, CATALOG, CHOICE))
    nodes = {s.inverting for s in circuit.sections}
    probed = {p.net for p in of(board, TestPoint)}  # type: ignore[union-attr]
    assert not probed & nodes
    power = {GROUND, POSITIVE, NEGATIVE}
    assert probed == {f"{net}_out" for net in probed_nets(circuit)} | power
    for net in probed_nets(circuit):
        references = {reference for reference, _ in nets[f"{net}_out"]}
        assert len([r for r in references if r.startswith("R")]) == 1
        assert "J3" in references
    assert not any(r.startswith(("J", "TP")) for node in nodes for r, _ in nets[node])


def test_no_net_of_a_board_has_one_pin() -> None:
    for circuit in CIRCUITS.values():
        board = fitted(circuit, CHOICE, CATALOG)
        assert all(len(pads) > 1 for pads in joined(components(board, CATALOG, CHOICE)).values())


def test_the_drive_of_composites_is_read_through_them() -> None:
    circuit = CIRCUITS["paper"]
    first = next(p for p in circuit.parts if p.name == "R6")
    assert isinstance(first, Resistor)
    others = [p for p in circuit.parts if p is not first]
    series = [
        Resistor("R6A", first.a, "r6m", 3e3, ""),
        Resistor("R6B", "r6m", first.b, 6.1e3, ""),
    ]
    parallel = [replace(first, name="R6A"), replace(first, name="R6B")]
    joined_ = replace(circuit, parts=(*others, *series))
    beside = replace(circuit, parts=(*others, *parallel))
    assert drive_resistance(circuit, "s2") == first.value
    assert drive_resistance(joined_, "s2") == pytest.approx(9.1e3)
    assert drive_resistance(beside, "s2") == pytest.approx(first.value / 2.0)
    assert fault_current(joined_, "s2", 9.1) == pytest.approx(1e-3)
    assert set(driven_nodes(CIRCUITS["f20"])) == {"s2", "s4"}


def protected(drive: str, circuit: Circuit, tmp_path: Path) -> tuple[float, float]:
    """Voltage of s2 and current out of VM1, by ngspice, with the protection's diodes there."""
    diodes = [p for p in fitted(circuit, CHOICE, CATALOG).fittings if isinstance(p, Diode)]
    lines = [
        "* protection",
        *(f"{d.name} {d.anode} {d.cathode} kind" for d in diodes),
        card(diodes[0].model, "kind", charge=False),
        drive,
        ".control",
        "op",
        "print v(s2) i(VM1)",
        "quit 0",
        ".endc",
        ".end",
    ]
    path = tmp_path / "deck.cir"
    path.write_text("\n".join(lines) + "\n")
    done = subprocess.run(
        ["ngspice", "-b", path], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    said = dict(re.findall(r"^([vi]\(\w+\)) = (\S+)$", done.stdout, re.MULTILINE))
    return float(said["v(s2)"]), -float(said["i(vm1)"])


def test_the_leakage_of_the_protection_is_that_of_ngspice(tmp_path: Path) -> None:
    circuit = CIRCUITS["paper"]
    across = 0.01
    _, current = protected(f"VM1 s2 0 {across}", circuit, tmp_path)
    level = protection_offset(circuit, "s2", CHOICE, CATALOG, across)
    assert current * drive_resistance(circuit, "s2") == pytest.approx(level, rel=0.05)
    assert level < 1e-4  # of a drive of volts


@pytest.mark.parametrize("volts", [GENERATOR_MOST, -GENERATOR_MOST])
def test_the_protection_holds_the_input_near_ground(volts: float, tmp_path: Path) -> None:
    circuit = CIRCUITS["paper"]
    ohms = drive_resistance(circuit, "s2")
    voltage, current = protected(f"VM1 vg 0 {volts}\nR6 vg s2 {ohms}", circuit, tmp_path)
    assert 0.3 < abs(voltage) < 0.8
    assert abs(current) < fault_current(circuit, "s2", GENERATOR_MOST)


@pytest.mark.parametrize("mounting", ["smd", "tht"])
@pytest.mark.parametrize("name", ["paper", "rectifier", "composites"])
def test_a_board_has_the_cases_that_are_asked_for(name: str, mounting: str) -> None:
    catalog = CATALOG.mounted("smd" if mounting == "smd" else "tht")
    choice = replace(CHOICE, spec=BoardSpec(mounting=catalog.mounting))
    circuit = CIRCUITS[name]
    found = components(fitted(circuit, choice, catalog), catalog, choice)
    placed = [c for c in found if c.kind not in ("connector", "test point")]
    assert {mounting_of(c.footprint) for c in placed} == {mounting}
    for c in placed:
        assert c.bought is not None
        assert c.bought.part_number
    references = [c for c in found if c.kind == "reference"]
    for c in references:  # TI SLOS456: SOT-23 has the cathode at 1, TO-92 in the middle
        pads = {pin.name: pin.number for pin in c.pins}
        assert pads["cathode"] == ("1" if mounting == "smd" else "2")
        assert [pin.electrical for pin in c.pins].count("no_connect") == 1


def test_a_part_without_such_a_case_is_named() -> None:
    with pytest.raises(InputError, match="OPA4192") as caught:
        CATALOG.mounted("tht").opamp("OPA4192")
    assert caught.value.field == "board.mounting"


def test_an_op_amp_without_such_a_section_is_refused() -> None:
    quad = CATALOG.opamp("TL074C")
    dual = replace(quad, pins=quad.pins[:2])
    catalog = replace(CATALOG, opamps=(dual,))
    with pytest.raises(InputError, match="a section C") as caught:
        components(CIRCUITS["paper"], catalog, CHOICE)
    assert caught.value.field == "circuit.opamp"


def test_stages_of_parts() -> None:
    """By hand from Fig. 4 and Fig. 5 of the paper."""
    names = stage_names(fitted(CIRCUITS["paper"], CHOICE, CATALOG))
    wanted = {
        "integrator 1": "U1A C1 R1",
        "integrator 2": "U2C C2 R2 R3 R4 R5 R6 R50 D901 D902 R911",
        "integrator 3": "U1C C3 R7",
        "integrator 4": "U2D C4 R8 R9 R10 R11",
        "inverter 1": "U2A R100 R101",
        "inverter 2": "U1B R102 R103",
        "inverter 3": "U2B R104 R105",
        "inverter 4": "U1D R106 R107",
        "dead zone": "U3A U3B U3C U3D R200 R201 R202 R203 R204 R205 R206 R207 R208 R209 R210",
        "interface": "J2 J3 R901 R902 R903 R904 R905 TP1 TP2 TP3 TP4 TP5 RV901",
        "supply": "J1 C901 C902 C903 C904 C905 C906 C907 C908 D911 D912 TP6 TP7 TP8 TP9",
    }
    assert {stage: sorted(n for n in names if names[n] == stage) for stage in wanted} == {
        stage: sorted(parts.split()) for stage, parts in wanted.items()
    }
    rectifier = stage_names(fitted(CIRCUITS["rectifier"], CHOICE, CATALOG))
    ours = {"VR1", "VR2", "D200", "D201", "D202", "D203", "R206", "R207", "R208", "R209"}
    assert {rectifier[name] for name in ours} == {"dead zone"}
    assert rectifier["U3C"] == "supply"


def test_what_a_board_leaves_out() -> None:
    spec = BoardSpec(test_points=False, input_protection=False, dc_trim="none")
    board = fitted(CIRCUITS["paper"], replace(CHOICE, spec=spec), CATALOG)
    kinds = {type(p) for p in board.fittings}
    assert kinds == {SupplyCapacitor, SupplyDiode, Connector, Resistor}
    bare = replace(spec, reverse_protection="")
    board = fitted(CIRCUITS["paper"], replace(CHOICE, spec=bare), CATALOG)
    assert {type(p) for p in board.fittings} == {SupplyCapacitor, Connector, Resistor}
    assert not of(board, Trimmer)
    again = fitted(board, CHOICE, CATALOG)
    assert again == fitted(CIRCUITS["paper"], CHOICE, CATALOG)


@pytest.mark.parametrize(
    ("line", "field", "expected"),
    [
        ('mounting = "SMT"', "mounting", '"mixed", "smd" or "tht"'),
        ("test_points = 1", "test_points", "true or false"),
        ('probe_resistor = "10"', "probe_resistor", "from 100 Ω"),
        ("probe_resistor = true", "probe_resistor", "from 100 Ω"),
        ("decoupling = 0", "decoupling", "> 0"),
        ('bulk = "10 µV"', "bulk", "F"),
        ('dc_trim = "no"', "dc_trim", "fitted"),
        ("input_protection = 0", "input_protection", "true or false"),
        ('bom = "kicad"', "bom", "a list"),
        ('bom = ["../kicad"]', "bom", "small letters"),
        ("mountng = 1", "mountng", 'did you mean "mounting"?'),
    ],
)
def test_wrong_values_of_the_table_are_named(line: str, field: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_model_file(f"{MODEL}[board]\n{line}\n")
    assert caught.value.field == f"board.{field}"
    assert expected in str(caught.value.expected)


def test_the_table_is_read() -> None:
    text = '[board]\nmounting = "tht"\nprobe_resistor = "2.2k"\ndc_trim = "fitted"\nbom = []\n'
    spec = parse_model_file(MODEL + text).board
    assert spec == BoardSpec(mounting="tht", probe_resistor=2200.0, dc_trim="fitted", bom=())
    assert parse_model_file(MODEL).board == BoardSpec()


def test_components_say_what_they_are() -> None:
    board = fitted(CIRCUITS["paper"], CHOICE, CATALOG)
    found: dict[str, Component] = {c.reference: c for c in components(board, CATALOG, CHOICE)}
    assert found["R6"].nets == {"1": "vg", "2": "s2"}
    assert found["R6"].role == "force on M1"
    assert found["R6"].bought is not None
    assert found["R6"].bought.part_number == "RC0603FR-079K1L"
    assert found["R6"].bought.substitute == "Vishay CRCW06039K10FKEA"
    assert found["U2"].nets["8"] == "v2"  # section C of a quad: output 8, inputs 9 and 10
    assert (found["U2"].nets["9"], found["U2"].nets["10"]) == ("s2", GROUND)
    assert (found["U2"].nets["4"], found["U2"].nets["11"]) == ("vcc", "vee")
    assert found["D901"].nets == {"1": GROUND, "2": "s2"}  # KiCad's cathode is pad 1
    assert not found["RV901"].fitted
    assert found["TP1"].fitted
