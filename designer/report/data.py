"""What a report is made from, and what follows from it about each response."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from designer.board.board_parts import board_circuit
from designer.board.bom import bill
from designer.board.component import Numbers, components, pin_numbers, to_buy
from designer.check.checked_design import CheckedResponse
from designer.circuit.design import Design
from designer.circuit.netlist import Circuit
from designer.dynamics.orbit import OrbitStatus
from designer.model.model_file import ModelFile
from designer.report.layers import Layers
from designer.spread.part_grades import BetterGrade, better_grades
from designer.yields.joint_yield import all_on_one
from designer.yields.ngspice_sampling import Hearing
from designer.yields.verdict import Answer, StudyPlan, Yield

if TYPE_CHECKING:
    from designer.spice.equation_check import EquationCheck
    from designer.yields.run_result import RunResult


@dataclass(frozen=True)
class ReportData:
    """What a report is made from.

    checked : every wanted response. plan, answers : the tolerance study, of some or all of them;
    plan None where there was none. yields : one for each response (None where it was left out) or
    one for each question of the plan; None where there was no study. bom : rows of ``bom.csv``.
    command : the command line that makes these results again. equations : the equation check.
    heard : what ngspice said about boards of the study. layers : what else the study has.
    starts : how to start each response, from ``setup.csv``; empty where there is none. board : the
    circuit with its fittings, to be drawn; None for no drawing. pins : of its op-amps.
    better_grades : parts that are bought at a better grade than was asked for.
    """

    modelfile: ModelFile
    design: Design
    checked: tuple[CheckedResponse, ...]
    yields: tuple[Yield | None, ...] | None
    answers: tuple[Answer, ...]
    plan: StudyPlan | None
    bom: Sequence[Mapping[str, str]]
    provenance: Mapping[str, Any]
    command: str
    equations: EquationCheck | None = None
    heard: tuple[Hearing, ...] = ()
    layers: Layers = field(default_factory=Layers)
    starts: tuple[str, ...] = ()
    board: Circuit | None = None
    pins: Numbers = field(default_factory=dict)
    better_grades: Mapping[str, BetterGrade] = field(default_factory=dict)

    @classmethod
    def of(cls, result: RunResult, command: str, starts: Sequence[str] = ()) -> ReportData:
        """The data of a finished run."""
        circuit, choice = board_circuit(result)
        found = components(circuit, result.catalog, choice)
        return cls(
            modelfile=result.modelfile,
            design=result.design,
            checked=result.checked,
            yields=result.yields,
            answers=result.answers,
            plan=result.plan,
            bom=[line.cells() for line in bill(to_buy(found, choice))],
            provenance=result.provenance,
            command=command,
            equations=result.equations,
            heard=result.study.heard,
            starts=tuple(starts),
            board=circuit,
            pins=pin_numbers(found),
            better_grades=better_grades(result.modelfile, result.design.circuit, result.catalog),
            layers=Layers(
                tuned=result.study.tuned,
                trimmed=result.study.trimmed,
                reached=result.study.reached,
                combined=result.study.combined,
                recipes=result.study.recipes or (),
                blame=result.study.blame,
                maps=result.study.maps,
                status=result.study.blame_status,
            ),
        )

    @cached_property
    def question_of(self) -> tuple[int | None, ...]:
        """For each response its question in the plan; None where it was left out."""
        free = dict(enumerate(self.plan.questions)) if self.plan is not None else {}
        found: list[int | None] = []
        for c in self.checked:
            same = (
                i
                for i, q in free.items()
                if q.spec == c.model.spec and q.excitation == c.excitation
            )
            number = next(same, None)
            if number is not None:
                del free[number]
            found.append(number)
        return tuple(found)

    @property
    def census(self) -> bool:
        """Whether the study's boards are all the boards there are."""
        return self.plan is not None and self.plan.census

    @property
    def ngspice_asked(self) -> bool:
        """Whether ngspice was asked about every response that the nominal circuit shows."""
        shown = [c for c in self.checked if c.circuit.status is OrbitStatus.PERIODIC]
        return any(c.gate is not None for c in self.checked) and all(
            c.gate is not None for c in shown
        )

    def answers_to(self, response: int) -> tuple[Answer, ...]:
        """Answers for response number ``response``, by sample."""
        number = self.question_of[response]
        return tuple(a for a in self.answers if number is not None and a.question == number)

    def heard_of(self, response: int) -> tuple[Hearing, ...]:
        """What ngspice said about response number ``response``, by sample."""
        number = self.question_of[response]
        return tuple(h for h in self.heard if number is not None and h.question == number)

    def yield_of(self, response: int) -> Yield | None:
        """Its yield; None where it was left out or there was no study."""
        if self.yields is None:
            return None
        if len(self.yields) == len(self.checked):
            return self.yields[response]
        number = self.question_of[response]
        return self.yields[number] if number is not None and number < len(self.yields) else None

    @cached_property
    def all_on_one_board(self) -> Yield | None:
        """Boards that show every response; None unless each was asked of each board."""
        if len(self.checked) < 2 or None in self.question_of or not self.answers:
            return None
        return all_on_one(self.answers, self.census)
