"""Successions of windows: what a response goes over into as the parameter falls or rises."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from designer.bifurcations.windows import BranchWindow, WindowEnd

ADJACENT = 1e-9
"""Two windows that are nearer than this, over the parameter's value, follow upon one another."""


@dataclass(frozen=True)
class Cascade:
    """Windows that follow upon one another, each beginning where the one before ended."""

    steps: tuple[BranchWindow, ...]
    """The windows, in order; the last one's end is where the cascade stops."""
    down: bool
    """Whether it goes towards smaller values of the parameter."""

    @property
    def ends(self) -> tuple[WindowEnd, ...]:
        """Where each window ends."""
        return tuple(w.low if self.down else w.high for w in self.steps)

    def describe(self) -> str:
        """ "1-1-1 → period-doubling 1.34995 → 2-2-2 → …"."""
        words = []
        for w, end in zip(self.steps, self.ends, strict=True):
            name = w.response + ("" if w.symmetric or w.response[0] != "1" else " (AS)")
            words.append(f"{name} → {end.why} {end.value:.5f}")
        return " → ".join(words)

    def as_dict(self) -> dict[str, object]:
        """The cascade as plain data for JSON."""
        return {"down": self.down, "windows": [w.as_dict() for w in self.steps]}


def cascade(windows: Sequence[BranchWindow], first: BranchWindow, *, down: bool = True) -> Cascade:
    """The windows that follow upon one, on its own branch or on those that leave it.

    Where several begin at the same point the widest is taken.
    """
    steps = [first]
    while True:
        at = (steps[-1].low if down else steps[-1].high).value
        near = ADJACENT * abs(at)
        after = [
            w
            for w in windows
            if w not in steps and abs((w.high if down else w.low).value - at) <= near
        ]
        if not after:
            return Cascade(tuple(steps), down)
        steps.append(max(after, key=lambda w: w.width))
