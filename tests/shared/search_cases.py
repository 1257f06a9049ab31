"""Model files and designs that the tests of the search share."""

from __future__ import annotations

from functools import cache

from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.check.synthesis_result import Synthesis, synthesise
from designer.model.model_file import ModelFile, parse_model_file
from designer.spread.part_rules import spread_of
from designer.spread.spread import Spread
from tests.shared.answer_store import stored
from tests.shared.model_text import PAPER_TABLE

HEAD = (
    """format = 1
title = "A search"
"""
    + PAPER_TABLE
)
TAIL = """[circuit]
saturation = 13.0
dead_zone = "{zone}"
objective = "{objective}"
[search]
omega = [{low}, {high}]
dead_zones = [{zones}]
"""


def asked(
    *responses: str,
    zone: str = "rectifier",
    zones: str = '"rectifier"',
    objective: str = "yield",
    band: tuple[float, float] = (0.7, 1.0),
    more: str = "",
) -> str:
    """The text of a model file. responses : the lines of each [[response]]."""
    wanted = "".join(f"[[response]]\n{lines}\n" for lines in responses)
    low, high = band
    tail = TAIL.format(zone=zone, zones=zones, objective=objective, low=low, high=high)
    return HEAD + wanted + tail + more


def file(*responses: str, **rest: str) -> ModelFile:
    """The same, read."""
    return parse_model_file(asked(*responses, **rest))  # type: ignore[arg-type]


@cache
def catalog() -> Catalog:
    return load_catalog()


@cache
def made() -> Synthesis:
    """A rectifier design for 1-2-2 at one place."""
    found = file('omega = 0.85\nexpect = "1-2-2"', objective="match")
    design: Synthesis = stored(synthesise)(found, catalog())
    return design


@cache
def spread() -> Spread:
    return spread_of(made().modelfile, made().design.circuit, catalog())
