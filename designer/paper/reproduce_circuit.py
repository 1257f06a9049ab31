"""``designer reproduce circuit``: the paper's Section 5 measured.

Fig. 7 and Fig. 8 with the paper's values as printed, corrected, and with this tool's own; what each
misprint and the op-amps' offsets would have cost; and the claim that the circuit takes a third of
the time. The report is made of pieces of plain data; each is on disk as soon as it is done.

All offsets of a board have the same size, the typical or the largest of the data sheet, and only
their signs differ. Each of these boards is asked from the nominal circuit's own orbit, as a board
of a tolerance study is; the other parts are exact.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from designer.base import progress
from designer.base.arrays import Array
from designer.base.defaults import check_count, cores
from designer.base.plain_json import plain
from designer.base.report_pieces import CaseStore
from designer.base.version import __version__
from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.dead_zone_place import OUTPUT
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import GROUND, Circuit, Excitation, Generator, Section
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit
from designer.folders.origin import provenance
from designer.kernels.kernel_boards import POINTS
from designer.model.find_responses import ModelResponse, find
from designer.model.response_table import Response
from designer.paper import circuit_clock, misprints
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
from designer.spice import deck, numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateResult, GateSubject
from designer.spice.pool import SpicePool, require_ngspice
from designer.spice.simulator import SimulationFailed, SpiceJob, Waveforms
from designer.verdicts.verdict import Verdict, judge, rounded
from designer.yields.yield_count import Yield

PATTERNS = 512
"""Sign patterns, at most; twelve sections have 4096."""


def signs(sections: int, most: int = PATTERNS) -> Array:
    """(k, sections) of ±1: every pattern, or ``most`` of them drawn without replacement.

    The first is all plus. A pattern and its negative give mirror images of the same board, but
    for bias currents; both are kept, for they cost little and need no argument.
    """
    total = 2**sections
    numbers = np.arange(total)
    if total > most:
        drawn = np.random.default_rng(0).choice(total - 1, most - 1, replace=False) + 1
        numbers = np.concatenate([[0], np.sort(drawn)])
    bits = (numbers[:, None] >> np.arange(sections)) & 1
    return np.asarray(1.0 - 2.0 * bits)


def shifts(
    one: Built,
    wanted: Sequence[ModelResponse],
    size: float,
    *,
    jobs: int = 1,
    most: int = PATTERNS,
) -> list[dict[str, Any]]:
    """Each response on every board with offsets of ± size [V], a row each.

    there : whether the nominal circuit shows the response; where not, nothing is counted.
    counted, interval : verdicts over the sign patterns, and the yield's 95 % interval. to : what
    the boards that lose it show, and on how many patterns, most frequent first.
    """
    circuit = one.circuit
    patterns = signs(len(circuit.sections), most)
    nominal = Boards.of(circuit, [nominal_board(circuit)])
    many = nominal.take(np.zeros(len(patterns), dtype=np.intp))
    offset = {s.name: size * patterns[:, i] for i, s in enumerate(circuit.sections)}
    ensemble = Ensemble(replace(many, offset=offset), jobs=jobs)
    system = one.reduction().system()
    rows = []
    for r in wanted:
        drive = one.excitation(r.omega).drive
        own = settle(Flow(system, drive), r.orbit.start * one.volts)
        there = judge(own, r.spec, own)[0] is Verdict.OK
        orbits: Sequence[Orbit] = ()
        if there:
            starts = np.tile(own.start, (len(patterns), 1))
            drives = [drive] * len(patterns)
            orbits = ensemble.settle(range(len(patterns)), drives, starts, jobs=jobs)
        row = {"omega": r.omega, "expected": r.expected, "size": size, "there": there}
        rows.append(row | _counts(orbits, r.spec, own))
    return rows


def _counts(orbits: Sequence[Orbit], wanted: Response, own: Orbit) -> dict[str, Any]:
    """What became of the boards. own : the nominal circuit's orbit."""
    verdicts = [judge(orbit, wanted, own)[0] for orbit in orbits]
    tally = Counter(verdicts)
    lost = Counter(
        orbit.response for orbit, v in zip(orbits, verdicts, strict=True) if v is not Verdict.OK
    )
    counted = Yield(
        tally[Verdict.OK], tally[Verdict.LOST], tally[Verdict.GRAZING], tally[Verdict.FAILED]
    )
    return {
        "counted": asdict(counted),
        "to": sorted(lost.items(), key=lambda item: (-item[1], item[0])),
        "interval": counted.interval,
    }


FINE = 8 * POINTS
"""Points of a drive period of a portrait: a contact of p = 8 still is a curve."""
DISPLACEMENT = "v1"
"""Net that the stage is fed from."""


@dataclass(frozen=True)
class NgspiceResponse:
    """One response in ngspice, with the settings that passed the gate."""

    response: str
    """n-p-q or status that ngspice shows."""
    passed: bool
    """Whether settings passed the gate."""
    reason: str
    """Why there is no answer, or ""."""
    steps: int
    """Steps a drive period."""
    trace: Array
    """(n · FINE + 1, 4) states in model units from a strobe on; empty where there is none."""

    @property
    def displacement(self) -> Array:
        """(n · POINTS,) of the first mass."""
        return self.trace[: -1 : FINE // POINTS, 0] if len(self.trace) else np.zeros(0)


def stage_curve(pool: SpicePool, circuit: Circuit, reach: float, points: int) -> Array:
    """(k, 2) v1 and the nonlinear stage's output [V], by ``.dc`` over ± reach.

    The stage is cut out of the circuit and fed by a source; op-amps of the fidelity ``ideal``.

    Raises
    ------
    SimulationFailed : ngspice gives no such curve.
    """
    step = 2.0 * reach / points
    board = nominal_board(circuit)
    stage = replace(
        circuit,
        parts=tuple(p for p in circuit.parts if p.name in _stage(circuit)),
        generator=Generator("VM1", DISPLACEMENT),
        states=(),
        state_nets=(),
    )
    settings = SolverSettings("trap", 1.0, reltol=1e-6, abstol=1e-14, vntol=1e-9)
    text = deck.write(
        stage, board, Excitation(1.0, 1.0), settings, title="nonlinear stage", stop_time=1.0
    )
    lines = []
    for line in text.splitlines():
        word = line.split(maxsplit=1)[0]
        if word == "VM1":
            line = f"VM1 {DISPLACEMENT} 0 DC 0"
        elif word == ".tran":
            line = f".dc VM1 {-reach!r} {reach + 0.5 * step!r} {step!r}"
        lines.append(line)
    job = SpiceJob("\n".join(lines) + "\n", (OUTPUT,), reach - 0.01 * step, _whole, "dc")
    for _, answer in pool.map([job]):
        if isinstance(answer, SimulationFailed):
            raise answer
        return np.column_stack([answer.axis, answer.signals[OUTPUT].real])
    raise SimulationFailed("ngspice gave no answer")


def ngspice_responses(
    pool: SpicePool, one: Built, settled: Sequence[SettledResponse]
) -> tuple[NgspiceResponse, ...]:
    """Every response that the exact circuit shows periodically, behind the numerics gate."""
    reduction = one.reduction()
    subjects = [
        GateSubject(reduction, one.excitation(f.omega), f.orbit) for f in settled if f.orbit.n
    ]
    results = iter(numerics_gate.check(pool, subjects))
    return tuple(
        _response(next(results), one, f)
        if f.orbit.n
        else NgspiceResponse("", False, "", 0, np.zeros((0, 4)))
        for f in settled
    )


def _response(result: GateResult, one: Built, settled: SettledResponse) -> NgspiceResponse:
    steps = result.tried[-1]
    if isinstance(result.read, SimulationFailed):
        return NgspiceResponse("failed", False, result.read.reason, steps, np.zeros((0, 4)))
    orbit = result.read.orbit
    trace = np.zeros((0, 4))
    if orbit.n and result.read.trace is not None:
        time, states = result.read.trace
        grid = np.linspace(0.0, time[-1], orbit.n * FINE + 1)
        trace = np.stack([np.interp(grid, time, column) for column in states.T], axis=1) / one.volts
    reason = "" if result.passed else "the numerics gate did not pass"
    return NgspiceResponse(orbit.response, result.passed, reason, steps, trace)


def _stage(circuit: Circuit) -> set[str]:
    """Names of the parts that make the stage's output of v1: what is more going back from the
    output, but for integrators and what feeds them. A section is more at its output alone."""
    summing = {c.minus for c in circuit.capacitors}
    ends = {GROUND, DISPLACEMENT} | {rail.net for rail in circuit.rails}
    left = [p for p in circuit.parts if not summing & set(p.nets)]
    nets, names = {OUTPUT}, set[str]()
    while True:
        more = [
            p
            for p in left
            if p.name not in names and nets & {*([p.output] if isinstance(p, Section) else p.nets)}
        ]
        if not more:
            return names
        names |= {p.name for p in more}
        nets |= {net for p in more for net in p.nets} - ends


def _whole(sweep: Waveforms) -> Waveforms:
    return sweep


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
    patterns: int = PATTERNS
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
    bench = _Bench(catalog, find(modelfile.model, wanted), extent, jobs)
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
    progress.stage(f"{TITLES[name]}: parts, exact circuit")
    one = build(name, bench.catalog)
    assert one.errors is not None
    settled = follow(one, bench.wanted)
    threshold = one.errors.scales.threshold
    progress.stage(f"{TITLES[name]}: ngspice")
    with SpicePool(bench.jobs, timeout=900.0) as pool:
        spice = stage_curve(pool, one.circuit, DC_REACH * threshold, DC_POINTS)
        ngspice = ngspice_responses(pool, one, settled)
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
    step = progress.stage("misprints", len(all_of_them))
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
        progress.stage(f"{TITLES[name]}: {kind} offset of {1e3 * size:g} mV")
        out["sizes"][kind] = shifts(
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
            step = progress.stage(f"times at ω = {r.omega:g}", bench.extent.rounds)
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
