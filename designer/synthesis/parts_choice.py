"""From a model to chosen parts: search within limits, verify, name what binds.

Lexicographic, as docs/synthesis.md explains: the linear block's error first, then the dead zone's;
each with the fewest distinct values among its best. The finished circuit is reduced and its errors
and side conditions are computed afresh; where a condition is not kept, its limit is tightened and
the search repeated.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NoReturn

import numpy as np

from designer.base.errors import Unreachable
from designer.base.progress import best_so_far, doing, part, quiet
from designer.base.units import format_quantity
from designer.catalog.design_rule import ROUNDING
from designer.catalog.entries import UNITS, Kind
from designer.catalog.parts_catalog import Catalog
from designer.circuit.coefficients import EXACT
from designer.circuit.dead_zone_parts import half_parts
from designer.circuit.design import Certificate, ConditionCheck, Design
from designer.circuit.nominal import circuit_flow, nominal_reduction
from designer.circuit.static_shifts import least_drive
from designer.dynamics.attractors import settle
from designer.dynamics.step_budget import Budget
from designer.linear_network import linear_search
from designer.linear_network.linear_terms import LinearBlock, Shortfall, Targets
from designer.model.circuit_table import SIDE_CONDITIONS, CircuitSpec
from designer.model.find_responses import ModelResponse, Peaks, matches
from designer.model.mechanics import MechanicalModel
from designer.synthesis import composites, output_loads, side_conditions
from designer.synthesis.all_stages import alike
from designer.synthesis.attempt import (
    Attempt,
    Order,
    attempt,
    largest_amplitudes,
    linear_block,
    linear_question,
)
from designer.synthesis.further_stages import idle_shares
from designer.synthesis.limits import NO_AIMS, Aims, ConditionLimits, limits
from designer.synthesis.part_checks import check_choices
from designer.synthesis.scale_box import Conflict
from designer.synthesis.scale_choice import ScaleAttempt, ScaleChoice

EVERY: dict[Kind, tuple[float, float]] = {"resistor": (1e-2, 1e10), "capacitor": (1e-14, 1.0)}
"""A range that holds every value which is sold [ohm, F]."""
ROUNDS = 4
"""How often limits are tightened before the search gives up."""
BOX_ROUNDS = 8
"""How often scales are chosen before the search gives up."""
BOUND_STEPS = 4_000_000
"""Steps of the tree of choices that looks for a lower bound."""
LOOK = 400_000
"""Steps of the engine in which a circuit has to settle on a wanted response."""
BESIDE, BESIDE_TREE, BESIDE_PAIRS = 10, 2, 1
"""Linear blocks that are tried beside the first: where joins find them; where a tree of choices
does, or any resistor may be a pair, both slower by far."""
EMPTY = 1e-9
"""Relative: so far below a bound there is no choice, where at the bound there may be one."""
RULED = frozenset({"swing", "load", "bandwidth"})
"""Side conditions whose figures design rules judge too."""
LEAST_IDLE = 0.2
"""Least share of an idle half's current (``idle_shares``) with which both halves share an output;
the driving one has so much of the swing."""
ASIDE = 1e-6
"""Relative: the ends of an interval of R4 leave out the value between."""
FREES = {
    "frequency": "widen circuit.frequency or circuit.capacitor_range",
    "displacement integrators": "add a series to circuit.capacitors or widen circuit.frequency",
    "signal resistors": "widen circuit.resistor_range, or leave out the side condition resistors",
    "coefficients": "add a series to circuit.resistors or circuit.capacitors, or widen the ranges",
    "stop slope": "widen circuit.resistor_range (R50 is the stop) or take a finer series",
    "stop stiffness": "a softer stop or a wider circuit.resistor_range: R4 is too small",
    "dead-zone null": "a finer series, or a wider clearance: the threshold may be too small a part "
    "of the swing for the gain of the saturating path",
    "dead-zone bias": "a finer series or a wider circuit.resistor_range (R211 and R212)",
    "threshold": "a finer series or a wider circuit.resistor_range (R200 and R201), or a wider "
    "clearance: the reference has to be divided down to the threshold",
    "reference current": "a wider circuit.resistor_range (R201 and R206) or a larger "
    "circuit.supply",
    "noise gain": "a wider clearance, or a larger circuit.resistor_range",
    "signal level": "leave level out of circuit.side_conditions, or take a wider "
    "circuit.resistor_range and circuit.capacitor_range",
    "side conditions": "fewer names in circuit.side_conditions, or wider ranges in circuit",
    "matched parts": "drop a group of circuit.matched or add a series",
    "distinct values": "raise circuit.most_values, or add circuit.preferred or circuit.slack",
    "swing": "a larger circuit.saturation or circuit.supply",
    "level": "a clearance that is reached, a larger circuit.saturation, or an op-amp "
    "with less offset",
    "load": "an op-amp that drives more, or a wider circuit.resistor_range",
    "noise_gain": "a wider clearance, or a larger circuit.resistor_range",
    "bandwidth": "a faster circuit.opamp, or lower frequencies in circuit.frequency",
    "resistors": "another circuit.capacitor_range or circuit.frequency",
    "generator": "a smaller clearance, or smaller resistors in circuit.resistor_range",
}
"""What frees a condition that leaves no choice of parts, by its name in ``Unreachable``."""


@dataclass(frozen=True)
class _Verified:
    """A design that keeps the conditions, the attempt that it is made of, and its limits."""

    attempt: Attempt
    design: Design
    limits: ConditionLimits


@dataclass(frozen=True)
class _Missed:
    """Why there is no design, and the side conditions that finished circuits broke on the way
    there."""

    short: Shortfall
    broken: tuple[str, ...] = ()
    conflicts: tuple[Conflict, ...] = ()
    """Limits that cannot be kept together, by a proof; none where that is not why."""
    apart: int | None = None
    """The clearance, by its place in the order, whose idle half would not stay off beside the other
    one; the circuit is to be had with both apart."""


def _apart(index: int) -> _Missed:
    return _Missed(Shortfall("swing", True), ("swing",), apart=index)


def synthesise(
    model: MechanicalModel,
    spec: CircuitSpec,
    catalog: Catalog,
    peaks: Peaks,
    responses: Sequence[ModelResponse] = (),
    *,
    aims: Aims = NO_AIMS,
    binding: bool = True,
    jobs: int = 1,
    stand: Callable[[Design], None] = quiet,
) -> Design:
    """Choose the parts.

    responses : that are wanted; the finished circuit is held to the voltages and currents that
    they need. Without them it is held to ``peaks``. aims : inside the side conditions. binding :
    whether it is asked what each side condition costs, which changes no part. jobs : threads; no
    part depends on it. stand : is given the design as soon as no part of it changes any more.

    Raises
    ------
    InputError : a choice of the model file that this stage cannot build.
    Unreachable : no choice of parts meets the conditions; names the one that binds.
    """
    began = time.perf_counter()
    check_choices(model, spec, catalog)
    largest = largest_amplitudes(model, responses)
    drive = least_drive(model, responses)
    make = partial(Order.of, model, spec, catalog, peaks, largest=largest, drive_force=drive)
    order = make(aims=aims)
    search = _Search(order, responses, jobs)
    best = search.best(spec.active_conditions)
    while isinstance(best, _Missed) and best.apart is not None:
        apart = order.stage.apart | {best.apart}
        order = make(aims=aims, apart=apart)
        search = _Search(order, responses, jobs)
        best = search.best(spec.active_conditions)
    if isinstance(best, _Missed):
        search.refuse(best, catalog)
    design = best.design
    if spec.composites:
        doing("composites")
        design = search.with_composites(best)
    _check_error(design, spec)
    stand(design)
    least = design.errors.max_error - EXACT
    if binding and least > 0.0:
        costs = search.binding(best)
        design = replace(design, binding={n: cost for n, cost in costs.items() if cost < least})
    return replace(design, seconds=time.perf_counter() - began)


@dataclass(frozen=True)
class _Search:
    """The search for what is ordered, held to these responses."""

    order: Order
    responses: Sequence[ModelResponse]
    jobs: int

    def best(self, conditions: frozenset[str]) -> _Verified | _Missed:
        """The best design that keeps these side conditions, verified on its circuit.

        Bandwidth that is missing is sought in smaller gains first, in a slower time scale then.
        """
        if self.by_scales:
            return self._in_box(conditions)
        answer = self._rounds(conditions, slower=False)
        if isinstance(answer, _Missed) and answer.apart is not None:
            return answer
        if isinstance(answer, _Missed) and answer.broken and "bandwidth" in conditions:
            answer = self._rounds(conditions, slower=True)
        if isinstance(answer, _Missed) and not self.whole_by_joins and not self._asked:
            return self._in_box(conditions)
        return answer

    @cached_property
    def by_scales(self) -> bool:
        """Whether scales are chosen before values: for all but one clearance of two masses that
        joins search as a whole, unless the least error or the fewest values are asked for. What
        limits, stops with damping, and combinations of displacements are always chosen so."""
        zones = self.order.model.second_order().dead_zones
        if any(zone.limits or zone.damping or not zone.plain for zone in zones):
            return True
        return self.order.spec.objective != "match" and not (self.whole_by_joins or self._asked)

    @property
    def _asked(self) -> bool:
        """Whether fewest values or equal parts are asked for, which scales first do not know."""
        return self.order.spec.most_values is not None or bool(self.order.spec.matched)

    @cached_property
    def whole_by_joins(self) -> bool:
        """Whether joins and one even stage to ground on the first mass are the whole circuit."""
        system = self.order.model.second_order()
        zones = system.dead_zones
        plain = not zones or (
            len(zones) == 1
            and alike(zones[0])
            and zones[0].pushed == ((0, 1.0),)
            and zones[0].quantity == "displacement"
        )
        return self.by_joins and plain and not system.wired.constant.any()

    @cached_property
    def by_joins(self) -> bool:
        """Whether joins choose the linear block, so that searching it again costs little."""
        return Targets.of(self.order.model).fully_coupled_pair

    def binding(self, best: _Verified) -> dict[str, float]:
        """max_error without each condition that costs some; nothing where the error is none, and
        only asked where joins choose: elsewhere each condition would have to be searched again."""
        error, conditions = best.design.errors.max_error, self.order.spec.active_conditions
        if error <= EXACT or not self.by_joins or self.by_scales:
            return {}

        def without(names: frozenset[str]) -> float:
            other = self.best(conditions - names)
            return float("inf") if isinstance(other, _Missed) else other.design.errors.max_error

        active = [n for n in SIDE_CONDITIONS if n in conditions and self._acts(best, n)]
        least = error - EXACT - self.order.spec.slack  # inside the slack an error may lie anywhere
        if len(active) > 1:
            with part("what the side conditions cost"):
                free = without(conditions)
            if free > least:
                return {}
        costs = {}
        for number, name in enumerate(active, start=1):
            with part(f"what {name} costs ({number} of {len(active)})"):
                costs[name] = without(frozenset({name}))
        return {name: cost for name, cost in costs.items() if cost < least}

    def with_composites(self, best: _Verified) -> Design:
        """The design with resistors of two parts where that lowers its error; or as it was."""
        spec, design = self.order.spec, best.design
        for made in self._in_pairs(best):
            if isinstance(made, Shortfall) or _error(made) >= design.errors.max_error - EXACT:
                continue
            most = spec.most_values
            if most is not None and made.distinct_values(spec.preferred) > most:
                continue
            improved = verified(self.order, made, self.responses, spec.active_conditions)
            if not all(check.holds for check in improved.checks):
                continue
            least = improved.errors.max_error - EXACT
            certificate = Certificate(
                "optimal" if least <= 0.0 else "bound",
                0.0,
                "no error is below 0, and one up to 1e-6 counts as none"
                if least <= 0.0
                else "composites near the best single parts; no lower bound but 0",
            )
            design = replace(improved, certificate=certificate)
            if least <= 0.0:
                break
        return design

    def _in_pairs(self, best: _Verified) -> Iterator[Attempt | Shortfall]:
        """Attempts with resistors of two parts, what takes least to find first: of the best linear
        block, of that beside it which is best without them, and of others beside it."""
        spec, order, first = self.order.spec, self.order, best.attempt
        alone = partial(attempt, order, best.limits)

        def paired(made: Attempt | Shortfall) -> Attempt | Shortfall:
            return (isinstance(made, Attempt) and composites.improve(order, made)) or made

        yield paired(first)
        if spec.most_values is not None or self.by_scales:
            return
        linear = first.linear
        alternative = best_alternative(order, best.limits, linear, first, alone)
        yield alternative
        best_pair = paired(alternative)
        yield best_pair
        most = BESIDE_PAIRS if spec.composites is True else BESIDE

        def make(other: LinearBlock) -> Attempt | Shortfall:
            return paired(alone(other))

        yield best_alternative(order, best.limits, linear, best_pair, make, most)

    def refuse(self, missed: _Missed, catalog: Catalog) -> NoReturn:
        """Raise ``Unreachable`` with what binds, the side conditions among it, and what frees
        it."""
        if missed.conflicts:
            _refuse_conflicts(missed, self.order.spec, catalog)
        what = missed.short.what
        guilty, names = self._guilty(missed)
        if names and names != what:
            what += f"; side condition: {names}"
        free = FREES.get(missed.short.what, "a wider choice of parts")
        if guilty:
            free += "; or circuit.side_conditions without " + " or ".join(guilty)
        if self.order.spec.most_values is not None and missed.short.what != "distinct values":
            free += "; or raise circuit.most_values: with few values anything may bind"
        # Conditions that were made narrower on the way shut out choices that the file allows.
        whole = missed.short.whole and not missed.broken
        searched = "" if whole else " within the search's count of steps"
        raise Unreachable(
            None, "circuit", f"no choice of parts{searched}; what binds: {what}", free
        )

    def _guilty(self, missed: _Missed) -> tuple[list[str], str]:
        """The side conditions that leave no choice, and their names in words: by joins those
        without which there is one, in a tree of choices those that finished circuits broke."""
        if not self.by_joins:
            guilty = [name for name in SIDE_CONDITIONS if name in missed.broken]
            return guilty, ", ".join(guilty)
        conditions = self.order.spec.active_conditions
        doing("what leaves no choice")
        if not conditions or isinstance(self.best(frozenset()), _Missed):
            return [], ""
        guilty = [
            name
            for name in SIDE_CONDITIONS
            if name in conditions and isinstance(self.best(conditions - {name}), _Verified)
        ]
        return guilty, ", ".join(guilty) or "several together"

    def _limits(self, conditions: frozenset[str]) -> ConditionLimits:
        o = self.order
        unit = o.model.second_order().own_frequency
        return limits(o.spec, conditions, o.bounds, o.output.limit, o.peaks.fastest, o.aims, unit)

    def _rounds(self, conditions: frozenset[str], *, slower: bool) -> _Verified | _Missed:
        """Search, verify, tighten what is not kept, and again."""
        within = self._limits(conditions)
        broken: list[ConditionCheck] = []
        names: tuple[str, ...] = ()
        # Under the conditions as they are stated: later rounds search less than they allow.
        widest = linear_block(self.order, within, most_values=self.order.spec.most_values)
        if isinstance(widest, Shortfall):
            return _Missed(widest)
        for number in range(ROUNDS + 1):
            made = self._within_most_values(within, widest, again=number > 0)
            if isinstance(made, Shortfall):
                return _Missed(made, names)
            design = verified(self.order, made, self.responses, conditions)
            design = replace(design, certificate=_certificate(made, widest))
            broken = [check for check in design.checks if not check.holds]
            if not broken:
                return _Verified(made, design, within)
            names += tuple(check.name for check in broken)
            apart = self._too_unequal(broken)
            if apart is not None:
                return _apart(apart)
            tighter = within.tightened(broken, design, slower=slower)
            if tighter == within:
                break
            within = tighter
        return _Missed(Shortfall(broken[0].name, False), names)

    def _in_box(self, conditions: frozenset[str]) -> _Verified | _Missed:
        """Scales first, then parts; verify, tighten what is not kept, and again."""
        for place in self.order.stage.places(self.order.model.second_order().dead_zones):
            shares = idle_shares(place.clearance, self.order.peaks.reach(place.index))
            least = min(shares.values(), default=1.0)
            if self.order.stage.rectifies and place.shared and least < LEAST_IDLE:
                return _apart(place.index)
        within = stated = self._limits(conditions)
        names: tuple[str, ...] = ()
        before, broken = None, list[ConditionCheck]()
        found: tuple[ScaleAttempt, Design, ConditionLimits] | None = None
        for number in range(BOX_ROUNDS):
            choice = ScaleChoice(self.order, within, self.jobs)
            made = self._showing(choice.circuits(before))
            if isinstance(made, Shortfall):
                if found is not None:
                    break
                conflicts = tuple(choice.conflicts())
                return _Missed(replace(made, whole=bool(conflicts)), names, conflicts=conflicts)
            design = verified(self.order, made.made, self.responses, conditions)
            broken = [check for check in design.checks if not check.holds]
            if broken and found is not None:
                break
            if not broken:
                found = made, design, within
            over = broken or [c for c in design.checks if c.name in RULED and _above(c)]
            names += tuple(check.name for check in broken)
            before = made.z
            tighter = within.tightened(over, design, slower=number > 0)
            if tighter == within:
                break
            within = tighter
        if found is None:
            return _Missed(Shortfall(broken[0].name, False), names)
        made, design, within = found
        certificate = _certificate(made.made, self._least(made.made, stated), made.words)
        return _Verified(made.made, replace(design, certificate=certificate), within)

    def _showing(self, circuits: Iterable[ScaleAttempt | Shortfall]) -> ScaleAttempt | Shortfall:
        """The first circuit that shows every response which the model does; the first of all where
        none does."""
        first: ScaleAttempt | Shortfall | None = None
        there = [r for r in self.responses if r.found]
        for each in circuits:
            first = first or each
            if isinstance(each, Shortfall) or self._shows(_design(self.order, each.made), there):
                return each
        assert first is not None
        return first

    @staticmethod
    def _shows(design: Design, responses: Sequence[ModelResponse]) -> bool:
        """Whether the nominal circuit shows these responses; one that it takes long to settle on
        is none."""
        doing("responses of the finished circuit")
        system = nominal_reduction(design).system() if responses else None
        for response in responses:
            assert system is not None
            flow = circuit_flow(system, design, response)
            start = response.orbit.start * design.volts(response.b)
            orbit = settle(flow, start, budget=Budget(LOOK), watch=0)
            if not matches(design.in_model_units(orbit, design.volts(response.b)), response.spec):
                return False
        return True

    def _least(self, made: Attempt, within: ConditionLimits) -> LinearBlock:
        """The linear block with what a tree of choices, or joins, prove of any within these
        limits."""
        question = linear_question(self.order, within)
        if self.order.stage.rectifies:  # the stop's resistor is one of the program's
            question = replace(question, bounds=replace(question.bounds, stop=0.0))
        doing("least error of any integrators")
        bound, proof = linear_search.lower_bound(question, made.errors.max_error, BOUND_STEPS)
        return replace(made.linear, bound=bound, proved=True, proof=proof)

    def _too_unequal(self, broken: Sequence[ConditionCheck]) -> int | None:
        """The clearance, by its place in the order, whose steeper half drives fv further than its
        other half can idle, which no amplitude mends; None without one."""
        where = {check.where for check in broken if check.quantity == "rectifier_fv_v"}
        for index, clearance in enumerate(self.order.model.second_order().dead_zones):
            stops = [stop for _, stop in clearance.sides]
            diodes = {half_parts(index, side).series for side, _ in clearance.sides}
            if where & diodes and len({stop.stiffness for stop in stops}) > 1:
                return index
        return None

    def _within_most_values(
        self, within: ConditionLimits, widest: LinearBlock, *, again: bool
    ) -> Attempt | Shortfall:
        """An attempt that keeps the limit on distinct values, where there is one.

        widest : the linear block within limits at least as wide; within these themselves unless
        ``again``. What is over the limit is taken from the linear block's share, after a round in
        which whatever only sets a level does with values that the linear block has.
        """
        spec, empty = self.order.spec, widest.bound * (1.0 - EMPTY)
        most, share = spec.most_values, spec.most_values
        for number in range(ROUNDS + 1):
            known = None if again or number > 0 else widest
            linear = known or linear_block(self.order, within, most_values=share, empty=empty)
            if isinstance(linear, Shortfall):
                return linear
            made = attempt(self.order, within, linear, thrifty=number > 0)
            if most is None and spec.composites and isinstance(made, Attempt):
                return made  # two parts may cure the dead zone's error where it stands
            if most is None:
                make = partial(attempt, self.order, within)
                return best_alternative(self.order, within, linear, made, make)
            if isinstance(made, Shortfall):
                # With few values left the dead zone may fail for any reason.
                if number == 0 and made.what != "distinct values":
                    return made
                over = 1
            else:
                over = made.distinct_values(spec.preferred) - most
                if over <= 0:
                    return made
            if number > 0:
                own = len(set(linear.values.values()) - set(spec.preferred))
                share = max(min(own, most) - over, 1)
        return Shortfall("distinct values", False)

    def _acts(self, best: _Verified, name: str) -> bool:
        """Whether the search could notice that this condition is left out."""
        conditions = self.order.spec.active_conditions
        first, without = self._limits(conditions), self._limits(conditions - {name})
        if best.limits != first:  # some limit had to be tightened
            return True
        return name == "swing" or first != replace(without, conditions=conditions)


def _above(check: ConditionCheck) -> bool:
    """Whether a figure is beyond its limit, which a design rule knows no tolerance of."""
    return check.excess > 1.0 + ROUNDING


def verified(
    order: Order, made: Attempt, responses: Sequence[ModelResponse], conditions: frozenset[str]
) -> Design:
    """The design of an attempt, these side conditions checked on its circuit.

    responses : whose voltages and currents count; without them the peaks of the order do.
    """
    design = _design(order, made)
    loads = None
    if responses and conditions & {"swing", "load"}:
        doing("voltages and currents of the finished circuit")
        board = nominal_reduction(design)
        loads = output_loads.design_loads(design, board, responses)
    amplitudes = design.largest_amplitudes(responses)
    bounds = order.bounds
    checks = side_conditions.verify(design, conditions, bounds, order.peaks, amplitudes, loads)
    _tell(design, checks)
    low, high = order.spec.frequency
    numbers = {"frequency_low_hz": low, "frequency_high_hz": high}
    return replace(
        design,
        checks=checks,
        conditions=numbers | {check.quantity: check.limit for check in checks},
    )


def _design(order: Order, made: Attempt) -> Design:
    """The design of an attempt, of which nothing is checked or proved yet."""
    return Design(
        model=order.model,
        circuit=made.circuit,
        errors=made.errors,
        certificate=Certificate("bound", 0.0, "not yet proved"),
        conditions={},
        solver=made.solver,
        seconds=0.0,
    )


def _sold(kind: Kind, spec: CircuitSpec, catalog: Catalog) -> tuple[float, float]:
    """The least and the largest value of the file's series and grade that can be bought."""
    series, grade = (
        (spec.capacitors, spec.capacitor_grade)
        if kind == "capacitor"
        else (spec.resistors, spec.resistor_grade)
    )
    values = catalog.values(kind, series, *EVERY[kind], grade)
    return float(values.min()), float(values.max())


def _unbought(conflict: Conflict, spec: CircuitSpec, catalog: Catalog) -> str:
    """That a wider range alone would ask for a value which cannot be bought; "" of one that can,
    and of any other limit."""
    limit = conflict.limit
    for kind in UNITS:
        if limit.condition == f"{kind}_range":
            low, high = _sold(kind, spec, catalog)
            if limit.least and conflict.needed < low:
                return f"no {kind} below {format_quantity(low, limit.unit, 3)}"
            if not limit.least and conflict.needed > high:
                return f"no {kind} above {format_quantity(high, limit.unit, 3)}"
    return ""


def _refuse_conflicts(missed: _Missed, spec: CircuitSpec, catalog: Catalog) -> NoReturn:
    """Raise ``Unreachable`` with limits that cannot be kept together, and how far each would have
    to give: those that can, and why the others cannot."""
    limits = ", ".join(c.limit.text(c.limit.value) for c in missed.conflicts)
    found = f"no scales within the limits of the search (linear program): together stand {limits}"
    if missed.broken:
        names = ", ".join(n for n in SIDE_CONDITIONS if n in missed.broken)
        found += f"; where finished circuits did not keep {names}, that was made narrower"
    given = [c for c in missed.conflicts if np.isfinite(c.needed) and c.needed]
    alone = [c for c in missed.conflicts if c not in given]
    lacking = {c: text for c in given if (text := _unbought(c, spec, catalog))}
    ways = [c.limit.text(c.needed) for c in given if c not in lacking]
    there = {c.limit.condition for c in missed.conflicts if c.frees}
    free = "one of them as wide as this, the others as they are: " + " or ".join(ways)
    if not ways:
        free = "two of them wider"
    for each, text in lacking.items():
        free += f"; {each.limit.text(each.needed)} would do too, but the catalogue has {text}"
    if alone and ways:
        free += f"; no value of {' or of '.join(c.limit.what for c in alone)} alone is enough"
    if there & set(SIDE_CONDITIONS):
        free += "; or circuit.side_conditions without "
        free += " or ".join(n for n in SIDE_CONDITIONS if n in there)
    raise Unreachable(None, "circuit", found, free)


def _check_error(design: Design, spec: CircuitSpec) -> None:
    """Raise ``Unreachable`` for an error above ``circuit.max_error``, with what would lower it."""
    errors, certificate = design.errors, design.certificate
    if spec.max_error is None or errors.max_error <= spec.max_error:
        return
    name = max(errors.errors, key=lambda each: abs(errors.errors[each]))
    found = (
        f"{spec.max_error:g}, where the best design that was found has {errors.max_error:.3g} "
        f"({name}); no smaller error than {certificate.lower_bound:.3g} is possible with these "
        "choices"
    )
    ways = [*ways_to_less_error(spec), "a larger number"]
    raise Unreachable(None, "circuit.max_error", found, " or ".join(ways))


def _tell(design: Design, checks: Sequence[ConditionCheck]) -> None:
    """A circuit that was found: a step on the way where it does not keep every condition."""
    broken = ", ".join(check.name for check in checks if not check.holds)
    not_yet = f", which does not keep {broken} yet" if broken else ""
    text = f"a circuit with a largest error of {design.errors.max_error:.2g}{not_yet}"
    best_so_far(text, step=bool(broken))


def ways_to_less_error(spec: CircuitSpec) -> list[str]:
    """What may lower a design's largest coefficient error, in words of the model file."""
    ways = ["a finer series or several in circuit.resistors"]
    if not spec.composites:
        ways.append("circuit.composites = true")
    ways.append("wider circuit.resistor_range, capacitor_range or frequency")
    if spec.active_conditions:
        ways.append("fewer circuit.side_conditions")
    return ways


def best_alternative(
    order: Order,
    within: ConditionLimits,
    linear: LinearBlock,
    first: Attempt | Shortfall,
    make: Callable[[LinearBlock], Attempt | Shortfall],
    most: int = BESIDE,
) -> Attempt | Shortfall:
    """The attempt of least error among linear blocks as good as ``linear``.

    What the stop needs follows R4 (its slope is in units of K1 = 1/(R4 C2)), and an exact linear
    network stays exact at other levels. So where the first choice leaves the dead zone an error
    that counts, others of the least error are tried, one for each interval of R4 that is left.

    first : the attempt with ``linear`` itself, which stands unless another is better by more than
    what counts. make : an attempt with another linear block. most : of them.
    """
    best = first
    left = deque(_rest_of(linear, (0.0, float("inf")), order.stiffness))
    if not Targets.of(order.model).fully_coupled_pair:
        most = min(most, BESIDE_TREE)
    for number in range(most):
        if (
            not left
            or not order.model.second_order().dead_zones
            or _error(best) <= max(linear.least, EXACT)
        ):
            break
        between = left.popleft()
        with part(f"other integrators ({number + 1} of at most {most})"):
            other = linear_block(order, within, between=between, level=linear.least)
            if isinstance(other, Shortfall) or other.least > linear.least + EXACT:
                continue
            left.extend(_rest_of(other, between, order.stiffness))
            made = make(other)
        if isinstance(made, Attempt) and _error(made) < _error(best) - EXACT:
            best = made
    return best


def _rest_of(
    linear: LinearBlock, between: tuple[float, float], name: str
) -> list[tuple[float, float]]:
    """What this block's resistor of this name leaves of an interval, the part above it first."""
    value, (low, high) = linear.values[name], between
    return [(value * (1.0 + ASIDE), high), (low, value * (1.0 - ASIDE))]


def _error(made: Attempt | Shortfall) -> float:
    return made.errors.max_error if isinstance(made, Attempt) else float("inf")


def _certificate(made: Attempt, widest: LinearBlock, words: str = "") -> Certificate:
    """No circuit has a smaller error than the linear block's bound under the stated conditions.

    widest : the linear block that they allow; the circuit may have another. The dead zone's own
    bound is for the scales of one linear block, so it is told but proves nothing about others.
    """
    error, dead_zone = made.errors.max_error, made.dead_zone
    proof = f"linear block: {widest.proof}"
    if words:
        proof += f"; {words}"
    elif made.linear is not widest:
        proof += "; the circuit has another linear block, for the dead zone or the conditions"
    if dead_zone is not None and not words:
        proof += f"; dead zone, for the scales of the circuit's linear block: {dead_zone.proof}"
    proved = widest.proved and error <= widest.bound + EXACT
    return Certificate("optimal" if proved else "bound", min(widest.bound, error), proof)
