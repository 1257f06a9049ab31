"""Sizing the saturating dead zone (Fig. 5, Eq. (17)-(20)) for the op-amp's output limit.

    fv = -R210 (v11/R208 + v12/R209),  v12 = -A_ v1,  v11 = beta · clip(A+ v1, ± Esat)
    A+ = R201 R203/(R200 R202),  A_ = R207/R206,  beta = (R205 || R208)/(R204 + R205 || R208)

With R208 = R209 the dead zone is flat when beta A+ = A_ (the divider's load counted), the
threshold is Esat/A+, and the slope in contact is A_ R210/R209. Two errors count: the slope against
the model's stop, and the null, weighted by mu. Again tables reduced by inequalities (rows whose
error is inside a level), then a small program in cvxpy: least error, then fewest distinct values.
"""

from __future__ import annotations

from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from designer.selection import SOLVER
from designer.system import Array

THRESHOLD_ROOM = (1.06, 1.2)
"""How far below the largest possible threshold the sized one may lie: a narrow range first."""
FEW = 120
"""Values of a list that is short enough to leave one more resistor free."""
GROUPS, ROWS = 40, 15
"""Gains A_, and rows of each table for each gain, that go into the program."""
SLOPES = 24_000
"""Rows of the slope's table that are looked at further."""


@dataclass(frozen=True)
class DeadZoneTarget:
    """What the stage has to do.

    mu : stop stiffness over K1. slope : wanted (fv slope)/R50 [1/ohm]. saturation [V].
    threshold : largest v1 at the stop that keeps every state inside its swing [V].
    linear_gain : largest A_ that keeps U3A linear; output_gain : largest fv slope that keeps U3D
    linear. load : least resistance that an output may drive [ohm].
    """

    mu: float
    slope: float
    saturation: float
    threshold: float
    linear_gain: float
    output_gain: float
    load: float


@dataclass(frozen=True)
class DeadZone:
    """Values of R50 and R200 … R210, their predicted errors, and whether the search was whole."""

    values: dict[str, float]
    slope_error: float
    null_error: float
    solver: str


def size(
    target: DeadZoneTarget, resistors: Array, base: float, used: frozenset[float]
) -> DeadZone | str:
    """The stage for this target, or the name of the condition that leaves none.

    resistors : values that may be used [ohm], ascending. base : the value of every resistor that
    only sets a level (inputs of the gain stages, R208, R209). used : values that the rest of the
    circuit has already; they cost nothing in the second stage.
    """
    heavy = resistors[resistors >= target.load]
    slopes = _slope_rows(target, resistors, heavy, base)
    if len(slopes) == 0:
        return "stop slope"
    gains = np.unique(slopes[:, 4])
    inputs = np.array([base])
    nulls = np.zeros((0, 8))
    for room in THRESHOLD_ROOM:
        if len(nulls) == 0 or nulls[:, 6].min() > 1e-9:
            nulls = _null_rows(target, resistors, heavy, inputs, base, gains, room)
    if len(heavy) <= FEW and (len(nulls) == 0 or nulls[:, 6].min() > 1e-9):
        # A coarse series reaches the null better with a free input resistor.
        inputs = heavy[(heavy >= base) & (heavy < 10.0 * base)]
        nulls = _null_rows(target, resistors, heavy, inputs, base, gains, THRESHOLD_ROOM[-1])
    if len(nulls) == 0:
        return "dead-zone null"
    slopes, nulls, common = _best_groups(slopes, nulls)
    i, j, word = _choose(slopes, nulls, common, used, base)
    r206, r207, r210, r50 = slopes[i, :4]
    r200, r201, r203, r204, r205 = nulls[j, [7, 0, 1, 2, 3]]
    values = {
        "R50": r50, "R200": r200, "R201": r201, "R202": base, "R203": r203, "R204": r204,
        "R205": r205, "R206": r206, "R207": r207, "R208": base, "R209": base, "R210": r210,
    }  # fmt: skip
    return DeadZone(
        values={k: float(v) for k, v in values.items()},
        slope_error=float(slopes[i, 5]),
        null_error=float(nulls[j, 6]),
        solver=word,
    )


def _slope_rows(target: DeadZoneTarget, resistors: Array, heavy: Array, base: float) -> Array:
    """Columns R206, R207, R210, R50, ln A_, |slope error|: the nearest R50 for each choice."""
    wide = heavy[(heavy >= base / 5) & (heavy <= base * 20)]
    r206, r207 = (a.ravel() for a in np.meshgrid(wide[(wide >= base) & (wide < 10 * base)], wide))
    gain = r207 / r206
    fine = (gain <= target.linear_gain) & (gain >= target.linear_gain / 1.6)
    r206, r207, gain = r206[fine], r207[fine], gain[fine]
    feedback = resistors[(resistors >= target.load) & (resistors <= 100 * base)]
    i, j = (a.ravel() for a in np.meshgrid(np.arange(len(gain)), np.arange(len(feedback))))
    total = gain[i] * feedback[j] / base
    wanted = np.log(total / target.slope)
    # R50 has to be on the list; of what is left, the larger slopes: they need less noise gain.
    fine = (total <= target.output_gain) & (wanted <= np.log(heavy[-1]) + 0.05)
    fine &= wanted >= np.log(heavy[0]) - 0.05
    if not fine.any():
        return np.zeros((0, 6))
    fine &= total >= total[fine].max() / 2.5
    i, j, total, wanted = i[fine], j[fine], total[fine], wanted[fine]
    r50, error = _nearest(np.log(heavy), wanted)
    rows = np.stack([r206[i], r207[i], feedback[j], heavy[r50], np.log(gain[i]), error], axis=1)
    rows = rows[error < 0.05]
    return rows[np.argsort(rows[:, 5], kind="stable")][:SLOPES]


def _null_rows(
    target: DeadZoneTarget,
    resistors: Array,
    heavy: Array,
    inputs: Array,
    base: float,
    gains: Array,
    room: float,
) -> Array:
    """Columns R201, R203, R204, R205, ln A+, ln A_, mu |ln(beta A+/A_)|, R200 of ``inputs``."""
    wide = heavy[(heavy >= base) & (heavy <= 100 * base)]
    r200, r201, r203 = (a.ravel() for a in np.meshgrid(inputs, wide, wide))
    steep = r201 * r203 / (r200 * base)
    least = target.saturation / target.threshold
    # U3B must still be linear where U3C reaches its limit.
    fine = (steep >= least) & (steep <= room * least) & (r203 / base >= 1.15)
    r200, r201, r203, steep = r200[fine], r201[fine], r203[fine], np.log(steep[fine])
    # R204 alone carries the output's current; R205 may be as small as the list goes.
    top = heavy[heavy <= 100 * base]
    r204, r205 = (a.ravel() for a in np.meshgrid(top, resistors[resistors <= 20 * base]))
    loaded = r205 * base / (r205 + base)
    beta = np.log(loaded / (r204 + loaded))
    order = np.argsort(beta, kind="stable")
    r204, r205, beta = r204[order], r205[order], beta[order]
    if len(steep) == 0 or len(beta) == 0:
        return np.zeros((0, 8))
    out = []
    for gain in gains:
        index, error = _nearest(beta, gain - steep)
        keep = np.argsort(error, kind="stable")[:20]
        keep = keep[error[keep] < 0.05]
        k = index[keep]
        same = np.full(len(keep), gain)
        out.append(
            np.stack(
                [
                    r201[keep],
                    r203[keep],
                    r204[k],
                    r205[k],
                    steep[keep],
                    same,
                    target.mu * error[keep],
                    r200[keep],
                ],
                axis=1,
            )
        )
    return np.concatenate(out)


def _nearest(table: Array, wanted: Array) -> tuple[Array, Array]:
    """Index of the nearest entry of a sorted table, and the distance, for each wanted value."""
    right = np.clip(np.searchsorted(table, wanted), 1, len(table) - 1)
    left = right - 1
    index = np.where(np.abs(table[left] - wanted) <= np.abs(table[right] - wanted), left, right)
    return index, np.abs(table[index] - wanted)


def _best_groups(slopes: Array, nulls: Array) -> tuple[Array, Array, Array]:
    """Rows of the gains A_ that both tables have and whose larger least error is smallest.

    At most ``GROUPS`` gains with ``ROWS`` rows each: what the program holds.
    """
    key1, key2 = np.round(slopes[:, 4], 12), np.round(nulls[:, 5], 12)
    common = np.intersect1d(key1, key2)
    least1, least2 = (np.full(len(common), np.inf) for _ in range(2))
    for least, key, error in ((least1, key1, slopes[:, 5]), (least2, key2, nulls[:, 6])):
        known = np.isin(key, common)
        np.minimum.at(least, np.searchsorted(common, key[known]), error[known])
    chosen = np.sort(common[np.argsort(np.maximum(least1, least2), kind="stable")[:GROUPS]])
    out = []
    for rows, key, error in ((slopes, key1, slopes[:, 5]), (nulls, key2, nulls[:, 6])):
        keep = []
        for gain in chosen:
            own = np.flatnonzero(key == gain)
            keep.append(own[np.argsort(error[own], kind="stable")[:ROWS]])
        out.append(rows[np.concatenate(keep)])
    return out[0], out[1], chosen


def _choose(
    slopes: Array, nulls: Array, common: Array, used: frozenset[float], base: float
) -> tuple[int, int, str]:
    """One row of each table with the same A_: least error, then fewest new values."""
    z1, z2 = cp.Variable(len(slopes), boolean=True), cp.Variable(len(nulls), boolean=True)
    error = cp.Variable(nonneg=True)
    g1, g2 = np.round(slopes[:, 4], 12), np.round(nulls[:, 5], 12)
    m1 = (g1[None, :] == common[:, None]).astype(float)
    m2 = (g2[None, :] == common[:, None]).astype(float)
    rules = [
        cp.sum(z1) == 1,
        cp.sum(z2) == 1,
        m1 @ z1 == m2 @ z2,
        cp.sum(m1 @ z1) == 1,
        z1 @ slopes[:, 5] <= error,
        z2 @ nulls[:, 6] <= error,
    ]
    # Both errors count, so the program's objective is their largest, then their sum.
    total = z1 @ slopes[:, 5] + z2 @ nulls[:, 6]
    problem = cp.Problem(cp.Minimize(error + 1e-3 * total), rules)
    problem.solve(solver=cp.HIGHS, **SOLVER)
    if z1.value is None or z2.value is None:
        raise ArithmeticError(f"HiGHS: {problem.status}")
    best = int(np.argmax(z1.value)), int(np.argmax(z2.value))
    reached = max(slopes[best[0], 5], nulls[best[1], 6])
    values = np.unique(np.concatenate([slopes[:, :4].ravel(), nulls[:, [0, 1, 2, 3, 7]].ravel()]))
    values = values[~np.isin(values, [*used, base])]
    kinds = cp.Variable(len(values), nonneg=True)
    uses = []
    for z, columns in ((z1, slopes[:, :4]), (z2, nulls[:, [0, 1, 2, 3, 7]])):
        for column in columns.T:
            member = (column[None, :] == values[:, None]).astype(float)
            uses.append(member @ z <= kinds)
    stage = cp.Problem(cp.Minimize(cp.sum(kinds)), [*rules, *uses, error <= reached + 1e-9])
    stage.solve(solver=cp.HIGHS, **SOLVER)
    if z1.value is not None and abs(z1.value.max() - 1) < 1e-6 and abs(z2.value.max() - 1) < 1e-6:
        best = int(np.argmax(z1.value)), int(np.argmax(z2.value))
    return (*best, f"HiGHS: {problem.status}")
