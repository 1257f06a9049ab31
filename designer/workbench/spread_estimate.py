"""How boards differ, learnt from the boards that were fitted.

One record says little of one part, but many boards say how far parts of a kind lie from their
values. Each fit leaves a normal distribution of the board's coordinates. What the records alone add
to it is kept, the prior is widened or narrowed kind by kind, and the factors that make all records
most probable are found by expectation and maximisation (Dempster, Laird and Rubin, J. R. Stat. Soc.
B 39, 1977, section 4.5: variance components).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from designer.base.arrays import Array, Index
from designer.base.csv_tables import csv_text
from designer.base.errors import InputError
from designer.workbench.board_fit import BoardFit
from designer.workbench.board_prior import Prior

ROUNDS = 500
"""Rounds of expectation and maximisation at most."""
STEADY = 1e-4
"""Relative change of every factor below which they end."""
FEWEST = 4.0
"""Single numbers, as it were, that all records must have told of a kind before it is reported."""
KINDS = {
    "offset": "offsets",
    "low": "output limits",
    "high": "output limits",
    "bias": "bias currents",
    "reference": "references",
    "supply": "rails",
}
"""Of what a quantity that is no part's value is one, by its group."""
COLUMNS = ("part", "value", "tolerance", "board")


@dataclass(frozen=True)
class KindSpread:
    """How far one kind of quantity varies from board to board, over what the spread says."""

    kind: str
    """Such as "resistors" or "offsets"."""
    factor: float
    """Standard deviation on these boards over that of the spread that they were fitted with."""
    low: float
    """Lower end of its 95 % interval."""
    high: float
    """Upper end of its 95 % interval."""
    told: float
    """How many numbers of this kind the records told in all, a part of one each."""


def estimated_spread(fits: Sequence[BoardFit]) -> tuple[KindSpread, ...]:
    """The kinds of which the records of all these boards tell enough.

    fits : one of each board, all with the same prior.

    Raises
    ------
    InputError : no board.
    """
    if not fits:
        raise InputError(None, "--boards", "none", "one board at least")
    members = _members(fits[0].prior)
    precision, weighted = map(np.array, zip(*map(_known, fits), strict=True))
    square = np.ones(len(members))
    for _ in range(ROUNDS):
        before = square
        square, told = _improved(precision, weighted, members, square)
        if (np.abs(square - before) <= STEADY * before).all():
            break
    return tuple(
        _interval(kind, float(square[i]), float(told[i]))
        for i, kind in enumerate(members)
        if told[i] >= FEWEST
    )


def _members(prior: Prior) -> dict[str, Index]:
    """Coordinates of each kind: by what a coordinate moves most, in shares of its spread."""
    sigma = np.array([quantity.sigma for quantity in prior.quantities])
    most = np.argmax(np.abs(prior.slopes) / sigma[:, None], axis=0)
    kinds: dict[str, list[int]] = {}
    for coordinate, q in enumerate(most):
        quantity = prior.quantities[q]
        passive = {"R": "resistors", "C": "capacitors"}.get(quantity.part[0], "parts")
        kinds.setdefault(KINDS.get(quantity.group, passive), []).append(coordinate)
    return {kind: np.array(own) for kind, own in kinds.items()}


def _known(fit: BoardFit) -> tuple[Array, Array]:
    """(K, K) and (K,) precision of what the records alone say, and that times its mean."""
    whole = np.linalg.inv(fit.covariance)
    return np.asarray(whole - np.eye(len(whole))), np.asarray(whole @ fit.centre)


def _improved(
    precision: Array, weighted: Array, members: Mapping[str, Index], square: Array
) -> tuple[Array, Array]:
    """(kinds,) variances that are more probable, and how many numbers of each kind were told.

    precision (N, K, K), weighted (N, K) : what the records of N boards say, see ``_known``.
    """
    prior = np.empty(weighted.shape[1])
    for own, value in zip(members.values(), square, strict=True):
        prior[own] = value
    covariance = np.linalg.inv(precision + np.diag(1.0 / prior))
    left = np.diagonal(covariance, axis1=1, axis2=2)
    second = ((covariance @ weighted[..., None])[..., 0] ** 2 + left).mean(axis=0)
    told = (1.0 - left / prior).sum(axis=0)
    new = [max(float(second[own].mean()), 1e-12) for own in members.values()]
    return np.array(new), np.array([told[own].sum() for own in members.values()])


def _interval(kind: str, square: float, told: float) -> KindSpread:
    """The interval with as many degrees of freedom as numbers were told."""
    low, high = (told / chi2.ppf(p, told) for p in (0.975, 0.025))
    factor = float(np.sqrt(square))
    return KindSpread(kind, factor, factor * float(np.sqrt(low)), factor * float(np.sqrt(high)),
                      told)  # fmt: skip


def measured_list(fits: Mapping[str, BoardFit], draws: int = 1) -> str:
    """The fitted boards as a list of measured values, which ``designer tolerance --measured``
    takes (docs/spread.md).

    fits : by name of the board. draws : boards written for each: with one the most probable one,
    which is nearer to the nominal board than the real one wherever the records are silent; with
    more the boards "NAME 1", "NAME 2", …, as probable as the records leave them.

    Raises
    ------
    InputError : fewer than one draw.
    """
    if draws < 1:
        raise InputError(None, "draws", draws, "1 or more")
    rows = []
    for name, fit in fits.items():
        z = fit.samples(draws + 1, 0)
        z = z[:1] if draws == 1 else z[1:]
        for number, board in enumerate(_values(fit.prior, z), start=1):
            label = name if draws == 1 else f"{name} {number}"
            rows += [
                {"part": q.name, "value": repr(float(value)), "tolerance": "", "board": label}
                for q, value in zip(fit.prior.quantities, board, strict=True)
            ]
    return csv_text(COLUMNS, rows)


def _values(prior: Prior, z: Array) -> Array:
    """(N, quantities) of boards at z (N, K)."""
    return prior.middle_values + z @ prior.slopes.T
