"""``designer reproduce circuit``: the paper's Section 5 measured.

Fig. 7 and Fig. 8 with the paper's values as printed, corrected, and with this tool's own; what each
misprint and the op-amps' offsets would have cost; and the claim that the circuit takes a third of
the time. The report is made of pieces of plain data; each is on disk as soon as it is done.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.defaults import check_count, cores
from designer.base.plain_json import plain
from designer.base.progress import Progress
from designer.base.report_pieces import CaseStore
from designer.base.version import __version__
from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.dynamics.flow import Flow
from designer.folders.origin import provenance
from designer.model.find_responses import ModelResponse, find
from designer.paper import circuit_clock, circuit_ngspice, misprints, offsets
from designer.paper.circuit_ngspice import FINE
from designer.paper.circuit_page import circuit_figures, circuit_page
from designer.paper.circuits import (
    CIRCUITS,
    CORRECTED,
    OMEGA,
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
from designer.paper.report_files import README, write_files
from designer.spice.pool import SpicePool, require_ngspice
from designer.verdicts.verdict import rounded

FORMAT = 1
COMMAND = "designer reproduce circuit --out reports/paper-circuit"
DATA = "circuit.json"
PICTURES = ("fig7", "misprints", "offsets", "times")
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


def names(extent: CircuitExtent) -> tuple[str, ...]:
    """The report's files beside its pieces."""
    pictures = (*PICTURES, *(f"fig8-{name}" for name in extent.circuits))
    return (DATA, README, *(f"{name}.png" for name in pictures))


def reproduce(
    out: Path,
    *,
    jobs: int | None = None,
    progress: Progress | None = None,
    resume: bool = False,
    extent: CircuitExtent | None = None,
) -> None:
    """Make the report in the folder ``out``.

    resume : go on with the pieces that are there, if they were made with the same settings.
    extent : the report's by default.

    Raises
    ------
    InputError : results, or files that go by their names, are there already; pieces of other
        settings; a number that cannot be.
    EnvironmentMissing : ngspice is missing; nothing is written then.
    """
    progress = Progress() if progress is None else progress
    jobs = cores() if jobs is None else jobs
    check_count("--jobs", jobs, 1)
    extent = CircuitExtent() if extent is None else extent
    with SpicePool(1) as pool:
        require_ngspice(pool)
    catalog = load_catalog()
    key = json.dumps([FORMAT, __version__, asdict(extent), catalog.hash]).encode("ascii")
    store = CaseStore(out, names(extent), resume=resume, note=progress.note)
    store.expect(hashlib.sha256(key).hexdigest())
    progress.stage("responses of the model")
    modelfile = model_with("saturation")
    wanted = [r for p, r in zip(OMEGA, modelfile.responses, strict=True) if p in extent.p]
    bench = _Bench(catalog, find(modelfile.model, wanted), extent, jobs, progress)
    pieces = {
        name: store.piece(name, partial(_timed, make)) for name, make in bench.pieces().items()
    }
    seconds = {name: piece.pop("seconds") for name, piece in pieces.items()}
    progress.stage("pictures")
    document = {
        "format": FORMAT,
        "command": COMMAND,
        **{name: _without_curves(piece) for name, piece in pieces.items()},
        "provenance": provenance(
            modelfile, catalog.hash, seed=0, settings={"circuit": asdict(extent)}
        ),
        "cost": {"seconds": sum(seconds.values()), "pieces": seconds},
    }
    write_files(out, (DATA, document), circuit_page(pieces, COMMAND), circuit_figures(pieces))


def _timed(make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """A piece in the types of JSON, with its wall time."""
    began = time.perf_counter()
    return {**plain(make()), "seconds": time.perf_counter() - began}


def _without_curves(piece: Mapping[str, Any]) -> dict[str, Any]:
    """Curves stay in the pieces."""
    out = dict(piece)
    if "responses" in out:
        out["responses"] = [
            {k: v for k, v in row.items() if not k.endswith("portrait")} for row in out["responses"]
        ]
    if "dc" in out:
        out["dc"] = {k: v for k, v in out["dc"].items() if not isinstance(v, list)}
    return out


@dataclass(frozen=True)
class _Bench:
    """What every piece needs."""

    catalog: Catalog
    wanted: tuple[ModelResponse, ...]
    extent: CircuitExtent
    jobs: int
    progress: Progress

    def pieces(self) -> dict[str, Callable[[], dict[str, Any]]]:
        """What makes each piece, by name, in order."""
        circuits = self.extent.circuits
        return {
            "model": partial(_model, self),
            **{f"circuit-{name}": partial(_circuit, self, name) for name in circuits},
            "misprints": partial(_misprints, self),
            **{f"offsets-{name}": partial(_offsets, self, name) for name in circuits},
            "clock": partial(_clock, self),
        }


def _model(bench: _Bench) -> dict[str, Any]:
    """The orbits that every circuit is held against."""
    rows = []
    for r in bench.wanted:
        curve = model_flow(r.omega).run(r.orbit.start, r.orbit.n, points=FINE).strobes
        rows.append({"omega": r.omega, "expected": r.expected, "portrait": _portrait(curve)})
    return {"responses": rows}


def _circuit(bench: _Bench, name: str) -> dict[str, Any]:
    """Fig. 7 and Fig. 8 of one circuit."""
    bench.progress.stage(f"{TITLES[name]}: parts, exact circuit")
    one = build(name, bench.catalog)
    assert one.errors is not None
    settled = follow(one, bench.wanted)
    threshold = one.errors.scales.threshold
    bench.progress.stage(f"{TITLES[name]}: ngspice")
    with SpicePool(bench.jobs, timeout=900.0) as pool:
        spice = circuit_ngspice.stage_curve(pool, one.circuit, DC_REACH * threshold, DC_POINTS)
        ngspice = circuit_ngspice.ngspice_responses(pool, one, settled)
    exact = dc_curve(one, spice[:, 0])
    rows = []
    for r, f, h in zip(bench.wanted, settled, ngspice, strict=True):
        rows.append(
            {
                **_settled_row(f),
                "ngspice": h.response,
                "ngspice_passed": h.passed,
                "ngspice_reason": h.reason,
                "ngspice_error": rounded(error_of(r, h.displacement)),
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
            "difference": rounded(float(np.abs(exact - spice[:, 1]).max())),
            **_lines(spice[:, 0], exact, threshold),
        },
        "responses": rows,
    }


def _lines(v1: Array, out: Array, threshold: float) -> dict[str, float]:
    """Slopes inside the clearance and in contact, by straight lines through Fig. 7."""
    inside = np.abs(v1) < 0.9 * threshold
    beyond = v1 > 1.1 * threshold
    return {
        "slope_inside": rounded(float(np.polyfit(v1[inside], out[inside], 1)[0])),
        "slope_contact": rounded(float(np.polyfit(v1[beyond], out[beyond], 1)[0])),
    }


def _misprints(bench: _Bench) -> dict[str, Any]:
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
            row["responses"] = [_settled_row(f) for f in follow(one, bench.wanted)] if m.run else []
        rows.append(row)
        step()
    return {"misprints": rows}


def _offsets(bench: _Bench, name: str) -> dict[str, Any]:
    one = build(name, bench.catalog)
    offset = bench.catalog.opamp(one.circuit.opamp).offset
    out: dict[str, Any] = {"circuit": name, "title": TITLES[name], "sizes": {}}
    for kind, size in (("typical", offset.typ), ("maximum", offset.max)):
        assert size is not None
        bench.progress.stage(f"{TITLES[name]}: {kind} offset of {1e3 * size:g} mV")
        out["sizes"][kind] = offsets.shifts(
            one, bench.wanted, size, jobs=bench.jobs, most=bench.extent.patterns
        )
    return out


def _clock(bench: _Bench) -> dict[str, Any]:
    one = build(CORRECTED, bench.catalog)
    rows = []
    with SpicePool(1, timeout=900.0) as pool:
        for r, f in zip(bench.wanted, follow(one, bench.wanted), strict=True):
            p = next(p for p, omega in OMEGA.items() if omega == r.omega)
            if p not in bench.extent.clocked:
                continue
            step = bench.progress.stage(f"times at ω = {r.omega:g}", bench.extent.rounds)
            methods = circuit_clock.measure(
                pool, one, r, f, rounds_=bench.extent.rounds, progress=step
            )
            rows.append({"omega": r.omega, "p": p, "methods": methods})
    return {"rounds": bench.extent.rounds, "responses": rows}


def _settled_row(f: SettledResponse) -> dict[str, Any]:
    return {
        "omega": f.omega,
        "expected": f.expected,
        "circuit": f.orbit.response,
        "kept": f.kept,
        "error": rounded(f.error),
    }


def _trace(one: Built, settled: SettledResponse) -> Array:
    """(k, 4) the orbit in model units; empty where there is none."""
    orbit = settled.orbit
    if not orbit.n:
        return np.zeros((0, 4))
    flow = Flow(one.reduction().system(), one.excitation(settled.omega).drive)
    run = flow.run(orbit.start, orbit.n, mode=orbit.mode or None, points=FINE)
    return run.strobes / one.volts


def _portrait(trace: Array) -> list[list[float]]:
    """x1 and x1' of a trace, to five digits: what a picture shows."""
    return [_rounded(trace[:, 0]), _rounded(trace[:, 1])] if len(trace) else [[], []]


def _rounded(values: Array) -> list[float]:
    return [float(f"{v:.5g}") for v in values]
