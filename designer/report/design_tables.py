"""Tables of a report about the design itself: model, parts, errors, scales, conditions."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from designer.base.page import Table, table
from designer.base.si_unit import acceleration_text, drive_text
from designer.circuit.coefficients import EXACT
from designer.circuit.design import Design
from designer.circuit.netlist import Capacitor, Circuit, Diode, Reference, Resistor, Section
from designer.fabrication.board_cost import CostEstimate
from designer.model.lumped_system import LumpedSystem
from designer.model.mechanics import MechanicalModel
from designer.model.model import Dimensionless, Mechanical, SiScales
from designer.model.relative_motion import relative_motions, subscripted
from designer.model.si_units import MECHANICAL_UNITS
from designer.plots.system_equations import element_rows
from designer.report import words
from designer.workbench.prediction import PredictedStop

_PARAMETERS = {
    "m": "mass ratio M2/(M1 + M2)",
    "k": "stiffness ratio K2/(K1 + K2)",
    "k0": "stop stiffness K0/(K0 + K1)",
    "c": "damping ratio C2/(C1 + C2)",
    "zeta": "damping ζ = C1/(2 √(K1 M1))",
    "f20": "share of the force on M2, P2/(P1 + P2)",
    "b": "clearance B K1/(P1 + P2)",
    "sides": "sides of M1 with a stop",
}

_MEANINGS = {
    "M": "mass", "C": "damper", "K": "spring", "K0": "stop's spring", "B": "clearance",
    "P": "force amplitude on mass",
}  # fmt: skip

_BOM = {
    "quantity": "qty", "designators": "designators", "value": "value",
    "part_number": "part number", "manufacturer": "manufacturer", "footprint": "footprint",
    "rating": "rating", "grade": "grade", "price_class": "price class",
    "assumed": "assumed",
}  # fmt: skip

_CONDITIONS = {
    "frequency_low_hz": ("frequency at ω = 1, at least", "Hz"),
    "frequency_high_hz": ("frequency at ω = 1, at most", "Hz"),
    "swing_v": ("peak of any state, at most", "V"),
    "guaranteed_swing_v": ("peak of an output at the current that it gives, at most", "V"),
    "rectifier_fv_v": ("rectifier's output, so that the idle half stays off, at most", "V"),
    "generator_peak_v": ("generator amplitude (peak), at most", "V"),
    "signal_level_ratio": ("ratio of the states' peaks that belong together, at most", ""),
    "signal_share_ratio": ("another state's peak over that of x₁, at most", ""),
    "signal_offset_ratio": ("peak of x₁ over the op-amps' largest offset, at least", ""),
    "noise_gain": ("noise gain of a stage, at most", ""),
    "noise_gain_bandwidth_hz": ("noise gain times the fastest harmonic, at most", "Hz"),
    "output_current_a": ("current of an output (peak), at most", "A"),
    "load_ohm": ("load of an output, at least", "Ω"),
    "signal_resistor_low_ohm": ("signal resistors, at least", "Ω"),
    "signal_resistor_high_ohm": ("signal resistors, at most", "Ω"),
    "stop_resistor_r4_low_ohm": (
        "R4, so that the stop's resistor is no heavier load, at least",
        "Ω",
    ),
}

_QUANTITY = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)([fpnµmkM]?[ΩFVW])(?!\w)")


def model_table(model: Dimensionless) -> Table | None:
    rows = [
        ("ζ" if k == "zeta" else k, words.number(getattr(model, k)), t)
        for k, t in _PARAMETERS.items()
    ]
    return table(("parameter", "value", "what it is"), rows, (1,))


def mechanical_table(parameters: Mechanical) -> Table | None:
    rows = []
    for name, unit in MECHANICAL_UNITS.items():
        kind = _MEANINGS.get(name) or f"{_MEANINGS[name[0]]} {name[1:]}"
        rows.append((name, words.quantity(getattr(parameters, name), unit), kind))
    return table(("parameter", "value", "what it is"), rows, (1,))


def elements_table(model: LumpedSystem, *, si: bool) -> Table | None:
    """The numbers of a system's elements. si : whether they are SI values."""
    return table(("symbol", "value", "what it is"), element_rows(model, si=si), (1,))


def bom_table(bom: Sequence[Mapping[str, str]]) -> Table | None:
    keys = [k for k in _BOM if any(k in row for row in bom)]
    rows = [[_bom_cell(k, row.get(k, "")) for k in keys] for row in bom]
    numeric = [keys.index(k) for k in ("quantity", "value") if k in keys]
    return table([_BOM[k] for k in keys], rows, numeric)


def cost_table(estimate: CostEstimate) -> Table | None:
    """Euro for one board, by the size of the order."""
    rows = [
        (str(c.boards), *(f"{euro:.2f} €" for euro in (c.parts, c.bare_board, c.assembly, c.total)))
        for c in estimate.costs
    ]
    columns = ("boards", "parts", "bare board", "assembly", "one board")
    return table(columns, rows, range(len(columns)))


def part_table(circuit: Circuit) -> Table | None:
    """Everything but the op-amps, by what it does."""
    roles: dict[str, list[str]] = {}
    for part in circuit.parts:
        if not isinstance(part, Section):
            roles.setdefault(part.role, []).append(f"{part.name}\u00a0=\u00a0{_value(part)}")
    return table(("role", "parts"), [(r, ", ".join(p)) for r, p in roles.items()])


def _value(part: Resistor | Capacitor | Diode | Reference) -> str:
    match part:
        case Diode():
            return part.model.name
        case Reference():
            return f"{part.model} ({words.quantity(part.volts, 'V')})"
        case Resistor():
            return words.quantity(part.value, "Ω")
        case Capacitor():
            return words.quantity(part.value, "F")


def opamp_table(circuit: Circuit) -> Table | None:
    rows = [(s.name, s.package, s.role) for s in circuit.sections]
    return table(("section", "package", "role"), rows)


def error_table(design: Design) -> Table | None:
    spring = spring_of(design.model)
    rows = [
        (words.coefficient(name, spring), _wanted(design, name), words.error(error))
        for name, error in design.errors.errors.items()
    ]
    return table(("coefficient", "wanted", "ln(realised/wanted)"), rows, (1, 2), names=2)


def spring_of(model: MechanicalModel) -> str:
    """What the stiffness of a stop is counted in."""
    return "K1" if isinstance(model, Dimensionless) else "the springs on its mass"


def _wanted(design: Design, name: str) -> str:
    """The coefficient as the model has it."""
    system = design.model.second_order()
    if term := words.TERM.fullmatch(name):
        row, column = (2 * (int(term[i]) - 1) + len(term[i + 1]) for i in (1, 3))
        return words.number(float(system.state_matrix()[row - 1, column]))
    if name.startswith(("dead-zone null", "dead-zone bias")):
        return "0"
    if name.endswith("stop slope"):
        return words.number(system.relative_stiffness(system.dead_zones[0]))
    if name.endswith("stop damping"):
        zone = system.dead_zones[0]
        return words.number(zone.damping / float(system.mass[zone.mass]))
    return words.NONE


def stop_table(stops: Sequence[PredictedStop]) -> Table | None:
    """Where each dead zone of the nominal board ends, and how steep its output is."""
    rows = [
        (
            stop.clearance,
            "upper" if side > 0 else "lower",
            moved_nets(stop),
            words.quantity(end, "V").replace("-", "−"),
            stop.output,
            words.number(stop.inside[1]),
            words.number(stop.inside[1] + stop.gains[side]),
        )
        for stop in stops
        for side, end in sorted(stop.ends.items(), reverse=True)
    ]
    columns = (
        "dead zone", "side", "moves with", "begins at", "output", "V per V inside",
        "V per V beyond",
    )  # fmt: skip
    return table(columns, rows, (3, 5, 6))


def moved_nets(stop: PredictedStop) -> str:
    """What the displacement of a dead zone is made of, such as "v1" or "v1 − v3"."""
    text = ""
    for net, factor in stop.displacement.items():
        size = "" if abs(abs(factor) - 1.0) < 0.01 else f"{abs(factor):.3g} "
        text += f" {'−' if factor < 0.0 else '+'} {size}{net}"
    return text.removeprefix(" + ").strip()


def scale_table(design: Design, si: SiScales | None) -> Table | None:
    scales, unit_omega = design.errors.scales, design.model.second_order().own_frequency
    hertz = None if si is None else si.hertz(unit_omega)
    rows = [
        ("one unit of model time", words.quantity(scales.seconds, "s")),
        (
            f"generator frequency at {drive_text(unit_omega, hertz)}",
            words.quantity(scales.frequency(unit_omega), "Hz"),
        ),
    ]
    if si is not None:
        slow = si.time_scale / scales.seconds
        rows.append(("mechanism's time per circuit time", f"{words.number(slow)} s/s"))
    rows += _thresholds(design)
    names = words.state_symbols(len(scales.volts) // 2)
    for state, volts in zip(names, scales.volts, strict=True):
        rows.append((f"one unit of {state}", words.quantity(float(volts), "V")))
        if si is not None:
            speed = state.endswith("′")
            scale = si.speed_scale if speed else si.length_scale
            unit = "m/s" if speed else "m"
            rows.append((f"one volt of {state}", words.quantity(scale / float(volts), unit)))
    gains = design.errors.drive_gain, design.errors.second_gain
    for name, each in zip(("generator", "second channel"), gains, strict=True):
        gain = float(np.abs(each).sum())
        if gain <= 0.0:
            continue
        rows.append((f"{name} for forces of 1 in all", f"{words.quantity(1.0 / gain, 'V')} peak"))
        if si is not None:
            one = "one generator volt" if name == "generator" else f"one volt of the {name}"
            rows.append((one, words.quantity(gain * si.force_scale, "N")))
    base = design.base_per_volt()
    if base is not None and si is not None:
        volt = ("one generator volt", "one volt of the second channel")[base[0]]
        text = acceleration_text(base[1] * si.acceleration_scale)
        rows.append((f"{volt}, of the base's acceleration", text))
    return table(("scale", "value"), rows, (1,))


def _thresholds(design: Design) -> list[tuple[str, str]]:
    """Where contact begins in each clearance, on the scale of the mass that moves in it."""
    system, rows = design.model.second_order(), []
    for number, (clearance, motion) in enumerate(
        zip(system.clearances, relative_motions(system), strict=False)
    ):
        mass = system.dead_zones[number].mass
        symbol = f"v{2 * mass + 1}"
        if len(clearance.terms) > 1:
            symbol = f"{motion.symbol} by the scale of {subscripted(f'x{mass + 1}')}"
        named = "" if len(system.clearances) == 1 else f" in {clearance.name}"
        rows.append((f"contact{named} begins at ({symbol})", _places(design, number)))
    return rows


def _places(design: Design, number: int) -> str:
    """Voltages with their signs; ± where both stops stand alike."""
    places = [side * distance for side, distance in design.thresholds(number).items()]
    texts = [words.quantity(place, "V").replace("-", "−") for place in places]
    even = abs(sum(places)) <= EXACT * sum(map(abs, places)) and len(places) == 2
    return f"± {texts[0]}" if even else " and ".join(texts)


def condition_table(design: Design) -> Table | None:
    rows = [_condition(k, v) for k, v in design.conditions.items()]
    return table(("condition", "value"), rows, (1,))


def _bom_cell(key: str, text: str) -> str:
    if key == "grade" and text:
        try:
            return f"{100 * float(text):g} %"
        except ValueError:
            return text
    if key == "footprint":
        return text.rpartition(":")[2]  # the library's name says what the value says already
    if key in ("value", "rating"):
        return _QUANTITY.sub("\\1\u00a0\\2", text.replace(" ", "\u00a0"))
    return text


def _condition(name: str, value: float) -> tuple[str, str]:
    text, unit = _CONDITIONS.get(name, (name.replace("_", " "), ""))
    return text, words.quantity(value, unit) if unit else words.number(value)
