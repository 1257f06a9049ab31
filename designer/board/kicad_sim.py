"""What the sheet needs to be simulated: fields of the symbols, a library, directives.

The models are those of the deck's fidelity ``ideal``. An op-amp is one subcircuit for its whole
package, whose pins are those of the case.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from designer.base.views import View
from designer.board.component import Component
from designer.board.kicad_names import kicad_net
from designer.board.pins import SUPPLY_UNIT
from designer.check.deck_runs import FirstRun
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit
from designer.spice import deck, opamp_model
from designer.spice.deck import diode_cards, diode_names, following
from designer.spice.opamp_model import literal

GENERATOR = "generator"
Fields = tuple[tuple[str, str], ...]


def sources(
    circuit: Circuit, run: FirstRun, library: str
) -> Iterator[tuple[str, str, str, Fields]]:
    """The sources of the simulation alone: name, net, the value that is shown, fields. library :
    file of the models, where a generator of another shape than a sine is one."""
    drive = run.excitation
    sine = (
        f"dc={literal(drive.offset)} ampl={literal(drive.amplitude)} f={literal(drive.frequency)} "
        "td=0 theta=0 phase=180"
    )
    for number, channel in enumerate(circuit.generators):
        name = _channel(number)
        model = _model("SUBCKT", library, name, f"1={channel.net} 2=bottom")
        yield channel.name, channel.net, name, model if _shaped(run) else _source("SIN", sine)
    for rail in circuit.rails:
        # A reference without a number is none to KiCad.
        dc = _source("DC", f"dc={literal(rail.volts)}")
        yield f"{rail.name}1", rail.net, f"{rail.volts:g} V", dc


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
            ("Sim.Params", f"{letter}={literal(circuit.values[component.parts[0]])}"),
        )
    if component.kind == "op-amp":
        pins = " ".join(f"{pin.number}={pin.number}" for pin in component.pins)
        return _model("SUBCKT", library, component.reference.lower(), pins)
    by_names = f"{numbers['cathode']}={{}} {numbers['anode']}={{}}"
    if component.kind == "diode":
        return _model(
            "D", library, diode_names(circuit)[component.parts[0]], by_names.format("K", "A")
        )
    name = _references(circuit)[component.parts[0]]
    return _model("SUBCKT", library, name, by_names.format("cathode", "anode"))


def models(circuit: Circuit, components: Sequence[Component], run: FirstRun) -> str:
    """The library: op-amp packages, diodes, references, and a generator whose voltage is no
    sine."""
    board = nominal_board(circuit)
    lines = ["* Models of the sheet: op-amps with limits and finite gain.", ""]
    lines += opamp_model.ideal(circuit.gain)
    for package in components:
        if package.kind != "op-amp":
            continue
        units, numbers = package.units, [pin.number for pin in package.pins]
        supply = units.pop(SUPPLY_UNIT)
        lines += ["", f".subckt {package.reference.lower()} {' '.join(numbers)}"]
        limits = (-circuit.saturation, circuit.saturation)
        for unit, pins in units.items():
            name = f"{package.reference}{unit}"
            lines.append(
                opamp_model.instance(
                    name,
                    (pins["+"], pins["-"], pins["OUT"]),
                    fidelity="ideal",
                    vos=0.0,
                    ib=board.bias.get(name, circuit.bias),
                    rails=board.rails.get(name, limits),
                    supplies=(supply["V+"], supply["V-"]),
                )
            )
        lines.append(f".ends {package.reference.lower()}")
    lines += diode_cards(circuit, charge=False)
    for r in circuit.references:
        name = _references(circuit)[r.name]
        lines += ["", f".subckt {name} cathode anode"]
        lines += [f"Vkept cathode anode {literal(board.reference[r.name])}", f".ends {name}"]
    for number, channel in enumerate(circuit.generators if _shaped(run) else ()):
        name, own = _channel(number), run.excitation.channel(number)
        lines += ["", f".subckt {name} {channel.net} bottom"]
        lines += [*deck.generator(channel, own, bottom="bottom"), f".ends {name}"]
    return "\n".join(lines) + "\n"


def directives(circuit: Circuit, run: FirstRun) -> tuple[str, ...]:
    """The lines that a simulation of the sheet runs with."""
    s = run.settings
    by_name = {c.name: c for c in circuit.capacitors}
    # The other plate is a summing node, which starts at 0 V.
    volts: dict[str, float] = {}
    if run.initial is not None:
        volts = dict(zip(circuit.states, run.initial.tolist(), strict=True))
        volts |= following(circuit, nominal_board(circuit), run.initial, run.excitation.at_start)
    starts = [f".ic v({kicad_net(by_name[name].plus)})={literal(v)}" for name, v in volts.items()]
    return (
        f".options method={s.method} reltol={literal(s.reltol)}",
        f".options abstol={literal(s.abstol)} vntol={literal(s.vntol)} noopiter",
        *starts,
        f".tran {literal(s.max_step)} {literal(run.stop_time)} 0 {literal(s.max_step)} uic",
    )


def _channel(number: int) -> str:
    """What stands at a channel of the generator, and the name of its model."""
    return GENERATOR + (f"{number + 1}" if number else "")


def _shaped(run: FirstRun) -> bool:
    """Whether the generator's voltage is more than a sine."""
    return not run.excitation.drive.is_sine


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


def _references(circuit: Circuit) -> Mapping[str, str]:
    return {r.name: f"reference{i}" for i, r in enumerate(circuit.references)}
