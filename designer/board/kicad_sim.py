"""What the sheet needs to be simulated: fields of the symbols, a library, directives.

The models are those of the deck's rung ``ideal``. An op-amp is one subcircuit for its whole
package, whose pins are those of the case.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from designer.base.views import View
from designer.board.component import Component
from designer.board.kicad_names import kicad_net
from designer.catalog import diode_curve
from designer.check.deck_runs import FirstRun
from designer.circuit.netlist import Circuit, nominal_board
from designer.spice import opamp_model

GENERATOR, RAIL = "generator", "supply"
Fields = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Source:
    """A voltage source that only the simulation has, from ``net`` to ground."""

    name: str
    """Its designator."""
    net: str
    """The net that it drives."""
    value: str
    """The value that is shown."""
    fields: Fields
    """Its fields for the simulation, by name."""


def sources(circuit: Circuit, run: FirstRun) -> tuple[Source, ...]:
    """The generator and both rails."""
    drive = run.excitation
    sine = (
        f"dc={_n(drive.offset)} ampl={_n(drive.amplitude)} f={_n(drive.frequency)} "
        "td=0 theta=0 phase=180"
    )
    made = [Source(circuit.generator.name, circuit.generator.net, GENERATOR, _source("SIN", sine))]
    made += [
        # A reference without a number is none to KiCad.
        Source(
            f"{rail.name}1", rail.net, f"{rail.volts:g} V", _source("DC", f"dc={_n(rail.volts)}")
        )
        for rail in circuit.rails
    ]
    return tuple(made)


def fields(component: Component, circuit: Circuit, library: str) -> Fields:
    """The ``Sim.*`` fields of a component; none where it is not simulated."""
    if View.SIMULATION not in component.views:
        return ()
    numbers = {pin.name: pin.number for pin in component.pins}
    if component.kind in ("resistor", "capacitor"):
        letter = component.kind[0]
        return (
            ("Sim.Device", letter.upper()),
            ("Sim.Pins", "1=+ 2=-"),
            ("Sim.Params", f"{letter}={_n(circuit.values[component.parts[0]])}"),
        )
    if component.kind == "op-amp":
        pins = " ".join(f"{pin.number}={pin.number}" for pin in component.pins)
        return _model("SUBCKT", library, component.reference.lower(), pins)
    by_names = f"{numbers['cathode']}={{}} {numbers['anode']}={{}}"
    if component.kind == "diode":
        return _model("D", library, _diodes(circuit)[component.parts[0]], by_names.format("K", "A"))
    name = _references(circuit)[component.parts[0]]
    return _model("SUBCKT", library, name, by_names.format("cathode", "anode"))


def models(circuit: Circuit, components: Sequence[Component]) -> str:
    """The library: op-amp packages, diodes, references."""
    board = nominal_board(circuit)
    lines = ["* Models of the sheet: op-amps with limits and finite gain.", ""]
    lines += opamp_model.ideal(circuit.gain)
    for package in components:
        if package.kind != "op-amp":
            continue
        numbers = [pin.number for pin in package.pins]
        units: dict[str, dict[str, str]] = {}
        for pin in package.pins:
            units.setdefault(pin.unit, {})[pin.name] = pin.number
        supplies = next((u["V+"], u["V-"]) for u in units.values() if "V+" in u)
        lines += ["", f".subckt {package.reference.lower()} {' '.join(numbers)}"]
        limits = (-circuit.saturation, circuit.saturation)
        for unit, found in units.items():
            if "OUT" not in found:
                continue
            name = f"{package.reference}{unit}"
            lines.append(
                opamp_model.instance(
                    name,
                    (found["+"], found["-"], found["OUT"]),
                    rung="ideal",
                    vos=0.0,
                    ib=board.bias.get(name, circuit.bias),
                    rails=board.rails.get(name, limits),
                    supplies=supplies,
                )
            )
        lines.append(f".ends {package.reference.lower()}")
    kinds = {name: d.model for d in circuit.diodes for name in [_diodes(circuit)[d.name]]}
    lines += [diode_curve.card(model, name, charge=False) for name, model in kinds.items()]
    for r in circuit.references:
        name = _references(circuit)[r.name]
        lines += ["", f".subckt {name} cathode anode"]
        lines += [f"Vkept cathode anode {_n(board.reference[r.name])}", f".ends {name}"]
    return "\n".join(lines) + "\n"


def directives(circuit: Circuit, run: FirstRun) -> tuple[str, ...]:
    """The lines that a simulation of the sheet runs with."""
    s = run.settings
    by_name = {c.name: c for c in circuit.capacitors}
    # The other plate is a summing node, which starts at 0 V.
    starts = (
        []
        if run.initial is None
        else [
            f".ic v({kicad_net(by_name[name].plus)})={_n(volts)}"
            for name, volts in zip(circuit.states, run.initial, strict=True)
        ]
    )
    return (
        f".options method={s.method} reltol={_n(s.reltol)}",
        f".options abstol={_n(s.abstol)} vntol={_n(s.vntol)} noopiter",
        *starts,
        f".tran {_n(s.max_step)} {_n(run.stop_time)} 0 {_n(s.max_step)} uic",
    )


def _model(device: str, library: str, name: str, pins: str) -> Fields:
    return (
        ("Sim.Library", library),
        ("Sim.Name", name),
        ("Sim.Device", device),
        ("Sim.Pins", pins),
    )


def _source(kind: str, parameters: str) -> Fields:
    return (
        ("Sim.Device", "V"),
        ("Sim.Type", kind),
        ("Sim.Pins", "1=+ 2=-"),
        ("Sim.Params", parameters),
    )


def _diodes(circuit: Circuit) -> Mapping[str, str]:
    """The model of each diode, as in the deck."""
    kinds = list(dict.fromkeys(d.model for d in circuit.diodes))
    return {d.name: f"diode{kinds.index(d.model)}" for d in circuit.diodes}


def _references(circuit: Circuit) -> Mapping[str, str]:
    return {r.name: f"reference{i}" for i, r in enumerate(circuit.references)}


def _n(value: float) -> str:
    """A number that SPICE reads back as the same float."""
    return repr(float(value))
