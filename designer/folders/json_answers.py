"""Results as JSON objects, by the keys of docs/contract.md.

JSON has no NaN and no infinity: both become null.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

from designer.base.plain_json import FORMAT, plain
from designer.dynamics.drive_shape import SINE

if TYPE_CHECKING:  # the engines are not needed to print a catalogue
    from designer.answers.design_answer import (
        DeadZoneRow,
        DesignAnswer,
        DesignExtras,
        DesignKeys,
        GradeRow,
        KnobRow,
        ShapeKeys,
    )
    from designer.answers.shared_rows import ProvenanceRow
    from designer.answers.simulate_answer import (
        ClearanceReach,
        CoexistingOrbit,
        OrbitExtras,
        OrbitRow,
        ResponseRow,
        SimulateAnswer,
        SimulateExtras,
        StopReach,
        TwinRow,
    )
    from designer.answers.study_answer import RunAnswer, RunCost, StudyAnswer, StudyKeys
    from designer.base.arrays import Array
    from designer.check.simulation import Simulated
    from designer.circuit.design import Design, GeneratorSetting
    from designer.circuit.netlist import Circuit
    from designer.dynamics.orbit import Orbit
    from designer.model.find_responses import ModelResponse
    from designer.model.model import SiScales
    from designer.model.model_file import ModelFile
    from designer.spread.part_grades import BetterGrade

STUDY_KEYS = (
    "samples", "until", "narrow", "all_on_one_board", "any_lost", "blame", "boards", "maps",
)  # fmt: skip
"""What ``run`` prints of a study beside its responses."""


def synthesis_json(
    modelfile: ModelFile,
    design: Design,
    responses: Sequence[ModelResponse],
    provenance: ProvenanceRow,
    seconds: float,
    better_grades: Mapping[str, BetterGrade] | None = None,
) -> DesignAnswer:
    """What ``synthesise`` prints and ``design.json`` holds.

    better_grades : parts that are bought at a better grade than was asked for; the key is left
    out where there are none.
    """
    from designer.circuit.design import settings

    errors, circuit = design.errors, design.circuit
    better: DesignExtras = {"better_grades": _plain_grades(better_grades)} if better_grades else {}
    return {
        "format": FORMAT,
        "title": modelfile.title,
        "model": plain(design.model.as_dict()),
        "circuit": {
            "opamp": circuit.opamp,
            "gain": circuit.gain,
            "bias": circuit.bias,
            "supply": circuit.supply,
            "saturation": circuit.saturation,
        },
        "parts": circuit.values,
        "composites": design.composites,
        **better,
        "errors": errors.errors,
        "max_error": errors.max_error,
        "certificate": plain(design.certificate),
        "scales": {
            "seconds": errors.scales.seconds,
            "volts": _by_state(errors.scales.volts),
            "threshold": errors.scales.threshold,
        },
        "knobs": [
            _knob(s, r, modelfile.si)
            for s, r in zip(settings(design, responses), responses, strict=True)
        ],
        "dead_zone": _dead_zone(design),
        "distinct_values": design.distinct_values,
        "conditions": _conditions(design),
        "solver": design.solver,
        "provenance": provenance,
        "cost": {"seconds": seconds, "synthesis_seconds": design.seconds},
    }


def _knob(s: GeneratorSetting, response: ModelResponse, si: SiScales | None) -> KnobRow:
    from designer.model.si_units import base_json, mechanism_json

    shapes: ShapeKeys = {} if s.shape == SINE else {"shape": s.shape}
    if s.second is not None:
        shapes["second"] = {
            "amplitude_v_peak": s.second.amplitude,
            "phase_deg": s.excitation.second_phase_deg,
            "shape": s.second.shape,
        }
    return {
        "omega": s.omega,
        "frequency_hz": s.frequency_hz,
        **mechanism_json(s.omega, si),
        **base_json(s.base, si),
        "amplitude_v_peak": s.amplitude_v_peak,
        "offset_v": s.offset_v,
        **shapes,
        "expected": response.expected,
        "found": response.found,
    }


def _plain_grades(better: Mapping[str, BetterGrade]) -> dict[str, GradeRow]:
    return {name: {"asked": g.wanted, "bought": g.bought} for name, g in better.items()}


def cost_of(file: Mapping[str, Any]) -> Any:
    """The object ``cost`` of a file; empty where somebody took it out: its hash leaves it out."""
    cost = file.get("cost")
    return dict(cost) if isinstance(cost, Mapping) else {}


def run_json(design: DesignAnswer, study: StudyAnswer) -> RunAnswer:
    """What ``run`` prints, from the objects of the two files."""
    cost: RunCost = {"design": cost_of(design), "study": cost_of(study)}
    rest = cast("StudyKeys", {key: study.get(key) for key in STUDY_KEYS if key in study})
    return {
        **cast("DesignKeys", design),
        **rest,
        "equation_check": study.get("equation_check"),
        "responses": study["responses"],
        "provenance": study["provenance"],
        "cost": cost,
    }


def simulate_json(
    simulated: Sequence[Simulated],
    engine: str,
    provenance: ProvenanceRow,
    seconds: float,
    si: SiScales | None = None,
) -> SimulateAnswer:
    """What ``simulate`` prints; with ``si`` also what that is in SI units."""
    names: SimulateExtras = {}
    if simulated and simulated[0].masses:
        names = {"masses": simulated[0].masses, "clearances": simulated[0].clearances}
    return {
        "format": FORMAT,
        "engine": engine,
        **names,
        "responses": [_response_json(s, si) for s in simulated],
        "provenance": provenance,
        "cost": {"seconds": seconds},
    }


def _response_json(s: Simulated, si: SiScales | None) -> ResponseRow:
    from designer.model.si_units import hertz_json

    return {
        "omega": s.omega,
        **hertz_json(s.omega, si),
        "expected": s.expected,
        "found": s.found,
        **_coexisting(s, 0, si),
        "others": [_coexisting(s, i + 1, si) for i in range(len(s.others))],
        "starts": None if s.coexistence is None else s.coexistence.as_dict(),
        "engine": s.settings,
        "trust": s.trust.as_dict(),
        "cost": {"periods": s.orbit.periods, "seconds": s.seconds},
    }


def _coexisting(simulated: Simulated, number: int, si: SiScales | None) -> CoexistingOrbit:
    """The orbit (number 0) or one of the others. Masses with names are those of a file of format 2,
    whose plain numbers are the SI values already."""
    from designer.check.curved_laws import misfits_json

    orbit = (simulated.orbit, *simulated.others)[number]
    twin = simulated.twins[number] if simulated.twins else None
    beside = None if simulated.masses else si
    row = orbit_json(orbit, beside)
    if si is not None and orbit.frequencies:
        row["frequencies_hz"] = [si.hertz(omega) for omega in orbit.frequencies]
    if simulated.masses:
        for impact, stop in zip(row["impacts"], orbit.impact_clearances, strict=True):
            impact["clearance"] = simulated.clearances[stop]
        high, low = _reach(simulated.absolute[number] if simulated.absolute else None)
        row["x1_max"], row["x1_min"] = (None, None) if not high or not low else (high[0], low[0])
        row["x_max"], row["x_min"] = high, low
    if simulated.base:
        spans = simulated.from_base
        high, low = _reach(spans[number] if spans else orbit.extremes)
        row["from_base_max"], row["from_base_min"] = high, low
        row["base_amplitude"] = simulated.base
    if simulated.clearances:
        row["in_clearances"] = _in_clearances(simulated, orbit, beside)
    row = {**row, **misfits_json(simulated.misfits[number] if simulated.misfits else ())}
    held = simulated.sticking[number] if simulated.sticking else ()
    if held is None or held:
        row["sticking"] = plain(held)
    # What else the twin is follows by the mirror.
    mirrored: TwinRow | None = (
        None if twin is None else {"response": twin.response, "start": twin.start.tolist()}
    )
    return {**row, "twin": mirrored}


def _reach(span: Array | None) -> tuple[list[float], list[float]] | tuple[None, None]:
    """Greatest and least displacement of each mass; None where they are not known.

    span : (states, 2) least and greatest, or (0, 2).
    """
    if span is None or not len(span):
        return None, None
    return span[0::2, 1].tolist(), span[0::2, 0].tolist()


def _in_clearances(simulated: Simulated, orbit: Orbit, si: SiScales | None) -> list[ClearanceReach]:
    """How far an orbit goes in each clearance and into its stops, and how fast it meets them; with
    ``si`` also that in SI units."""
    rows = []
    for k, (name, motion) in enumerate(zip(simulated.clearances, simulated.motions, strict=True)):
        low, high = orbit.spans[k] if len(orbit.spans) else (math.nan, math.nan)
        speeds = orbit.speeds[k] if len(orbit.speeds) else (math.nan, math.nan)
        row: ClearanceReach = {
            "clearance": name,
            "upper": None,
            "lower": None,
            "max": high,
            "min": low,
        }
        if si is not None:
            row["max_m"], row["min_m"] = si.length_scale * high, si.length_scale * low
        for side, place in motion.stops:
            end, speed = (high, speeds[1]) if side > 0 else (low, speeds[0])
            depth = side * (end - place)
            stop: StopReach = {"depth": depth, "speed": speed}
            if si is not None:
                stop["depth_m"], stop["speed_m_s"] = si.length_scale * depth, si.speed_scale * speed
            if side > 0:
                row["upper"] = stop
            else:
                row["lower"] = stop
        rows.append(row)
    return rows


def _by_state(values: Array) -> dict[str, Any]:
    """Rows of a (states, …) array by the states' names."""
    from designer.model.mechanics import state_names

    return dict(zip(state_names(len(values) // 2), values.tolist(), strict=True))


def orbit_json(orbit: Orbit, si: SiScales | None = None) -> OrbitRow:
    """An orbit in model units; with ``si`` also its extremes and impacts in SI units. frequencies :
    of a quasi-periodic motion the drive's ω and the second one."""
    is_known = len(orbit.extremes) > 0
    impacts = zip(orbit.impact_times, orbit.impact_sides, orbit.impact_velocities, strict=True)
    more: OrbitExtras = {"more": orbit.more} if orbit.more else {}
    row: OrbitRow = {
        "response": orbit.response,
        "status": str(orbit.status),
        "n": orbit.n,
        "p": orbit.p,
        "q": orbit.q,
        **more,
        "start": orbit.start.tolist(),
        "symmetric": orbit.symmetric,
        "asymmetry": orbit.asymmetry,
        "x1_max": orbit.extremes[0, 1] if is_known else None,
        "x1_min": orbit.extremes[0, 0] if is_known else None,
        "extremes": _by_state(orbit.extremes) if is_known else None,
        "impact_velocities": orbit.impact_velocities.tolist(),
        "impacts": [
            {"time": t, "side": "upper" if side > 0 else "lower", "velocity": v}
            for t, side, v in impacts
        ],
        "multipliers": [[m.real, m.imag] for m in orbit.multipliers.astype(complex).tolist()],
        "lyapunov": orbit.lyapunov,
        "lyapunov_error": orbit.lyapunov_error,
        "frequencies": list(orbit.frequencies) or None,
        "penetration": orbit.penetration,
        "miss": orbit.miss,
        "reason": orbit.reason,
    }
    if si is not None:
        low, high = orbit.extremes[0] * si.length_scale if is_known else (None, None)
        row["x1_max_m"], row["x1_min_m"] = high, low
        row["impact_velocities_m_s"] = (orbit.impact_velocities * si.speed_scale).tolist()
    return row


def _conditions(design: Design) -> dict[str, Any]:
    """Limits by name; what the finished circuit has; which conditions are near, which cost."""
    return {
        **design.conditions,
        "checked": design.checks,
        "at_limit": sorted({check.name for check in design.checks if check.at_limit}),
        "binding": dict(design.binding),
    }


def _limit(circuit: Circuit) -> float:
    """Output limit [V] of the section that makes the first dead zone; of a rectifier as stated."""
    switches = [contact.switch for _, contact in circuit.dead_zones[0].contacts]
    return circuit.output_limits().get(switches[0], circuit.saturation)


def _dead_zone(design: Design) -> DeadZoneRow | None:
    if not design.circuit.dead_zones:
        return None
    errors = design.errors
    kinds = ("stop slope", "bend slope")
    slopes = [e for name, e in errors.errors.items() if any(kind in name for kind in kinds)]
    return {
        "kind": "rectifier" if design.circuit.diodes else "saturation",
        "saturation": _limit(design.circuit),
        "threshold": errors.scales.threshold,
        "threshold_lower": errors.scales.threshold_lower,
        "offcentre": errors.scales.offcentre,
        "slope_error": max(slopes, key=abs),
        "null_error": errors.errors.get("dead-zone null"),
        "bias_error": errors.errors.get("dead-zone bias"),
    }
