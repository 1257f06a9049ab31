"""How to start a board so that it ends on the wanted response: where to switch on, how to sweep.

Several attractors coexist at one setting, so the generator's phase at power-up may decide; a sweep
from where only one exists does not leave it to chance. ``designer.recipe_search`` finds recipes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from designer.deck import Excitation
from designer.exact import drive_of
from designer.quantity import format_quantity
from designer.system import Drive


class Way(StrEnum):
    """Kinds of recipe, the simplest first."""

    DIRECT = "direct"
    FROM_ABOVE = "sweep down"
    FROM_BELOW = "sweep up"
    AMPLITUDE = "amplitude up"
    FROM_FAR = "long sweep down"


@dataclass(frozen=True)
class Recipe:
    """Switch on at ``first``, go to ``target`` in steps of equal ratio, wait.

    steps : of the sweep, ``hold`` drive periods each, the one at ``first`` included; 0 without
    one. wait : drive periods at the target. omega : dimensionless frequency of the target.
    reached, trials : on the nominal circuit; board_reached, board_trials : on sample boards that
    show the response as built.
    """

    way: Way
    omega: float | None
    target: Excitation
    first: Excitation
    steps: int
    hold: int
    wait: int
    reached: int = 0
    trials: int = 0
    board_reached: int = 0
    board_trials: int = 0

    def stages(self) -> Iterator[tuple[Excitation, int]]:
        """Settings of the generator in order, each with its whole drive periods."""
        for k in range(self.steps):
            part = k / self.steps
            yield (
                Excitation(
                    _between(self.first.frequency, self.target.frequency, part),
                    _between(self.first.amplitude, self.target.amplitude, part),
                    self.target.offset,
                ),
                self.hold,
            )
        yield self.target, self.wait

    @property
    def drives(self) -> list[tuple[Drive, int]]:
        """The stages as the exact circuit sees them."""
        return [(drive_of(excitation), periods) for excitation, periods in self.stages()]

    @property
    def sweep_seconds(self) -> float:
        return sum(p / e.frequency for e, p in list(self.stages())[:-1])

    @property
    def wait_seconds(self) -> float:
        return self.wait / self.target.frequency

    @property
    def rate(self) -> float:
        """Of all trials, those that reached it."""
        trials = self.trials + self.board_trials
        return (self.reached + self.board_reached) / trials if trials else 0.0

    @property
    def text(self) -> str:
        """The recipe in words, for ``setup.csv``."""
        said = f"reached in {self.reached} of {self.trials} trials"
        if self.board_trials:
            said += f" and on sample boards in {self.board_reached} of {self.board_trials}"
        wait = f"wait {_seconds(self.wait_seconds)}"
        if self.way is Way.DIRECT:
            return f"switch on at this setting; {wait}; {said}"
        at, to = self._setting(self.first), self._setting(self.target)
        return (
            f"switch on at {at}; to {to} in {self.steps} steps of equal ratio, "
            f"{self.hold} periods each ({_seconds(self.sweep_seconds)} in all); {wait}; {said}"
        )

    def _setting(self, at: Excitation) -> str:
        """Frequency, in Hz and dimensionless, and amplitude."""
        omega = ""
        if self.omega is not None:
            omega = f" (omega {self.omega * at.frequency / self.target.frequency:.4g})"
        return f"{at.frequency:.5g} Hz{omega}, {at.amplitude:.4g} V peak"

    def as_dict(self) -> dict[str, Any]:
        """For JSON: settings in Hz and V, times in drive periods and seconds."""
        return {
            "way": str(self.way),
            "frequency_hz": self.first.frequency,
            "amplitude_v_peak": self.first.amplitude,
            "to_frequency_hz": self.target.frequency,
            "to_amplitude_v_peak": self.target.amplitude,
            "steps": self.steps,
            "hold_periods": self.hold,
            "wait_periods": self.wait,
            "sweep_seconds": self.sweep_seconds,
            "wait_seconds": self.wait_seconds,
            "reached": self.reached,
            "trials": self.trials,
            "board_reached": self.board_reached,
            "board_trials": self.board_trials,
            "text": self.text,
        }


def _between(first: float, last: float, part: float) -> float:
    return first if first == last else first * (last / first) ** part


def _seconds(value: float) -> str:
    return format_quantity(value, "s", 2)
