"""What the rules look at: a design with its components, and what its circuit does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from designer.base.second_process import Ask
from designer.base.units import parse_quantity
from designer.board.board_parts import board_circuit
from designer.board.component import Component, components
from designer.catalog.design_rule import Finding, NotRun
from designer.catalog.entries import ROOM, OpAmp
from designer.catalog.parts_catalog import Catalog
from designer.check.synthesis_result import Synthesis
from designer.circuit.design import Design
from designer.circuit.netlist import Circuit
from designer.circuit.nominal import circuit_flow, nominal_reduction, on_circuit
from designer.circuit.reduction import Reduction
from designer.circuit.static_shifts import Shifts, forces, least_drive
from designer.model.find_responses import ModelResponse, peaks
from designer.synthesis import output_loads
from designer.synthesis.operating_point import Operating, merged, operating, stuck
from designer.synthesis.output_loads import Run


@dataclass(frozen=True)
class RuleSubject:
    """The design and the board that the rules check.

    Quantities that take time are computed when a rule first asks for them.
    """

    synthesis: Synthesis
    """The design, with its model."""
    circuit: Circuit
    """The circuit with its fittings."""
    components: Sequence[Component]
    """The components of its board."""
    other: Ask | None = None
    """A process that may take half of what takes long."""

    @classmethod
    def of(cls, synthesis: Synthesis, other: Ask | None = None) -> Self:
        """A design with the board that its model file asks for.

        Raises
        ------
        InputError : there can be no such board, as ``board_parts.fitted`` and
            ``component.components`` say.
        """
        circuit, choice = board_circuit(synthesis)
        return cls(synthesis, circuit, components(circuit, synthesis.catalog, choice), other)

    @property
    def design(self) -> Design:
        return self.synthesis.design

    @property
    def catalog(self) -> Catalog:
        return self.synthesis.catalog

    @property
    def model_responses(self) -> Sequence[ModelResponse]:
        return self.synthesis.model_responses

    @property
    def opamp(self) -> OpAmp:
        """The catalogue's entry of the circuit's op-amp, with the bounds that hold at every
        temperature of the boards."""
        figures = self.circuit.figures or self.catalog.opamp(self.circuit.opamp)
        return figures.over(self.catalog.temperatures)

    @property
    def warm(self) -> str:
        """Temperatures that bounds hold at, as a part of a sentence; "" where none are stated."""
        if self.catalog.temperatures is None:
            return ""
        low, high = (f(*self.catalog.temperatures, ROOM) for f in (min, max))
        return f", from {low:g} to {high:g} °C"

    @cached_property
    def reduction(self) -> Reduction:
        """The reduction of the nominal board: of the design's own, where what is simulated is."""
        return nominal_reduction(replace(self.design, circuit=replace(self.circuit, fittings=())))

    @cached_property
    def _runs(self) -> tuple[list[Run], dict[str, str]]:
        if not self.model_responses:
            raise NotRun("the model file wants no response, so nothing says what the board does")
        system = self.reduction.system()
        drives = [circuit_flow(system, self.design, r).drive for r in self.model_responses]
        orbits = [on_circuit(system, self.design, r) for r in self.model_responses]
        return output_loads.runs([r.omega for r in self.model_responses], drives, orbits)

    @cached_property
    def each_run(self) -> dict[str, Operating]:
        """What is met in each wanted response, and in each start from rest, by its name.

        Raises
        ------
        NotRun : there is no response to go by.
        """
        return {run.name: operating(self.reduction, [run], {}) for run in self._runs[0]}

    @cached_property
    def operating(self) -> Operating:
        """Over the wanted responses and their starts from rest.

        Raises
        ------
        NotRun : there is no orbit to go by.
        """
        found = merged(list(self.each_run.values()))
        found.left_out |= self._runs[1]
        return _complete(found, "at")

    @cached_property
    def stuck(self) -> Operating:
        """What is met with each op-amp stuck at each rail, at the largest amplitude of the wanted
        responses."""
        runs, left_out = self._runs
        if not runs:
            raise NotRun(f"no orbit of the exact circuit: {left_out}")
        largest = max(runs, key=lambda run: abs(run.drive.amplitude))
        return _complete(stuck(self.circuit, largest, self.other), "with")

    @cached_property
    def forces(self) -> tuple[Shifts, ...]:
        """Disturbances as constant forces at each clearance, as shares of the drive's amplitude."""
        drive = least_drive(self.design.model, self.model_responses)
        system, volts = self.design.model.second_order(), self.design.volts()
        return forces(self.circuit, system, volts, drive)

    @cached_property
    def fastest(self) -> float:
        """Frequency of the highest harmonic that matters [Hz]."""
        highest = peaks(self.design.model, self.model_responses).fastest
        return highest / (2.0 * np.pi * self.design.errors.scales.seconds)

    @cached_property
    def resistor_grades(self) -> dict[str, float]:
        """Grade of each resistor as it is bought; where none is known, that of the model file."""
        usual = self.synthesis.modelfile.circuit.resistor_grade
        bought_grades = {
            name: component.bought.grade
            for component in self.components
            if component.bought is not None and component.bought.grade is not None
            for name in component.parts
        }
        return {r.name: bought_grades.get(r.name, usual) for r in self.circuit.resistors}

    @cached_property
    def watts(self) -> dict[str, float]:
        """Rated power [W] by resistor, of what is ordered; without those that state none."""
        return self._rated("resistor", "W")

    @cached_property
    def volts(self) -> dict[str, float]:
        """Rated voltage [V] by capacitor, likewise."""
        return self._rated("capacitor", "V")

    @cached_property
    def dielectrics(self) -> dict[str, str]:
        """What each capacitor is made of, in words."""
        capacitors = (c for c in self.components if c.kind == "capacitor" and c.bought is not None)
        return {c.parts[0]: c.bought.dielectric for c in capacitors if c.bought is not None}

    def kept_under_dc(self, capacitor: Component) -> float:
        """Share of its capacitance that a capacitor keeps at the supply's voltage.

        Raises
        ------
        NotRun : the catalogue does not say it of a ceramic that is not C0G, or states no voltage.
        """
        bought = capacitor.bought
        assert bought is not None
        rated = self.volts.get(capacitor.parts[0])
        if bought.dc_bias is not None and rated is not None:
            return 1.0 - bought.dc_bias * min(self.circuit.supply / rated, 1.0)
        if "ceramic" in bought.dielectric and "C0G" not in bought.dielectric:
            raise NotRun(f"the catalogue does not say what {bought.part_number} keeps under DC")
        return 1.0

    def _rated(self, kind: str, unit: str) -> dict[str, float]:
        out = {}
        for component in self.components:
            if component.kind != kind or component.bought is None:
                continue
            for words in component.bought.rating.split(", "):
                if words.endswith(unit):
                    out[component.parts[0]] = parse_quantity(words, unit)
        return out


def _complete(point: Operating, place: str) -> Operating:
    """The extremes over all runs; ``NotRun`` where a run has no answer."""
    for name, why in point.left_out.items():
        raise NotRun(f"no answer of the exact circuit {place} {name}: {why}")
    return point


Look = Callable[[RuleSubject], Iterable[Finding]]
"""A rule on the circuit."""
