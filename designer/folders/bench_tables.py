"""What to set on the bench: the generator for each response, and the scale card."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from designer.base.csv_tables import csv_text
from designer.base.second_process import Ask
from designer.base.units import distinct_texts
from designer.check import checked_design
from designer.circuit.design import Design, GeneratorSetting, settings
from designer.dynamics.drive_shape import Shape, wave
from designer.dynamics.orbit import SETTLED
from designer.model.clearance import Clearance
from designer.model.find_responses import ModelResponse
from designer.model.mechanics import state_names
from designer.model.model import SiScales
from designer.model.model_file import ModelFile
from designer.model.si_units import BASE, base_json
from designer.yields.start_recipe import Recipe, hertz, volts
from designer.yields.start_recipe_search import find_recipes
from designer.yields.study_plan import plan_study

if TYPE_CHECKING:
    from designer.check.synthesis_result import Synthesis

COLUMNS = (
    "omega",
    "expect",
    "frequency_hz",
    "amplitude_v_peak",
    "amplitude_vpp",
    "offset_v",
    "load",
    "start",
)
DIGITS = 6
"""Significant ones of the scale card."""
SIDES = {1: "upper", -1: "lower"}
WAVEFORM_POINTS = 4096
"""Values in ``waveform.csv``."""
OMEGA_DIGITS = 6
"""Significant ones of ω where it follows from SI values; more where they tell responses apart."""
SECOND = ("amplitude2_v_peak", "amplitude2_vpp", "phase2_deg")
"""Further columns, of boards that a generator's second channel drives too."""
MECHANISM = "mechanism_hz"
"""A further column, of models with SI values."""
LOAD = "high-Z"
NO_RECIPE = "none: the nominal circuit does not show the wanted response"


def setup_csv(
    design: Design,
    responses: Sequence[ModelResponse],
    recipes: Sequence[Recipe | None],
    si: SiScales | None = None,
) -> str:
    """``setup.csv``, in digits that a generator takes; ``design.json`` has all of them.

    recipes : how to start each response; None where the nominal circuit does not show it.
    si : adds what each frequency is in the mechanism, Hz, and where its base moves the base's
    acceleration per volt of the channel that stands for it, in last columns.
    """
    bench_settings = settings(design, responses)
    omegas = [repr(s.omega) for s in bench_settings]
    if si is not None:  # there ω follows from Hz or rad/s, and all its digits say nothing
        omegas = distinct_texts([s.omega for s in bench_settings], OMEGA_DIGITS)
    rows = [
        {
            "omega": omega,
            "expect": s.expect or "",
            "frequency_hz": hertz(s.frequency_hz),
            "amplitude_v_peak": volts(s.amplitude_v_peak),
            "amplitude_vpp": repr(2.0 * float(volts(s.amplitude_v_peak))),
            "offset_v": repr(s.offset_v),
            "load": LOAD,
            "start": _start(recipe, si) + _coexisting(r),
            **_second(s),
            **({} if si is None else {MECHANISM: hertz(si.hertz(s.omega))}),
            **{key: f"{value:.{DIGITS}g}" for key, value in base_json(s.base, si).items()},
        }
        for s, omega, r, recipe in zip(bench_settings, omegas, responses, recipes, strict=True)
    ]
    more: tuple[str, ...] = SECOND if any(s.second for s in bench_settings) else ()
    more += () if si is None else (MECHANISM,)
    more += (BASE,) if any(BASE in row for row in rows) else ()
    return csv_text((*COLUMNS, *more), rows)


def _second(setting: GeneratorSetting) -> dict[str, str]:
    """What the generator's second channel is set to."""
    if setting.second is None:
        return {}
    peak = volts(setting.second.amplitude)
    values = peak, repr(2.0 * float(peak)), f"{setting.excitation.second_phase_deg:.5g}"
    return dict(zip(SECOND, values, strict=True))


def waveform_csv(shape: Shape) -> str:
    """``waveform.csv``, or ``waveform2.csv``: a period of the generator's voltage over its peak,
    from drive phase 0 on, a value a line, as generators read an arbitrary waveform."""
    angle = 2.0 * np.pi * np.arange(WAVEFORM_POINTS) / WAVEFORM_POINTS
    return "".join(f"{-value:.7f}\n" for value in wave(shape, angle).tolist())


def _start(recipe: Recipe | None, si: SiScales | None) -> str:
    """A recipe in words, its frequencies also as those of the mechanism."""
    if recipe is None:
        return NO_RECIPE
    return (recipe if si is None else replace(recipe, hertz_scale=si.hertz(1.0))).text


def start_recipes(
    synthesis: Synthesis, jobs: int = 1, other: Ask | None = None
) -> tuple[Recipe | None, ...]:
    """A start recipe for each response of a design, found on its circuit; None where the model or
    the nominal circuit does not show it. other : as of ``find_recipes``."""
    checked = checked_design.check(synthesis.design, synthesis.model_responses, None)
    indices = [i for i, c in enumerate(checked) if c.model.found and c.circuit.status in SETTLED]
    plan = plan_study(
        synthesis.modelfile,
        synthesis.design,
        [checked[i] for i in indices],
        synthesis.catalog,
        samples=1,  # neither this nor the seed matters to a recipe
        seed=0,
    )
    recipe_of = dict(zip(indices, find_recipes(plan, jobs, other), strict=True))
    return tuple(recipe_of.get(i) for i in range(len(checked)))


def scales_csv(modelfile: ModelFile, design: Design, responses: Sequence[ModelResponse]) -> str:
    """``scales.csv``: what a volt and a second on the bench stand for.

    A response that is wanted at a clearance of its own is driven harder or softer instead of
    moving the threshold, so its volts stand for other lengths and have rows of their own.
    """
    scales, b0 = design.errors.scales, design.model.b
    rows = [
        ("model time per circuit second", 1.0 / scales.seconds, "1/s", b0),
        ("circuit seconds per unit of model time", scales.seconds, "s", b0),
    ]
    if modelfile.si is not None:
        slow = modelfile.si.time_scale / scales.seconds
        rows.append(("mechanism seconds per circuit second", slow, "s/s", b0))
    rows += [(name, volts, "V", b0) for name, volts in _thresholds(design)]
    for b in dict.fromkeys([b0, *(r.b for r in responses)]):
        rows += _amplitudes(modelfile, design, b)
    return csv_text(
        ("quantity", "value", "unit", "b"),
        [
            {"quantity": q, "value": f"{v:.{DIGITS}g}", "unit": u, "b": repr(b)}
            for q, v, u, b in rows
        ],
    )


def _thresholds(design: Design) -> list[tuple[str, float]]:
    """Where contact begins [V], as a distance from rest. Several clearances have a row for each
    stop, on the scale of the mass that moves in it; one has a row, or two where its middle is off
    rest. Where several displacements make up that in a clearance, the others are at 0."""
    scales, system = design.errors.scales, design.model.second_order()
    clearances = system.dead_zones[: len(system.clearances)]

    def where(clearance: Clearance) -> str:
        alone = clearance.other is None and not clearance.combination
        return f"of v{2 * clearance.mass + 1}" + ("" if alone else " with the others at 0")

    if len(clearances) > 1:
        return [
            (f"threshold of contact, {c.name}, {SIDES[side]} stop, {where(c)}", volts)
            for number, c in enumerate(clearances)
            for side, volts in design.thresholds(number).items()
        ]
    if not clearances:
        return []
    ends = "" if where(clearances[0]) == "of v1" else f", {where(clearances[0])}"
    rows = [(f"threshold of contact{ends}", scales.threshold)]
    if abs(scales.offcentre) > 1e-9:
        rows.append((f"threshold of contact, lower stop{ends}", scales.threshold_lower))
    return rows


def _amplitudes(
    modelfile: ModelFile, design: Design, b: float
) -> list[tuple[str, float, str, float]]:
    volts = [float(v) for v in design.volts(b)]
    each = design.errors.drive_gain, design.errors.second_gain
    gains = [(b / design.model.b) * float(np.abs(gain).sum()) for gain in each]
    names = ("generator volt", "volt of the generator's second channel")
    driving = [(name, gain) for name, gain in zip(names, gains, strict=True) if gain]
    states = state_names(len(volts) // 2)
    base = design.base_per_volt(b)
    rows = [(f"volts per unit of {s}", v, "V", b) for s, v in zip(states, volts, strict=True)]
    si = modelfile.si
    if si is None:
        rows += [
            (f"model units of {s} per volt", 1.0 / v, "1/V", b)
            for s, v in zip(states, volts, strict=True)
        ]
        rows += [(f"model force per {name}", gain, "1/V", b) for name, gain in driving]
        if base is not None:
            rows.append((f"model acceleration of the base per {names[base[0]]}", base[1], "1/V", b))
        return rows
    length, speed = si.length_scale, si.speed_scale
    for i, (s, v) in enumerate(zip(states, volts, strict=True)):
        name = f"metres per volt of {s}" if i % 2 == 0 else f"metres per second per volt of {s}"
        rows.append((name, (speed if i % 2 else length) / v, "m/s/V" if i % 2 else "m/V", b))
    force = si.force_scale
    rows += [(f"newtons per {name}", gain * force, "N/V", b) for name, gain in driving]
    if base is not None:
        name = f"acceleration of the base per {names[base[0]]}"
        rows.append((name, base[1] * si.acceleration_scale, "m/s²/V", b))
    return rows


def _coexisting(response: ModelResponse) -> str:
    """What other starts may end on."""
    others = ", ".join(o.response for o in response.others)
    return f"; other starts may end on {others}" if others else ""
