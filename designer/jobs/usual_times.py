"""How long the phases of a verb take as a rule, for what is said of the time that is left.

Wall times [s] on two cores of a system with three masses, its program compiled; the key is how the
name of a phase's first stage begins (``WholeWork``). A work that is slower or faster than this
says so as it goes on, so that it is the ratios that matter.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from designer.model.model_file import ModelFile

SEARCHED: Final[Mapping[str, float]] = {
    "windows of the responses": 1.0,
    "designs": 120.0,
    "exact circuit with bandwidth": 35.0,
    "ngspice, rung": 26.0,
    "what each lever is worth": 30.0,
    "the design that was found": 8.0,
}
"""The times of the search for the design of the highest yield."""
CHOSEN: Final[Mapping[str, float]] = {"responses of the model, parts": 12.0}
"""The times of the choice of parts by the match."""
OTHER_STAGE: Final[Mapping[str, float]] = {"the other stage of the clearance": 4.0}
"""The times of a look at the stage that the file does not state."""
FILES: Final[Mapping[str, float]] = {"files of the design": 5.0, "KiCad project": 4.0}
"""The times of the files of a design that are known as soon as its parts are chosen."""
LAST: Final[Mapping[str, float]] = {"start recipes": 6.0}
"""The times of the other files."""
WRITTEN: Final[Mapping[str, float]] = {**FILES, **LAST}
"""The times of all files of a design."""


STUDIED: Final[Mapping[str, float]] = {
    "tolerance study": 3.0,
    "boards in ngspice": 48.0,
    "report": 20.0,
    "blame": 10.0,
}
"""The times of a study of 200 boards."""
RUN: Final[Mapping[str, float]] = {"routing": 12.0, "ngspice, equation check": 9.0, **STUDIED}
"""The times of what ``run`` does once there is a design."""
SEARCH: Final[Mapping[str, float]] = {
    **SEARCHED,
    **WRITTEN,
    "tolerance study": 28.0,
    "report": 30.0,
    "what limits each response": 8.0,
    "ngspice, rung dynamic, numerics": 48.0,
}
"""The times of the search, the study and the confirmation of a design."""
REPAIRED: Final[Mapping[str, float]] = {
    "the design as it is": 10.0,
    "linear picture": 60.0,
    "round": 60.0,
    "cured design": 1.0,
    **WRITTEN,
}
"""The times of the search for a repair."""


def of_design(modelfile: ModelFile) -> dict[str, float]:
    """The times of the design of this model file, made and written."""
    if modelfile.circuit.objective == "yield":
        return {**SEARCHED, **WRITTEN}
    other = OTHER_STAGE if modelfile.circuit.dead_zone is not None else {}
    return {**CHOSEN, **FILES, **other, **LAST}
