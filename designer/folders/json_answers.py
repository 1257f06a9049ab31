"""Results as JSON objects, by the keys of docs/contract.md.

JSON has no NaN and no infinity: both become null.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from designer.base.plain_json import FORMAT, plain
from designer.dynamics.drive_shape import SINE
from designer.dynamics.piecewise_linear import SecondDrive

if TYPE_CHECKING:  # the engines are not needed to print a catalogue
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
    provenance: Mapping[str, Any],
    seconds: float,
    better_grades: Mapping[str, BetterGrade] | None = None,
) -> dict[str, Any]:
    """What ``synthesise`` prints and ``design.json`` holds.

    better_grades : parts that are bought at a better grade than was asked for; the key is left
    out where there are none.
    """
    from designer.circuit.design import settings
    from designer.model.si_units import base_json, mechanism_json

    errors, circuit = design.errors, design.circuit
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
        **({"better_grades": _plain_grades(better_grades)} if better_grades else {}),
        "errors": errors.errors,
        "max_error": errors.max_error,
        "certificate": design.certificate,
        "scales": {
            "seconds": errors.scales.seconds,
            "volts": _by_state(errors.scales.volts),
            "threshold": errors.scales.threshold,
        },
        "knobs": [
            {
                "omega": s.omega,
                "frequency_hz": s.frequency_hz,
                **mechanism_json(s.omega, modelfile.si),
                **base_json(s.base, modelfile.si),
                "amplitude_v_peak": s.amplitude_v_peak,
                "offset_v": s.offset_v,
                **({} if s.shape == SINE else {"shape": [list(wave) for wave in s.shape]}),
                **({} if s.second is None else {"second": _second(s, s.second)}),
                "expected": r.expected,
                "found": r.found,
            }
            for s, r in zip(settings(design, responses), responses, strict=True)
        ],
        "dead_zone": _dead_zone(design),
        "distinct_values": design.distinct_values,
        "conditions": _conditions(design),
        "solver": design.solver,
        "provenance": provenance,
        "cost": {"seconds": seconds, "synthesis_seconds": design.seconds},
    }


def _second(setting: GeneratorSetting, second: SecondDrive) -> dict[str, Any]:
    """The generator's second channel, ahead of the first by its phase."""
    return {
        "amplitude_v_peak": second.amplitude,
        "phase_deg": setting.excitation.second_phase_deg,
        "shape": [list(wave) for wave in second.shape],
    }


def _plain_grades(better: Mapping[str, BetterGrade]) -> dict[str, dict[str, float]]:
    return {name: {"asked": g.wanted, "bought": g.bought} for name, g in better.items()}


def cost_of(file: Mapping[str, Any]) -> dict[str, Any]:
    """The object ``cost`` of a file; empty where somebody took it out: its hash leaves it out."""
    cost = file.get("cost")
    return dict(cost) if isinstance(cost, Mapping) else {}


def run_json(design: Mapping[str, Any], study: Mapping[str, Any]) -> dict[str, Any]:
    """What ``run`` prints, from the objects of the two files."""
    cost = {"design": cost_of(design), "study": cost_of(study)}
    return {
        **design,
        **{key: study[key] for key in STUDY_KEYS if key in study},
        "equation_check": study.get("equation_check"),
        "responses": study["responses"],
        "provenance": study["provenance"],
        "cost": cost,
    }


def simulate_json(
    simulated: Sequence[Simulated],
    engine: str,
    provenance: Mapping[str, Any],
    seconds: float,
    si: SiScales | None = None,
) -> dict[str, Any]:
    """What ``simulate`` prints; with ``si`` also what that is in SI units."""
    from designer.model.si_units import hertz_json

    masses = simulated[0].masses if simulated else ()
    return {
        "format": FORMAT,
        "engine": engine,
        **({"masses": masses, "clearances": simulated[0].clearances} if masses else {}),
        "responses": [
            {
                "omega": s.omega,
                **hertz_json(s.omega, si),
                "expected": s.expected,
                "found": s.found,
                **_response_json(s, 0, si),
                "others": [_response_json(s, i + 1, si) for i in range(len(s.others))],
                "starts": None if s.coexistence is None else s.coexistence.as_dict(),
                "engine": s.settings,
                "trust": s.trust.as_dict(),
                "cost": {"periods": s.orbit.periods, "seconds": s.seconds},
            }
            for s in simulated
        ],
        "provenance": provenance,
        "cost": {"seconds": seconds},
    }


def _response_json(simulated: Simulated, number: int, si: SiScales | None) -> dict[str, Any]:
    """The orbit (number 0) or one of the others. Masses with names are those of a file of format 2,
    whose plain numbers are the SI values already."""
    orbit = (simulated.orbit, *simulated.others)[number]
    twin = _twin_json(simulated.twins[number] if simulated.twins else None)
    if not simulated.masses:
        own = {**orbit_json(orbit, si), **_frequencies_hz(orbit, si)}
        return {**own, **_in_clearances(simulated, orbit, si), "twin": twin}
    answer = {**orbit_json(orbit), **_frequencies_hz(orbit, si)}
    from designer.check.curved_laws import misfits_json

    is_known = simulated.absolute and len(simulated.absolute[number])
    x = simulated.absolute[number][0::2] if is_known else None
    low, high = (None, None) if x is None else (x[:, 0], x[:, 1])
    answer |= {
        "x1_max": None if high is None else high[0],
        "x1_min": None if low is None else low[0],
        "x_max": high,
        "x_min": low,
        **_from_base(simulated, number),
        **_in_clearances(simulated, orbit),
        **misfits_json(simulated.misfits[number] if simulated.misfits else ()),
        **_sticking(simulated, number),
        "twin": twin,
    }
    for impact, stop in zip(answer["impacts"], orbit.impact_clearances, strict=True):
        impact["clearance"] = simulated.clearances[stop]
    return answer


def _from_base(simulated: Simulated, number: int) -> dict[str, Any]:
    """Extremes of the displacements from a base that moves, and its amplitude."""
    if not simulated.base:
        return {}
    spans = simulated.from_base
    span = spans[number] if spans else (simulated.orbit, *simulated.others)[number].extremes
    z = span[0::2] if len(span) else None
    low, high = (None, None) if z is None else (z[:, 0], z[:, 1])
    return {"from_base_max": high, "from_base_min": low, "base_amplitude": simulated.base}


def _in_clearances(
    simulated: Simulated, orbit: Orbit, si: SiScales | None = None
) -> dict[str, Any]:
    """How far an orbit goes in each clearance and into its stops, and how fast it meets them; with
    ``si`` also that in SI units. Nothing of a model without clearances."""
    rows: list[dict[str, Any]] = []
    scales = {"": (1.0, "", 1.0, "")}
    if si is not None:
        scales["SI"] = (si.length_scale, "_m", si.speed_scale, "_m_s")
    for k, (name, motion) in enumerate(zip(simulated.clearances, simulated.motions, strict=False)):
        low, high = orbit.spans[k] if len(orbit.spans) else (math.nan, math.nan)
        speeds = orbit.speeds[k] if len(orbit.speeds) else (math.nan, math.nan)
        row: dict[str, Any] = {"clearance": name, "upper": None, "lower": None}
        for length, unit, speed, rate in scales.values():
            row |= {f"max{unit}": length * high, f"min{unit}": length * low}
            for side, place in motion.stops:
                end, met = (high, speeds[1]) if side > 0 else (low, speeds[0])
                key = "upper" if side > 0 else "lower"
                depth = {f"depth{unit}": length * side * (end - place)}
                row[key] = {**(row[key] or {}), **depth, f"speed{rate}": speed * met}
        rows.append(row)
    return {"in_clearances": rows} if rows else {}


def _sticking(simulated: Simulated, number: int) -> dict[str, Any]:
    """What each friction does over an orbit, null where that is not known; nothing without any."""
    held = simulated.sticking[number] if simulated.sticking else ()
    if held is None:
        return {"sticking": None}
    return {"sticking": held} if held else {}


def _by_state(values: Array) -> dict[str, Any]:
    """Rows of a (states, …) array by the states' names."""
    from designer.model.mechanics import state_names

    return dict(zip(state_names(len(values) // 2), values, strict=True))


def _frequencies_hz(orbit: Orbit, si: SiScales | None) -> dict[str, Any]:
    """The two frequencies of a quasi-periodic motion in Hz; nothing of any other motion, nor of a
    dimensionless model."""
    if si is None or not orbit.frequencies:
        return {}
    return {"frequencies_hz": [si.hertz(omega) for omega in orbit.frequencies]}


def orbit_json(orbit: Orbit, si: SiScales | None = None) -> dict[str, Any]:
    """An orbit in model units; with ``si`` also its extremes and impacts in SI units. frequencies :
    of a quasi-periodic motion the drive's ω and the second one."""

    is_known = len(orbit.extremes) > 0
    impacts = zip(orbit.impact_times, orbit.impact_sides, orbit.impact_velocities, strict=True)
    return {
        "response": orbit.response,
        "status": str(orbit.status),
        "n": orbit.n,
        "p": orbit.p,
        "q": orbit.q,
        **({"more": orbit.more} if orbit.more else {}),
        "start": orbit.start,
        "symmetric": orbit.symmetric,
        "asymmetry": orbit.asymmetry,
        "x1_max": orbit.extremes[0, 1] if is_known else None,
        "x1_min": orbit.extremes[0, 0] if is_known else None,
        "extremes": _by_state(orbit.extremes) if is_known else None,
        "impact_velocities": orbit.impact_velocities,
        "impacts": [
            {"time": t, "side": "upper" if side > 0 else "lower", "velocity": v}
            for t, side, v in impacts
        ],
        "multipliers": list(orbit.multipliers.astype(complex)),
        "lyapunov": orbit.lyapunov,
        "lyapunov_error": orbit.lyapunov_error,
        "frequencies": list(orbit.frequencies) or None,
        "penetration": orbit.penetration,
        "miss": orbit.miss,
        "reason": orbit.reason,
        **_orbit_si(orbit, si),
    }


def _orbit_si(orbit: Orbit, si: SiScales | None) -> dict[str, Any]:
    if si is None:
        return {}
    is_known = len(orbit.extremes) > 0
    low, high = orbit.extremes[0] * si.length_scale if is_known else (None, None)
    return {
        "x1_max_m": high,
        "x1_min_m": low,
        "impact_velocities_m_s": orbit.impact_velocities * si.speed_scale,
    }


def _twin_json(twin: Orbit | None) -> dict[str, Any] | None:
    """A mirror twin: what it is called and where it starts; the rest follows by the mirror."""
    return None if twin is None else {"response": twin.response, "start": twin.start}


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


def _dead_zone(design: Design) -> dict[str, Any] | None:
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
