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
    """What a report is made from."""

    modelfile: ModelFile
    """The model file."""
    design: Design
    """The design."""
    checked: tuple[CheckedResponse, ...]
    """Every wanted response."""
    yields: tuple[Yield | None, ...] | None
    """One for each response (None where it was left out) or one for each question of the plan; None
    where there was no study."""
    answers: tuple[Answer, ...]
    """Rows of the study, of some or all of the responses."""
    plan: StudyPlan | None
    """What decides the study's samples; None where there was no study."""
    bom: Sequence[Mapping[str, str]]
    """Rows of ``bom.csv``."""
    provenance: Mapping[str, Any]
    """Versions, seed and settings."""
    command: str
    """The command line that makes these results again."""
    equations: EquationCheck | None = None
    """The equation check; None where it was not made."""
    heard: tuple[Hearing, ...] = ()
    """What ngspice said about boards of the study."""
    layers: Layers = field(default_factory=Layers)
    """What else the study has."""
    starts: tuple[str, ...] = ()
    """How to start each response, from ``setup.csv``; empty where there is none."""
    board: Circuit | None = None
    """The circuit with its fittings, to be drawn; None for no drawing."""
    pins: Numbers = field(default_factory=dict)
    """Pins of the board's op-amps."""
    better_grades: Mapping[str, BetterGrade] = field(default_factory=dict)
    """Parts that are bought at a better grade than was asked for."""

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
