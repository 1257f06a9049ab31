"""Other values in the data of a model file, as a script or a slider gives them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from designer.base.errors import InputError
from designer.base.plain_json import plain
from designer.base.schema import one_of
from designer.base.units import restated
from designer.model.lumped_system import LumpedSystem
from designer.model.mechanics import MechanicalModel
from designer.model.model import Dimensionless, Mechanical, SiScales
from designer.model.si_units import MECHANICAL_UNITS, Reader, in_si


@dataclass(frozen=True)
class FileNumbers:
    """The numbers of a model file, and where they stand in its data."""

    model: MechanicalModel
    """What they make."""
    mechanical: Mechanical | None
    """The SI values of a file of format 1 that gives these."""
    si: SiScales | None
    """SI values of the model's units; None where they are not known."""

    def change(self, data: dict[str, Any], changes: Mapping[str, Any], keys: Sequence[str]) -> None:
        """Give parameters other values in a file's data: a number, a text with a unit, or None to
        leave a number of an element out. keys : of the top level, which an error names too.

        Raises
        ------
        InputError : a name that is no parameter, or a value outside its domain.
        """
        model, numbers = self.model, dict[str, float]()
        for name, value in changes.items():
            if name not in model.parameters:
                known = one_of(name, (*keys, *model.parameters))
                raise InputError(None, name, repr(value), f"a parameter or a key: {known}")
            if not isinstance(model, LumpedSystem):
                numbers[name] = self._number(name, value)
            elif name == "b":
                raise InputError(None, "b", value, "the gaps themselves: b is a factor on all")
            elif (value is None or isinstance(value, str)) and not _indexed(model.places[name]):
                put_key(*self._entry(data, name), name, value)
            else:
                numbers[name] = self._number(name, value)
        self.put(data, model.changed(numbers))

    def _number(self, name: str, value: object) -> float:
        """A parameter in the model's units."""
        if not isinstance(value, bool):
            with suppress(TypeError, OverflowError):
                plain_value = value if isinstance(value, str) else float(value)  # type: ignore[arg-type]
                return Reader(self.model, self.si).value(name, name, plain_value)
        raise InputError(None, name, repr(value), "a number, or a text with a unit")

    def put(self, data: dict[str, Any], new: MechanicalModel) -> None:
        """Change the numbers of a file's data that another model has otherwise; a value keeps its
        unit. The factor ``b`` of a system is no number of its file."""
        model = self.model
        changed = [n for n in model.parameters if model.parameter(n) != new.parameter(n)]
        if isinstance(model, LumpedSystem):
            units = model.units if in_si(self.si, model) else {}
            for name in (each for each in changed if each != "b"):
                table, *way = model.places[name]
                value, unit = new.parameter(name), units.get(name, "")
                if table == "matrices":
                    _put_entry(data[table], way, value)
                    continue
                entry, key = self._entry(data, name)
                old = entry.get(key) if isinstance(entry, dict) else entry[key]
                if _indexed(way) and not isinstance(old, str):
                    unit = ""  # a unit in one point of a law says what the others are
                entry[key] = _with_unit(value, unit, old)
        elif self.mechanical is None:
            data["model"] |= {name: new.parameter(name) for name in changed}
        elif changed:
            assert isinstance(new, Dimensionless)
            _put_si(data["mechanical"], self.mechanical, new)

    def _entry(self, data: dict[str, Any], name: str) -> tuple[Any, Any]:
        """The table, or the point of a law, of a system's file that has a parameter, and its key
        there."""
        assert isinstance(self.model, LumpedSystem)
        found: Any = data
        *way, key = self.model.places[name]
        for step in way:
            found = found[step]
        return found, key


def _indexed(way: Sequence[str | int]) -> bool:
    """Whether a number stands in a list of a key's value, which no text replaces."""
    return isinstance(way[-1], int)


def _put_entry(matrices: dict[str, Any], way: Sequence[str | int], value: float) -> None:
    """Change an entry of a matrix, and its mirror image in a symmetric one."""
    key, i, j = way
    rows = matrices[str(key)]
    if not isinstance(rows[0], list):  # a diagonal
        if i == j:
            rows[i] = value
            return
        size = range(len(rows))
        rows = [[rows[k] if k == n else 0.0 for n in size] for k in size]
        matrices[str(key)] = rows
    rows[i][j] = value
    if key != "damping":
        rows[j][i] = value


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


def put_at(data: dict[str, Any], name: str, value: object) -> None:
    """Change, add or, with None, remove a key of a file's data such as "circuit.opamp", or a whole
    table.

    Raises
    ------
    InputError : no table has such a key, or the value has no form in a file.
    """
    table, (*tables, key) = data, name.split(".")
    for each in tables:
        table = table.setdefault(each, {})
        if not isinstance(table, dict):
            expected = f"a key of a table; {each} is none (a list is given as a whole)"
            raise InputError(None, name, repr(value), expected)
    put_key(table, key, name, value)


def put_key(table: dict[str, Any], key: str, name: str, value: object) -> None:
    """The same of the table itself. name : what was asked for, which an error names."""
    if value is None:
        if key not in table:
            raise InputError(None, name, "None", "a key that the file has")
        del table[key]
        return
    try:
        table[key] = plain(value)
    except (TypeError, RecursionError):
        raise InputError(None, name, repr(value), "a text, a number, a list or a table") from None
    if table[key] is None:  # plain of what is not finite
        raise InputError(None, name, repr(value), "a finite number")
