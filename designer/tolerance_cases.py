"""The circuits and spreads that the tolerance report compares, and what is asked of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from designer import paper_design, pipeline
from designer.attractor import settle
from designer.catalog import Catalog
from designer.circuit import Circuit, nominal_board
from designer.coefficients import coefficient_errors
from designer.deck import Excitation
from designer.flow import Flow
from designer.modelfile import ModelFile, parse_model_file
from designer.orbit import Orbit
from designer.paper_design import Candidate
from designer.reduction import Reduction
from designer.responses import ModelResponse, find
from designer.spread import Spread
from designer.system import Array
from designer.verdict import Question, StudyPlan, Verdict, judge

OMEGA = {1: 1.55, 2: 0.85, 3: 0.54, 4: 0.41, 5: 0.337, 6: 0.284, 7: 0.24, 8: 0.215}
"""Drive frequency at which 1-p-p is asked for, by p."""
RESISTORS = (0.05, 0.01, 0.001)
CAPACITORS = (0.05, 0.01)
REFERENCE = (0.01, 0.01, True)
"""Grades and offsets of the case whose blame is worked out."""
PRINTED, CORRECTED, RECTIFIER = "printed", "corrected", "rectifier"
TITLES = {
    PRINTED: "paper, as printed",
    CORRECTED: "paper, corrected",
    RECTIFIER: "rectifier stage",
}

_MODEL = """format = 1
title = "The paper's 1-p-p responses, rectifying dead zone"
[model]
m = 0.5
k = 0.5
k0 = 0.95
c = 0.5
zeta = 0.1
f20 = 0.0
b = 0.25
sides = "both"
{responses}
[circuit]
opamp = "TL074C"
saturation = 13.0
resistors = "E96"
capacitors = "E12"
resistor_grade = 0.01
capacitor_grade = 0.01
dead_zone = "rectifier"
diode = "1N4148"
reference = "LM4040C50"
"""


@dataclass(frozen=True)
class Case:
    """A circuit under a spread. plan : of the responses that the nominal circuit shows.

    asked : for each question its p. missing : by p, what the nominal circuit shows instead.
    """

    circuit: str
    resistor: float
    capacitor: float
    offsets: bool
    plan: StudyPlan
    asked: tuple[int, ...]
    missing: dict[int, str]

    @property
    def name(self) -> str:
        """ "printed-r1-c5-offsets": grades in per cent."""
        said = "offsets" if self.offsets else "level"
        return f"{self.circuit}-r{100 * self.resistor:g}-c{100 * self.capacitor:g}-{said}"

    @property
    def reference(self) -> bool:
        """Whether it is the case whose blame is worked out."""
        return (self.resistor, self.capacitor, self.offsets) == REFERENCE


def model_file() -> ModelFile:
    """The paper's model with the eight 1-p-p responses, and the rectifying dead zone."""
    responses = "\n".join(
        f'[[response]]\nomega = {omega}\nexpect = "1-{p}-{p}"' for p, omega in OMEGA.items()
    )
    return parse_model_file(_MODEL.format(responses=responses))


def cases(catalog: Catalog, *, samples: int, seed: int) -> Iterator[Case]:
    """Every case, the reference case of each circuit first."""
    modelfile = model_file()
    found = find(modelfile.model, modelfile.responses)
    opamp = catalog.opamp(paper_design.OPAMP)
    grades = [(r, c, o) for o in (True, False) for r in RESISTORS for c in CAPACITORS]
    grades.sort(key=lambda g: g != REFERENCE)
    circuits = list(_circuits(modelfile, found, catalog))
    for resistor, capacitor, offsets in grades:
        spread = Spread.bench_1(opamp, resistor, capacitor)
        if not offsets:
            spread = replace(spread, offset_sigma=0.0, offset_limit=0.0)
        for name, circuit, questions, missing in circuits:
            plan = StudyPlan(circuit, spread, seed, samples, tuple(questions.values()))
            yield Case(name, resistor, capacitor, offsets, plan, tuple(questions), missing)


def _circuits(
    modelfile: ModelFile, found: tuple[ModelResponse, ...], catalog: Catalog
) -> Iterator[tuple[str, Circuit, dict[int, Question], dict[int, str]]]:
    model, opamp = modelfile.model, catalog.opamp(paper_design.OPAMP)
    exact = paper_design.corrected()
    papers = {
        PRINTED: Candidate(
            TITLES[PRINTED],
            "",
            paper_design.circuit(model, paper_design.PRINTED, opamp),
            paper_design.PRINTED_FREQUENCY,
            paper_design.PRINTED_AMPLITUDE,
        ),
        CORRECTED: Candidate(
            TITLES[CORRECTED],
            "",
            paper_design.circuit(model, exact, opamp),
            *paper_design.generator(model, exact),
        ),
    }
    for name, candidate in papers.items():
        errors = coefficient_errors(candidate.circuit, model.second_order())
        settings = [Excitation(candidate.frequency * r.omega, candidate.amplitude) for r in found]
        yield (
            name,
            candidate.circuit,
            *_questions(candidate.circuit, errors.scales.volts, settings, found),
        )
    _, design = pipeline.design_for(modelfile, catalog)
    settings = [
        Excitation(design.errors.scales.frequency(r.omega), design.amplitude(r.b)) for r in found
    ]
    yield (
        RECTIFIER,
        design.circuit,
        *_questions(design.circuit, design.volts(), settings, found),
    )


def _questions(
    circuit: Circuit,
    volts: Array,
    settings: list[Excitation],
    found: tuple[ModelResponse, ...],
) -> tuple[dict[int, Question], dict[int, str]]:
    """The questions that can be asked, by p, and what stands in the place of the others."""
    system = Reduction(circuit, nominal_board(circuit)).system()
    questions: dict[int, Question] = {}
    missing: dict[int, str] = {}
    for p, response, excitation in zip(OMEGA, found, settings, strict=True):
        orbit: Orbit = settle(Flow(system, excitation.drive), response.orbit.start * volts)
        if judge(orbit, response.spec, orbit)[0] is Verdict.OK:
            questions[p] = Question(response.spec, excitation, orbit, None)
        else:
            missing[p] = orbit.response
    return questions, missing
