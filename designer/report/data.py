"""What a report is made from, and what follows from it about each response."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from designer.base.errors import InputError
from designer.base.si_unit import prefixed
from designer.board.board_parts import board_circuit
from designer.board.bom import bill
from designer.board.component import Numbers, components, pin_numbers, to_buy
from designer.board.kicad_reader import BoardFile
from designer.check.checked_design import CheckedResponse, traces
from designer.check.synthesis_result import Synthesis
from designer.circuit.design import Design
from designer.circuit.law_curves import LawCurve, law_curves
from designer.circuit.netlist import Circuit
from designer.circuit.nominal import Trace
from designer.design_rules.rule_subject import RuleSubject
from designer.dynamics.orbit import OrbitStatus
from designer.fabrication.bench_sheet import BenchSheet, bench_sheet
from designer.fabrication.board_cost import CostEstimate, cost_or_none
from designer.model.mechanics import MechanicalModel
from designer.model.model import Mechanical, SiScales
from designer.model.relative_motion import RelativeMotion, companion_motions, different_motions
from designer.model.si_units import in_si
from designer.report import words
from designer.spread.part_grades import BetterGrade, better_grades
from designer.verdicts.verdict import StudyPlan
from designer.workbench.prediction import BoardPrediction, PredictedStop
from designer.yields.loss_attribution import ResponseAttribution
from designer.yields.study import RunResult, Study
from designer.yields.yield_count import Yield

if TYPE_CHECKING:
    from designer.answers.design_answer import RuleShown

OF_DESIGN = {"drawn", "traces", "stops", "bom", "board_cost", "bench", "board"}
"""What the design and its nominal responses decide, by the names of ``ReportData``."""
ALL = "all on one board"
"""Name of the yield of every response on the same board."""


@dataclass(frozen=True)
class ReportData:
    """A finished run, and how it was asked for."""

    result: RunResult
    """What the run found."""
    command: str
    """The command line that makes these results again; "" where there is none."""
    starts: tuple[str, ...] = ()
    """How to start each response, from ``setup.csv``; empty where there is none."""
    board_file: BoardFile | None = None
    """The board as the tool has written it beside the report; None where there is none."""
    warnings: tuple[str, ...] = ()
    """What is not good enough about the design, in sentences."""
    failed_rules: tuple[RuleShown, ...] = ()
    """The design rules that fail on its circuit: ``id``, ``found``, ``limit`` and ``do``."""
    folder: str = ""
    """Name of the folder of the design; "" where it is in none."""
    drawn: dict[str, str] = field(default_factory=dict, init=False, compare=False, repr=False)
    """Pictures and plots that the design and its nominal responses decide, by name (``once``)."""

    def once(self, name: str, draw: Callable[[], str]) -> str:
        """What ``draw`` makes; drawn once for this report and those that follow it
        (``of_study``)."""
        if name not in self.drawn:
            self.drawn[name] = draw()
        return self.drawn[name]

    def of_study(self, result: RunResult) -> ReportData:
        """The data of a study that went on; what the design decides is taken over."""
        later = replace(self, result=result)
        alike = zip(result.checked, self.checked, strict=False)
        if len(result.checked) != len(self.checked) or any(a is not b for a, b in alike):
            return later
        for name in OF_DESIGN & vars(self).keys():
            vars(later)[name] = vars(self)[name]
        return later

    @property
    def design(self) -> Design:
        return self.result.design

    @property
    def checked(self) -> tuple[CheckedResponse, ...]:
        """Every wanted response."""
        return self.result.checked

    @property
    def study(self) -> Study:
        return self.result.study

    @property
    def plan(self) -> StudyPlan:
        return self.study.plan

    @property
    def mechanical(self) -> Mechanical | None:
        """The SI parameters; None where the model file is dimensionless."""
        return self.result.modelfile.mechanical

    @property
    def si(self) -> SiScales | None:
        """SI values of the model's units; None where they are not known."""
        return self.result.modelfile.si

    @property
    def parameters(self) -> MechanicalModel | Mechanical:
        """The parameters as the model file gives them."""
        return self.mechanical or self.design.model

    @cached_property
    def yields(self) -> tuple[Yield | None, ...]:
        """The yield of each response; None where it was left out of the study."""
        return self.study.yields

    @property
    def rated(self) -> tuple[list[str], list[Yield | None]]:
        """What has a yield, by the names of pictures, with it: every response, and all of them on
        one board where that was counted."""
        names, yields = [words.label(c) for c in self.checked], list(self.yields)
        joint = self.study.all_on_one_board
        return (names, yields) if joint is None else ([*names, ALL], [*yields, joint])

    @cached_property
    def traces(self) -> tuple[Mapping[str, Trace], ...]:
        """The orbit of each response by engine, in model units (``checked_design.traces``)."""
        return tuple(traces(self.design, c) for c in self.checked)

    def motions(self, response: int) -> tuple[RelativeMotion, ...]:
        """What moves in the clearances at a response, with its own stops: clearances in which the
        same displacement is seen have one motion. Of a model whose numbers
        are SI values in the unit that suits the largest displacement, such as mm."""
        checked = self.checked[response].model
        model = self.design.model.at(checked.b)
        motions = different_motions(model.second_order())
        if not in_si(self.si, model):
            return motions
        places = [abs(gap) for motion in motions for gap in motion.gaps]
        moved = checked.orbit.extremes[0::2] if len(checked.orbit.extremes) else np.zeros(0)
        metres, unit = prefixed(max([*places, *np.abs(moved).ravel().tolist()], default=1.0), "m")
        return tuple(motion.in_unit(1.0 / metres, unit) for motion in motions)

    def companions(self, response: int, motion: RelativeMotion) -> tuple[RelativeMotion, ...]:
        """Over a base that moves: the absolute displacement of what a motion counts from the base,
        or the other way round, in its unit."""
        system = self.design.model.at(self.checked[response].model.b).second_order()
        each = (m.in_unit(motion.scale, motion.unit) for m in companion_motions(system))
        return tuple(m for m in each if np.array_equal(m.row, motion.row))

    @property
    def stops(self) -> tuple[PredictedStop, ...]:
        """The stages of the clearances on the nominal board."""
        return self.zones[: len(self.design.circuit.stops)]

    @cached_property
    def zones(self) -> tuple[PredictedStop, ...]:
        """The stages of all dead zones of the nominal board, those of the clearances first."""
        result = self.result
        nominal = Synthesis(result.modelfile, result.catalog, result.model_responses, result.design)
        return BoardPrediction(nominal).zones

    @cached_property
    def laws(self) -> tuple[LawCurve, ...]:
        """The force laws, as wanted and as the nominal board makes them."""
        orbits = [c.model.orbit.extremes for c in self.checked]
        return law_curves(self.design, orbits, si=in_si(self.si, self.design.model))

    @cached_property
    def bom(self) -> list[Mapping[str, str]]:
        """Rows of ``bom.csv``."""
        circuit, choice = board_circuit(self.result)
        parts = to_buy(components(circuit, self.result.catalog, choice), choice)
        return [line.cells() for line in bill(parts)]

    @cached_property
    def board_cost(self) -> CostEstimate | None:
        """What the boards cost, estimated; None where there can be no board."""
        return cost_or_none(self.result)

    @cached_property
    def bench(self) -> BenchSheet | None:
        """What to expect at the test points; None where there can be no board, or it has none."""
        result = self.result
        made = Synthesis(result.modelfile, result.catalog, result.model_responses, result.design)
        try:
            return bench_sheet(RuleSubject.of(made))
        except InputError:
            return None

    @cached_property
    def board(self) -> tuple[Circuit, Numbers]:
        """The circuit with its fittings, and the pins of its op-amps."""
        circuit, choice = board_circuit(self.result)
        return circuit, pin_numbers(components(circuit, self.result.catalog, choice))

    @property
    def better_grades(self) -> Mapping[str, BetterGrade]:
        """Parts that are bought at a better grade than was asked for."""
        return better_grades(self.result.modelfile, self.design.circuit, self.result.catalog)

    @property
    def ngspice_ran(self) -> bool:
        """Whether ngspice ran every response that the nominal circuit shows."""
        periodic = [c for c in self.checked if c.circuit.status is OrbitStatus.PERIODIC]
        return any(c.gate is not None for c in self.checked) and all(
            c.gate is not None for c in periodic
        )

    def question_of(self, response: int) -> int | None:
        """The question of the plan that asks for a response; None where it was left out."""
        indices = self.study.response_indices
        return indices.index(response) if response in indices else None

    def attribution_of(self, response: int) -> ResponseAttribution | None:
        """The attribution of a response."""
        attribution, question = self.study.blame, self.question_of(response)
        rows = () if attribution is None else attribution.responses
        return next((b for b in rows if b.question == question), None)


def portrait_name(response: int, motion: int) -> str:
    """Name of the portrait of a response, by the numbers of the response and of its motion."""
    return f"portrait {response} {motion}"


def stop_name(clearance: int) -> str:
    """Name of the plot of the dead zone of a clearance."""
    return f"stop {clearance}"
