"""Names in a KiCad project: nets, libraries, ids, and the project itself.

Supplies and ground are KiCad's global power nets; every other net is a local label of the one
sheet, which KiCad writes with a slash before it.
"""

from __future__ import annotations

import re
import uuid

from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE

LIBRARY = "designer"
"""Nickname of the project's own symbol and footprint libraries."""
POWER = {GROUND: "GND", POSITIVE: "VCC", NEGATIVE: "VEE"}
"""KiCad's names of the nets that are power symbols on the sheet."""
HEAD = {"generator": LIBRARY, "generator_version": "9.0"}
"""What stands after the version in every file, as KiCad 9 writes it."""
BOARD_VERSION, SHEET_VERSION, SYMBOLS_VERSION = 20241229, 20250114, 20241209
"""KiCad 9's versions of boards and footprints, of schematics, of symbol libraries."""
PAPERS = {"A4": (297, 210), "A3": (420, 297), "A2": (594, 420), "A1": (841, 594), "A0": (1189, 841)}
"""Sizes of sheets [mm], landscape."""
LONGEST = 40
"""Characters of a project's name."""

_SPACE = uuid.UUID("a3f0b4de-6f0e-5c8e-9a75-2f1a0f1f7c11")
_CIRCUIT_NETS = {name: net for net, name in POWER.items()}


def kicad_net(net: str) -> str:
    """KiCad's full name of a net of the circuit."""
    return POWER.get(net, f"/{net}")


def circuit_net(name: str) -> str:
    """The circuit's name of one of KiCad's nets: the other way round."""
    return _CIRCUIT_NETS.get(name, name.removeprefix("/"))


def project_name(title: str) -> str:
    """The name of the project's files, from the model's title: letters, digits, hyphens."""
    words = re.findall(r"[a-z0-9]+", title.lower())
    name = ""
    for word in words:
        longer = f"{name}-{word}" if name else word[:LONGEST]
        if len(longer) > LONGEST:
            break
        name = longer
    return name or "board"


def identifier(*names: str) -> str:
    """A UUID that depends on the names alone, so that the same thing keeps it."""
    return str(uuid.uuid5(_SPACE, "\x1f".join(names)))


def sheet_id(project: str) -> str:
    """The id of the one sheet."""
    return identifier(project, "sheet")


def symbol_id(project: str, reference: str, unit: int = 1) -> str:
    """The id of a unit of a symbol; the board's footprints refer to it."""
    return identifier(project, "symbol", reference, str(unit))


def library_name(text: str) -> str:
    """A text as the name of a symbol or footprint in a library."""
    return re.sub(r"[^A-Za-z0-9_.+-]", "_", text) or "_"


def footprint_name(footprint: str) -> str:
    """The footprint's own name, without the library that the catalogue has it from."""
    return library_name(footprint.rpartition(":")[2])


def safe_text(text: str) -> str:
    """A foreign text for a title block: printable, one line, no variable that KiCad expands."""
    flat = " ".join("".join(ch if ch.isprintable() else " " for ch in text).split())
    return flat.replace("${", "$ {").replace("@{", "@ {")[:120].rstrip()
