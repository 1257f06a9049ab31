"""From a model to chosen parts: search within limits, verify, name what binds.

Lexicographic, as docs/synthesis.md explains: the linear block's error first, then the dead zone's;
each with the fewest distinct values among its best. The finished circuit is reduced and its errors
and side conditions are computed afresh; where a condition is not kept, its limit is tightened and
the search repeated.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NoReturn

from designer.base.errors import InputError, Unreachable
from designer.base.progress import doing, part
from designer.catalog.catalog import Catalog
from designer.circuit.coefficients import EXACT
from designer.circuit.design import Certificate, ConditionCheck, Design
from designer.circuit.netlist import nominal_board
from designer.circuit.reduction import Reduction
from designer.model.circuit_table import SIDE_CONDITIONS, CircuitSpec
from designer.model.find_responses import ModelResponse, Peaks
from designer.model.model import Dimensionless
from designer.synthesis import composites, output_loads, side_conditions
from designer.synthesis.advice import FREES
from designer.synthesis.attempt import (
    Attempt,
    Order,
    attempt,
    linear_block,
    order,
    to_choose_from,
    zone_of_spec,
)
from designer.synthesis.limits import NO_AIMS, Aims, ConditionLimits, limits
from designer.synthesis.linear_alternatives import best_beside
from designer.synthesis.linear_search import LinearBlock
from designer.synthesis.part_choice import diode_of, opamp_of, reference_of
from designer.synthesis.part_names import check_names, check_preferred, parts_of, wishes_of
from designer.synthesis.tie_break import Shortfall

ROUNDS = 4
"""How often limits are tightened before the search gives up."""


@dataclass(frozen=True)
class UncertifiedDesign:
    """A design that keeps the conditions, without its certificate's last word."""

    made: Attempt
    """The chosen values."""
    design: Design
    """The design that they make."""
    limits: ConditionLimits
    """Limits of the side conditions that were kept."""


@dataclass(frozen=True)
class Missed:
    """Why there is no design."""

    short: Shortfall
    """What leaves no choice."""
    tightened: bool
    """Whether a limit had been tightened by then."""


def synthesise(
    model: Dimensionless,
    spec: CircuitSpec,
    catalog: Catalog,
    peaks: Peaks,
    found: Sequence[ModelResponse] = (),
    *,
    aims: Aims = NO_AIMS,
    binding: bool = True,
) -> Design:
    """Choose the parts.

    found : the wanted responses; the finished circuit is held to the voltages and currents that
    they need. Without them it is held to ``peaks``. aims : inside the side conditions. binding :
    whether it is asked what each side condition costs, which changes no part.

    Raises
    ------
    InputError : a choice of the model file that this stage cannot build.
    Unreachable : no choice of parts meets the conditions; names the one that binds.
    """
    began = time.perf_counter()
    check_choices(model, spec, catalog)
    largest = max((model.b / r.b for r in found), default=1.0)
    wanted = replace(order(model, spec, catalog, peaks, max(largest, 1.0)), aims=aims)
    reached = _reach(wanted, spec.kept, found)
    if isinstance(reached, Shortfall):
        _refuse(wanted, reached, found)
    design = reached.design
    if binding:
        design = replace(design, binding=_binding(wanted, reached, found))
    if spec.composites:
        doing("composites")
        design = _with_composites(wanted, reached, design, found)
    return replace(design, seconds=time.perf_counter() - began)


def check_choices(model: Dimensionless, spec: CircuitSpec, catalog: Catalog) -> None:
    """Refuse what cannot be built before anything is computed.

    Raises
    ------
    InputError : a part of the catalogue that is not known or cannot be used, a part that the
        circuit does not have, or a choice of the contract that this version does not build.
    Unreachable : no value of the series can be bought in the range.
    """
    opamp_of(spec, catalog)
    if spec.saturation is not None and not 0.0 < spec.saturation <= spec.supply:
        expected = f"above 0 and up to {spec.supply:g} V"
        raise InputError(None, "circuit.saturation", spec.saturation, expected)
    if spec.dead_zone == "rectifier" and model.k0 > 0.0:
        diode_of(spec.diode, catalog)
        reference_of(spec, catalog)
    if spec.objective != "match":
        raise InputError(
            None,
            "circuit.objective",
            spec.objective,
            '"match": a design for the yield comes from search, run or synthesise with --out',
        )
    check_names(parts_of(model, spec, catalog, zone_of_spec(model, spec, catalog)), spec)
    resistors = to_choose_from("resistor", spec, catalog)
    check_preferred(spec, resistors, to_choose_from("capacitor", spec, catalog))


def _reach(
    order: Order, kept: frozenset[str], found: Sequence[ModelResponse]
) -> UncertifiedDesign | Shortfall:
    """The best design that keeps these conditions, verified on its circuit.

    Bandwidth that is missing is sought in smaller gains first, in a slower time scale then.
    """
    answer = _rounds(order, kept, found, slower=False)
    if isinstance(answer, UncertifiedDesign) or "bandwidth" not in kept or not answer.tightened:
        return answer.short if isinstance(answer, Missed) else answer
    answer = _rounds(order, kept, found, slower=True)
    return answer.short if isinstance(answer, Missed) else answer


def _rounds(
    order: Order, kept: frozenset[str], found: Sequence[ModelResponse], *, slower: bool
) -> UncertifiedDesign | Missed:
    """Search, verify, tighten what is not kept, and again."""
    within = limits(
        order.spec, kept, order.opamp, order.saturation, order.peaks.fastest, order.aims
    )
    broken: list[ConditionCheck] = []
    # Under the conditions as they are stated: later rounds search less than they allow.
    widest = linear_block(order, within, wishes_of(order.spec))
    if isinstance(widest, Shortfall):
        return Missed(widest, False)
    for number in range(ROUNDS + 1):
        made = _counted(order, within, widest if number == 0 else None)
        if isinstance(made, Shortfall):
            return Missed(made, number > 0)
        design = replace(
            _verified(order, made, kept, found),
            certificate=_certificate(made, widest),
        )
        broken = [check for check in design.checks if not check.holds]
        if not broken:
            return UncertifiedDesign(made, design, within)
        tighter = within.tightened(broken, design, slower=slower)
        if tighter == within:
            break
        within = tighter
    return Missed(Shortfall(broken[0].name, False), True)


def _counted(
    order: Order, within: ConditionLimits, first: LinearBlock | None
) -> Attempt | Shortfall:
    """An attempt that keeps the limit on distinct values, where there is one.

    first : the linear block within these limits, where it is known. What is over the limit is
    taken from the linear block's share, after a round in which whatever only sets a level does
    with values that the linear block has.
    """
    wishes = wishes_of(order.spec)
    most, share = wishes.most_values, wishes.most_values
    for number in range(ROUNDS + 1):
        known = first if number == 0 else None
        linear = known or linear_block(order, within, replace(wishes, most_values=share))
        if isinstance(linear, Shortfall):
            return linear
        made = attempt(order, within, wishes, linear, thrifty=number > 0)
        if most is None and order.spec.composites:
            return made  # two parts cure the dead zone's error where it stands
        if most is None:
            return best_beside(order, within, wishes, linear, made)
        if isinstance(made, Shortfall):
            # With few values left the dead zone may fail for any reason.
            if number == 0 and made.what != "distinct values":
                return made
            over = 1
        else:
            over = made.kinds(wishes.preferred) - most
            if over <= 0:
                return made
        if number > 0:
            own = len(set(linear.values.values()) - wishes.preferred)
            share = max(min(own, most) - over, 1)
    return Shortfall("distinct values", False)


def _verified(
    order: Order,
    made: Attempt,
    kept: frozenset[str],
    found: Sequence[ModelResponse],
) -> Design:
    """The design of an attempt, its conditions checked on its circuit."""
    design = Design(
        model=order.model,
        circuit=made.circuit,
        errors=made.errors,
        certificate=Certificate("bound", 0.0, "not yet proved"),
        conditions={},
        solver=made.solver,
        seconds=0.0,
    )
    needed = None
    if found and kept & {"swing", "load"}:
        doing("voltages and currents of the finished circuit")
        board = Reduction(made.circuit, nominal_board(made.circuit))
        needed = output_loads.design_loads(design, board, found)
    amplitudes = [design.amplitude(r.b) for r in found] or [design.amplitude()]
    checks = side_conditions.verify(design, kept, order.opamp, order.peaks, amplitudes, needed)
    low, high = order.spec.frequency
    numbers = {"frequency_low_hz": low, "frequency_high_hz": high}
    return replace(
        design,
        checks=checks,
        conditions=numbers | {check.quantity: check.limit for check in checks},
    )


def _certificate(made: Attempt, widest: LinearBlock) -> Certificate:
    """No circuit has a smaller error than the linear block's bound under the stated conditions.

    widest : the linear block that they allow; the circuit may have another. The dead zone's own
    bound is for the scales of one linear block, so it is told but proves nothing about others.
    """
    reached, zone = made.errors.max_error, made.zone
    proof = f"linear block: {widest.proof}"
    if made.linear is not widest:
        proof += "; the circuit has another linear block, for the dead zone or the conditions"
    if zone is not None:
        proof += f"; dead zone, for the scales of the circuit's linear block: {zone.proof}"
    proved = widest.proved and reached <= widest.bound + EXACT
    return Certificate("optimal" if proved else "bound", min(widest.bound, reached), proof)


def _with_composites(
    order: Order, reached: UncertifiedDesign, design: Design, found: Sequence[ModelResponse]
) -> Design:
    """The design with resistors of two parts where that lowers its error; or as it was."""
    better = composites.improve(order, reached.made)
    most, free = order.spec.most_values, wishes_of(order.spec).preferred
    if better is None or (most is not None and better.kinds(free) > most):
        return design
    improved = _verified(order, better, order.spec.kept, found)
    if not all(check.holds for check in improved.checks):
        return design
    exact = improved.errors.max_error <= EXACT
    certificate = Certificate(
        "optimal" if exact else "bound",
        0.0,
        "no error is below 0, and one up to 1e-6 counts as none"
        if exact
        else "composites near the best single parts; no lower bound but 0",
    )
    least = improved.errors.max_error - EXACT
    binding = {name: cost for name, cost in design.binding.items() if cost < least}
    return replace(improved, certificate=certificate, binding=binding)


def _binding(
    order: Order, reached: UncertifiedDesign, found: Sequence[ModelResponse]
) -> dict[str, float]:
    """max_error without each condition that costs some; nothing where the error is none."""
    error, kept = reached.design.errors.max_error, order.spec.kept
    if error <= EXACT:
        return {}

    def without(names: frozenset[str]) -> float:
        other = _reach(order, kept - names, found)
        return float("inf") if isinstance(other, Shortfall) else other.design.errors.max_error

    active = [n for n in SIDE_CONDITIONS if n in kept and _acts(order, reached, n)]
    least = error - EXACT - order.spec.slack  # inside the slack an error may lie anywhere
    if len(active) > 1:
        with part("what the side conditions cost"):
            free = without(kept)
        if free > least:
            return {}
    costs = {}
    for number, name in enumerate(active, start=1):
        with part(f"what {name} costs ({number} of {len(active)})"):
            costs[name] = without(frozenset({name}))
    return {name: cost for name, cost in costs.items() if cost < least}


def _acts(order: Order, reached: UncertifiedDesign, name: str) -> bool:
    """Whether the search could notice that this condition is left out."""
    kept = order.spec.kept
    first, without = (
        limits(order.spec, names, order.opamp, order.saturation, order.peaks.fastest, order.aims)
        for names in (kept, kept - {name})
    )
    if reached.limits != first:  # some limit had to be tightened
        return True
    return name == "swing" or first != replace(without, kept=kept)


def _refuse(order: Order, short: Shortfall, found: Sequence[ModelResponse]) -> NoReturn:
    """Raise ``Unreachable`` with what binds, the side conditions among it, and what frees it."""
    kept, what = order.spec.kept, short.what
    guilty: list[str] = []
    doing("what leaves no choice")
    if kept and isinstance(_reach(order, frozenset(), found), UncertifiedDesign):
        guilty = [
            name
            for name in SIDE_CONDITIONS
            if name in kept and isinstance(_reach(order, kept - {name}, found), UncertifiedDesign)
        ]
        names = ", ".join(guilty) or "several together"
        what += f"; side condition: {names}" if names != what else ""
    free = FREES.get(short.what, "a wider choice of parts")
    if guilty:
        free += "; or circuit.side_conditions without " + " or ".join(guilty)
    raise Unreachable(None, "circuit", f"no choice of parts; what binds: {what}", free)
