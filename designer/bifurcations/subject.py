"""What a sweep changes: parameters of a system, or settings of its drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from designer.base.arrays import Array
from designer.base.si_unit import Unit
from designer.bifurcations.flow_family import Family, FlowPlane
from designer.dynamics.steady_state import DrivenSystem


@dataclass(frozen=True)
class ShownStop:
    """A stop whose impacts a diagram shows in a panel of its own."""

    clearance: int
    """Index of the clearance."""
    side: int
    """1 for its upper stop, -1 for the lower."""
    name: str
    """The stop in words, such as "the upper stop of A"."""
    velocity: str
    """Symbol of the velocity in the clearance."""


class Subject(Protocol):
    """A system with named parameters.

    ``model.swept_model`` has a mechanical model's, ``circuit.swept_board`` a circuit's.
    """

    @property
    def name(self) -> str:
        """Whose motion it is, in words, for titles."""
        ...

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of what can be swept."""
        ...

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        ...

    @property
    def weights(self) -> Array:
        """(states,) factors that make the states comparable in size."""
        ...

    @property
    def units(self) -> Mapping[str, str]:
        """By parameter, and by "x", "v" and "λ" for the axes of a diagram."""
        ...

    @property
    def labels(self) -> Mapping[str, str]:
        """What axes call a state, and the "displacement" in the first clearance, where they have
        names of their own."""
        ...

    @property
    def stops(self) -> tuple[ShownStop, ...]:
        """The stops whose impacts a diagram shows: of one even clearance the upper one alone, of
        which the lower is the mirror image; else every stop. One at least."""
        ...

    @property
    def si(self) -> Mapping[str, Unit]:
        """SI units of the dimensionless quantities that have one, by name."""
        ...

    def check(self, option: str, name: str, value: float) -> None:
        """InputError that names the option, unless the parameter may have this value."""
        ...

    def settings(self, changes: Sequence[Mapping[str, float]]) -> list[DrivenSystem]:
        """One for each set of changes, the others as they stand."""
        ...

    def scale(self, changes: Sequence[Mapping[str, float]]) -> Array:
        """(states,) size of the states that starts are drawn from: one for all changes."""
        ...

    def family(self, parameter: str) -> Family:
        """One flow for each value of a parameter, the others as they stand."""
        ...

    def plane(self, first: str, second: str) -> FlowPlane:
        """One flow for each pair of values of two parameters, the others as they stand."""
        ...

    def fixed(self, swept: Mapping[str, float | None]) -> Mapping[str, float | None]:
        """The parameters that are not swept, with their values; None where there is none."""
        ...

    def remarks(self) -> Sequence[str]:
        """What a title says of the system beside its parameters."""
        ...

    def as_dict(self) -> dict[str, object]:
        """What decides the flow, for hashes and provenance."""
        ...
