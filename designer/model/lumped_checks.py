"""Whether elements make a mechanical system that has a steady response to its drive.

Each refusal says which element, and what to do.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NoReturn

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import MISSING, InputError
from designer.base.schema import one_of
from designer.model.lumped_elements import GROUND, Elements, Gap

RESERVED = (GROUND, "base")
"""Names that mean something else."""
MOST_MASSES = 12
"""Beyond it nothing was tried."""
DRIFTS = (
    ": nothing holds the place of a mass inside its gap, in a circuit no more than in the model; "
    "a soft spring, of a hundredth of the stops' stiffness, changes little"
)
UNDAMPED = 1e-12
"""Least damping ratio of a mode: below it no steady response is reached."""


def check(system: Elements) -> None:
    """Refuse elements that do not make such a system.

    Raises
    ------
    InputError : the first thing that is wrong; its field is that of the model file.
    """
    if not system.masses:
        _refuse("mass", MISSING, "at least one table [[mass]]")
    if len(system.masses) > MOST_MASSES:
        _refuse("mass", len(system.masses), f"at most {MOST_MASSES} masses")
    _check_names(system)
    for gap in system.gaps:
        _check_gap(gap)
    _check_grounded(system)
    _check_driven(system)


def _refuse(field: str, found: object, expected: str) -> NoReturn:
    raise InputError(None, field, found, expected)


def _check_names(system: Elements) -> None:
    """Each name once, and only names that there are."""
    names = [*system.names, *(gap.name for gap in system.gaps)]
    for name, count in Counter(names).items():
        field = "mass" if name in system.names else "clearance"
        if count > 1:
            _refuse(f"{field}.name", name, "a name that no other mass or clearance has")
        if name in RESERVED:
            _refuse(f"{field}.name", name, f"a name other than {', '.join(RESERVED)}")
    nets = Counter(gap.name.casefold().removesuffix("_out") for gap in system.gaps)
    for gap in system.gaps:  # nets of the circuit bear them, and SPICE knows no capitals
        if nets[gap.name.casefold().removesuffix("_out")] > 1:
            expected = "a name that differs from the others in more than capitals or an _out"
            _refuse("clearance.name", gap.name, expected)
    for kind, between in _joints(system):
        for name in between:
            if name not in (*system.names, GROUND):
                _refuse(f"{kind}.between", name, one_of(name, (*system.names, GROUND)))
    for force in system.forces:
        if force.on not in system.names:
            _refuse("force.on", force.on, one_of(force.on, system.names))


def _joints(system: Elements) -> Iterable[tuple[str, tuple[str, str]]]:
    yield from (("spring", spring.between) for spring in system.springs)
    yield from (("damper", damper.between) for damper in system.dampers)
    yield from (("clearance", gap.between) for gap in system.gaps)


def _check_gap(gap: Gap) -> None:
    field = f"clearance {gap.name}"
    if gap.upper is None and gap.lower is None:
        _refuse(f"{field}.upper", MISSING, "a gap to an upper or a lower stop, or both")
    if gap.upper is not None and gap.lower is not None and gap.upper + gap.lower <= 0.0:
        text = f"{gap.upper:g}, with lower = {gap.lower:g}"
        more = "two stops that are both in contact at rest are two clearances, one for each"
        _refuse(f"{field}.upper", text, f"upper + lower > 0; {more}")
    if gap.law == "hertz":
        for key in ("constant", "depth"):
            if getattr(gap, key) is None:
                _refuse(f"{field}.{key}", MISSING, f'a {key} of the law "hertz"')
        for key in ("stiffness", "upper_stiffness", "lower_stiffness"):
            if getattr(gap, key) is not None:
                _refuse(f"{field}.{key}", getattr(gap, key), 'none: the law "hertz" has a constant')
        return
    for key in ("constant", "depth"):
        if getattr(gap, key) is not None:
            _refuse(f"{field}.{key}", getattr(gap, key), 'none without law = "hertz"')
    for side in ("upper", "lower"):
        stiffness = getattr(gap, f"{side}_stiffness")
        if getattr(gap, side) is None and stiffness is not None:
            _refuse(f"{field}.{side}_stiffness", stiffness, f"none: there is no {side} stop")
        if getattr(gap, side) is not None and stiffness is None and gap.stiffness is None:
            _refuse(f"{field}.stiffness", MISSING, f"a stiffness, or {side}_stiffness")


def _check_grounded(system: Elements) -> None:
    """Springs hold every mass to ground, directly or through others."""
    sprung = {name for spring in system.springs for name in spring.between}
    for name in system.names:
        if name not in sprung:
            expected = f"a [[spring]] between {name} and another"
            if any(name in gap.between for gap in system.gaps):
                expected += DRIFTS
            _refuse("spring.between", f"no spring on {name}", expected)
    grounded = _reached({GROUND}, [spring.between for spring in system.springs])
    floating = [name for name in system.names if name not in grounded]
    if floating:
        _refuse(
            "spring.between",
            f"{', '.join(floating)} without a spring to ground",
            "a [[spring]] that holds this part: it floats",
        )


def _check_driven(system: Elements) -> None:
    """A drive that reaches every clearance."""
    driven = {force.on for force in system.forces if force.amplitude}
    if system.base is not None:
        driven |= set(system.names)  # the ground's inertia force is on every mass
    if not driven:
        _refuse("force", MISSING, "a [[force]] with an amplitude, or a [base]: nothing moves")
    if system.base is not None and system.base.stops == "fixed":
        for gap in system.gaps:
            if gap.damping and GROUND in gap.between:
                expected = 'damping = 0 where [base] stops = "fixed": the damper\'s other end moves'
                _refuse(f"clearance {gap.name}.damping", gap.damping, expected)
    joints = [between for _, between in _joints(system) if GROUND not in between]
    moved = _reached(driven, joints)
    for gap in system.gaps:
        if moved.isdisjoint(gap.between):
            expected = "a force, a base motion or a spring that moves it: it can never be reached"
            _refuse(
                f"clearance {gap.name}.between", f"{' and '.join(gap.between)}, at rest", expected
            )


def _reached(start: set[str], joints: Sequence[tuple[str, str]]) -> set[str]:
    """What hangs together with ``start``."""
    reached = set(start)
    while True:
        more = {name for pair in joints if not reached.isdisjoint(pair) for name in pair} - reached
        if not more:
            return reached
        reached |= more


def check_damped(state_matrix: Array) -> None:
    """Refuse a system of which some free motion does not die out with all clearances open.

    state_matrix : (2n, 2n) of the open system.

    Raises
    ------
    InputError : a mode has no damping.
    """
    rates = np.linalg.eigvals(state_matrix)
    slowest = rates[np.argmax(rates.real / np.abs(rates))]
    if not -slowest.real > UNDAMPED * abs(slowest):
        text = f"none that slows the motion at {abs(slowest.imag):.4g} rad per unit of time"
        expected = "a [[damper]] for it: without one no steady response is reached"
        _refuse("damper.between", text, expected)
