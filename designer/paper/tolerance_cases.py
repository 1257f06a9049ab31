"""The circuits and spreads that the tolerance report compares, and what is asked of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from designer.base.arrays import Array
from designer.catalog.parts_catalog import Catalog
from designer.check.synthesis_result import synthesise
from designer.circuit import paper_values
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit
from designer.model.find_responses import ModelResponse, find
from designer.model.model_file import ModelFile
from designer.paper.circuits import CORRECTED, OMEGA, PRINTED, RECTIFIER, build, model_file
from designer.spread.spread import Spread
from designer.verdicts.verdict import Question, StudyPlan, Verdict, judge
from designer.yields.yield_count import Yield

RESISTORS = (0.05, 0.01, 0.001)
CAPACITORS = (0.05, 0.01)
REFERENCE = (0.01, 0.01, True)
"""Grades and offsets of the case whose attribution is worked out."""
TITLES = {
    PRINTED: "paper, as printed",
    CORRECTED: "paper, corrected",
    RECTIFIER: "rectifier stage",
}


@dataclass(frozen=True)
class SpreadCase:
    """A circuit under a spread."""

    circuit: str
    resistor: float
    """Grade of the resistors, a fraction."""
    capacitor: float
    """Grade of the capacitors, a fraction."""
    offsets: bool
    """Whether the op-amps have offsets."""
    plan: StudyPlan
    """What decides the samples, with the responses that the nominal circuit shows."""
    asked: tuple[int, ...]
    """p of the response of each question."""
    missing: dict[int, str]
    """What the nominal circuit shows instead of the wanted response, by p."""

    @property
    def name(self) -> str:
        """ "printed-r1-c5-offsets": grades in per cent."""
        ending = "offsets" if self.offsets else "level"
        return f"{self.circuit}-r{100 * self.resistor:g}-c{100 * self.capacitor:g}-{ending}"

    @property
    def reference(self) -> bool:
        """Whether it is the case whose attribution is worked out."""
        return (self.resistor, self.capacitor, self.offsets) == REFERENCE


@dataclass(frozen=True)
class YieldRow:
    """The yield of one response in one case."""

    circuit: str
    resistor: float
    """Grade of the resistors, a fraction."""
    capacitor: float
    """Grade of the capacitors, a fraction."""
    offsets: bool
    """Whether the op-amps have offsets."""
    expect: str
    """The wanted response, such as "1-3-3"."""
    omega: float
    """Dimensionless frequency."""
    kind: str
    """Kind of the yield, such as "as built"."""
    there: bool
    """Whether the nominal circuit shows it; where it does not every count is 0."""
    ok: int
    """Boards that keep the response."""
    lost: int
    """Boards that lose the response."""
    grazing: int
    """Boards whose count of impacts is undecided."""
    failed: int
    """Boards without an answer."""

    @property
    def counted(self) -> Yield:
        return Yield(self.ok, self.lost, self.grazing, self.failed)

    @property
    def spread(self) -> tuple[float, float, bool]:
        """Grade of the resistors and of the capacitors, and whether there are offsets."""
        return (self.resistor, self.capacitor, self.offsets)


def cases(catalog: Catalog, *, samples: int, seed: int) -> Iterator[SpreadCase]:
    """Every case, the reference case of each circuit first."""
    modelfile = model_file()
    wanted = find(modelfile.model, modelfile.responses)
    opamp = catalog.opamp(paper_values.OPAMP)
    grades = [(r, c, o) for o in (True, False) for r in RESISTORS for c in CAPACITORS]
    grades.sort(key=lambda g: g != REFERENCE)
    circuits = list(_circuits(modelfile, wanted, catalog))
    for resistor, capacitor, offsets in grades:
        spread = Spread.bench_1(opamp, resistor, capacitor)
        if not offsets:
            spread = replace(spread, offset_sigma=0.0, offset_limit=0.0)
        for name, circuit, questions, missing in circuits:
            plan = StudyPlan(circuit, spread, seed, samples, tuple(questions.values()))
            yield SpreadCase(name, resistor, capacitor, offsets, plan, tuple(questions), missing)


def _circuits(
    modelfile: ModelFile, wanted: tuple[ModelResponse, ...], catalog: Catalog
) -> Iterator[tuple[str, Circuit, dict[int, Question], dict[int, str]]]:
    for name in (PRINTED, CORRECTED):
        one = build(name, catalog)
        settings = [one.excitation(r.omega) for r in wanted]
        yield name, one.circuit, *_questions(one.circuit, one.volts, settings, wanted)
    design = synthesise(modelfile, catalog).design
    settings = [design.excitation(r.b, r.omega) for r in wanted]
    yield RECTIFIER, design.circuit, *_questions(design.circuit, design.volts(), settings, wanted)


def _questions(
    circuit: Circuit,
    volts: Array,
    settings: list[Excitation],
    wanted: tuple[ModelResponse, ...],
) -> tuple[dict[int, Question], dict[int, str]]:
    """The questions that can be asked, by p, and what stands in the place of the others."""
    system = Reduction(circuit, nominal_board(circuit)).system()
    questions: dict[int, Question] = {}
    missing: dict[int, str] = {}
    for p, response, excitation in zip(OMEGA, wanted, settings, strict=True):
        orbit: Orbit = settle(Flow(system, excitation.drive), response.orbit.start * volts)
        if judge(orbit, response.spec, orbit)[0] is Verdict.OK:
            questions[p] = Question(response.spec, excitation, orbit, None)
        else:
            missing[p] = orbit.response
    return questions, missing
