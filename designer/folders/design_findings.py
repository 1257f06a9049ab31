"""What is not good enough about a design, for the JSON object of ``design.json``.

The rules are those of the verb ``rules`` on the circuit, judged by the same code; those on a board
need one. Nothing here changes the design, and nothing refuses it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from designer.base.errors import InputError
from designer.base.second_process import Ask
from designer.catalog.design_rule import FAIL, RuleOutcome
from designer.check import checked_design
from designer.check.curved_laws import curved_laws, law_misfits
from designer.check.synthesis_result import Synthesis
from designer.circuit.coefficients import LARGE_ERROR
from designer.design_rules import run_rules
from designer.design_rules.rule_subject import RuleSubject
from designer.model.driven import model_flow
from designer.report import words
from designer.report.design_tables import spring_of
from designer.synthesis.parts_choice import ways_to_less_error

if TYPE_CHECKING:
    from designer.answers.design_answer import DesignFindings

FINDINGS = {"warnings", "failed_rules"}
"""The keys."""


def subject_of(synthesis: Synthesis, other: Ask | None = None) -> RuleSubject | InputError:
    """What the rules look at, or why no board can be made of the design. other : as of
    ``RuleSubject``."""
    try:
        return RuleSubject.of(synthesis, other)
    except InputError as error:
        return error


def judged(synthesis: Synthesis, subject: RuleSubject | InputError) -> Synthesis:
    """With what the rules say of the circuit, where they can look at it. subject : ``subject_of``
    the design."""
    if synthesis.outcomes is not None or isinstance(subject, InputError):
        return synthesis
    outcomes = run_rules.on_circuit(subject, synthesis.modelfile.rules)
    return replace(synthesis, outcomes=outcomes)


def findings(synthesis: Synthesis, subject: RuleSubject | InputError) -> DesignFindings:
    """``warnings`` and ``failed_rules`` by the keys of docs/contract.md. subject : ``subject_of``
    the design.

    A design without responses, or one that no board can be made of, has no rule that fails for
    want of something to look at; the latter is a warning.
    """
    warnings = [*error_warnings(synthesis), *_responses(synthesis), *_misfits(synthesis)]
    failed: list[RuleOutcome] = []
    if isinstance(subject, InputError):
        warnings.append(f"The design rules were not looked at: {subject}")
    else:
        outcomes = judged(synthesis, subject).outcomes
        failed = [o for o in outcomes or () if o.status == FAIL]
    if synthesis.better_stage:
        warnings.append(synthesis.better_stage)
    if failed:
        warnings.append(_rules([o.rule.id for o in failed]))
    return {"warnings": warnings, "failed_rules": [o.as_dict() for o in failed]}


def error_warnings(synthesis: Synthesis) -> Iterator[str]:
    """A largest coefficient error that is too large, and what lowers it."""
    design, spec = synthesis.design, synthesis.modelfile.circuit
    worst = design.errors.max_error
    if worst <= LARGE_ERROR:
        return
    errors = design.errors.errors
    worst_name = max(errors, key=lambda each: abs(errors[each]))
    name = words.coefficient(worst_name, spring_of(design.model))
    text = (
        f"The largest coefficient error is {words.error(worst)} ({name}), "
        f"above {100 * LARGE_ERROR:g} %."
    )
    if design.certificate.lower_bound > LARGE_ERROR:
        least = words.error(design.certificate.lower_bound)
        text += f" No choice within the model file's limits has less than {least}."
    yield f"{text} What may lower it: {', '.join(ways_to_less_error(spec))}."


def _responses(synthesis: Synthesis) -> Iterator[str]:
    """Wanted responses that the model shows and the nominal circuit does not."""
    found, file = synthesis.model_responses, synthesis.modelfile
    for checked in checked_design.check(synthesis.design, found, None):
        wanted = checked.model
        if wanted.found and not checked.agrees:
            name = wanted.expected or wanted.orbit.response
            at, shown = file.drive_text(wanted.omega), words.orbit(checked.circuit)
            yield f"The nominal circuit does not show {name} at {at}: it shows {shown}."


def _misfits(synthesis: Synthesis) -> Iterator[str]:
    """Curved laws whose force is off where a response of the model draws them."""
    file = synthesis.modelfile
    if not curved_laws(file.model):
        return
    for r in synthesis.model_responses:
        model = file.model.at(r.b)
        flow = model_flow(model, r.omega)
        for misfit in law_misfits(model, flow, r.orbit, np.ones(flow.system.size)):
            text = misfit.text(r.orbit.response, in_si=file.si is not None)
            yield f"At {file.drive_text(r.omega)} the response {text}."


def _rules(ids: Sequence[str]) -> str:
    names = " and ".join(filter(None, (", ".join(ids[:-1]), ids[-1])))
    if len(ids) == 1:
        return f"A design rule fails on the circuit: {names}."
    return f"{len(ids)} design rules fail on the circuit: {names}."
