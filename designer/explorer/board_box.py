"""Real parts for the response that is shown, and how many boards of them keep it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import replace
from functools import cached_property

from designer.base.defaults import SAMPLES, SEED
from designer.base.environment import spawn_context
from designer.base.errors import InputError
from designer.base.si_unit import quantity_text
from designer.base.units import format_quantity
from designer.centering import stage_choice
from designer.check import checked_design
from designer.check.synthesis_result import Synthesis
from designer.circuit.design import ConditionCheck, settings
from designer.dynamics.orbit import OrbitStatus
from designer.explorer.place import ModelPlace
from designer.explorer.saved_model import PinnedResponse, saved_text
from designer.explorer.wire import Message
from designer.model.model_file import ModelFile, parse_model_file
from designer.verdicts import exact_circuit
from designer.yields.study_plan import plan_study
from designer.yields.yield_count import count

PIECE = 10
"""Boards between two messages."""
UNITS = {"hz": "Hz", "v": "V", "a": "A", "ohm": "Ω"}
"""Last words of what side conditions limit."""
Choose = Callable[[ModelFile], Synthesis]
"""Chooses parts for a model file that wants one response."""


class PartsProcess:
    """A process of its own that chooses parts: a second of it would hold up every picture."""

    @cached_property
    def _pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(1, mp_context=spawn_context())

    def __call__(self, modelfile: ModelFile) -> Synthesis:
        """``synthesise`` of the file, in that process."""
        future: Future[Synthesis] = self._pool.submit(
            stage_choice.synthesise, modelfile, all_found=False
        )
        return future.result()

    def close(self) -> None:
        """End the process once what it is at is done."""
        if "_pool" in self.__dict__:
            self._pool.shutdown(cancel_futures=True)


def board_box(
    modelfile: ModelFile, place: ModelPlace, expect: str, choose: Choose
) -> Iterator[Message]:
    """The parts for one response at a place, its generator's setting and what limits the circuit;
    then the yield on the exact circuit under the file's spread, as samples arrive.

    expect : n-p-q of the response.

    Raises
    ------
    InputError, Unreachable : no circuit makes this model, or none of these parts does.
    """
    yield {"kind": "board", "words": "parts are being chosen", "rows": []}
    pin = PinnedResponse(place.omega, expect, place.model.b)
    wanted = parse_model_file(saved_text(modelfile, place, [pin]), modelfile.source)
    wanted = replace(wanted, measured=modelfile.measured)
    synthesis = choose(wanted)
    design = synthesis.design
    (checked,) = checked_design.check(design, synthesis.model_responses, None)
    rows = _rows(synthesis, checked.circuit.response)
    if checked.circuit.status is not OrbitStatus.PERIODIC:
        yield {
            "kind": "board",
            "words": f"the circuit shows: {checked.circuit.response}",
            "rows": rows,
        }
        return
    parts = synthesis.modelfile, design, (checked,), synthesis.catalog
    plan = plan_study(*parts, samples=SAMPLES, seed=SEED)
    verdicts = []
    yield {"kind": "board", "words": "", "rows": rows}
    for indices in plan.blocks(PIECE):
        verdicts += exact_circuit.block(plan, indices, 1)
        counted = count(verdicts)
        low, high = counted.interval
        yield {
            "kind": "yield",
            "ok": counted.ok,
            "samples": counted.samples,
            "of": plan.samples,
            "words": f"{100.0 * counted.rate:.0f} % of {counted.samples} boards keep it "
            f"({100.0 * low:.0f} to {100.0 * high:.0f} %)",
        }


def expected(value: object) -> str:
    """n-p-q of a page's question.

    Raises
    ------
    InputError : no text.
    """
    if not isinstance(value, str) or not value:
        raise InputError(None, "expect", repr(value), "the n-p-q of a periodic response")
    return value


def condition_row(check: ConditionCheck) -> tuple[str, str]:
    """A side condition, its value and its limit in the unit that its quantity ends in."""
    words = check.quantity.split("_")
    unit, values = UNITS.get(words[-1], ""), (check.found, check.limit)
    found, limit = (quantity_text(v, unit, 3) if unit else f"{v:.3g}" for v in values)
    side = "at least" if check.least else "at most"
    held = "" if check.holds else ", not kept"
    return " ".join(words[:-1] if unit else words), f"{found} ({side} {limit}{held})"


def _rows(synthesis: Synthesis, response: str) -> list[tuple[str, str]]:
    design = synthesis.design
    (setting,) = settings(design, synthesis.model_responses)
    rows = [
        ("exact circuit", response),
        ("generator", format_quantity(setting.frequency_hz, "Hz")),
        (
            "amplitude, peak",
            ", ".join(format_quantity(v, "V") for v in setting.excitation.amplitudes),
        ),
        ("largest error", f"{100.0 * design.errors.max_error:.2g} % ({design.certificate.status})"),
    ]
    rows += [condition_row(each) for each in design.checks]
    if setting.second is not None:
        ahead = setting.excitation.second_phase_deg
        rows.insert(
            3, ("second channel", f"{ahead:.4g}° ahead" if ahead else "the second amplitude")
        )
    circuit = design.circuit
    rows += [(part.name, format_quantity(part.value, "Ω")) for part in circuit.resistors]
    rows += [(part.name, format_quantity(part.value, "F")) for part in circuit.capacitors]
    return rows
