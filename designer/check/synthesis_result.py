"""The main job as functions with typed results: what ``from designer import …`` offers.

Nothing here writes a file or prints; ``jobs.synthesise_job`` does the same with a design folder.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace

from designer.base.frames import table_html
from designer.base.progress import doing, is_watched, note, seeking
from designer.catalog.design_rule import RuleOutcome
from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.circuit.coefficients import EXACT
from designer.circuit.dead_zone_parts import stage_kind
from designer.circuit.design import Design, settings
from designer.linear_network.milp import import_cvxpy
from designer.model.circuit_table import DeadZone
from designer.model.find_responses import ModelResponse, find, need_found, peaks
from designer.model.model_file import ModelFile, errors_in
from designer.spread.part_rules import check_names, spread_of
from designer.synthesis import parts_choice
from designer.synthesis.part_checks import check_choices, unit_circuit

Ahead = Callable[[], tuple[ModelResponse, ...] | None]
"""Waits for a model's responses that another process looks for; None where it does not."""


@dataclass(frozen=True)
class Synthesis:
    """A model file, what its model shows, and the parts chosen for it."""

    modelfile: ModelFile
    catalog: Catalog
    """The catalogue that parts were chosen from."""
    model_responses: tuple[ModelResponse, ...]
    """The wanted responses as the model shows them."""
    design: Design
    """The parts chosen for it."""
    seconds: float = 0.0
    """Wall time [s]."""
    stage_reason: str = ""
    """Why the circuit has its dead-zone stage, where the model file states none."""
    better_stage: str = ""
    """What is said of a stated stage that is the worse one; empty where it is not."""
    outcomes: tuple[RuleOutcome, ...] | None = None
    """What the design rules of its circuit say, where they were judged already."""

    def _repr_html_(self) -> str:
        responses = self.model_responses
        rows = [
            {
                "omega": r.omega,
                "expected": r.expected,
                "model": r.orbit.response,
                "frequency_hz": s.frequency_hz,
                "amplitude_v_peak": s.amplitude_v_peak,
            }
            for r, s in zip(responses, settings(self.design, responses), strict=True)
        ]
        note = f"largest coefficient error {self.design.errors.max_error:.3g}"
        return table_html(self.modelfile.title, rows, note)


def synthesise(
    modelfile: ModelFile,
    catalog: Catalog | None = None,
    *,
    all_found: bool = False,
    jobs: int = 1,
    announced: bool = True,
    shown: tuple[ModelResponse, ...] | None = None,
    ahead: Ahead | None = None,
) -> Synthesis:
    """Find the wanted responses on the model and choose the parts.

    all_found : whether there have to be all of them before a part is chosen; one that is not there
    has the swing of what was found instead otherwise. jobs : threads; no part depends on it.
    announced : whether who watches hears that parts stand. shown : the responses, where they are
    known. ahead : as of ``responses_of``.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built.
    ResponseNotFound : ``all_found``, and the model does not show a response.
    """
    began = time.perf_counter()
    modelfile = with_stage(modelfile)
    catalog = load_catalog() if catalog is None else catalog
    responses = shown or responses_of(modelfile, catalog, all_found=all_found, ahead=ahead)
    catalog = _checked(modelfile, catalog)
    with errors_in(modelfile):
        choice = modelfile.model, modelfile.circuit, catalog
        held = peaks(modelfile.model, responses)

        with ExitStack() as search:
            search.enter_context(seeking("parts"))

            def stand(design: Design) -> None:
                spread_of(modelfile, design.circuit, catalog)  # refuses what no board of it can be
                search.close()  # what comes is no search for parts
                if announced and is_watched():
                    note(parts_line(design, time.perf_counter() - began))

            design = parts_choice.synthesise(*choice, held, responses, jobs=jobs, stand=stand)
    return Synthesis(modelfile, catalog, responses, design, time.perf_counter() - began)


def responses_of(
    modelfile: ModelFile,
    catalog: Catalog,
    *,
    all_found: bool = False,
    ahead: Ahead | None = None,
) -> tuple[ModelResponse, ...]:
    """The wanted responses on the model, of a file with a stage whose choices can be built.

    ahead : waits for them where they are looked for already.

    Raises
    ------
    InputError, ResponseNotFound : as ``synthesise``.
    """
    _checked(modelfile, catalog)
    with errors_in(modelfile):
        doing("responses of the model")
        found = None
        if ahead is not None:
            import_cvxpy()  # the parts need it: better now than idle
            found = ahead()
        found = found or find(modelfile.model, modelfile.responses)
        if all_found:
            need_found(dict(enumerate(found, start=1)), modelfile.si, modelfile.source)
    return found


def _checked(modelfile: ModelFile, catalog: Catalog) -> Catalog:
    """What the model file chooses from, once it is known that it can."""
    catalog = modelfile.choices(catalog)
    with errors_in(modelfile):
        choice = modelfile.model, modelfile.circuit, catalog
        check_choices(*choice)
        check_names(modelfile, unit_circuit(*choice), catalog)
    return catalog


def with_stage(modelfile: ModelFile, kind: DeadZone | None = None) -> ModelFile:
    """The model file with this stage stated; the kind that is built without one, if None."""
    spec = modelfile.circuit
    kind = kind or stage_kind(spec, modelfile.model.second_order().dead_zones)
    return replace(modelfile, circuit=replace(spec, dead_zone=kind))


def parts_line(design: Design, seconds: float) -> str:
    """The line that says that parts are chosen. seconds : since the work on them began."""
    error, number = design.errors.max_error, len(design.circuit.values)
    worst = f"{100 * error:.3g} %" if error > EXACT else "0 to rounding"
    return f"parts stand after {seconds:.1f} s: {number} of them, largest error {worst}"


synthesize = synthesise
"""The same in American spelling."""
