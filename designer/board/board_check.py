"""What a board needs besides the parts that are chosen, refused before any part is chosen.

The board is listed once with values that stand for the chosen ones, so whatever the catalogue
lacks for it, in the cases that it takes, is met here as it would be met after the synthesis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from designer.base.errors import InputError, Unreachable
from designer.board.board_parts import fitted
from designer.board.bom_layouts import layouts
from designer.board.component import Component, components
from designer.board.footprints import footprint
from designer.catalog.entries import Kind, OpAmp, Use
from designer.catalog.parts_catalog import Catalog
from designer.circuit.netlist import Capacitor, Circuit, Part, Resistor
from designer.model.board_table import BoardChoice, BoardSpec
from designer.model.circuit_table import CircuitSpec
from designer.model.model_file import ModelFile
from designer.synthesis.part_checks import (
    buyable,
    check_choices,
    diode_of,
    opamp_of,
    unit_circuit,
)


def check_board(modelfile: ModelFile, catalog: Catalog, spec: CircuitSpec | None = None) -> None:
    """Refuse what a design folder of this model file could not be written for.

    spec : one that a search may come to, instead of the file's own table [circuit].

    Raises
    ------
    InputError : a part, a case or a layout that the catalogue does not have or that does not fit.
    Unreachable : a value that cannot be bought.
    """
    spec, board = spec or modelfile.circuit, modelfile.board
    catalog = catalog.mounted(board.mounting)
    check_choices(modelfile.model, spec, catalog)
    opamp_of(spec, catalog, _pads_refusal)
    if board.input_protection:
        diode_of(spec.diode, catalog)
    _check_values(board, spec, catalog)
    circuit = _standing_in(modelfile, spec, catalog)
    listing = BoardChoice.of(spec, board)
    for component in components(fitted(circuit, listing, catalog), catalog, listing):
        _check_pads(component)
    layouts(board.bom, catalog.folders)


def _standing_in(modelfile: ModelFile, spec: CircuitSpec, catalog: Catalog) -> Circuit:
    """The model's circuit with one resistor's and one capacitor's value everywhere."""
    values: Mapping[Kind, float] = {
        kind: float(sold[len(sold) // 2])
        for kind in ("resistor", "capacitor")
        for sold in [buyable(kind, spec, catalog)]
    }

    def bought(part: Part) -> Part:
        if isinstance(part, Resistor):
            return replace(part, value=values["resistor"])
        return replace(part, value=values["capacitor"]) if isinstance(part, Capacitor) else part

    circuit = unit_circuit(modelfile.model, spec, catalog)
    return replace(circuit, parts=tuple(bought(part) for part in circuit.parts))


def _check_values(board: BoardSpec, spec: CircuitSpec, catalog: Catalog) -> None:
    """The values that the table [board] states can be bought."""
    stated: tuple[tuple[str, Kind, float, float, Use], ...] = (
        ("probe_resistor", "resistor", board.probe_resistor, spec.resistor_grade, "signal"),
        ("decoupling", "capacitor", board.decoupling, 1.0, "supply"),
        ("bulk", "capacitor", board.bulk, 1.0, "supply"),
    )
    for key, kind, value, grade, use in stated:
        try:
            catalog.part(kind, value, grade, use)
        except Unreachable as error:
            raise Unreachable(None, f"board.{key}", error.found, error.expected) from None


def _pads_refusal(opamp: OpAmp) -> InputError | None:
    """Why an op-amp's pins are not the pads of its case; None if they are, or the case is none
    that is known here, which only the KiCad project needs."""
    pads = _pads_of(opamp.footprint)
    pins = [*opamp.supply_pins]
    pins += [number for s in opamp.pins for number in (s.inverting, s.noninverting, s.output)]
    lost = [number for number in pins if pads and number not in pads]
    if not lost:
        return None
    pair = f"{opamp.name}, with a pin {lost[0]} in {opamp.footprint}"
    return InputError(None, "circuit.opamp", pair, f"an op-amp with pins of its {len(pads)} pads")


def _check_pads(component: Component) -> None:
    pads = _pads_of(component.footprint)
    for pin in component.pins:
        if pads and pin.number not in pads:
            pair = f"{component.value}, with a pin {pin.number} in {component.footprint}"
            raise InputError(None, component.kind, pair, "pins that are pads of the footprint")


def _pads_of(name: str) -> frozenset[str]:
    """Numbers of the pads of a footprint; empty where it is not known here."""
    try:
        return frozenset(pad.number for pad in footprint(name).pads)
    except InputError:
        return frozenset()
