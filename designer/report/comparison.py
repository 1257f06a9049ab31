"""Designs of one model side by side: errors, peaks, offsets, parts, price, and what they show;
as one JSON object by the keys of docs/contract.md.

Each column is a circuit with its generator's settings. Everything is computed from the reduction
of that circuit, with the finite gain and the bias current of its op-amp where it moves, with ideal
op-amps where its coefficients are asked for (docs/definitions.md). What cannot be computed says
why and does not keep the rest from being shown.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from designer.base.errors import Unreachable
from designer.base.plain_json import FORMAT, plain
from designer.board.bom import bill
from designer.board.component import components
from designer.catalog.entries import Kind, OpAmp
from designer.catalog.fields import PRICE_CLASSES
from designer.catalog.parts_catalog import Catalog
from designer.check.synthesis_result import Synthesis
from designer.circuit import paper_values
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.coefficients import CoefficientErrors, coefficient_errors
from designer.circuit.netlist import Capacitor, Circuit, Resistor, Section
from designer.circuit.packing import QUAD
from designer.circuit.paper_values import ComparedCircuit
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, failed
from designer.dynamics.piecewise_linear import Drive
from designer.model.board_table import BoardChoice
from designer.model.circuit_table import CircuitSpec
from designer.model.find_responses import ModelResponse, matches
from designer.model.model import Dimensionless
from designer.synthesis import output_loads as loads
from designer.synthesis.output_loads import Load, Loads

if TYPE_CHECKING:
    from designer.answers.design_answer import (
        ComparedColumn,
        Comparison,
        ComparisonFile,
        PaperNames,
    )
    from designer.answers.shared_rows import ProvenanceRow

OURS = "this design"
_PROBE = 1e-3
"""Offset [V] that the shift is computed with; it is proportional, so the size does not matter."""


_GAIN = 1e9
"""Gain of op-amps that are ideal but for offsets; between two diodes an infinite one has no
answer."""


@dataclass(frozen=True)
class ComparedResponse:
    """One wanted response on one circuit: what it settles on from the model's own orbit."""

    omega: float
    """Dimensionless frequency."""
    expected: str | None
    """The wanted n-p-q; None where any is of interest."""
    orbit: Orbit
    """The orbit that the circuit settles on."""
    is_wanted: bool
    """Whether that is the wanted response (where nothing is wanted, the model's)."""


@dataclass(frozen=True)
class OffsetShare:
    """Shift of v1's operating point against the middle of the clearance, over the threshold."""

    typical: float
    """Root of the sum of squares over all sections, of typical offsets; nan where unknown."""
    maximum: float
    """The same root, of the largest offsets."""
    largest: str
    """Name of the section with the largest part in it."""


@dataclass(frozen=True)
class Bill:
    """What a circuit asks to be bought and soldered."""

    parts: int
    """Pieces to solder."""
    packages: int
    """Packages of op-amps."""
    distinct: int
    """Different values of resistors and capacitors."""
    price: float
    """Upper bound [€], the sum of the upper ends of the price classes of everything that is
    sold."""
    unsold: tuple[str, ...]
    """Names of the parts whose value no catalogue family holds."""


@dataclass(frozen=True)
class DesignColumn:
    """Everything about one design."""

    candidate: ComparedCircuit
    """The circuit with its generator's settings."""
    errors: CoefficientErrors | None
    """Errors of its coefficients; None where one has the wrong sign."""
    reason: str
    """Which coefficient has the wrong sign, or ""."""
    k0: float
    """Stop stiffness ratio as realised by the parts, by Eq. (3); nan where it does not apply."""
    f20: float
    """Share of the force on the second mass as realised by the parts, by Eq. (3); nan where it does
    not apply."""
    b: float
    """Clearance as realised by the parts and the stated amplitude, by Eq. (3); nan where it does
    not apply."""
    frequency_error: float
    """ln(stated/right) of the generator's frequency."""
    offset: OffsetShare | None
    """What the op-amps' offsets do; None where it does not apply."""
    loads: Loads
    """What its outputs have to give."""
    settled: tuple[ComparedResponse, ...]
    """The orbit that the circuit settles on for each wanted response."""
    bill: Bill
    """What has to be bought."""

    @property
    def current(self) -> Load | None:
        """The section that gives the largest current."""
        return max(self.loads.sections, key=lambda load: load.current, default=None)


def compare(
    result: Synthesis, progress: Callable[[str], None] = lambda _: None
) -> tuple[DesignColumn, ...]:
    """The paper's circuits for this model of two masses, as far as they can follow it, and the
    design."""
    model, spec = result.design.model, result.modelfile.circuit
    assert isinstance(model, Dimensionless)
    design = ComparedCircuit(
        OURS,
        f"chosen for the model file: {spec.opamp}, resistors {' and '.join(spec.resistors)}, "
        f"capacitors {' and '.join(spec.capacitors)}",
        result.design.circuit,
        result.design.errors.scales.frequency(1.0),
        result.design.amplitude(),
    )
    out = []
    for candidate in (*paper_values.candidates(model, spec, result.catalog), design):
        progress(candidate.name)
        out.append(column(candidate, model, result.model_responses, spec, result.catalog))
    return tuple(out)


def column(
    candidate: ComparedCircuit,
    model: Dimensionless,
    wanted: Sequence[ModelResponse],
    spec: CircuitSpec,
    catalog: Catalog,
) -> DesignColumn:
    """One design's figures. Coefficients of the wrong sign and responses without an answer are
    part of them.

    Raises
    ------
    FloatingCircuit : the nodal equations of the circuit have no unique answer in some mode.
    """
    circuit = candidate.circuit
    errors, reason = None, ""
    try:
        swing = circuit.saturation, np.ones(len(circuit.states))
        errors = coefficient_errors(circuit, model.second_order(), swing=swing)
    except (ArithmeticError, FloatingCircuit) as error:
        reason = str(error)
    reduction = Reduction(circuit, nominal_board(circuit))
    drives = [_drive(candidate, model, r) for r in wanted]
    settled = tuple(
        _show(reduction, model, errors, r, d) for r, d in zip(wanted, drives, strict=True)
    )
    opamp = catalog.opamp(circuit.opamp)
    return DesignColumn(
        candidate=candidate,
        errors=errors,
        reason=reason,
        k0=_k0(model, errors),
        f20=float("nan")
        if errors is None
        else float(errors.drive_gain[1] / errors.drive_gain.sum()),
        b=_b(candidate, model, errors),
        frequency_error=_frequency_error(candidate, errors),
        offset=offset_share(circuit, opamp),
        loads=loads.over(
            reduction, *loads.runs([r.omega for r in wanted], drives, [s.orbit for s in settled])
        ),
        settled=settled,
        bill=bill_of(circuit, spec, catalog),
    )


def _drive(candidate: ComparedCircuit, model: Dimensionless, response: ModelResponse) -> Drive:
    """The generator for this response; a clearance of its own is set by the amplitude."""
    return Drive(
        2.0 * np.pi * candidate.frequency * response.omega,
        -candidate.amplitude * model.b / response.b,
    )


def _show(
    reduction: Reduction,
    model: Dimensionless,
    errors: CoefficientErrors | None,
    response: ModelResponse,
    drive: Drive,
) -> ComparedResponse:
    """What the circuit shows from the model's orbit; from rest where the circuit has no scale to
    carry the orbit over."""
    start = np.zeros(len(reduction.circuit.states))
    if errors is not None:
        start = response.orbit.start * errors.scales.volts * (model.b / response.b)
    try:
        orbit = settle(Flow(reduction.system(), drive), start)
    except ArithmeticError as error:
        orbit = failed(str(error))
    is_wanted = matches(orbit, response.spec)
    if response.expected is None:
        reference = response.orbit
        is_wanted = (orbit.status, orbit.counts.family) == (
            reference.status,
            reference.counts.family,
        )
    return ComparedResponse(response.omega, response.expected, orbit, is_wanted)


def _k0(model: Dimensionless, errors: CoefficientErrors | None) -> float:
    """K0/(K0 + K1) of the parts: the ratio of two terms of one equation, so free of scales.

    Where the two sides differ, of the side that is further off.
    """
    if errors is None:
        return float("nan")
    spring_error = errors.errors["x1'' x1"]
    off = [e - spring_error for name, e in errors.errors.items() if name.endswith("stop slope")]
    if not off:
        return float("nan")
    mu = model.mu * np.exp(max(off, key=abs))
    return float(mu / (1.0 + mu))


def _b(candidate: ComparedCircuit, model: Dimensionless, errors: CoefficientErrors | None) -> float:
    """B K1/(P1 + P2) of the parts and the amplitude, from the driven mass M1 (M2 if f20 = 1)."""
    if errors is None or not candidate.circuit.stops:
        return float("nan")
    if model.f20 < 1.0:
        force = errors.drive_gain[0] * candidate.amplitude / (1.0 - model.f20)
    else:
        force = errors.drive_gain[1] * candidate.amplitude
    return float(model.b * np.exp(errors.errors["x1'' x1"]) / force)


def _frequency_error(candidate: ComparedCircuit, errors: CoefficientErrors | None) -> float:
    """ln of the stated frequency over that of ω = 2π f √(M1/K1), with M1 and K1 of the parts: free
    of scales too."""
    if errors is None:
        return float("nan")
    own = 0.5 * (errors.errors["x1' x1'"] + errors.errors["x1'' x1"])
    return float(np.log(candidate.frequency / errors.scales.frequency(1.0)) - own)


def offset_share(circuit: Circuit, opamp: OpAmp) -> OffsetShare | None:
    """See ``OffsetShare``; None without a clearance, or where the circuit has no operating point.

    The operating point is the equilibrium of the mode in which every stop is open, without drive,
    all op-amps ideal but for their offsets.
    """
    if not circuit.stops:
        return None
    ideal = replace(nominal_board(circuit, ideal=True), inverse_gain=1.0 / _GAIN)
    try:
        nominal, width = _distances(circuit, ideal)
        shifts = {
            s.name: _shift(_distances(circuit, replace(ideal, offset={s.name: _PROBE}))[0], nominal)
            for s in circuit.sections
        }
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    per_volt = float(np.sqrt(sum(s**2 for s in shifts.values()))) / _PROBE / width
    typical, largest = opamp.offset.typ, opamp.offset.max
    return OffsetShare(
        float("nan") if typical is None else per_volt * abs(typical),
        float("nan") if largest is None else per_volt * abs(largest),
        max(shifts, key=lambda name: abs(shifts[name])),
    )


def _distances(circuit: Circuit, board: Board) -> tuple[dict[int, float], float]:
    """Distance [V] of the operating point to the stop on each side, and the half clearance.

    One-sided: the clearance is the distance itself.
    """
    system = Reduction(circuit, board).system()
    mode = system.mode(system.start)
    point = -np.linalg.solve(mode.A, mode.d)
    out: dict[int, float] = {}
    for guard in mode.guards:
        if guard.clearance != 0:
            continue
        side = system.mode(guard.target).sides[0]
        if side:
            away = -float(guard.C @ point + guard.e)
            out[side] = min(away, out.get(side, np.inf))
    if not out:
        raise ArithmeticError("no stop beside the open mode")
    return out, sum(out.values()) / len(out)


def _shift(moved: dict[int, float], nominal: dict[int, float]) -> float:
    """How far the point went towards the upper stop, against the middle of the clearance."""
    return sum(side * (nominal[side] - moved[side]) for side in nominal) / len(nominal)


def bill_of(circuit: Circuit, spec: CircuitSpec, catalog: Catalog) -> Bill:
    passives: tuple[tuple[Kind, float, Sequence[Resistor | Capacitor]], ...] = (
        ("resistor", spec.resistor_grade, circuit.resistors),
        ("capacitor", spec.capacitor_grade, circuit.capacitors),
    )
    unsold = []
    for kind, grade, parts in passives:
        for part in parts:
            try:
                catalog.part(kind, part.value, grade)
            except Unreachable:
                unsold.append(part.name)
    sold = replace(circuit, parts=tuple(p for p in circuit.parts if p.name not in unsold))
    lines = bill(components(sold, catalog, BoardChoice.of(spec)))
    return Bill(
        parts=sum(not isinstance(p, Section) for p in circuit.parts) + len(circuit.packages),
        packages=len(circuit.packages),
        distinct=sum(len({part.value for part in parts}) for _, _, parts in passives),
        price=float(sum(x.quantity * PRICE_CLASSES[x.price_class - 1] for x in lines)),
        unsold=tuple(unsold),
    )


def comparison_json(columns: Sequence[DesignColumn]) -> Comparison:
    """``columns`` in order, and the sources of the printed values where they are one of them."""
    by_net = {s.output: s.name for s in columns[0].candidate.circuit.sections}
    answer: Comparison = {
        "columns": [{**_column_json(c), **_paper_names(c, by_net)} for c in columns]
    }
    printed = [c for c in columns if c.candidate.name == paper_values.AS_PRINTED]
    if printed:
        names = printed[0].candidate.circuit.values
        answer["printed_in"] = {name: paper_values.SOURCE[name] for name in names}
    whole: Comparison = plain(answer)
    return whole


def file_json(
    answer: Comparison, title: str, provenance: ProvenanceRow, seconds: float
) -> ComparisonFile:
    """What ``compare.json`` holds."""
    return {
        "format": FORMAT,
        "title": title,
        **answer,
        "provenance": provenance,
        "cost": {"seconds": seconds},
    }


def in_answer(file: ComparisonFile) -> Comparison:
    """The key ``comparison`` of what ``synthesise`` prints, from the object of the file."""
    answer: Comparison = {"columns": file["columns"]}
    if "printed_in" in file:
        answer["printed_in"] = file["printed_in"]
    return answer


def _paper_names(column: DesignColumn, by_net: Mapping[str, str]) -> PaperNames:
    """``paper_names``: what the paper calls each section, where its op-amps are no quads.

    by_net : names by the net of the output, of a circuit with the paper's op-amps.
    """
    circuit = column.candidate.circuit
    if circuit.figures is None or circuit.figures.sections == len(QUAD):
        return {}
    names = {s.name: by_net.get(s.output, s.name) for s in circuit.sections}
    return {"paper_names": names} if any(new != old for old, new in names.items()) else {}


def _column_json(column: DesignColumn) -> ComparedColumn:
    candidate, errors, bill = column.candidate, column.errors, column.bill
    circuit, current, offset = candidate.circuit, column.current, column.offset
    return {
        "name": candidate.name,
        "what": candidate.what,
        "opamp": circuit.opamp,
        "supply": circuit.supply,
        "saturation": circuit.saturation,
        "parts": circuit.values,
        "errors": None if errors is None else errors.errors,
        "max_error": None if errors is None else errors.max_error,
        "reason": column.reason,
        "k0": column.k0,
        "f20": column.f20,
        "b": column.b,
        "threshold": None if errors is None else errors.scales.threshold,
        "frequency_hz": candidate.frequency,
        "frequency_error": column.frequency_error,
        "amplitude_v_peak": candidate.amplitude,
        "responses": [
            {
                "omega": s.omega,
                "expected": s.expected,
                "circuit": s.orbit.response,
                "kept": s.is_wanted,
                "reason": s.orbit.reason,
            }
            for s in column.settled
        ],
        "peaks": {
            load.section: {
                "low": load.low,
                "high": load.high,
                "current": load.current,
                "low_in": load.low_in,
                "high_in": load.high_in,
                "current_in": load.current_in,
            }
            for load in column.loads.sections
        },
        "not_run": column.loads.left_out,
        "largest_current": None
        if current is None
        else {
            "ampere": current.current,
            "section": current.section,
            "response": current.current_in,
        },
        "offset": plain(offset),
        "part_count": bill.parts,
        "packages": bill.packages,
        "distinct_values": bill.distinct,
        "unsold": bill.unsold,
        "price_at_most_eur": bill.price if math.isfinite(bill.price) else None,
    }
