"""What to set on the bench: the generator for each response, and the scale card."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from designer.bom import csv_text
from designer.design import Design
from designer.modelfile import ModelFile
from designer.responses import ModelResponse

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
LOAD = "high-Z"
START = "from the nominal orbit; how to reach it from power-up is not yet studied"
STATES = ("x1", "x1'", "x2", "x2'")


@dataclass(frozen=True)
class Setting:
    """The generator for one response: Hz, volts peak into a high impedance, volts of offset."""

    omega: float
    expect: str | None
    frequency_hz: float
    amplitude_v_peak: float
    offset_v: float = 0.0


def settings(design: Design, found: Sequence[ModelResponse]) -> tuple[Setting, ...]:
    """The generator's settings, in the order of the responses."""
    scales = design.errors.scales
    return tuple(
        Setting(r.omega, r.expected, scales.frequency(r.omega), design.amplitude(r.b))
        for r in found
    )


def setup_csv(design: Design, found: Sequence[ModelResponse]) -> str:
    """``setup.csv``."""
    rows = [
        {
            "omega": repr(s.omega),
            "expect": s.expect or "",
            "frequency_hz": repr(s.frequency_hz),
            "amplitude_v_peak": repr(s.amplitude_v_peak),
            "amplitude_vpp": repr(2.0 * s.amplitude_v_peak),
            "offset_v": repr(s.offset_v),
            "load": LOAD,
            "start": START + _coexisting(r),
        }
        for s, r in zip(settings(design, found), found, strict=True)
    ]
    return csv_text(COLUMNS, rows)


def scales_csv(modelfile: ModelFile, design: Design, found: Sequence[ModelResponse]) -> str:
    """``scales.csv``: what a volt and a second on the bench stand for.

    A response that is wanted at a clearance of its own is driven harder or softer instead of
    moving the threshold, so its volts stand for other lengths and have rows of their own.
    """
    scales, b0 = design.errors.scales, design.model.b
    rows = [
        ("model time per circuit second", 1.0 / scales.seconds, "1/s", b0),
        ("circuit seconds per unit of model time", scales.seconds, "s", b0),
    ]
    if modelfile.mechanical is not None:
        slow = modelfile.mechanical.time_scale / scales.seconds
        rows.append(("mechanism seconds per circuit second", slow, "s/s", b0))
    if design.circuit.stops:
        rows.append(("threshold of contact", scales.threshold, "V", b0))
        if abs(scales.offcentre) > 1e-9:
            rows.append(("threshold of contact, lower stop", scales.threshold_lower, "V", b0))
    for b in dict.fromkeys([b0, *(r.b for r in found)]):
        rows += _amplitudes(modelfile, design, b)
    return csv_text(
        ("quantity", "value", "unit", "b"),
        [{"quantity": q, "value": repr(float(v)), "unit": u, "b": repr(b)} for q, v, u, b in rows],
    )


def _amplitudes(
    modelfile: ModelFile, design: Design, b: float
) -> list[tuple[str, float, str, float]]:
    volts = [float(v) for v in design.volts(b)]
    gain = (b / design.model.b) * sum(float(g) for g in design.errors.drive_gain)
    rows = [(f"volts per unit of {s}", v, "V", b) for s, v in zip(STATES, volts, strict=True)]
    mechanical = modelfile.mechanical
    if mechanical is None:
        rows += [
            (f"model units of {s} per volt", 1.0 / v, "1/V", b)
            for s, v in zip(STATES, volts, strict=True)
        ]
        return [*rows, ("model force per generator volt", gain, "1/V", b)]
    length, speed = mechanical.length_scale, mechanical.length_scale / mechanical.time_scale
    for i, (s, v) in enumerate(zip(STATES, volts, strict=True)):
        name = f"metres per volt of {s}" if i % 2 == 0 else f"metres per second per volt of {s}"
        rows.append((name, (speed if i % 2 else length) / v, "m/s/V" if i % 2 else "m/V", b))
    return [*rows, ("newtons per generator volt", gain * mechanical.force_scale, "N/V", b)]


def _coexisting(response: ModelResponse) -> str:
    """What else a start may end on."""
    others = ", ".join(o.response for o in response.others)
    return f"; a start may also end on {others}" if others else ""
