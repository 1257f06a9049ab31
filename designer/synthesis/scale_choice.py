"""Parts at scales that were chosen first: points of the box, rounded to what can be bought.

Every coefficient has a resistor of its own, so at any scales that keep the conditions the values
are known but for rounding. Corners of the box near its best point are mixed, and each mixture is
rounded and descended from (``kernel_rounding``). Up to a tenth of the resistors' grade an error is
worth nothing behind the parts' own: then the highest thresholds count, then the fewest values.
Lower thresholds are tried only where the error is not good enough. The number of descents is
limited and the draws follow from it, so the same order has the same answer.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.progress import best_so_far, doing
from designer.base.threads import parallel
from designer.catalog.design_rules import BY_ID
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.netlist import Circuit
from designer.circuit.scale_fit import LargestFit
from designer.circuit.static_shifts import forces, largest_offset, offset_forces
from designer.linear_network.linear_terms import LinearBlock, Shortfall, Targets
from designer.synthesis.attempt import BASE, Attempt, Order, attempt, completed
from designer.synthesis.dead_zone_target import DeadZone
from designer.synthesis.kernel_rounding import Rounding, descend
from designer.synthesis.limits import GENERATOR_PEAK, ConditionLimits
from designer.synthesis.scale_box import Conflict, ScaleBox
from designer.synthesis.scale_program import Affine, LinearBound, ScaleProgram, StatedLimit

NEAR, FAR = (0.05, 0.2), (0.7, 6.0)
"""Of the logarithm of the thresholds: how far below their best the points lie, in turn; further
only for an error that is not good enough."""
CORNERS, DESCENTS, BATCHES = 30, 100, 4
"""Corners of the box at each loss; mixtures of them that are descended from at a time, and how
often, unless one is good."""
LOOKED_AT = 20
"""Choices of a batch whose least error is computed: those that a descent leaves with the least."""
DRAWS = 4096
"""Numbers that one descent draws from."""
MIXED = 0.3
"""Parameter of the Dirichlet distribution of a mixture: most of it is a few corners."""
KEPT = 1e-6
"""Of a logarithm: a limit that is missed by no more is kept."""
ALIKE = 0.02
"""Of the logarithm of the thresholds: choices no further apart are as good."""
ROOM = 0.9
"""Of the limit of the rule ``offset-force``: what scales are chosen for. Parts are rounded,
and some are sized afterwards."""
TANGENTS, CUTS = 12, 3
"""Tangents of it at the best point, at most; and at corners of each range of thresholds."""
STEP = 1e-4
"""Of a logarithm: for the slope of a tangent."""
MOST_TRIED = 30
"""Choices, the best ones first, of which circuits are made."""
TRIED = 6
"""Choices that have no circuit, or one with a larger error than they have: no more circuits are
made after so many. One whose offsets are too large does not count."""
DECLINED = 12
"""Circuits as they are meant: no more are made after so many."""
GOAL, ENOUGH = 0.1, 0.5
"""Of the resistors' grade: an error up to the first is worth nothing more; one up to the second is
worth no lower thresholds."""
CLOSE = 1.05
"""Of a choice's error: that of its circuit, which has constants and nets that the program leaves
out."""


@dataclass(frozen=True)
class RoundedChoice:
    """A choice of scales and parts."""

    z: Array
    """The scales and free parts."""
    rounded: Array
    """(rows,) logarithms of the resistors that follow, as they are bought."""
    error: float
    """The least that the largest error can be made by the scales."""
    worth: float
    """``ScaleBox.worth`` of it."""
    kinds: int
    """Distinct values."""
    quiet: bool
    """Whether its offsets keep the rule ``offset-force``, or no scales do."""


@dataclass(frozen=True)
class ScaleAttempt:
    """An attempt with the scales that it was made at."""

    made: Attempt
    z: Array
    """The scales and free parts."""
    words: str
    """What is proved of the thresholds."""


@dataclass
class ScaleChoice:
    """The choice of scales and parts for one order, within limits."""

    order: Order
    """What is to be built, and from what."""
    within: ConditionLimits
    jobs: int = 1
    """Threads that descend; no choice depends on it."""
    candidates: list[RoundedChoice] = field(default_factory=list)
    """Choices that keep all limits which are known before the circuit is made."""
    _noisy: bool = False
    """Whether no scales were found that keep the rule ``offset-force``."""

    @cached_property
    def program(self) -> ScaleProgram:
        return ScaleProgram.of(self.order, self.within)

    @cached_property
    def box(self) -> ScaleBox:
        return ScaleBox(self.program)

    @property
    def goal(self) -> float:
        """The error that is aimed at."""
        return self._at_most(GOAL)

    def _at_most(self, share: float) -> float:
        """This share of the resistors' grade, or what the model file accepts, if that is less."""
        spec = self.order.spec
        return min(share * spec.resistor_grade, spec.max_error or np.inf)

    def conflicts(self) -> list[Conflict]:
        """The limits that leave no scales; none where there are some."""
        return self.box.conflicts()

    def circuits(self, before: Array | None = None) -> Iterator[ScaleAttempt | Shortfall]:
        """Circuits of the best choices, the best one first; what leaves none, where there is none.
        before : scales whose choice nearly kept the limits."""
        if self.box.best() is None:
            return iter([Shortfall("side conditions", True)])
        self._keep_offsets()
        if before is not None:
            self._descend([before] * 4, 0)
        for number, loss in enumerate((*NEAR, *FAR)):
            enough = self._at_most(GOAL if loss in NEAR else ENOUGH)
            if self._least <= enough:
                break
            corners = np.array(self._corners(loss, number))
            for batch in range(BATCHES):
                known = f", so far an error of {self._least:.2%}" if self.candidates else ""
                doing(f"scales and parts, range {number + 1}, part {batch + 1} of {BATCHES}{known}")
                random = np.random.default_rng((number, batch))
                shares = random.dirichlet(np.full(len(corners), MIXED), DESCENTS)
                self._descend(list(shares @ corners), 1 + number * BATCHES + batch)
                if self.candidates:
                    best_so_far(f"scales and parts with an error of {self._least:.2g}", step=True)
                if self._least <= self.goal:
                    break
        return self._circuits()

    def _keep_offsets(self) -> None:
        """Cut off the points of the box whose circuits fail the rule ``offset-force``, as far as
        that leaves any: near the best point, by tangents."""
        before = list(self.box.cuts)
        for _ in range(TANGENTS):
            z = self.box.best()
            if z is None:  # no scales keep the rule, which judges the finished circuit
                self.box.cuts, self._noisy = before, True
            if z is None or self._over(z[None])[0] <= 0.0:
                return
            doing("scales at which offsets matter less")
            self.box.cuts.append(self._offset_cut(z))

    def _corners(self, loss: float, seed: int) -> list[Array]:
        """Corners of the box; cut once more where offsets of the worst are too large."""
        corners = self.box.points(CORNERS, loss, seed=seed)
        logs = self._over(np.array(corners)).tolist()
        over = sorted(((log, k) for k, log in enumerate(logs)), reverse=True)
        worst = [corners[k] for log, k in over[:CUTS] if log > 0.0]
        if worst:
            before = list(self.box.cuts)
            self.box.cuts += [self._offset_cut(z) for z in worst]
            fewer = self.box.points(CORNERS, loss, seed=seed)
            if fewer:
                return fewer
            self.box.cuts = before
        return corners

    def _offset_cut(self, z: Array) -> LinearBound:
        """The tangent of the offsets at these scales."""
        rule = BY_ID["offset-force"]
        assert rule.limit is not None
        log, *beside = self._over(np.vstack([z, z + STEP * np.eye(len(z))])).tolist()
        slope = (np.array(beside) - log) / STEP
        limit = StatedLimit(rule.id, "offsets over the drive", rule.limit)
        return LinearBound(Affine(slope, log - float(slope @ z)), limit)

    def _over(self, z: Array) -> Array:
        """(k,) ``_over_limit`` at these scales (k, z), with what they are to leave beside the
        limit; parts that are sized afterwards have some value. -inf where no scales keep it."""
        program, circuit = self.program, self._unsized
        if self._noisy or not program.outputs:
            return np.full(len(z), -np.inf)
        values = program.values(z, program.follows(z)) | self._drive(z)
        nominal = nominal_board(circuit)
        own: dict[str, Any] = {name: values.get(name, v) for name, v in nominal.values.items()}
        gain: Any = np.full(len(z), nominal.inverse_gain)
        board = replace(nominal, values=own, inverse_gain=gain)
        return np.asarray(self._over_limit(circuit, program.volts(z), board) - np.log(ROOM))

    @cached_property
    def _unsized(self) -> Circuit:
        """The circuit with some value of each part."""
        return self.order.build(defaultdict(lambda: BASE))

    def _drive(self, z: Array) -> dict[str, Array]:
        """(k,) the drive's resistors at half of the generator's largest amplitude [ohm]."""
        order, program = self.order, self.program
        system, volts = order.model.second_order(), program.volts(z)
        out = {}
        for channel, (names, largest) in enumerate(zip(order.drives, order.largest, strict=True)):
            force = system.drive_force(system.own_frequency, channel)
            for name, mass in zip(names, np.flatnonzero(force).tolist(), strict=True):
                state = 2 * mass + 1
                rate = volts[:, state] * abs(force[mass]) / system.mass[mass] / np.exp(z[:, 0])
                amperes = rate * np.exp(z[:, program.shared[f"C{state + 1}"]])
                ohms = 0.5 * GENERATOR_PEAK / (largest * amperes)
                out[name] = np.clip(ohms, order.resistors[0], order.resistors[-1])
        return out

    def _over_limit(self, circuit: Circuit, volts: Array, board: Board | None = None) -> Array:
        """(...,) logarithm of the largest offsets as a force at a clearance over the limit of the
        rule: above 0 they are too large. board : as of ``forces``."""
        order, rule = self.order, BY_ID["offset-force"]
        assert rule.limit is not None
        limit = largest_offset(order.bounds)
        at = forces(circuit, order.model.second_order(), volts, order.drive_force, board)
        each = [np.hypot.reduce(list(offset_forces(shifts, limit).values())) for shifts in at]
        return np.asarray(np.log(np.max(each, axis=0) / rule.limit))

    def _circuits(self) -> Iterator[ScaleAttempt | Shortfall]:
        """Circuits of the best candidates, as they are ranked: up to ``DECLINED`` as meant, then up
        to ``TRIED`` whose error is not that of their candidate, then those whose offsets are too
        large."""
        why = Shortfall("coefficients", False)
        worse: list[tuple[bool, float, ScaleAttempt]] = []
        given = tried = 0
        best = self.box.best()
        for candidate in list(self._ranked())[:MOST_TRIED]:
            if tried == TRIED or given == DECLINED:
                break
            made = self.circuit_of(candidate)
            if isinstance(made, Shortfall):
                why, tried = made, tried + 1
                continue
            own = ScaleAttempt(made, candidate.z, self._words(candidate, best))
            noisy = bool(self._over_limit(made.circuit, made.errors.scales.volts) > 0.0)
            error = made.errors.max_error
            as_meant = error <= max(self.goal, CLOSE * candidate.error)
            if as_meant and not noisy:
                given += 1
                yield own
            else:
                tried += not noisy
                worse.append((noisy, 0.0 if as_meant else error, own))
        yield from (own for *_, own in sorted(worse, key=lambda each: each[:2]))
        if not (given or worse):
            yield why

    def _descend(self, starts: Sequence[Array], seed: int) -> None:
        """Choices near these points."""
        rounding = self._rounding()
        random = np.random.default_rng((seed, len(starts), 1))
        kept: list[Array] = []
        broken = []
        draws = [random.random(DRAWS) for _ in starts]

        def choice(own: tuple[Array, Array]) -> Array:
            return descend(rounding, *own)

        for z in parallel(choice, zip(starts, draws, strict=True), self.jobs):
            over = (rounding.limits @ z + rounding.limit_constants).max()
            sums = self.program.broken(z, KEPT)
            broken += [s.tangent(z) for s in sums]
            if over <= KEPT and not sums:
                kept.append(z)
        self.box.cuts += broken[: len(self.program.sums)]
        if not kept:
            return
        logs = np.array([rounding.rows @ z + rounding.constants for z in kept])
        rounded = self._rounded(logs)
        errors = _held(rounding, (rounded - logs).T).T
        largest = np.abs(errors).max(axis=1)
        best = np.argsort(largest, kind="stable")[:LOOKED_AT]
        quiet = self._over(np.array([kept[k] for k in best])) <= -np.log(ROOM)
        fit = self._fit(rounding)
        for k, is_quiet in zip(best, quiet, strict=True):
            error = float(largest[k])
            least = error if error <= self.goal else fit.largest(errors[k])
            self.candidates.append(self._candidate(kept[k], rounded[k], least, bool(is_quiet)))

    def _fit(self, rounding: Rounding) -> LargestFit:
        """At the scales that make the error of the coefficients least; constant forces are read at
        these."""
        scales = [k for k, values in enumerate(self.program.lists) if not len(values)]
        own = np.array([not row.constant for row in self.program.rows])
        return LargestFit(_held(rounding, -rounding.rows[:, scales]), own)

    @property
    def _least(self) -> float:
        ranked = sorted(self.candidates, key=lambda c: c.error)
        return next((c.error for c in ranked if c.quiet), np.inf)

    def _rounded(self, logs: Array) -> Array:
        """(k, rows) the values nearest to these logarithms (k, rows)."""
        columns = []
        for row, own in zip(self.program.rows, logs.T, strict=True):
            at = np.clip(np.searchsorted(row.values, own), 1, max(len(row.values) - 1, 1))
            low, high = row.values[at - 1], row.values[np.minimum(at, len(row.values) - 1)]
            columns.append(np.where(np.abs(low - own) <= np.abs(high - own), low, high))
        return np.column_stack(columns)

    def _candidate(self, z: Array, rounded: Array, error: float, quiet: bool) -> RoundedChoice:
        own = z[[k for k, values in enumerate(self.program.lists) if len(values)]]
        kinds = len(np.unique(np.round(np.concatenate([rounded, own]), 9)))
        return RoundedChoice(z, rounded, error, self.box.worth(z), kinds, quiet)

    def _ranked(self) -> Iterator[RoundedChoice]:
        """The candidates, the best one first."""
        good = [c for c in self.candidates if c.error <= self.goal and c.quiet]
        own = {id(c) for c in good}
        if good:
            top = max(c.worth for c in good)
            first = [c for c in good if c.worth >= top - ALIKE]
            yield from sorted(first, key=lambda c: (c.kinds, c.error))
            good = [c for c in good if c.worth < top - ALIKE]
            yield from sorted(good, key=lambda c: -c.worth)
        rest = [c for c in self.candidates if id(c) not in own]
        yield from sorted(rest, key=lambda c: c.error)

    def _rounding(self) -> Rounding:
        program, bounds = self.program, [*self.program.bounds, *self.box.cuts]
        return Rounding(
            rows=np.array([row.log.weights for row in program.rows]),
            constants=np.array([row.log.constant for row in program.rows]),
            sizes=np.array([row.size for row in program.rows]),
            held=np.array([float(row.held) for row in program.rows]),
            lead=program.lead,
            row_values=np.concatenate([row.values for row in program.rows]),
            row_first=np.cumsum([0, *(len(row.values) for row in program.rows)]),
            limits=np.array([b.log.weights for b in bounds]),
            limit_constants=np.array([b.log.constant for b in bounds]),
            values=np.concatenate(program.lists),
            first=np.cumsum([0, *(len(values) for values in program.lists)]),
        )

    def circuit_of(self, candidate: RoundedChoice) -> Attempt | Shortfall:
        """The circuit of a choice, with what is sized afterwards."""
        found = self.program.values(candidate.z, candidate.rounded)
        values = {name: float(value) for name, value in found.items()}
        targets = Targets.of(self.order.model)
        linear = self._linear(targets, values)
        within = self.within
        if self.program.lead < 0:  # nothing but the swing sets the amplitude
            top = max(log.at(candidate.z) for log in self.program.levels)
            within = replace(within, swing=float(np.exp(top)))
        if not self.order.stage.rectifies:
            return attempt(self.order, self.within, linear)
        own = {name: v for name, v in values.items() if name not in linear.values}
        stages = None
        if own:
            errors = candidate.error
            stages = DeadZone(
                values=own,
                errors={"stages": errors},
                threshold=float("nan"),
                bound=0.0,
                proved=False,
                proof="chosen with the linear block, at scales that keep the side conditions",
                solver="HiGHS for the scales, descents for the values",
            )
        return completed(self.order, within, linear, stages)

    def _linear(self, targets: Targets, values: dict[str, float]) -> LinearBlock:
        own = {name: values[name] for name in targets.parts}
        return LinearBlock(own, np.nan, np.nan, 0.0, False, "", "descents from points of the box")

    def _words(self, candidate: RoundedChoice, best: Array | None) -> str:
        """What is proved of the thresholds. best : ``ScaleBox.best``."""
        lows = self.program.thresholds
        if not lows or best is None:
            return ""
        low, high = (float(np.exp(min(log.at(z) for log in lows))) for z in (candidate.z, best))
        return (
            f"thresholds: the lowest is {low:.3g} V; the linear program of the scales, with the "
            f"limits of this search, allows {high:.3g} V"
        )


def _held(rounding: Rounding, errors: Array) -> Array:
    """(rows, k) errors of coefficients from those of resistors: thresholds and constant forces
    count beside the threshold that sets the amplitude."""
    first = errors[rounding.lead] if rounding.lead >= 0 else np.zeros(errors.shape[1])
    return np.asarray(rounding.sizes[:, None] * (errors - rounding.held[:, None] * first))
