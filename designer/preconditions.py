"""What has to hold before any work: options, responses, ngspice; and whose fault it is if not."""

from __future__ import annotations

import os

from designer.errors import EnvironmentMissing, InputError
from designer.modelfile import ModelFile
from designer.ngspice import HOW_TO_INSTALL, SimulationFailed, Waveforms
from designer.spice_batch import program_version
from designer.workers import SpiceJob, SpicePool


def cores() -> int:
    """How many cores this process may use: the default of ``jobs``."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def need_responses(modelfile: ModelFile, more: str = "") -> None:
    """InputError unless the file wants a response."""
    if not modelfile.responses:
        raise InputError(
            str(modelfile.source) if modelfile.source else None,
            "response",
            "nothing",
            f"at least one table [[response]]{more}",
        )


def at_least(name: str, value: int, least: int) -> None:
    """InputError unless an option is large enough."""
    if value < least:
        raise InputError(None, name, value, f"a whole number >= {least}")


class naming:  # noqa: N801 - reads as a word in a with statement
    """Names the model file in an InputError that names none."""

    def __init__(self, modelfile: ModelFile) -> None:
        self._source = modelfile.source

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if not isinstance(error, InputError) or error.file is not None or self._source is None:
            return
        raise type(error)(self._source, error.field, error.found, error.expected) from None


def require_ngspice(pool: SpicePool) -> None:
    """EnvironmentMissing before any long work; the worker that was started stays for it."""
    program_version()
    deck = "a resistor\nV1 a 0 1\nR1 a 0 1\n.tran 1 2\n.end\n"
    for _, answer in pool.map([SpiceJob(deck, ("a",), 2.0, _length)]):
        if isinstance(answer, SimulationFailed):
            raise EnvironmentMissing(f"ngspice does not work: {answer.reason}; {HOW_TO_INSTALL}")


def _length(waveforms: Waveforms) -> int:
    return len(waveforms.time)
