"""Other values in the data of a model file, as a script or a slider gives them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from designer.base.errors import InputError
from designer.base.plain_json import plain
from designer.base.schema import one_of
from designer.base.units import restated
from designer.model.lumped_system import LumpedSystem
from designer.model.mechanics import MechanicalModel
from designer.model.model import Dimensionless, Mechanical, SiScales
from designer.model.si_units import MECHANICAL_UNITS, in_si


@dataclass(frozen=True)
class FileNumbers:
    """The numbers of a model file, and where they stand in its data."""

    model: MechanicalModel
    """What they make."""
    mechanical: Mechanical | None
    """The SI values of a file of format 1 that gives these."""
    si: SiScales | None
    """SI values of the model's units; None where they are not known."""

    def change(self, data: dict[str, Any], changes: Mapping[str, Any], keys: Iterable[str]) -> None:
        """Make the changes of ``ModelFile.with_`` in a file's data. keys : of its top level.

        Raises
        ------
        InputError : a name that is neither a parameter nor a key, or a value outside its domain.
        """
        model, numbers = self.model, dict[str, float]()
        is_system, known = isinstance(model, LumpedSystem), (*keys, *model.parameters)
        for name, value in changes.items():
            if name not in model.parameters:
                _put_key(data, name, value, known)
            elif is_system and isinstance(value, str) and name != "b":
                entry, key = self._entry(data, name)
                entry[key] = value
            else:
                numbers[name] = _number(name, value)
        if is_system and "b" in numbers:
            raise InputError(None, "b", numbers["b"], "the gaps themselves: b is a factor on all")
        self.put(data, model.changed(numbers))

    def put(self, data: dict[str, Any], new: MechanicalModel) -> None:
        """Change the numbers of a file's data that another model has otherwise; a value keeps its
        unit. The factor ``b`` of a system is no number of its file."""
        model = self.model
        changed = [n for n in model.parameters if model.parameter(n) != new.parameter(n)]
        if isinstance(model, LumpedSystem):
            units = model.units if in_si(self.si, model) else {}
            for name in changed:
                if name != "b":
                    entry, key = self._entry(data, name)
                    value = new.parameter(name)
                    entry[key] = _with_unit(value, units.get(name, ""), entry.get(key))
        elif self.mechanical is None:
            data["model"] |= {name: new.parameter(name) for name in changed}
        elif changed:
            assert isinstance(new, Dimensionless)
            _put_si(data["mechanical"], self.mechanical, new)

    def _entry(self, data: dict[str, Any], name: str) -> tuple[dict[str, Any], str]:
        """The table of a system's file that has a parameter, and its key there."""
        assert isinstance(self.model, LumpedSystem)
        table, index, key = self.model.places[name]
        return (data[table] if index is None else data[table][index]), key


def _put_si(table: dict[str, Any], old: Mechanical, model: Dimensionless) -> None:
    """Of the mechanisms with these ratios the one with the file's M1, K1 and force."""
    new = Mechanical.from_dimensionless(model, M1=old.M1, K1=old.K1, force=old.P1 + old.P2)
    for name, unit in MECHANICAL_UNITS.items():
        value = float(getattr(new, name))
        if abs(value - getattr(old, name)) > 1e-12 * abs(value):
            table[name] = _with_unit(value, unit, table.get(name))


def _with_unit(value: float, unit: str, old: object) -> float | str:
    """As the file writes it: in the unit and prefix of its text; a plain number with the unit."""
    if not unit:
        return value
    return restated(value, unit, old if isinstance(old, str) else f"1 {unit}")


def _number(name: str, value: object) -> float:
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise InputError(None, name, repr(value), "a number") from None


def _put_key(data: dict[str, Any], name: str, value: object, known: Collection[str]) -> None:
    """Change, add or, with None, remove a key such as "circuit.opamp", or a whole table."""
    *tables, key = name.split(".")
    if (tables or [key])[0] not in known:
        raise InputError(None, name, repr(value), f"a parameter or a key: {one_of(name, known)}")
    table = data
    for each in tables:
        table = table.setdefault(each, {})
        if not isinstance(table, dict):
            expected = f"a key of a table; {each} is none (a list is given as a whole)"
            raise InputError(None, name, repr(value), expected)
    if value is None:
        table.pop(key, None)
        return
    try:
        table[key] = plain(value)
    except TypeError:
        raise InputError(None, name, repr(value), "a text, a number, a list or a table") from None
    if table[key] is None:  # plain of what is not finite
        raise InputError(None, name, repr(value), "a finite number")
