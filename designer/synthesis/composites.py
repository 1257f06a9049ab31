"""Resistors of two parts in series or parallel, where one part of the series is not near enough.

Near the best single parts every coefficient error is linear in the logarithms of the resistors
(exactly so for products and ratios of values). Tables of the pairs near each resistor's value,
all scales free, go into a mixed-integer program: least error, and what is at most ``EXACT`` counts
as none; then fewest composites; then fewest new values. The circuit is rebuilt with the pairs and
its error computed afresh by the reduction. The search is local, so it proves nothing: only an
error that counts as none is known to be the least.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from designer.base.arrays import Array
from designer.base.progress import doing
from designer.circuit.coefficients import EXACT, CoefficientErrors
from designer.circuit.netlist import Circuit
from designer.circuit.resistors import Composite
from designer.linear_network.milp import NODES, SOLVER
from designer.synthesis.attempt import Attempt, Order
from designer.synthesis.part_checks import matching_resistors

if TYPE_CHECKING:
    import cvxpy as cp

REACH = 3.0
"""Half width, in ln, of the tables of pairs at least, in units of the error to be cured."""
MOST_PAIRS = 48
"""Pairs in each table."""
ROUNDING = 1e-12
"""Of a logarithm: pairs as near as this to one part are no composites."""
FEW = (1, 2, 3)
"""Numbers of composites that are tried before any number is allowed."""
STEP = 1e-3
"""Of a resistor's logarithm, for the slopes of the errors."""


@dataclass(frozen=True)
class Pair:
    """Two parts that make one resistor."""

    kind: Composite
    """How they are joined."""
    a: float
    """The larger resistance [ohm]."""
    b: float
    """The smaller resistance [ohm]."""

    @property
    def value(self) -> float:
        if self.kind == "series":
            return self.a + self.b
        return self.a * self.b / (self.a + self.b)


@dataclass(frozen=True)
class PairProgram:
    """errors (m,) = h + D scales + the sum over resistors of what their pairs change."""

    h: Array
    """(m,) constant term of the errors."""
    D: Array
    """(m, scales) change of the errors with each scale."""
    tables: Mapping[str, tuple[Pair, ...]]
    """Pairs that each resistor may become, by name."""
    changes: Mapping[str, Array]
    """(m, pairs) by resistor, what each of its pairs does to the errors."""
    curved: frozenset[str]
    """Resistors whose effect is no product of powers (a loaded divider): at most one of them may
    change, or the sum would not hold."""


def improve(order: Order, made: Attempt) -> Attempt | None:
    """The attempt with composites; None where none lowers the error."""
    if made.errors.max_error <= EXACT:
        return None
    asked = order.spec.composites
    known = matching_resistors(made.circuit)
    names = known if asked is True else [n for n in known if n in (asked or ())]
    tied = {name for group in order.spec.matched for name in group}
    # Of the states' peaks the largest [V] sets the amplitude of a circuit without stops.
    swing = float((made.errors.scales.volts * order.peaks.states).max())

    def errors_of(circuit: Circuit) -> CoefficientErrors:
        return order.errors(circuit, swing)

    singles = [name for name in names if name not in tied]
    program = _program(order, made, singles, lambda c: _without_scales(errors_of(c))[0])
    chosen = best(program, frozenset(made.circuit.values.values()) | set(order.spec.preferred))
    if not chosen:
        return None
    values = {name: v for name, v in made.values.items() if name not in chosen}
    for name, pair in chosen.items():
        values |= {f"{name}A": pair.a, f"{name}B": pair.b}
    kinds: dict[str, Composite] = {name: pair.kind for name, pair in chosen.items()}
    circuit = order.build(values, kinds)
    errors = errors_of(circuit)
    if errors.max_error >= made.errors.max_error - EXACT:
        return None
    return replace(made, values=values, circuit=circuit, errors=errors)


def _program(
    order: Order, made: Attempt, names: Sequence[str], error_of: Callable[[Circuit], Array]
) -> PairProgram:
    """The errors near this attempt as functions of these resistors."""
    h, D = _without_scales(made.errors)
    half = REACH * made.errors.max_error

    def change(name: str, by: float) -> Array:
        moved = made.values | {name: made.values[name] * float(np.exp(by))}
        return error_of(order.build(moved)) - h

    tables, changes, curved = {}, {}, set()
    for number, name in enumerate(names, start=1):
        doing(f"composites, pairs for {name} ({number} of {len(names)})")
        table = pairs_near(order.resistors, made.values[name], half)
        if not table:
            continue
        logs = np.log([pair.value / made.values[name] for pair in table])
        far = float(logs[np.argmax(np.abs(logs))])
        slope = change(name, STEP) / STEP
        effect = np.outer(slope, logs)
        if np.abs(change(name, far) - slope * far).max() > EXACT / 10.0:
            curved.add(name)
            effect = np.stack([change(name, float(by)) for by in logs], axis=1)
        tables[name], changes[name] = table, effect
    return PairProgram(h, D, tables, changes, frozenset(curved))


def pairs_near(resistors: Array, wanted: float, half: float) -> tuple[Pair, ...]:
    """Pairs near a resistor's value, without those that equal it, in the order of their value.

    Those within ``half`` of ln wanted, or the nearest ``MOST_PAIRS`` where fewer are; of more, as
    many that cover the window evenly.
    """
    i, j = np.triu_indices(len(resistors))
    a, b = resistors[j], resistors[i]
    off = np.log(np.concatenate([a + b, a * b / (a + b)]) / wanted)
    nearest = np.argsort(np.abs(off), kind="stable")
    nearest = nearest[np.abs(off[nearest]) > ROUNDING]
    nearest = nearest[: max(MOST_PAIRS, int((np.abs(off) <= half).sum()))]
    ordered = nearest[np.argsort(off[nearest], kind="stable")]
    if len(ordered) > MOST_PAIRS:
        ordered = ordered[np.linspace(0, len(ordered) - 1, MOST_PAIRS).round().astype(int)]
    kinds: tuple[Composite, ...] = ("series", "parallel")
    n = len(a)
    return tuple(Pair(kinds[k // n], float(a[k % n]), float(b[k % n])) for k in ordered)


def _without_scales(errors: CoefficientErrors) -> tuple[Array, Array]:
    """The errors (m,) with all scales taken out, and how they depend on the scales (m, n)."""
    volts = errors.scales.volts
    logs = np.log(np.concatenate([[errors.scales.seconds], volts]))
    D = errors.slopes
    h = np.array(list(errors.errors.values())) - D @ logs
    return h, D[:, [0, *range(2, len(logs))]]


def best(program: PairProgram, used: frozenset[float]) -> dict[str, Pair]:
    """The composites of least error, of those the fewest, of those with the fewest new values.

    used : values that cost nothing in the last stage.
    """
    if not program.tables:
        return {}
    model = _Model(program, used)
    most = len(program.tables)
    reached: tuple[float, dict[str, Pair]] = (float("inf"), {})
    for few in [*(n for n in FEW if n < most), most]:
        doing(f"composites, at most {few} of {most}")
        least = model.least_error(few)
        if least is not None and least[0] < reached[0] - EXACT:
            reached = least
        if reached[0] <= EXACT:
            break
    else:
        fewer = model.fewest(reached[0])
        reached = reached if fewer is None else (reached[0], fewer)
    doing("composites, fewest values")
    return model.fewest_values(*reached)


class _Model:
    """The program in cvxpy; each stage adds its own limits to the same variables."""

    def __init__(self, program: PairProgram, used: frozenset[float]) -> None:
        import cvxpy as cp  # takes a second

        self.program = program
        tables = program.tables
        self.z = {n: cp.Variable(len(table), boolean=True) for n, table in tables.items()}
        # Bounded, since an infinite bound times a zero coefficient warns inside cvxpy.
        shifts = cp.Variable(program.D.shape[1], bounds=[-1.0, 1.0])
        start = np.linalg.lstsq(program.D, -program.h, rcond=None)[0]
        # Below what counts as none there is nothing to gain, so the search may end there.
        self.error = cp.Variable(bounds=[EXACT / 2.0, 10.0])
        errors = program.h + program.D @ start + program.D @ shifts
        for n, z in self.z.items():
            errors = errors + program.changes[n] @ z
        self.rules: list[cp.Constraint] = [
            errors <= self.error,
            -errors <= self.error,
            *(cp.sum(z) <= 1 for z in self.z.values()),
        ]
        if len(program.curved) > 1:
            self.rules.append(cp.sum([cp.sum(self.z[n]) for n in sorted(program.curved)]) <= 1)
        self.count = cp.sum([cp.sum(z) for z in self.z.values()])
        pairs = [pair for table in tables.values() for pair in table]
        values = sorted({v for pair in pairs for v in (pair.a, pair.b)} - used)
        self.new = cp.Variable(max(len(values), 1), nonneg=True)
        self.kinds: list[cp.Constraint] = []
        for n, z in self.z.items():
            has = [[float(v in (pair.a, pair.b)) for pair in tables[n]] for v in values]
            if values:
                self.kinds.append(np.array(has) @ z <= self.new)

    def least_error(self, most: int) -> tuple[float, dict[str, Pair]] | None:
        """The least error that so many composites reach, and which do."""
        if not self._solve(self.error, [self.count <= most]):
            return None
        return float(self.error.value), self._chosen()

    def fewest(self, error: float) -> dict[str, Pair] | None:
        """As few composites as reach this error, to what counts as none."""
        return self._chosen() if self._solve(self.count, [self.error <= error + EXACT]) else None

    def fewest_values(self, error: float, known: dict[str, Pair]) -> dict[str, Pair]:
        """The same composites of other pairs that reach this error, with the fewest new values."""
        import cvxpy as cp  # takes a second

        others = [cp.sum(z) == 0 for n, z in self.z.items() if n not in known]
        limits = [self.error <= max(error, EXACT), *others, *self.kinds]
        return self._chosen() if self._solve(cp.sum(self.new), limits) else known

    def _chosen(self) -> dict[str, Pair]:
        rows = {n: z.value for n, z in self.z.items() if z.value is not None}
        return {
            n: self.program.tables[n][int(np.argmax(x))] for n, x in rows.items() if x.max() > 0.5
        }

    def _solve(self, aim: cp.Expression, limits: Sequence[cp.Constraint]) -> bool:
        """Whether there is an answer; at the limit of nodes it is the best so far, or none."""
        import cvxpy as cp  # takes a second

        problem = cp.Problem(cp.Minimize(aim), [*self.rules, *limits])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of an answer at the limit of nodes
            problem.solve(solver=cp.HIGHS, **SOLVER, mip_max_nodes=NODES)
        if problem.status not in (cp.OPTIMAL, cp.USER_LIMIT):
            return False
        # Without an incumbent HiGHS leaves nothing, or variables that are no choice.
        values = [z.value for z in self.z.values()]
        return all(x is not None and np.abs(x - x.round()).max() < 1e-6 for x in values)
