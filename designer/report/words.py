"""Names, numbers and short phrases of a report, the same wherever they stand."""

from __future__ import annotations

import math
import re
from dataclasses import replace

from designer.base.units import spaced_quantity
from designer.check.checked_design import CheckedResponse
from designer.check.trust import WORDS
from designer.circuit.coefficients import EXACT
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.mechanics import state_names
from designer.yields.yield_count import Yield

NONE = "–"

TERM = re.compile(r"x(\d+)('{1,2}) x(\d+)('?)")
_SLOPE = re.compile(
    r"(?:(upper|lower) )?(stop|bend) (slope|damping)(?: (?!x\d+' x)(.+?))?(?: x(\d+)' x(\d+)('?))?"
)
_GAP = re.compile(r"(gap|bend) (.+) (upper|lower)")
_REST = re.compile(r"(dead-zone null|dead-zone bias|constant)(?: (.+))?")

_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def name(c: CheckedResponse) -> str:
    return f"{c.model.spec.place_text()} ({c.model.expected or c.model.orbit.response})"


def label(c: CheckedResponse, join: str = "   ") -> str:
    """The name of a response in a picture, where n-p-q may stand on a line of its own."""
    return f"{c.model.spec.place_text()}{join}{c.model.expected or c.model.orbit.response}"


def orbit(shown: Orbit) -> str:
    return f"{shown.response} ({shown.reason})" if shown.reason else shown.response


def problem(c: CheckedResponse) -> str:
    """What is wrong with a response, in words; "" where it was found, all engines agree, and the
    exact ones can be trusted."""
    parts = []
    ngspice, without = c.ngspice, replace(c, gate=None)
    if not c.model.found:
        parts.append(f"the model shows {orbit(c.model.orbit)} instead")
    if not without.agrees:
        parts.append(f"model {orbit(c.model.orbit)} and exact circuit {orbit(c.circuit)} differ")
    exact = {"model": c.model_trust, "exact circuit": c.circuit_trust}
    for engine, trust in exact.items():
        if trust.reasons:  # without figures: equal studies are equal reports
            parts.append(f"{engine} {WORDS}: {'; '.join(trust.reasons)}")
    if ngspice is not None and ngspice.status is OrbitStatus.FAILED:
        parts.append(f"ngspice gave no answer: {ngspice.reason or 'no reason given'}")
    elif ngspice is not None and without.agrees and not c.agrees:
        parts.append(f"ngspice shows {orbit(ngspice)}, the exact circuit {orbit(c.circuit)}")
    return f"{name(c)}: {'; '.join(parts)}" if parts else ""


def coefficient(name: str, spring: str = "K1") -> str:
    """A coefficient error's name in words. spring : what stiffnesses are counted in."""
    if TERM.fullmatch(name):
        left, right = name.split()
        return f"{_pretty(right)} in the equation of {_pretty(left)}"
    if slope := _SLOPE.fullmatch(name):
        side, kind, what, zone, row, column, rate = slope.groups()
        end = f"{'a' if side is None else f'the {side}'} {kind}{_of(zone)}"
        if row is not None:
            state = _pretty(f"x{column}{rate}")
            return f"{state} in the equation of {_pretty(f'x{row}')}″, by {end}"
        if kind == "bend":
            return f"change of the slope at {end}"
        if what == "damping":
            return f"damping of {end}, over its mass"
        return f"stiffness of {end}, over {spring}"
    if gap := _GAP.fullmatch(name):
        kind = "gap to the {2} stop" if gap[1] == "gap" else "place of the {2} bend"
        end = kind.replace("{2}", gap[3]) + _of(gap[2])
        return f"{end}, over the gap or the bend that sets the amplitude"
    if rest := _REST.fullmatch(name):
        return {
            "dead-zone null": f"slope left inside the dead zone{_of(rest[2])}, over {spring}",
            "dead-zone bias": f"force left inside the dead zone{_of(rest[2])}, over {spring} times "
            "the threshold",
            "constant": f"constant force in the equation of {_pretty(rest[2] or '')}″",
        }[rest[1]]
    return name


def _of(clearance: str | None) -> str:
    """The clearance that is meant, where there are several."""
    return "" if clearance is None else f" of {clearance}"


def _pretty(state: str) -> str:
    return state.replace("''", "″").replace("'", "′").translate(_SUBSCRIPTS)


def state_symbols(masses: int) -> list[str]:
    """x₁, x₁′, x₂, … of so many masses."""
    return [_pretty(name) for name in state_names(masses)]


def limits(counted: Yield, figures: str) -> str:
    """An interval beside a share, given in ``figures``; of a census, which has none, the number
    of its boards."""
    return f"all {plural(counted.samples, 'board')}" if counted.census else figures


def yes(value: bool | None) -> str:
    return {True: "yes", False: "no", None: NONE}[value]


def all_of(number: int) -> str:
    return "Both" if number == 2 else f"All {number}"


def plural(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def number(value: object, digits: int = 4) -> str:
    if not isinstance(value, int | float):
        return str(value)
    return f"{value:.{digits}g}" if math.isfinite(value) else NONE


def span(low: float, high: float) -> tuple[str, str]:
    """The ends of an interval of shares in per cent: whole, with decimals where whole ones would
    not tell the ends apart."""
    for digits in range(4):
        ends = (f"{100 * low:.{digits}f}", f"{100 * high:.{digits}f}")
        if ends[0] != ends[1] or low == high:
            break
    return (ends[0], f"{100 * high:g}" if high in (0.0, 1.0) else ends[1])


def error(value: float) -> str:
    """A coefficient error, a logarithm, in per cent."""
    if not math.isfinite(value):
        return NONE
    return f"{100 * value:.3g} %" if abs(value) > EXACT else "exact (up to 1e-6)"


def deviation(value: float) -> str:
    """A measured deviation in per cent; a very small one has no digits of its own."""
    if not math.isfinite(value):
        return NONE
    return f"{100 * value:.3g} %" if abs(value) > EXACT else f"< {100 * EXACT:.4f} %"


def quantity(value: float, unit: str, digits: int = 4) -> str:
    return spaced_quantity(value, unit, digits) if math.isfinite(value) else NONE
