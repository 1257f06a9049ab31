"""The bill of materials of circuits with diodes and references."""

from __future__ import annotations

from pathlib import Path

import pytest

from designer.board.bom import Line, bill, bill_csv
from designer.board.component import components
from designer.circuit.netlist import Circuit
from designer.model.board_table import BoardChoice
from designer.model.circuit_table import CircuitSpec
from designer.model.clearance import Sides
from tests.shared.stages import CATALOG, rectifier, stage

VALUES = {**rectifier(5.0), "R50": 4.7e3, "R202": 24.9e3, "R205": 24.9e3}


def bought_for(circuit: Circuit) -> tuple[Line, ...]:
    return bill(components(circuit, CATALOG, BoardChoice.of(CircuitSpec())))


@pytest.mark.parametrize(("sides", "halves"), [("both", 2), ("upper", 1), ("lower", 1)])
def test_every_part_is_on_the_bill_once(sides: Sides, halves: int) -> None:
    circuit = stage("rectifier", sides, VALUES)
    lines = bought_for(circuit)
    named = [name for line in lines for name in line.designators]
    parts = {p.name for p in circuit.parts} - {s.name for s in circuit.sections}
    assert sorted(named) == sorted(parts | set(circuit.packages))
    by_value = {line.value: line for line in lines}
    diode, reference = by_value["1N4148"], by_value["LM4040C50"]
    assert diode.quantity == 2 * halves
    assert diode.description.startswith("diode")
    assert diode.footprint.startswith("Diode_SMD:")
    assert diode.rating == "100V reverse"
    assert reference.quantity == halves
    assert reference.part_number == "LM4040C50IDBZR"
    assert reference.grade == "0.005"
    assert set(reference.designators) <= {"VR1", "VR2"}
    feeds = {"R206", "R207"} & set(named)
    assert len(feeds) == halves


def test_the_bill_of_a_circuit_without_them_has_none() -> None:
    from tests.circuit.test_reduction import EXACT, circuit_of

    values = {line.value for line in bought_for(circuit_of(EXACT))}
    assert not values & {"1N4148", "LM4040C50"}


def test_it_is_a_table_of_text(tmp_path: Path) -> None:
    text = bill_csv(bought_for(stage("rectifier", "both", VALUES)))
    (tmp_path / "bom.csv").write_text(text)
    assert "D200 D201 D202 D203" in text
    assert all(line.count(",") >= 9 for line in text.splitlines())


def test_an_unbuyable_value_is_named() -> None:
    from designer.base.errors import Unreachable

    circuit = stage("rectifier", "both", {**VALUES, "R202": 12345.6})
    with pytest.raises(Unreachable, match=r"12\.3"):
        bought_for(circuit)
