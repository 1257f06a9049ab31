"""How to start a board so that it ends on the wanted response: where to switch on, how to sweep.

Several attractors coexist at one setting, so the generator's phase at power-up may decide; a sweep
from where only one exists does not leave it to chance. ``yields.start_recipe_search`` finds
recipes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

from designer.base.si_unit import value_text
from designer.circuit.netlist import Excitation
from designer.dynamics.piecewise_linear import Drive

if TYPE_CHECKING:
    from designer.answers.study_answer import RecipeRow, SecondAmplitudes

SLOWER = 10
"""How many times slower than it says a recipe is tried as well."""
FINER = 5
"""Into so many parts each step of a sweep is cut where it stands for a smooth one."""


class RecipeKind(StrEnum):
    """Kinds of recipe, the simplest first."""

    DIRECT = "direct"
    FROM_ABOVE = "sweep down"
    FROM_BELOW = "sweep up"
    AMPLITUDE = "amplitude up"
    FROM_FAR = "long sweep down"


@dataclass(frozen=True)
class Recipe:
    """Switch on at ``first``, go to ``target`` in steps of equal ratio, wait."""

    way: RecipeKind
    omega: float | None
    """Dimensionless frequency of the target."""
    target: Excitation
    """The generator's setting at the end."""
    first: Excitation
    """The generator's setting at power-up."""
    steps: int
    """Steps of the sweep, the one at ``first`` included; 0 without one."""
    hold: int
    """Drive periods at each step of the sweep."""
    wait: int
    """Drive periods at the target."""
    reached: int = 0
    """Switch-on phases of the nominal circuit, of ``trials``, that lead to the response."""
    trials: int = 0
    """Switch-on phases of the nominal circuit that were tried."""
    board_reached: int = 0
    """Starts of sample boards, of ``board_trials``, that lead to the response."""
    board_trials: int = 0
    """Starts of the ``able`` sample boards that were tried."""
    boards: int = 0
    """Sample boards that were drawn."""
    able: int = 0
    """Sample boards that show the response as built."""
    smooth: bool = False
    """Whether a sweep without steps did as well."""
    slower: bool = False
    """Whether a sweep ``SLOWER`` times as slow did as well."""
    hertz_scale: float | None = None
    """How many hertz of the mechanism ω = 1 is; None where that is not known."""

    def stages(self) -> Iterator[tuple[Excitation, int]]:
        """Settings of the generator in order, each with its whole drive periods."""
        for k in range(self.steps):
            part = k / self.steps
            yield (
                replace(
                    self.target.louder(
                        _between(self.first.amplitude, self.target.amplitude, part)
                        / self.target.amplitude
                    ),
                    frequency=_between(self.first.frequency, self.target.frequency, part),
                ),
                self.hold,
            )
        yield self.target, self.wait

    @property
    def drives(self) -> list[tuple[Drive, int]]:
        """The stages as the exact circuit sees them."""
        return [(excitation.drive, periods) for excitation, periods in self.stages()]

    @property
    def sweep_periods(self) -> int:
        """Drive periods of the sweep."""
        return self.steps * self.hold

    @property
    def sweep_seconds(self) -> float:
        return sum(p / e.frequency for e, p in list(self.stages())[:-1])

    @property
    def wait_seconds(self) -> float:
        return self.wait / self.target.frequency

    def refined(self, slower: int = 1) -> Recipe:
        """The same sweep in steps ``FINER`` times as fine, ``slower`` times as long in all."""
        return replace(
            self, steps=FINER * self.steps, hold=max(1, slower * self.hold // FINER), reached=0
        )

    @property
    def text(self) -> str:
        """The recipe in words, for ``setup.csv``: what a person sets on a generator. One that never
        worked is not offered."""
        if self.trials and not self.reached:
            return "; ".join([f"none: {self._unreached()}", *self._caution()])
        end = [f"wait {_seconds(self.wait_seconds)} or longer", *self._success()]
        if self.way is RecipeKind.DIRECT:
            return "; ".join(["switch on at this setting", *end])
        first = f"set {self._hertz(self.first)}, {_peaks(self.first)}, switch on"
        return "; ".join([first, self._sweep(), *end])

    def _sweep(self) -> str:
        """What is turned, to where, in what time."""
        took = _seconds(self.sweep_seconds)
        steps = f"in {self.steps} steps of equal ratio, {self.hold} periods each ({took} in all)"
        slower = f" (up to {SLOWER} times slower is fine)" if self.slower else ""
        if self.way is RecipeKind.AMPLITUDE:
            how = f"in {took}" if self.smooth else steps
            return f"raise the amplitude to {_peaks(self.target)} {how}{slower}"
        to = self._hertz(self.target)
        if not self.smooth:
            return f"step to {to} {steps}, without a break in phase{slower}"
        return f"sweep logarithmically to {to} in {took}, once, then hold{slower}"

    def _success(self) -> Iterator[str]:
        """How often it led to the response, and a warning where little is known of boards."""
        if not self.trials:
            return
        text = f"it worked from {self.reached} of {self.trials} switch-on phases"
        if self.board_trials:
            text += (
                f", and at {self.board_reached} of {self.board_trials} starts of "
                f"{self.able} sample boards"
            )
        yield text
        yield from self._caution()

    def _unreached(self) -> str:
        """That no recipe worked."""
        text = f"no recipe that was tried led to it from any of {self.trials} switch-on phases"
        if not self.board_reached:
            return text
        return (
            f"{text}, and at most at {self.board_reached} of {self.board_trials} starts of boards"
        )

    def _caution(self) -> Iterator[str]:
        """A warning where few boards can show the response."""
        if 2 * self.able < self.boards:
            shows = self.able or "none"
            yield f"caution: {shows} of {self.boards} sample boards can show it at this setting"

    def _hertz(self, at: Excitation) -> str:
        """In Hz, and what that is in the model: in Hz of the mechanism where that is known, else
        dimensionless."""
        text = f"{hertz(at.frequency)} Hz"
        if self.omega is None:
            return text
        omega = self.omega * at.frequency / self.target.frequency
        if self.hertz_scale is None:
            return f"{text} (omega {omega:.4g})"
        return f"{text} ({value_text(omega * self.hertz_scale, 'Hz')} of the mechanism)"

    def as_dict(self) -> RecipeRow:
        """For JSON: settings in Hz and V, times in drive periods and seconds."""
        second: SecondAmplitudes = {}
        if self.first.second is not None:
            second["amplitude2_v_peak"] = self.first.second.amplitude
        if self.target.second is not None:
            second["to_amplitude2_v_peak"] = self.target.second.amplitude
        return {
            "way": str(self.way),
            "frequency_hz": self.first.frequency,
            "amplitude_v_peak": self.first.amplitude,
            "to_frequency_hz": self.target.frequency,
            "to_amplitude_v_peak": self.target.amplitude,
            **second,
            "steps": self.steps,
            "hold_periods": self.hold,
            "wait_periods": self.wait,
            "sweep_seconds": self.sweep_seconds,
            "wait_seconds": self.wait_seconds,
            "reached": self.reached,
            "trials": self.trials,
            "board_reached": self.board_reached,
            "board_trials": self.board_trials,
            "boards": self.boards,
            "able": self.able,
            "smooth": self.smooth,
            "slower": self.slower,
            "text": self.text,
        }


def _peaks(at: Excitation) -> str:
    """The amplitudes of the generator's channels."""
    first = f"{volts(at.amplitude)} V peak"
    return first if at.second is None else f"{first} and {volts(at.second.amplitude)} V peak"


def _between(first: float, last: float, part: float) -> float:
    return first if first == last else first * (last / first) ** part


def hertz(value: float) -> str:
    """A frequency [Hz] as it is typed into a generator."""
    return f"{float(f'{value:.6g}'):.12g}"


def volts(value: float) -> str:
    """A voltage [V] as it is typed into a generator."""
    return f"{float(f'{value:.5g}'):.12g}"


def _seconds(value: float) -> str:
    """A time on the bench: two digits are enough."""
    return f"{float(f'{value:.2g}'):.12g} s"
