"""Lost boards of parts as good as they are, led there from lost boards of worse parts.

Subset simulation (S.-K. Au, J. L. Beck, Probab. Eng. Mech. 16, 2001) over the width of the parts'
laws: the width goes back in steps of which some boards stay lost, these are copied, and the copies
walk at random among lost boards (conditional sampling: I. Papaioannou et al., Probab. Eng. Mech.
41, 2015). Each kind of loss walks alone: the commonest of bad parts need not be that of good ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr, ndtri

from designer.base.arrays import Array, Mask

BOARDS = 48
"""Boards of a walk."""
MOVES = 2
"""Moves of each board at a width."""
LAST_MOVES, KEPT = 120, 20
"""Moves at the last width, and between two of which the boards are kept."""
MINOR = 0.01
"""Share of the commonest kind's losses below which a walk is kept after ``KEPT`` last moves: what
it finds adds next to nothing."""
FEWEST_APART, MOST_APART = 0.08, 0.5
"""Independent boards for each that is kept, at least and at most: copies have much in common."""
CHI = 0.455
"""Median of the square of a standard normal number."""
NARROWED = 0.8
"""The next width over that before, at first."""
STAY, FEW_STAY = 0.5, 0.08
"""Shares of boards that stay lost: above the first the next step is longer, below the second a
shorter one is tried."""
SHORTER = 0.5
"""Power of the step that is tried instead."""
TRIES = 4
"""Steps of which too few boards stay lost, one after the other, at which a walk takes every kind of
loss, and then ends."""
SHORTEST, LONGEST = 0.97, 0.6
"""Steps of the width."""
REACH = 0.4
"""Of a move at first: its new part, over the whole."""
ACCEPTED = 0.35
"""Share of moves that stay lost, which the reach is led to."""
EDGE = 1e-12
"""Least distance of a coordinate from the ends of its range: a normal number there is finite."""

Shown = Callable[[Array, Array], Sequence[str]]
"""What boards (N, coordinates), off by (N,) times as much as they may, show where they are lost;
"" where they are not."""


@dataclass
class LossWalk:
    """Boards that lose a response in one way."""

    kind: str
    """What they show."""
    met: float
    """Width at which the first of them were met."""
    width: float
    """Width at which these boards are lost."""
    normal: Array
    """(N, coordinates) the boards, as normal numbers."""
    share: float
    """Share of all boards of that width that are lost so, as far as its steps say."""
    step: float = NARROWED
    reach: float = REACH
    tries: int = 0
    """Steps, one after the other, of which too few stayed."""
    any_loss: bool = False
    """Whether every lost board is one of it: those of its kind alone came no further."""
    kept: list[Array] = field(default_factory=list)
    """(N, coordinates) boards of width 1, after some moves each."""

    @classmethod
    def of(cls, kind: str, width: float, points: Array, share: float) -> LossWalk:
        """From lost boards (N, coordinates) of one width, each as often as another, which are so
        large a share of all."""
        each = np.arange(BOARDS) % len(points)
        return cls(kind, width, width, ndtri(np.clip(points, EDGE, 1.0 - EDGE))[each], share)

    @property
    def going(self) -> bool:
        """Whether it is not there yet and has not ended on its way."""
        return self.width > 1.0 and self.tries < TRIES

    @property
    def points(self) -> Array:
        """(N, coordinates) in the cube."""
        return np.clip(ndtr(self.normal), 0.0, np.nextafter(1.0, 0.0))

    @property
    def next_width(self) -> float:
        return max(1.0, self.width * self.step)

    def takes(self, shown: str) -> bool:
        """Whether a board that shows this, "" where it is fine, is one of the walk's."""
        return shown == self.kind or (self.any_loss and shown != "")

    def narrow(self, stay: Mask) -> None:
        """Go to the next width with the boards that stay lost there; (N,) which do."""
        if stay.mean() < FEW_STAY:
            self.tries += 1
            self.step = min(self.step**SHORTER, SHORTEST)
            if self.tries == TRIES and not self.any_loss:
                self.any_loss, self.tries, self.step = True, 0, NARROWED
            return
        self.width, self.tries = self.next_width, 0
        self.share *= float(stay.mean())
        if stay.mean() > STAY:
            self.step = max(self.step**1.5, LONGEST)
        kept = self.normal[stay]
        self.normal = kept[np.arange(BOARDS) % len(kept)]


def walk(
    walks: Sequence[LossWalk],
    shown: Shown,
    rng: np.random.Generator,
    moves: int = LAST_MOVES,
    commonest: float = 0.0,
) -> tuple[Array, ...]:
    """Lead all walks to the width 1, as far as they come. moves : of each board at that width;
    fewer of a walk whose share is minor beside another's, or beside that of the ``commonest`` loss
    that is known.

    Returns for each walk (N, coordinates) lost boards of width 1, spread as lost boards of its kind
    are; none where it ended on its way. Boards that are near each other in it are not independent.
    """
    while going := [w for w in walks if w.going]:
        shows = _asked(going, [w.points for w in going], shown, [w.next_width for w in going])
        for each, mine in zip(going, shows, strict=True):
            each.narrow(mine)
        for _ in range(MOVES):
            _moved(going, shown, rng)
    there = [w for w in walks if w.width == 1.0]
    telling = MINOR * max([commonest, *(w.share for w in there)])
    for move in range(moves):
        if move == KEPT:
            there = [w for w in there if w.share >= telling]
        if not there:
            break
        _moved(there, shown, rng)
        if (move + 1) % KEPT == 0:
            for each in there:
                each.kept.append(each.points)
    return tuple(np.concatenate([w.normal[:0], *w.kept]) for w in walks)


def independent(points: Array) -> float:
    """Effective number of these boards (N, coordinates), of which many are copies that have moved.

    Most coordinates have nothing to do with a loss: their means, as normal numbers, are as far from
    0 as so many independent boards have them.
    """
    means = ndtri(np.clip(points, EDGE, 1.0 - EDGE)).mean(axis=0)
    apart = CHI / max(float(np.median(means**2)), EDGE)
    return float(np.clip(apart, FEWEST_APART * len(points), MOST_APART * len(points)))


def _asked(
    walks: Sequence[LossWalk], points: Sequence[Array], shown: Shown, widths: Sequence[float]
) -> list[Mask]:
    """Which of each walk's boards (N, coordinates) show its kind of loss, all asked at once."""
    shows = iter(shown(np.concatenate(points), np.repeat(widths, [len(p) for p in points])))
    return [
        np.array([each.takes(next(shows)) for _ in mine], dtype=bool)
        for each, mine in zip(walks, points, strict=True)
    ]


def _moved(walks: Sequence[LossWalk], shown: Shown, rng: np.random.Generator) -> None:
    """Each board of each walk moved once, where that leaves it lost: a move keeps the law of the
    parts, so that what is accepted has the law of lost boards."""
    old = [w.normal for w in walks]
    for each in walks:
        rest, new = np.sqrt(1.0 - each.reach**2), rng.standard_normal(each.normal.shape)
        each.normal = rest * each.normal + each.reach * new
    stay = _asked(walks, [w.points for w in walks], shown, [w.width for w in walks])
    for each, before, lost in zip(walks, old, stay, strict=True):
        each.normal = np.where(lost[:, None], each.normal, before)
        each.reach = float(np.clip(each.reach * np.exp(lost.mean() - ACCEPTED), 0.05, 0.95))
