"""The views of a circuit agree: what is simulated, what is on the board, what is bought."""

from __future__ import annotations

from dataclasses import replace

import pytest

from designer.base.errors import InputError
from designer.base.views import View
from designer.board.board_parts import fitted
from designer.board.bom import bill
from designer.board.component import components, designator, joined
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit, Excitation, Fitting, Section
from designer.model.board_table import BoardChoice
from designer.spice.deck import SolverSettings, write
from tests.circuit.test_reduction import EXACT
from tests.shared.chains import EVERYTHING, PRELOADED, chain, chain_circuit
from tests.shared.stages import CATALOG, bought, one_sided, rectifier, stage

CHOICE = BoardChoice()


def circuits() -> dict[str, Circuit]:
    composite = {**EXACT, "R50A": 12e3, "R50B": 10e3}
    del composite["R50"]
    return {
        "paper": stage("saturation", "both", bought(EXACT)),
        "rectifier": stage("rectifier", "both", bought(rectifier(5.0))),
        "one-sided": stage("saturation", "upper", bought(one_sided())),
        "one-sided rectifier": stage("rectifier", "lower", bought(rectifier(5.0))),
        "f20": stage("saturation", "both", bought({**EXACT, "R12": 18e3}), f20=0.2),
        "composites": stage("saturation", "both", bought(composite), {"R50": "series"}),
        "duals": stage("rectifier", "lower", bought(rectifier(5.0)), opamp="TL072C"),
        "singles": stage("saturation", "both", bought(EXACT), opamp="TL071C"),
        "one mass": chain_circuit(chain(1, PRELOADED), "rectifier"),
        "four masses": chain_circuit(chain(4, *EVERYTHING), "rectifier"),
    }


CIRCUITS = circuits()


def in_view(board: Circuit, view: View) -> tuple[Fitting, ...]:
    """The parts that stand in a view, simulated ones first."""
    return tuple(p for p in (*board.parts, *board.fittings) if view in p.views)


@pytest.mark.parametrize("circuit", CIRCUITS.values(), ids=CIRCUITS)
def test_fittings_leave_the_simulation_as_it_was(circuit: Circuit) -> None:
    def deck(c: Circuit) -> str:
        settings = SolverSettings("trap", 1e-6)
        return write(
            c, nominal_board(c), Excitation(100.0, 1.0), settings, title="t", stop_time=1e-3
        )

    board = fitted(circuit, CHOICE, CATALOG)
    assert board.fittings
    assert deck(board) == deck(circuit)
    assert in_view(board, View.SIMULATION) == circuit.parts


@pytest.mark.parametrize("circuit", CIRCUITS.values(), ids=CIRCUITS)
def test_components_are_the_board_and_carry_its_nets(circuit: Circuit) -> None:
    board = fitted(circuit, CHOICE, CATALOG)
    found = components(board, CATALOG, CHOICE)
    names = [name for c in found for name in c.parts]
    assert sorted(names) == sorted(p.name for p in in_view(board, View.BOARD))
    assert len({c.reference for c in found}) == len(found)
    # Pins carry the nets of the parts: the same pairs, found the other way round.
    nets = {net for part in in_view(board, View.BOARD) for net in part.nets}
    assert set(joined(found)) == nets | {"vcc", "vee"}
    for component in found:
        parts = [p for p in in_view(board, View.BOARD) if p.name in component.parts]
        carried = sorted(pin.net for pin in component.pins if pin.net)
        wanted = [net for part in parts for net in part.nets]
        wanted += ["vcc", "vee"] if component.kind == "op-amp" else []
        assert carried == sorted(wanted)


def test_every_designator_ends_in_a_number_and_none_meet() -> None:
    """R50A of the circuit is R50A1 on the board; a R50 or a R501 beside it is another."""
    names = ["R50", "R501", "R50A", "R50B", "R5", "R50A2", "U1", "TP1", "C903"]
    found = [designator(name) for name in names]
    assert len(set(found)) == len(names)
    assert all(name[-1].isdigit() for name in found)
    board = fitted(CIRCUITS["composites"], CHOICE, CATALOG)
    by_part = {name: c for c in components(board, CATALOG, CHOICE) for name in c.parts}
    assert by_part["R50A"].reference == "R50A1"
    assert by_part["R50A"].quantity == board.values["R50A"]
    (line,) = (
        line for line in bill(components(board, CATALOG, CHOICE)) if "R50A1" in line.designators
    )
    assert "R50A" not in line.designators


@pytest.mark.parametrize("circuit", CIRCUITS.values(), ids=CIRCUITS)
def test_every_section_of_a_package_is_used_or_tied_off(circuit: Circuit) -> None:
    board = fitted(circuit, CHOICE, CATALOG)
    for component in components(board, CATALOG, CHOICE):
        if component.kind == "op-amp":
            assert len(component.pins) == {"TL071C": 5, "TL072C": 8, "TL074C": 14}[circuit.opamp]
            assert all(pin.net for pin in component.pins)
    for part in board.fittings:
        if isinstance(part, Section):
            assert (part.inverting, part.noninverting) == (part.output, "0")


def test_a_part_in_the_wrong_place_is_refused() -> None:
    circuit = CIRCUITS["paper"]
    first = circuit.parts[0]
    with pytest.raises(InputError, match=r"circuit\.parts: found U1A"):
        replace(circuit, parts=(replace(first, views=View.FITTED), *circuit.parts[1:]))
    with pytest.raises(InputError, match=r"circuit\.fittings: found R999"):
        replace(circuit, fittings=(replace(circuit.resistors[0], name="R999"),))
    with pytest.raises(InputError, match="each reference once"):
        replace(circuit, fittings=(replace(circuit.resistors[0], views=View.FITTED),))
