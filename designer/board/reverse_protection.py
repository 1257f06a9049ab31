"""What a supply that is connected the wrong way round meets: a diode in series with each rail.

The rails keep the model file's ``supply``: it is what every equation and rule is computed with. At
the connector the supply has to be higher by what the diodes drop.
"""

from __future__ import annotations

from collections.abc import Iterator

from designer.base.errors import InputError
from designer.base.units import format_quantity
from designer.catalog.parts_catalog import Catalog
from designer.catalog.supply_diode import SupplyDiodeEntry
from designer.circuit.board_parts_only import SupplyDiode
from designer.circuit.netlist import NEGATIVE, POSITIVE, Circuit

KEY = "board.reverse_protection"


def supply_current(circuit: Circuit, catalog: Catalog) -> tuple[float, float]:
    """Current [A] that the amplifiers draw from each rail without a load: typical, and at most."""
    opamp = catalog.opamp(circuit.opamp)
    sections, current = opamp.sections * len(circuit.packages), opamp.supply_current
    most = current.nominal if current.max is None else current.max
    return sections * current.nominal, sections * most


def supply_diodes(
    circuit: Circuit, name: str, catalog: Catalog, first: int
) -> Iterator[SupplyDiode]:
    """A diode in each rail, from nets of their own.

    name : of the diode in the catalogue. first : number of the one in the positive rail.

    Raises
    ------
    InputError : no such diode, or one that does not stand the supply's current or voltage.
    """
    entry = catalog.supply_diode(name)
    drop = _drop(entry, circuit, catalog)
    for number, rail in enumerate((POSITIVE, NEGATIVE), start=first):
        source = f"{rail}_in"
        ends = (source, rail) if rail == POSITIVE else (rail, source)
        role = "against reverse polarity"
        yield SupplyDiode(f"D{number}", *ends, source, name, drop, role)


def _drop(entry: SupplyDiodeEntry, circuit: Circuit, catalog: Catalog) -> float:
    """Most that the diode drops [V]; it has to stand the current, and a supply that is turned round
    while the bulk capacitor of the rail is charged."""
    _, current = supply_current(circuit, catalog)
    drop = entry.drop(current)
    if drop is None:
        text = format_quantity(current, "A")
        raise InputError(None, KEY, entry.name, f"a diode for the {text} that the op-amps draw")
    across, reverse_voltage = 2.0 * circuit.supply + drop, entry.reverse_voltage.nominal
    if reverse_voltage < across:
        found = f"{entry.name}, for {reverse_voltage:g} V"
        expected = f"a diode for {across:g} V in reverse, twice the supply"
        raise InputError(None, KEY, found, expected)
    return drop
