"""Simulating responses on one engine: model, exact circuit or ngspice, in dimensionless terms.

Nothing here writes a file or prints.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from textwrap import shorten
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from designer.base import progress
from designer.base.arrays import Array
from designer.base.defaults import DRAWN_STARTS, SEED, Fidelity, cores
from designer.base.errors import InputError
from designer.base.frames import table_html
from designer.check import coexistence, trust
from designer.check.absolute_motion import absolute_extremes
from designer.check.checked_design import CheckedResponse, as_named_in_ngspice, spice_trace
from designer.check.coexistence import Coexistence
from designer.check.curved_laws import LawMisfit, law_misfits
from designer.check.stick_phases import Sticking, stick_phases
from designer.check.trust import Trust
from designer.circuit import nominal
from designer.circuit.nominal import Trace, UnitFlow, board_flow, record_of, traces_of
from designer.dynamics import attractors, step_budget
from designer.dynamics.attractors import settle, starts as sobol_starts
from designer.dynamics.coexisting_attractors import coexisting, outlived
from designer.dynamics.counts import MAX_PERIOD
from designer.dynamics.flow import MAX_EVENTS, Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import ANSWERS, SYMMETRY_TOLERANCE, Orbit, OrbitStatus
from designer.dynamics.step_budget import Budget
from designer.model.driven import model_flow
from designer.model.find_responses import (
    STARTS,
    ModelResponse,
    find,
    matches,
    scale_of,
)
from designer.model.mechanics import MechanicalModel, check_omega, state_names
from designer.model.model_file import ModelFile, errors_in, need_responses
from designer.model.relative_motion import (
    RelativeMotion,
    companion_motions,
    ground_of,
    relative_motions,
)
from designer.model.response_table import Response
from designer.spice import numerics_gate, read_orbit, twin_runs
from designer.spice.pool import SpicePool, require_ngspice

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import ArrayLike

    from designer.check.synthesis_result import Synthesis

Engine = Literal["model", "circuit", "ngspice"]
NEAR_TWIN = 0.02
"""How far the twin of a circuit's orbit may be from the mirror image, over the peak."""


@dataclass(frozen=True)
class Simulated:
    """A response on one engine, in model units whatever the engine."""

    omega: float
    """Dimensionless frequency."""
    expected: str | None
    """The wanted n-p-q; None where any is of interest."""
    found: bool
    """Whether the wanted response was found."""
    orbit: Orbit
    """The orbit in model units."""
    others: tuple[Orbit, ...]
    """Further attractors that were met, in model units."""
    seconds: float
    """Wall time [s]."""
    twins: tuple[Orbit | None, ...] = ()
    """Mirror twin of the orbit and of each of ``others``; None where an orbit is its own twin, or
    there is no mirror, or the engine was not asked (ngspice)."""
    b: float = float("nan")
    """The clearance."""
    motions: tuple[RelativeMotion, ...] = ()
    """What moves in each clearance."""
    companions: tuple[RelativeMotion, ...] = ()
    """Where the base moves, the other displacement of each mass with a clearance to ground: the
    absolute one, or the one from the base."""
    base: float = 0.0
    """Amplitude of the base's displacement; 0 where it rests."""
    masses: tuple[str, ...] = ()
    """Names of the masses; () where they have none."""
    clearances: tuple[str, ...] = ()
    """Names of the clearances."""
    absolute: tuple[Array, ...] = ()
    """Of the orbit and of each of ``others``, (states, 2): least and greatest absolute displacement
    of each mass in the place of its state, refined; (0, 2) where it is not known."""
    from_base: tuple[Array, ...] = ()
    """Likewise from a base that moves; () where the states themselves are counted from it."""
    misfits: tuple[tuple[LawMisfit, ...], ...] = ()
    """Of the orbit and of each of ``others``, the curved laws whose force is off there; of ngspice
    where the exact circuit's orbit draws them, from which it began."""
    sticking: tuple[tuple[Sticking, ...] | None, ...] = ()
    """Of the orbit and of each of ``others``, what each friction does there, None where that is not
    known; () in ngspice."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Settings of the engine for this response."""
    traces: tuple[Trace, ...] = ()
    """Where asked, the orbit and its twin over their periods, each from its start."""
    record: Trace | None = None
    """Where traces are asked, the orbit over many periods if it has none; not of ngspice."""
    trust: Trust = field(default_factory=Trust)
    """What is known of the orbit's error."""
    flow: UnitFlow | None = field(default=None, repr=False)
    """What the orbits are motions of; None in ngspice."""
    coexistence: Coexistence | None = None
    """What share of the starts in a box goes to the orbit, to each of ``others`` and to none; its
    orbits are in the flow's own units. None where none was drawn, as in ngspice."""

    @property
    def twin(self) -> Orbit | None:
        """The mirror twin of the orbit, if it has one."""
        return self.twins[0] if self.twins else None

    def motion(self, times: ArrayLike | None = None, *, orbit: Orbit | None = None) -> pd.DataFrame:
        """The states x1, x1', x2, … at any times, in model units; where the base moves, "y" is its
        displacement, and the states are counted from it unless its stops stay.

        times : (k,) from 0, where the drive's phase is 0; without it the period, or
        ``SHOWN_PERIODS`` drive periods of a motion that has none, at ``TRACE_POINTS`` a drive
        period. Exact at ``KNOTS`` times a drive period, between these by a spline. orbit : ``twin``
        or one of ``others`` in place of the response's own.

        Raises
        ------
        InputError : of ngspice, an orbit that was not found, or times that are none.
        """
        import pandas as pd

        shown = self.orbit if orbit is None else orbit
        own = any(shown is each for each in (self.orbit, *self.twins, *self.others))
        if self.flow is None or not own or not len(shown.start):
            found = "one of ngspice" if self.flow is None else getattr(shown, "response", shown)
            expected = "a motion of this response that the exact flow has found"
            raise InputError(None, "orbit", found, expected)
        if times is None:
            laps = nominal.shown_periods(shown)
            phases = np.arange(laps * nominal.TRACE_POINTS + 1) / nominal.TRACE_POINTS
            times = phases * (2.0 * math.pi / self.omega)
        try:
            at = np.asarray(times, dtype=float)
        except (TypeError, ValueError):
            at = np.full(1, np.nan)
        if at.ndim != 1 or not len(at) or not (at >= 0.0).all() or not np.isfinite(at).all():
            raise InputError(None, "times", shorten(repr(times), 80), "a list of numbers >= 0")
        states = self.flow.states_at(shown, at)
        motion = pd.DataFrame(states, columns=state_names(states.shape[1] // 2))
        motion.insert(0, "time", at)
        return motion.assign(y=self.flow.ground_at(at, self.omega)) if self.flow.ground else motion

    def rows(self) -> list[dict[str, Any]]:
        """A row for each orbit, which ``orbit`` says: "wanted" or "reached", "twin", "other"."""
        first = "reached" if self.expected is None else "wanted"
        every = (self.orbit, *self.others)
        spans = self.absolute or tuple(orbit.extremes for orbit in every)
        orbits = [(first, self.orbit, spans[0])]
        if self.twin is not None:
            # The base moves alike in either half period, so that what is absolute is mirrored too.
            mirrored = -spans[0][:, ::-1] if self.base else self.twin.extremes
            orbits.append(("twin", self.twin, mirrored))
        others = zip(self.others, spans[1:], strict=True)
        orbits += [("other", orbit, span) for orbit, span in others]
        head = {"omega": self.omega, "expected": self.expected, "found": self.found}
        return [{**head, "orbit": kind, **_figures(orbit, span)} for kind, orbit, span in orbits]

    def _repr_html_(self) -> str:
        return table_html(f"ω = {self.omega:g}", self.rows())


def simulate(
    modelfile: ModelFile,
    omegas: Sequence[float] = (),
    *,
    engine: Engine = "model",
    synthesis: Synthesis | None = None,
    jobs: int | None = None,
    traces: bool = False,
    fidelity: Fidelity = "ideal",
    starts: int = DRAWN_STARTS,
    seed: int = SEED,
    start: Array | None = None,
    choose: Callable[[ModelFile], Synthesis] | None = None,
) -> tuple[Simulated, ...]:
    """The responses of a model file, or at ``omegas`` what is reached from rest or ``start``.

    engine : "model" (exact flow), "circuit" (exact flow of the reduced circuit) or "ngspice".
    synthesis : of this model file; where the engine needs one and None is given it is made by
    ``choose``, or as ``check.synthesis_result`` makes it. traces : keep the orbits and their mirror
    twins as traces too. fidelity : the op-amps' model in ngspice. starts, seed : of the initial
    states that are drawn to see which attractors coexist (``check.coexistence``), 0 for none;
    ngspice has none. start : (states,) in model units, where the drive's phase is 0.

    Raises
    ------
    InputError : a fidelity for another engine, a frequency outside ``SLOWEST`` to ``FASTEST``, a
        number of starts that cannot be, or nothing to simulate.
    """
    coexistence.check(starts)
    sampling = (starts, seed)
    if fidelity != "ideal" and engine != "ngspice":
        raise InputError(
            None, "--rung", fidelity, "ideal, or --engine ngspice: other engines have none"
        )
    for omega in omegas:
        check_omega("--omega", omega, modelfile.model)
    if not omegas and not modelfile.responses:
        need_responses(modelfile, ', or --omega, or --frequency "10 Hz" of a file in SI')
    specs = [Response(float(w)) for w in omegas] or list(modelfile.responses)
    file = str(modelfile.source) if modelfile.source else None
    for number, spec in enumerate(specs, start=1):
        if spec.omega is not None:
            check_omega(f"response[{number}].omega", spec.omega, modelfile.model, file)
    if engine != "ngspice":
        one = partial(_on_model, modelfile, start, traces, sampling)
        if engine == "circuit":
            synthesis = synthesis or _design(modelfile, choose)
            one = partial(_on_circuit, synthesis, _Scan(bool(omegas), start), traces, sampling)
        engine_name = "model" if engine == "model" else "exact circuit"
        step = progress.stage(f"responses of the {engine_name}", len(specs))
        return tuple(_timed(step, one, spec) for spec in specs)
    with SpicePool(cores() if jobs is None else jobs) as pool:
        require_ngspice(pool)
        synthesis = synthesis or _design(modelfile, choose)
        scan = _Scan(bool(omegas), start)
        return _in_ngspice(synthesis, specs, scan, pool, traces, fidelity)


def _design(modelfile: ModelFile, choose: Callable[[ModelFile], Synthesis] | None) -> Synthesis:
    if choose is None:
        from designer.check import synthesis_result

        choose = synthesis_result.synthesise
    return choose(modelfile)


def engine_settings(engine: Engine, fidelity: Fidelity = "ideal") -> dict[str, Any]:
    """What ``simulate`` states of an engine: tolerances, bounds and limits (docs/engine.md)."""
    settings: dict[str, Any] = {
        "flow": "exact, by modes",
        "strobe_tolerance": attractors.STROBE_TOLERANCE,
        "undecided_below": attractors.ENGINE_ERROR,
        "symmetry_tolerance": SYMMETRY_TOLERANCE,
        "largest_period": MAX_PERIOD,
        "settling_periods": list(np.cumsum(attractors.STAGES)),
        "starts": STARTS,
        "most_events_a_period": MAX_EVENTS,
    }
    if engine == "ngspice":
        settings["strobe_tolerance"] = read_orbit.STROBE_TOLERANCE
        settings["undecided_below"] = read_orbit.ENGINE_ERROR
        settings |= {"gate_bound": numerics_gate.BOUND, "rung": fidelity}
    return settings


# ---------------------------------------------------------------------------------------------


def _figures(orbit: Orbit, extremes: Array) -> dict[str, Any]:
    """What a table says of an orbit; NaN where it has no extremes.

    extremes : (states, 2) or (0, 2) of absolute displacements.
    """
    masses = max(len(orbit.start) // 2, 1)
    ends = extremes[0::2] if len(extremes) else np.full((masses, 2), np.nan)
    return {
        "response": orbit.response,
        "status": str(orbit.status),
        "symmetric": orbit.symmetric,
        **{f"x{i}_max": float(high) for i, (_, high) in enumerate(ends, 1)},
        **{f"x{i}_min": float(low) for i, (low, _) in enumerate(ends, 1)},
        "largest_multiplier": orbit.radius,
        "lyapunov": orbit.lyapunov,
        "lyapunov_error": orbit.lyapunov_error,
        "penetration": orbit.penetration,
        "miss": orbit.miss,
    }


def _timed(
    step: Callable[[], None], one: Callable[[Response], Simulated], spec: Response
) -> Simulated:
    began = time.perf_counter()
    result = one(spec)
    step()
    return replace(result, seconds=time.perf_counter() - began)


@dataclass(frozen=True)
class _Scan:
    """Whether a board is looked at from many starts, and the first of them."""

    many: bool
    first: Array | None


def _on_model(
    modelfile: ModelFile,
    start: Array | None,
    traces: bool,
    sampling: tuple[int, int],
    spec: Response,
) -> Simulated:
    with errors_in(modelfile):
        (r,) = find(modelfile.model, [spec], start)
    model = modelfile.model.at(r.b)
    flow = model_flow(model, r.omega)
    measured = [_measured(flow, o) for o in (r.orbit, *_attractors(r.others))]
    orbits = _apart(flow, measured)
    box, first = scale_of(model, r.omega), _attractors(orbits)
    result, met = _drawn(flow, box, *sampling, first, measured)
    orbits += met
    twins = [None if flow.system.mirror is None else _twin(flow, o) for o in orbits]
    units = np.ones(flow.system.size)
    return Simulated(
        r.omega,
        r.expected,
        r.found and matches(orbits[0], r.spec),
        orbits[0],
        tuple(orbits[1:]),
        0.0,
        tuple(twins),
        r.b,
        settings=_exact_settings(flow, orbits[0], 1.0),
        traces=traces_of(flow, (orbits[0], twins[0]), units, 1.0) if traces else (),
        record=record_of(flow, orbits[0], units, 1.0) if traces else None,
        trust=trust.of_orbit(flow, orbits[0]),
        coexistence=result,
        **_displacements(model, r.omega, flow, orbits, units),
        misfits=tuple(law_misfits(model, flow, o, units) for o in orbits),
        sticking=tuple(stick_phases(model, flow, o, units, 1.0) for o in orbits),
        flow=UnitFlow(
            partial(model_flow, model, r.omega),
            units,
            1.0,
            model.second_order().ground_shape(r.omega),
        ),
        **_of_system(model, r.omega),
    )


def _drawn(
    flow: Flow,
    box: Array,
    starts: int,
    seed: int,
    known: Sequence[Orbit],
    seen: Sequence[Orbit],
    unit: Array | None = None,
    *,
    even: bool = True,
) -> tuple[Coexistence | None, list[Orbit]]:
    """Where drawn starts end, None of none, and the attractors that are not among the known; as of
    ``coexistence.of_flow``. seen : where each start led that was run before."""
    if not starts:
        return None, []
    lives = [n for o in seen for n in o.transients]
    result = coexistence.of_flow(flow, box, starts, seed, known, unit, even=even, lives=lives)
    return result, [_measured(flow, b.orbit) for b in result.basins[len(known) :]]


def _apart(flow: Flow, orbits: Sequence[Orbit]) -> list[Orbit]:
    """The first, and of the others the answers that are no orbit before them: a motion whose chaos
    was a transient has become another one."""
    apart = [orbits[0]]
    for orbit in _attractors(orbits[1:]):
        if not any(attractors.same(flow, orbit, known) for known in apart):
            apart.append(orbit)
    return apart


def _attractors(orbits: Sequence[Orbit]) -> list[Orbit]:
    """The attractors that are an answer."""
    return [o for o in orbits if o.status in ANSWERS]


def _displacements(
    model: MechanicalModel, omega: float, flow: Flow, orbits: Sequence[Orbit], volts: Array
) -> dict[str, Any]:
    """``Simulated.absolute`` and ``Simulated.from_base`` of orbits of a flow. volts (states,) : its
    units of a state in one of the model's."""
    system, ground = model.second_order(), ground_of(model, omega) * volts[:, None]

    def moved(ground: Array) -> tuple[Array, ...]:
        spans = (absolute_extremes(flow, orbit, ground) for orbit in orbits)
        return tuple(span / volts[:, None] if len(span) else span for span in spans)

    if not (system.absolute and system.driven_by_ground):
        return {"absolute": moved(ground)}
    return {"absolute": moved(0.0 * ground), "from_base": moved(-ground)}


def _of_system(model: MechanicalModel, omega: float) -> dict[str, Any]:
    """What ``Simulated`` says of the model itself."""
    system = model.second_order()
    return {
        "motions": relative_motions(system),
        "companions": companion_motions(system),
        "base": system.ground(omega),
        "masses": system.names,
        "clearances": tuple(stop.name for stop in system.clearances),
    }


def _twin(flow: Flow, orbit: Orbit) -> Orbit | None:
    """The mirror twin of an orbit that is not its own.

    Bias currents leave a circuit without an exact mirror; its twin is then the stable orbit next to
    the mirror image, if there is one with the counts the other way round.
    """
    if orbit.symmetric is not False:
        return None
    if flow.system.mirror is not None:
        return attractors.twin(flow, orbit)
    image = -flow.run(orbit.start, orbit.n, mode=orbit.mode or None, points=2).strobes[1]
    solution = attractors.shoot(flow, image, orbit.n)
    if solution is None:
        return None
    near = attractors.describe(flow, solution[0], orbit.n, solution[1])
    if not (near.counts == orbit.counts.mirrored and near.symmetric is False and near.radius < 1.0):
        return None
    return near if coexistence.alike(orbit, near, NEAR_TWIN, mirrored=True) else None


def _exact_settings(flow: Flow, orbit: Orbit, unit: float) -> dict[str, Any]:
    """kernel : which one carries the strobes. undecided_below : contacts shallower and misses
    nearer than this, in units of x1, count as grazing."""
    moving = flow.system.moving
    peak = float(np.abs(orbit.extremes[moving]).max()) if len(orbit.extremes) else float("nan")
    return {"kernel": flow.kernel, "undecided_below": attractors.ENGINE_ERROR * peak / unit}


def _circuit_orbits(
    synthesis: Synthesis, spec: Response, scan: _Scan
) -> tuple[ModelResponse, Flow, list[Orbit]]:
    """The wanted orbit first, in volts and seconds; or what is reached from the first of many."""
    with errors_in(synthesis.modelfile):
        same = [r for r in synthesis.model_responses if r.spec is spec]
        (r,) = same or find(synthesis.modelfile.model, [spec])
    flow = board_flow(synthesis.design, r)
    volts = synthesis.design.volts(r.b)
    if scan.many:
        model = synthesis.modelfile.model.at(r.b)
        states = sobol_starts(scale_of(model, r.omega), STARTS, first=scan.first)
        return r, flow, coexisting(flow, states * volts)
    found = [o for o in (r.orbit, *r.others) if len(o.start)]
    settled = [
        replace(settle(flow, o.start * volts, watch=0), transients=o.transients) for o in found
    ] or [settle(flow, np.zeros(flow.system.size), watch=0)]
    return r, flow, outlived(flow, settled, known=[n for o in settled for n in o.transients])


def _on_circuit(
    synthesis: Synthesis, scan: _Scan, traces: bool, sampling: tuple[int, int], spec: Response
) -> Simulated:
    design = synthesis.design
    r, flow, orbits = _circuit_orbits(synthesis, spec, scan)
    volts, seconds = design.volts(r.b), design.errors.scales.seconds
    measured = [_measured(flow, o) for o in orbits]
    scaled = [design.in_model_units(o, volts) for o in measured]
    rows = [i for i in _distinct(scaled) if i == 0 or scaled[i].status in ANSWERS]
    first = _attractors([measured[i] for i in rows])
    model = synthesis.modelfile.model.at(r.b)
    box = scale_of(model, r.omega)
    even = model.second_order().even
    result, more = _drawn(flow, box, *sampling, first, measured, volts, even=even)
    rows += range(len(measured), len(measured) + len(more))
    measured += more
    scaled += [design.in_model_units(o, volts) for o in more]
    twins = {i: _twin(flow, measured[i]) for i in rows}
    return Simulated(
        r.omega,
        r.expected,
        matches(scaled[0], r.spec),
        scaled[0],
        tuple(scaled[i] for i in rows[1:]),
        0.0,
        tuple(None if t is None else design.in_model_units(t, volts) for t in twins.values()),
        r.b,
        settings=_exact_settings(flow, measured[0], float(volts[design.moving])),
        traces=traces_of(flow, (measured[0], twins[0]), volts, seconds) if traces else (),
        record=record_of(flow, measured[0], volts, seconds) if traces else None,
        trust=trust.of_orbit(flow, measured[0]),
        coexistence=result,
        **_displacements(model, r.omega, flow, [measured[i] for i in rows], volts),
        misfits=tuple(law_misfits(model, flow, measured[i], volts) for i in rows),
        sticking=tuple(stick_phases(model, flow, measured[i], volts, seconds) for i in rows),
        flow=UnitFlow(
            partial(board_flow, design, r),
            volts,
            seconds,
            model.second_order().ground_shape(r.omega),
        ),
        **_of_system(model, r.omega),
    )


def _found_in_ngspice(orbit: Orbit, spec: Response) -> bool:
    """Whether ngspice shows what is wanted. With op-amps that lag it has no exponent."""
    named = as_named_in_ngspice(spec)
    if not math.isfinite(orbit.lyapunov_error):
        named = replace(named, least_exponent=None)
    return matches(orbit, named)


def _in_ngspice(
    synthesis: Synthesis,
    specs: Sequence[Response],
    scan: _Scan,
    pool: SpicePool,
    traces: bool,
    fidelity: Fidelity,
) -> tuple[Simulated, ...]:
    """ngspice from the exact circuit's attractors, at settings that pass the gate."""
    began, design = time.perf_counter(), synthesis.design
    model = synthesis.modelfile.model
    step = progress.stage("responses of the exact circuit", len(specs))
    reduction = nominal.nominal_reduction(design)
    rows, subjects = [], []
    for spec in specs:
        r, flow, orbits = _circuit_orbits(synthesis, spec, scan)
        drive = design.excitation(r.b, r.omega)
        settled = [o for o in orbits if len(o.start)]
        subjects += [
            numerics_gate.GateSubject(reduction, drive, o, fidelity=fidelity) for o in settled
        ]
        rows.append((r, drive, flow, settled))
        step()
    progress.stage("ngspice, numerics gate")
    passed = numerics_gate.check(pool, subjects)
    results = iter(twin_runs.with_exponents(pool, subjects, passed))
    seconds = (time.perf_counter() - began) / max(len(specs), 1)
    out = []
    for r, excitation, flow, settled in rows:
        volts, scale = design.volts(r.b), design.errors.scales.seconds
        gates = [next(results) for _ in settled]
        answers = [CheckedResponse(r, r.orbit, excitation, g).ngspice for g in gates]
        begun = [o for o, answer in zip(settled, answers, strict=True) if answer is not None]
        orbits = [o for o in answers if o is not None] or [Orbit(OrbitStatus.FAILED)]
        scaled = [design.in_model_units(o, volts) for o in orbits]
        out.append(
            Simulated(
                r.omega,
                r.expected,
                _found_in_ngspice(scaled[0], r.spec),
                scaled[0],
                tuple(scaled[i] for i in _distinct(scaled)[1:]),
                seconds,
                b=r.b,
                settings=_gate_settings(gates[0]) if gates else {},
                traces=spice_trace(gates[0], volts, scale) if gates and traces else (),
                trust=trust.of_gate(gates[0]) if gates else Trust(),
                **_unmoved(model, [scaled[i] for i in _distinct(scaled)]),
                misfits=tuple(
                    law_misfits(model.at(r.b), flow, begun[i], volts)
                    for i in _distinct(scaled)
                    if begun
                ),
                **_of_system(model.at(r.b), r.omega),
            )
        )
    return tuple(out)


def _unmoved(model: MechanicalModel, orbits: Sequence[Orbit]) -> dict[str, Any]:
    """As ``_displacements``; of those that are no states ngspice has no extremes."""
    system, unknown = model.second_order(), (np.zeros((0, 2)),) * len(orbits)
    if system.ground_moves:
        return {"absolute": unknown}
    own = tuple(orbit.extremes for orbit in orbits)
    return {"absolute": own, "from_base": unknown if system.driven_by_ground else ()}


def _gate_settings(result: numerics_gate.GateResult) -> dict[str, Any]:
    return {
        **result.settings.as_dict(),
        "steps_a_period": result.tried[-1],
        "steps_a_contact": result.contact_steps,
        "gate_passed": result.passed,
        "gate_difference": result.difference,
        "remedies": list(result.remedies),
        "discarded_periods": result.discarded,
    }


def _distinct(orbits: Sequence[Orbit]) -> list[int]:
    """Which orbits to show: the first, and the others that do not look like one before them."""
    shown = [0]
    for i in range(1, len(orbits)):
        if not any(_alike(orbits[i], orbits[k]) for k in shown):
            shown.append(i)
    return shown


def _alike(a: Orbit, b: Orbit) -> bool:
    if a.status is not b.status or a.counts.family != b.counts.family:
        return False
    if not (len(a.extremes) and len(b.extremes)):
        return True
    return any(coexistence.alike(a, b, coexistence.ALIKE, mirrored=m) for m in (False, True))


def _measured(flow: Flow, orbit: Orbit) -> Orbit:
    """The orbit with its exponent measured to a bound and, where it is not periodic, with its
    extremes and largest impacts over 200 periods."""
    orbit = attractors.with_exponent(flow, orbit)
    if len(orbit.extremes) or not len(orbit.start):
        return orbit
    with flow.within(Budget(step_budget.SETTLING)):
        run_ = flow.run(orbit.start, 200, measure=True)
    if run_.status is not FlowStatus.DONE:
        return orbit
    return replace(orbit, extremes=run_.extremes, spans=run_.spans, speeds=run_.speeds)
