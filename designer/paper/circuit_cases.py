"""The pieces of the report on the paper's circuit, each as plain data: what is computed once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.plain_json import plain
from designer.base.progress import Progress
from designer.catalog.catalog import Catalog
from designer.dynamics.flow import Flow
from designer.model.find_responses import ModelResponse, find
from designer.paper import circuit_clock, circuit_ngspice, misprints, offsets
from designer.paper.circuit_ngspice import FINE
from designer.paper.circuits import (
    CIRCUITS,
    CORRECTED,
    TITLES,
    Built,
    SettledResponse,
    build,
    dc_curve,
    error_of,
    follow,
    model_flow,
    model_with,
)
from designer.paper.tolerance_cases import OMEGA
from designer.spice.pool import SpicePool
from designer.yields.verdict import kept

DC_POINTS = 200
DC_REACH = 2.0
"""Of the threshold: how far Fig. 7 goes to each side."""


@dataclass(frozen=True)
class CircuitExtent:
    """How much is done; the defaults are the report's."""

    p: tuple[int, ...] = tuple(OMEGA)
    """p of the responses that are compared."""
    circuits: tuple[str, ...] = CIRCUITS
    """Names of those of ``CIRCUITS`` that are compared."""
    patterns: int = offsets.PATTERNS
    """Patterns of the offsets' signs."""
    clocked: tuple[int, ...] = (1, 3, 8)
    """p of the responses on which methods are timed."""
    rounds: int = circuit_clock.ROUNDS
    """How often each method is timed."""


@dataclass(frozen=True)
class PaperBench:
    """What every piece needs."""

    catalog: Catalog
    """The catalogue."""
    found: tuple[ModelResponse, ...]
    """The paper's responses, and what the model shows."""
    extent: CircuitExtent
    """How much of the report is done."""
    jobs: int
    """Number of threads and workers."""
    progress: Progress
    """Told how far the work is."""

    @classmethod
    def of(
        cls, catalog: Catalog, extent: CircuitExtent, jobs: int, progress: Progress
    ) -> PaperBench:
        made = model_with("saturation")
        wanted = [r for p, r in zip(OMEGA, made.responses, strict=True) if p in extent.p]
        return cls(catalog, find(made.model, wanted), extent, jobs, progress)


def pieces(bench: PaperBench) -> Iterator[tuple[str, Callable[[], dict[str, Any]]]]:
    """Name and maker of each piece, in the order in which they are made."""
    yield "model", lambda: _model(bench)
    for name in bench.extent.circuits:
        yield f"circuit-{name}", lambda name=name: _circuit(bench, name)  # type: ignore[misc]
    yield "misprints", lambda: _misprints(bench)
    for name in bench.extent.circuits:
        yield f"offsets-{name}", lambda name=name: _offsets(bench, name)  # type: ignore[misc]
    yield "clock", lambda: _clock(bench)


def _model(bench: PaperBench) -> dict[str, Any]:
    """The orbits that every circuit is held against."""
    rows = []
    for r in bench.found:
        curve = model_flow(r.omega).run(r.orbit.start, r.orbit.n, points=FINE).strobes
        rows.append({"omega": r.omega, "expected": r.expected, "portrait": _portrait(curve)})
    return {"responses": rows}


def _circuit(bench: PaperBench, name: str) -> dict[str, Any]:
    """Fig. 7 and Fig. 8 of one circuit."""
    bench.progress.stage(f"{TITLES[name]}: parts, exact circuit")
    one = build(name, bench.catalog)
    assert one.errors is not None
    followed = follow(one, bench.found)
    threshold = one.errors.scales.threshold
    bench.progress.stage(f"{TITLES[name]}: ngspice")
    with SpicePool(bench.jobs, timeout=900.0) as pool:
        spice = circuit_ngspice.stage_curve(pool, one.circuit, DC_REACH * threshold, DC_POINTS)
        heard = circuit_ngspice.listen(pool, one, followed)
    exact = dc_curve(one, spice[:, 0])
    rows = []
    for r, f, h in zip(bench.found, followed, heard, strict=True):
        rows.append(
            {
                **_said(f),
                "ngspice": h.response,
                "ngspice_passed": h.passed,
                "ngspice_reason": h.reason,
                "ngspice_error": kept(error_of(r, h.displacement)),
                "steps_a_period": h.steps,
                "portrait": _portrait(_trace(one, f)),
                "ngspice_portrait": _portrait(h.trace),
            }
        )
    return {
        "circuit": name,
        "title": TITLES[name],
        "parts": one.circuit.values,
        "errors": one.errors.errors,
        "max_error": one.errors.max_error,
        "threshold": threshold,
        "frequency_hz": one.candidate.frequency,
        "amplitude_v_peak": one.candidate.amplitude,
        "dc": {
            "v1": _rounded(spice[:, 0]),
            "exact": _rounded(exact),
            "ngspice": _rounded(spice[:, 1]),
            "difference": kept(float(np.abs(exact - spice[:, 1]).max())),
            **_lines(spice[:, 0], exact, threshold),
        },
        "responses": rows,
    }


def _lines(v1: Array, out: Array, threshold: float) -> dict[str, float]:
    """Slopes inside the clearance and in contact, by straight lines through Fig. 7."""
    inside = np.abs(v1) < 0.9 * threshold
    beyond = v1 > 1.1 * threshold
    return {
        "slope_inside": kept(float(np.polyfit(v1[inside], out[inside], 1)[0])),
        "slope_contact": kept(float(np.polyfit(v1[beyond], out[beyond], 1)[0])),
    }


def _misprints(bench: PaperBench) -> dict[str, Any]:
    all_of_them = misprints.MISPRINTS
    step = bench.progress.stage("misprints", len(all_of_them))
    rows = []
    for m in all_of_them:
        row: dict[str, Any] = {
            "where": m.where,
            "printed": m.printed,
            "right": m.right,
            "note": m.note,
            "reaches": m.build is not None,
        }
        if m.build is not None:
            one = misprints.apply(m, bench.catalog)
            row["max_error"] = None if one.errors is None else one.errors.max_error
            row["worst"] = one.reason
            if one.errors is not None:
                errors = one.errors.errors
                row["worst"] = max(errors, key=lambda name: abs(errors[name]))
            row["responses"] = [_said(f) for f in follow(one, bench.found)] if m.run else []
        rows.append(row)
        step()
    return {"misprints": rows}


def _offsets(bench: PaperBench, name: str) -> dict[str, Any]:
    one = build(name, bench.catalog)
    offset = bench.catalog.opamp(one.circuit.opamp).offset
    out: dict[str, Any] = {"circuit": name, "title": TITLES[name], "sizes": {}}
    for kind, size in (("typical", offset.typ), ("maximum", offset.max)):
        assert size is not None
        bench.progress.stage(f"{TITLES[name]}: {kind} offset of {1e3 * size:g} mV")
        rows = offsets.shifts(one, bench.found, size, jobs=bench.jobs, most=bench.extent.patterns)
        out["sizes"][kind] = [{**asdict(r), "interval": r.counted.interval} for r in rows]
    return out


def _clock(bench: PaperBench) -> dict[str, Any]:
    one = build(CORRECTED, bench.catalog)
    rows = []
    with SpicePool(1, timeout=900.0) as pool:
        for r, f in zip(bench.found, follow(one, bench.found), strict=True):
            p = next(p for p, omega in OMEGA.items() if omega == r.omega)
            if p not in bench.extent.clocked:
                continue
            step = bench.progress.stage(f"times at ω = {r.omega:g}", bench.extent.rounds)
            methods = circuit_clock.measure(
                pool, one, r, f, rounds_=bench.extent.rounds, progress=step
            )
            rows.append({"omega": r.omega, "p": p, "methods": [asdict(m) for m in methods]})
    return {"rounds": bench.extent.rounds, "responses": rows}


def _said(f: SettledResponse) -> dict[str, Any]:
    return {
        "omega": f.omega,
        "expected": f.expected,
        "circuit": f.orbit.response,
        "kept": f.kept,
        "error": kept(f.error),
    }


def _trace(one: Built, followed: SettledResponse) -> Array:
    """(k, 4) the orbit in model units; empty where there is none."""
    orbit = followed.orbit
    if not orbit.n:
        return np.zeros((0, 4))
    flow = Flow(one.reduction().system(), one.excitation(followed.omega).drive)
    run = flow.run(orbit.start, orbit.n, mode=orbit.mode or None, points=FINE)
    return run.strobes / one.volts


def _portrait(trace: Array) -> list[list[float]]:
    """x1 and x1' of a trace, to five digits: what a picture shows."""
    return [_rounded(trace[:, 0]), _rounded(trace[:, 1])] if len(trace) else [[], []]


def _rounded(values: Array) -> list[float]:
    return [float(f"{v:.5g}") for v in values]


def as_data(made: dict[str, Any]) -> dict[str, Any]:
    """In the types of JSON, so that what is read again equals what was made."""
    return dict(plain(made))
