"""Upgrades of a design, and the model file and the circuit that have them.

Everything that an upgrade changes stands in the model file afterwards, so the upgraded design is a
design like any other: parts of a better grade are ``[[spread.part]]``, parts that track
``[[spread.network]]``, a response at another place of its window has another ``omega`` or ``b``,
a DC offset that is trimmed on each board is the band of ``[tuning]``, and a trimmer that is fitted
is ``[board] dc_trim``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from designer.board.board_parts import board_circuit
from designer.board.bom import bill
from designer.board.component import components, to_buy
from designer.catalog.parts_catalog import Catalog
from designer.check.synthesis_result import Synthesis
from designer.circuit import build
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.dead_zone_parts import dead_zone_stage
from designer.circuit.design import Certificate, Design
from designer.circuit.netlist import Circuit
from designer.circuit.reduction import Reduction
from designer.model.find_responses import ModelResponse, find, peaks
from designer.model.model_file import ModelFile
from designer.model.response_table import placed
from designer.synthesis import output_loads, side_conditions

if TYPE_CHECKING:
    from designer.answers.cure_answer import PlaceRow, UpgradesRow


@dataclass(frozen=True)
class WindowPlace:
    """Where in its window a response is shown, in the model's units."""

    omega: float
    """Dimensionless frequency."""
    b: float
    """Dimensionless clearance."""


@dataclass(frozen=True)
class PartNetwork:
    """Parts that are bought as one array."""

    family: str
    """Family of the catalogue's arrays."""
    parts: tuple[str, ...]


@dataclass(frozen=True)
class Upgrades:
    """What is changed; None and empty: as it is."""

    opamp: str | None = None
    """Name of another op-amp."""
    dead_zone: str | None = None
    """Kind of another dead-zone stage."""
    reference: str | None = None
    """Name of another voltage reference."""
    grades: Mapping[str, float] = field(default_factory=dict)
    """Grades by part, fractions."""
    places: Mapping[int, WindowPlace] = field(default_factory=dict)
    """Other places, by number of the response."""
    trim: float | None = None
    """Half-width of the band of the generator's DC offset over its amplitude, within which each
    board is trimmed."""
    trimmer: bool = False
    """Whether the board's own trimmer is fitted, and set on each board."""
    networks: tuple[PartNetwork, ...] = ()
    """Arrays in the places of parts."""

    def in_words(self, file: ModelFile) -> list[str]:
        """Each upgrade in a few words, the same grade of several parts together.

        file : the model file that is repaired.
        """
        phrases = []
        if self.opamp is not None:
            phrases.append(f"op-amp {self.opamp}")
        if self.dead_zone is not None:
            phrases.append(f"dead zone: {self.dead_zone}")
        if self.reference is not None:
            phrases.append(f"reference {self.reference}")
        for grade in sorted(set(self.grades.values())):
            names = [name for name, of_part in self.grades.items() if of_part == grade]
            phrases.append(f"{100.0 * grade:g} % {' '.join(names)}")
        phrases += [f"array {n.family} for {' '.join(n.parts)}" for n in self.networks]
        for number, place in sorted(self.places.items()):
            phrases.append(
                f"response {number + 1} at {file.drive_text(place.omega)}, b = {place.b:g}"
            )
        if self.trimmer:
            phrases.append("trimmer fitted, set once on each board")
        if self.trim is not None:
            phrases.append(f"DC offset trimmed on each board, ± {100.0 * self.trim:g} %")
        return phrases

    def as_dict(self) -> UpgradesRow:
        """Plain data for JSON; responses are counted from 1."""
        places: list[PlaceRow] = [
            {"response": i + 1, "omega": p.omega, "b": p.b} for i, p in sorted(self.places.items())
        ]
        return {
            "opamp": self.opamp,
            "dead_zone": self.dead_zone,
            "reference": self.reference,
            "grades": dict(sorted(self.grades.items())),
            "places": places,
            "trim": self.trim,
            "trimmer": self.trimmer,
            "networks": [{"family": n.family, "parts": n.parts} for n in self.networks],
        }

    @classmethod
    def of_dict(cls, record: UpgradesRow) -> Upgrades:
        """The upgrades that ``as_dict`` wrote."""
        return cls(
            opamp=record["opamp"],
            dead_zone=record["dead_zone"],
            reference=record["reference"],
            grades=dict(record["grades"]),
            places={p["response"] - 1: WindowPlace(p["omega"], p["b"]) for p in record["places"]},
            trim=record["trim"],
            trimmer=record.get("trimmer", False),
            networks=tuple(
                PartNetwork(n["family"], tuple(n["parts"])) for n in record.get("networks", ())
            ),
        )


def upgraded_file(modelfile: ModelFile, upgrades: Upgrades) -> ModelFile:
    """The model file with these upgrades; the same object where nothing is changed.

    A stated saturation belongs to the op-amp it was stated for: another one has its own.
    """
    if upgrades == Upgrades():
        return modelfile
    data = {**modelfile.data, "title": modelfile.title}
    circuit = data.setdefault("circuit", {})
    if upgrades.opamp is not None:
        circuit["opamp"] = upgrades.opamp
        circuit.pop("saturation", None)
    # A stage that was chosen for the file is the one that is repaired: it is not chosen again.
    zone = upgrades.dead_zone or modelfile.circuit.dead_zone
    if zone is not None:
        circuit["dead_zone"] = zone
    if upgrades.reference is not None:
        circuit["reference"] = upgrades.reference
    for number, place in upgrades.places.items():
        table, moves = data["response"][number], place.omega != modelfile.responses[number].omega
        omega = place.omega if moves else None
        data["response"][number] = placed(table, omega, place.b, modelfile.si)
    if upgrades.trim is not None:
        data["tuning"] = {"frequency": 0.0, "amplitude": 0.0, "offset": upgrades.trim}
    if upgrades.trimmer:
        data.setdefault("board", {})["dc_trim"] = "fitted"
    parts = data.setdefault("spread", {}).setdefault("part", [])
    for grade in sorted(set(upgrades.grades.values())):
        names = [name for name, of_part in upgrades.grades.items() if of_part == grade]
        picked = [name for name in names if _was_picked_out(modelfile, name, grade)]
        others = [name for name in names if name not in picked]
        parts += [{"names": others, "grade": grade}] * bool(others)
        parts += [{"names": picked, "grade": grade, "law": "uniform"}] * bool(picked)
    for network in upgrades.networks:
        networks = data["spread"].setdefault("network", [])
        networks.append({"parts": list(network.parts), "family": network.family})
    return modelfile.rewritten(data)


def _was_picked_out(modelfile: ModelFile, name: str, grade: float) -> bool:
    """Whether a part of this grade is one of those that a binned law says were picked out: it lies
    anywhere within the grade, while the law of what was left does not reach it."""
    rules = modelfile.spread
    kind = "resistors" if name.startswith("R") else "capacitors"
    law = rules.resistors if kind == "resistors" else rules.capacitors
    composite = name[:-1] if name[-1] in "AB" else name  # of a composite's two parts
    for rule in rules.part:
        if rule.law is not None and {name, composite, kind} & set(rule.names):
            law = rule.law
    return law.law == "binned" and grade <= law.inner


def rebuilt(design: Design, modelfile: ModelFile, catalog: Catalog) -> Circuit:
    """The design's parts with the op-amp and the references that this file names."""
    spec, model = modelfile.circuit, modelfile.model
    opamp = catalog.opamp(spec.opamp)
    return build.circuit_of(
        model,
        design.circuit.values,
        opamp,
        supply=design.circuit.supply,
        saturation=spec.saturation,
        stage=dead_zone_stage(model, spec, catalog, design.circuit.values),
        composites=design.composites,
    )


def with_same_parts(
    base: Synthesis, modelfile: ModelFile, loaded: Sequence[int] | None = None
) -> Synthesis:
    """The base's parts in a design for another model file, verified afresh.

    loaded : numbers of the responses for which the op-amps' loads are computed; None: all. A
    response that stayed where it was loads the same circuit as before.

    The file differs in what ``Upgrades`` changes but for the dead zone. Its design's ``checks`` say
    whether the side conditions still hold.

    Raises
    ------
    InputError : the catalogue does not know a part.
    """
    model, catalog = modelfile.model, base.catalog
    circuit = rebuilt(base.design, modelfile, catalog)
    responses = _model_responses(base, modelfile)
    model_peaks = peaks(model, responses)
    swing = float((base.design.errors.scales.volts * model_peaks.states).max()), model_peaks.states
    errors = coefficient_errors(circuit, model.second_order(), swing=swing)
    design = replace(
        base.design,
        circuit=circuit,
        errors=errors,
        certificate=Certificate("bound", 0.0, "the parts are those of the design that was cured"),
        binding={},
    )
    conditions = modelfile.circuit.active_conditions
    amplitudes = design.largest_amplitudes(responses)
    needed = None
    if responses and conditions & {"swing", "load"}:
        loading = responses if loaded is None else [responses[number] for number in loaded]
        needed = output_loads.design_loads(
            design, Reduction(circuit, nominal_board(circuit)), loading
        )
    checks = side_conditions.verify(
        design,
        conditions,
        catalog.opamp(circuit.opamp).over(catalog.temperatures),
        model_peaks,
        amplitudes,
        needed,
    )
    stated = {c.quantity: c.limit for c in base.design.checks}
    numbers = {k: v for k, v in base.design.conditions.items() if k not in stated}
    design = replace(
        design, checks=checks, conditions=numbers | {c.quantity: c.limit for c in checks}
    )
    return replace(base, modelfile=modelfile, model_responses=responses, design=design)


def _model_responses(base: Synthesis, modelfile: ModelFile) -> tuple[ModelResponse, ...]:
    """The model's responses; those that stay where they were are not sought again."""
    responses = dict(zip(base.modelfile.responses, base.model_responses, strict=True))
    return tuple(
        responses[spec] if spec in responses else find(modelfile.model, [spec])[0]
        for spec in modelfile.responses
    )


def price(synthesis: Synthesis) -> float:
    """The price of everything on a design's bill of materials, in euro, with the catalogue's price
    of each class."""
    circuit, choice = board_circuit(synthesis)
    lines = bill(to_buy(components(circuit, synthesis.catalog, choice), choice))
    return float(np.sum([x.quantity * synthesis.catalog.euro(x.price_class) for x in lines]))
