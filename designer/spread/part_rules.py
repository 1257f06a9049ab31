"""The spread of a design: a model file's rules and the catalogue's figures, part by part."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from designer.base.errors import InputError, Unreachable
from designer.base.schema import did_you_mean, one_of
from designer.base.units import format_quantity
from designer.catalog.entries import ROOM, Kind, OpAmp, PartFamily
from designer.catalog.fields import Figure
from designer.catalog.parts_catalog import Catalog
from designer.circuit.netlist import Capacitor, Circuit, Reference, Resistor
from designer.circuit.resistors import composites_of
from designer.model.distributions import Distribution, Normal, Split, Uniform
from designer.model.measured_values import MeasuredBoards
from designer.model.spread_table import DataSheet, PartRule, SpreadShape, check_binned
from designer.spread.spread import Group, OpAmpDrift, Spread

if TYPE_CHECKING:
    from designer.model.model_file import ModelFile


_FACTOR = 2.0
"""A part is no further from the value it is sold for: a slip of a prefix is a factor of 1000."""


def check_measured(measured: MeasuredBoards, circuit: Circuit) -> None:
    """Refuse what cannot be of this circuit.

    Raises
    ------
    InputError : a part that it lacks, or a value far from the one that the part is sold for.
    """
    check_measured_names(measured, circuit)
    nominal = _nominal(circuit)
    for name, values in measured.values.items():
        line = f"line {measured.lines.get(name, 0)}"
        low, high, unit = nominal[name]
        for value in values:
            if not math.isnan(value) and not low <= value <= high:
                ends = " to ".join(format_quantity(end, unit) for end in (low, high))
                text = f"{name}, {format_quantity(value, unit)}"
                raise InputError(measured.source, line, text, f"a value within {ends}")


def check_measured_names(
    measured: MeasuredBoards, circuit: Circuit, more: Collection[str] = ()
) -> None:
    """Refuse parts that are neither of this circuit nor among ``more``.

    Raises
    ------
    InputError : names the first of them.
    """
    measurable = [*_nominal(circuit), *more]
    for name in measured.values:
        if name not in measurable:
            hint = did_you_mean(name, measurable)
            expected = "a part of this design" + (f"; {hint}" if hint else "")
            line = f"line {measured.lines.get(name, 0)}"
            raise InputError(measured.source, line, name, expected)


def _nominal(circuit: Circuit) -> dict[str, tuple[float, float, str]]:
    """Lowest and highest value, and unit, of everything that can be measured on a board."""

    def about(value: float, unit: str) -> tuple[float, float, str]:
        ends = sorted((value / _FACTOR, value * _FACTOR))
        return ends[0], ends[1], unit

    ranges = {r.name: about(r.value, "Ω") for r in circuit.resistors}
    ranges |= {c.name: about(c.value, "F") for c in circuit.capacitors}
    ranges |= {r.name: about(r.volts, "V") for r in circuit.references}
    ranges |= {rail.name: about(rail.volts, "V") for rail in circuit.rails}
    supply = circuit.supply
    for s in circuit.sections:
        ranges[f"{s.name}.offset"] = (-supply, supply, "V")
        ranges[f"{s.name}.low"] = (-_FACTOR * supply, 0.0, "V")
        ranges[f"{s.name}.high"] = (0.0, _FACTOR * supply, "V")
        ranges[f"{s.name}.bias"] = (-1e-3, 1e-3, "A")
        ranges[f"{s.name}.gbw"] = (1.0, 1e12, "Hz")
    return ranges


Part = Resistor | Capacitor | Reference
_OWN = ("grade", "law", "tempco", "ageing")
"""What a rule may state of a part."""
KINDS = {"resistors": Resistor, "capacitors": Capacitor, "references": Reference}
"""What a list of parts may say for all of a kind."""


def spread_of(modelfile: ModelFile, circuit: Circuit, catalog: Catalog) -> Spread:
    """What a model file says about the boards of this circuit.

    Raises
    ------
    InputError : a part that the circuit lacks, a part in two networks, a temperature where the
        catalogue sells no such part, measured values that cannot be of this circuit.
    """
    return _Rules(modelfile, circuit, catalog).spread()


def warmed(modelfile: ModelFile, circuit: Circuit, catalog: Catalog) -> Spread:
    """The spread of a model file with all boards at ``ROOM``, and with whatever moves them with
    temperature, whether or not the file states one.

    Raises
    ------
    InputError : as ``spread_of``.
    """
    room = replace(modelfile.spread, temperature=(ROOM, ROOM))
    return spread_of(replace(modelfile, spread=room), circuit, catalog)


def check_names(modelfile: ModelFile, circuit: Circuit, catalog: Catalog) -> None:
    """Refuse, before a design is sought, what no design of this circuit can have: unknown parts,
    networks that cannot be, and an ageing of which the catalogue says nothing.

    circuit : of any values. Where resistors may become two parts, their names are known too, and
    networks are looked at once the parts are chosen.

    Raises
    ------
    InputError : names the first unknown part, and the known ones; or what else is wrong.
    """
    may = modelfile.circuit.composites
    halves = [f"{r.name}{half}" for r in circuit.resistors for half in "AB" if may]
    parts = [p.name for p in circuit.parts if isinstance(p, Resistor | Capacitor | Reference)]
    part_names = [*KINDS, *parts]
    rules = modelfile.spread
    named = [(f"part[{i}].names", rule.names) for i, rule in enumerate(rules.part, start=1)]
    named += [(f"network[{i}].parts", rule.parts) for i, rule in enumerate(rules.network, start=1)]
    for field, names in named:
        for name in names:
            if name not in part_names and name not in halves:
                raise InputError(
                    modelfile.source, f"spread.{field}", name, one_of(name, part_names)
                )
    if modelfile.measured is not None:
        check_measured_names(modelfile.measured, circuit, halves)
    if not may:
        # Which array holds a part is decided by its value; the rest of a network is not.
        network = tuple(replace(n, family=None, share=n.share or 0.0) for n in rules.network)
        plain = replace(modelfile, spread=replace(rules, network=network))
        _Rules(plain, circuit, catalog).networks()
    if rules.ageing == "catalogue":
        _check_drifts(modelfile, circuit, catalog)


def _check_drifts(modelfile: ModelFile, circuit: Circuit, catalog: Catalog) -> None:
    """Refuse an ageing by the catalogue where it has no drift of any family of some part's kind."""
    rules = modelfile.spread
    with_ageing = {name for rule in rules.part if rule.ageing is not None for name in rule.names}
    for kind, parts in (("resistor", circuit.resistors), ("capacitor", circuit.capacitors)):
        families = [family for family in catalog.families if family.kind == kind]
        aged = f"{kind}s" in with_ageing or all(part.name in with_ageing for part in parts)
        if families and not aged and all(family.drift is None for family in families):
            raise InputError(
                modelfile.source,
                "spread.ageing",
                f"{kind}s, of which the catalogue has no drift",
                "a drift there, or an ageing in [[spread.part]]",
            )


class _Rules:
    def __init__(self, modelfile: ModelFile, circuit: Circuit, catalog: Catalog) -> None:
        self.modelfile, self.circuit, self.catalog = modelfile, circuit, catalog
        self.rules, self.choice = modelfile.spread, modelfile.circuit
        self.file = None if modelfile.source is None else str(modelfile.source)
        self.parts: dict[str, Part] = {
            p.name: p for p in circuit.parts if isinstance(p, Resistor | Capacitor | Reference)
        }
        self.own = self._own_rules()
        arrays = dict(self._of_arrays())
        self.own |= arrays
        self.elements = frozenset(arrays)
        self.drawn = {name: self._drawn_grade(part) for name, part in self.parts.items()}
        self.wanted_grades = self._wanted_grades()

    def spread(self) -> Spread:
        rules, choice = self.rules, self.choice
        opamp = self.catalog.opamp(self.circuit.opamp)
        offset = rules.offset
        measured = self.modelfile.measured
        if measured is not None:
            check_measured(measured, self.circuit)
        elif rules.measured is not None:
            raise self.refuse("measured", rules.measured, "a model file on disk, with the list")
        return Spread(
            resistor=choice.resistor_grade,
            capacitor=choice.capacitor_grade,
            offset_sigma=opamp.offset_sigma if offset is None else offset.sigma,
            offset_limit=opamp.offset_limit if offset is None else offset.limit,
            saturation=rules.saturation,
            resistor_shape=rules.resistors.over(choice.resistor_grade),
            capacitor_shape=rules.capacitors.over(choice.capacitor_grade),
            bias=_of_figure(rules.bias, opamp.bias),
            gain_bandwidth=_of_figure(rules.gain_bandwidth, opamp.gbw),
            supply=rules.supply,
            grades=self.grades(),
            shapes=self.shapes(),
            temperature=rules.temperature,
            tempco=self.tempco() if rules.temperature is not None else {},
            ageing=self.ageing(),
            groups=(*self.networks(), *self.reels()),
            measured=measured,
            wanted_grades=self.wanted_grades,
            opamps=self.opamp_drift(opamp),
        )

    def opamp_drift(self, opamp: OpAmp) -> OpAmpDrift:
        """What the catalogue says of temperature, where the file states one, and of age, where it
        leaves that to the catalogue."""
        old = _about_zero(opamp.offset_ageing) if self.rules.ageing == "catalogue" else None
        if self.rules.temperature is None:
            return OpAmpDrift(ageing=old)
        doubling = opamp.bias_doubling
        return OpAmpDrift(
            offset=_about_zero(opamp.offset_drift),
            ageing=old,
            bias_doubling=None if doubling is None else doubling.usual,
            gain_bandwidth=_slope(opamp.gbw_drift),
            slew=_slope(opamp.slew_drift),
            limit=_slope(opamp.saturation_drift),
        )

    def refuse(self, key: str, value: object, expected: str) -> InputError:
        return InputError(self.file, f"spread.{key}", value, expected)

    def _own_rules(self) -> dict[str, PartRule]:
        """The rule of each part in ``[[spread.part]]``; a later table adds to an earlier one."""
        rules: dict[str, PartRule] = {}
        for number, rule in enumerate(self.rules.part, start=1):
            for name in self.named(rule.names, f"part[{number}].names"):
                stated = {key: v for key in _OWN if (v := getattr(rule, key)) is not None}
                merged = replace(rules.get(name, PartRule((name,))), **stated)
                part = self.parts[name]
                shape, grade = self.shape(part, merged), self.grade(part, merged)
                check_binned(shape, grade, f"spread.part[{number}].law", self.file)
                rules[name] = merged
        return rules

    def _of_arrays(self) -> Iterator[tuple[str, PartRule]]:
        """What parts have as elements of arrays; a temperature coefficient and a drift of their own
        go before the array's."""
        for number, rule in enumerate(self.rules.network, start=1):
            if rule.family is None:
                continue
            field = f"network[{number}].parts"
            for name in self.named(rule.parts, field):
                part, before = self.parts[name], self.own.get(name, PartRule((name,)))
                if not isinstance(part, Resistor | Capacitor):
                    raise self.refuse(field, name, "two or more resistors, or capacitors")
                family = self.array(rule.family, name, number)
                if before.grade is not None:
                    expected = "parts without a grade of their own: the array has one"
                    raise self.refuse(field, name, expected)
                width = family.temperature_coefficient
                ageing = before.ageing
                if ageing is None and self.rules.ageing == "catalogue":
                    drift = self.drift(name, family)
                    ageing = (-drift, drift)
                tempco = (-width, width) if before.tempco is None else before.tempco
                yield name, PartRule((name,), family.grade, before.law, tempco, ageing)

    def array(self, family: str, name: str, number: int) -> PartFamily:
        """The family of arrays that a part is an element of."""
        part = self.parts[name]
        assert isinstance(part, Resistor | Capacitor)
        try:
            sold = self.catalog.array(family, part.value).family
        except InputError as error:
            value = f"{name}, {error.found}" if isinstance(error, Unreachable) else error.found
            raise self.refuse(f"network[{number}].family", value, error.expected) from None
        if sold.kind != kind_of(part):
            raise self.refuse(f"network[{number}].parts", name, f"{sold.kind}s, as {family} holds")
        return sold

    def named(self, names: tuple[str, ...], field: str) -> Iterator[str]:
        """The parts that are meant: of a kind, both of a composite, or the one of that name."""
        kinds = {
            word: [name for name, part in self.parts.items() if isinstance(part, kind)]
            for word, kind in KINDS.items()
        }
        pairs = {name: [f"{name}A", f"{name}B"] for name in composites_of(self.circuit)}
        for name in names:
            if name in self.parts:
                yield name
            elif name in pairs or kinds.get(name):
                yield from pairs.get(name, kinds.get(name, []))
            else:
                raise self.refuse(field, name, one_of(name, [*kinds, *pairs, *self.parts]))

    def grade(self, part: Part, rule: PartRule | None) -> float:
        """The grade that is asked for."""
        if rule is not None and rule.grade is not None:
            return rule.grade
        if isinstance(part, Reference):
            stated = self.rules.reference_grade
            return part.grade if stated is None else stated
        choice = self.choice
        return choice.resistor_grade if isinstance(part, Resistor) else choice.capacitor_grade

    def shape(self, part: Part, rule: PartRule | None) -> SpreadShape:
        if rule is not None and rule.law is not None:
            return rule.law
        exact = rule is not None and rule.grade == 0.0  # whatever the others are
        if exact or isinstance(part, Reference):
            return SpreadShape()
        return self.rules.resistors if isinstance(part, Resistor) else self.rules.capacitors

    def _drawn_grade(self, part: Part) -> float:
        """The grade that a part is drawn at: that of the part which is bought for the wanted grade.

        A grade at which, or better, nobody sells the value is drawn as it is asked for, and so is
        that of an array, whose elements are not bought one by one.
        """
        wanted = self.grade(part, self.own.get(part.name))
        if isinstance(part, Reference) or part.name in self.elements:
            return wanted
        sold = self.catalog.sold(kind_of(part), part.value, wanted)
        if sold is None or math.isclose(sold.family.grade, wanted, rel_tol=1e-9):
            return wanted
        return sold.family.grade

    def _wanted_grades(self) -> dict[str, float]:
        """The wanted grades of the parts that are bought at a better one."""
        grades = {n: self.grade(part, self.own.get(n)) for n, part in self.parts.items()}
        return {name: grade for name, grade in grades.items() if grade != self.drawn[name]}

    def grades(self) -> dict[str, float]:
        """Of the parts for which one is stated, and of those that are bought at a better one."""
        named = [name for name, rule in self.own.items() if rule.grade is not None]
        if self.rules.reference_grade is not None:
            named += [r.name for r in self.circuit.references]
        return {name: self.drawn[name] for name in (*named, *self.wanted_grades)}

    def shapes(self) -> dict[str, Distribution]:
        """Over the grade, of the parts for which one is stated.

        A binned law is about the grade that was asked for: a part that is bought at a better one
        lies in what was picked out, if that reaches so far.
        """
        shapes = {}
        for name, part in self.parts.items():
            rule, grade = self.own.get(name), self.drawn[name]
            shape = self.shape(part, rule)
            stated = rule is not None and (rule.law is not None or rule.grade is not None)
            if name in self.wanted_grades and shape.law == "binned":
                shapes[name] = (SpreadShape() if shape.inner >= grade else shape).over(grade)
            elif stated:
                shapes[name] = shape.over(grade)
        return shapes

    def tempco(self) -> dict[str, Distribution]:
        """Of every part [1/K]: its own, or ± what the catalogue says of its family."""
        laws: dict[str, Distribution] = {}
        for name, part in self.parts.items():
            rule = self.own.get(name)
            if rule is not None and rule.tempco is not None:
                laws[name] = Uniform(*rule.tempco)
            else:
                width = self.catalogued(part, rule)
                laws[name] = Uniform(-width, width)
        return laws

    def catalogued(self, part: Part, rule: PartRule | None) -> float:
        """The temperature coefficient [1/K] of a part as the bill of materials buys it."""
        if isinstance(part, Reference):
            return self.catalog.reference(part.model).temperature_coefficient
        return self.family(part, rule, "temperature", "tempco").temperature_coefficient

    def drift(self, name: str, family: PartFamily) -> float:
        """The relative change that the data sheet allows a part of this family."""
        if family.drift is None:
            text = f"{name}, {family.name}, of which the catalogue has no drift"
            raise self.refuse("ageing", text, "a drift there, or an ageing in [[spread.part]]")
        return family.drift

    def family(
        self, part: Resistor | Capacitor, rule: PartRule | None, key: str, figure: str
    ) -> PartFamily:
        """The family that the bill of materials buys the part from.

        key, figure : the key and the figure that the family is wanted for, as an error names them.
        """
        try:
            bought = self.catalog.part(kind_of(part), part.value, self.grade(part, rule))
        except Unreachable as error:
            expected = f"{error.expected}; or {figure} in [[spread.part]]"
            raise self.refuse(key, f"{part.name}, {error.found}", expected) from None
        return bought.family

    def ageing(self) -> dict[str, Distribution]:
        """Of the parts that age: resistors and capacitors by the file's figure, or their own;
        references by the catalogue's, where it has one."""
        laws: dict[str, Distribution] = {}
        for name, part in self.parts.items():
            rule = self.own.get(name)
            if rule is not None and rule.ageing is not None:
                laws[name] = Uniform(*rule.ageing)
            elif isinstance(part, Reference):
                drift = self.catalog.reference(part.model).drift
                if self.rules.ageing == "catalogue" and drift is not None:
                    laws[name] = Normal(drift, 3.0 * drift)
            elif self.rules.ageing is None:
                continue
            elif self.rules.ageing == "catalogue":
                width = self.drift(name, self.family(part, rule, "ageing", "ageing"))
                laws[name] = Uniform(-width, width)
            else:
                laws[name] = Uniform(*self.rules.ageing)
        return laws

    def networks(self) -> tuple[Group, ...]:
        groups: list[Group] = []
        for number, rule in enumerate(self.rules.network, start=1):
            field = f"network[{number}].parts"
            names = tuple(self.named(rule.parts, field))
            if len(names) < 2 or len({type(self.parts[name]) for name in names}) > 1:
                raise self.refuse(field, ", ".join(names), "two or more resistors, or capacitors")
            for name in names:
                if names.count(name) > 1 or any(name in g.parts for g in groups):
                    raise self.refuse(field, name, "parts that are in one network, once")
                if self.picked(name):
                    expected = "uniform or normal parts: a binned one is picked by itself"
                    raise self.refuse(field, f"{name}, binned", expected)
            share = rule.share
            if rule.family is not None:
                family = self.array(rule.family, names[0], number)
                share = family.share
                values = {f"{self.circuit.values[name]:.9g}" for name in names}
                if len(values) > 1 or len(names) > family.elements:
                    expected = f"up to {family.elements} parts of one value, as an array holds"
                    raise self.refuse(field, ", ".join(names), expected)
            assert share is not None
            groups.append(Group(f"network:{number}", names, share))
        return tuple(groups)

    def reels(self) -> tuple[Group, ...]:
        """Parts of one kind and value come from one reel, but for those in a network and those
        that were picked."""
        share = self.rules.reels
        excluded = {name for group in self.networks() for name in group.parts}
        reels: dict[str, list[str]] = {}
        for letter, parts in (("R", self.circuit.resistors), ("C", self.circuit.capacitors)):
            for part in parts:
                if part.name not in excluded and not self.picked(part.name):
                    key = f"reel:{letter}:{format_quantity(part.value, digits=12)}"
                    reels.setdefault(key, []).append(part.name)
        return tuple(
            Group(name, tuple(parts), share, reel=True)
            for name, parts in reels.items()
            if share > 0.0 and len(parts) > 1
        )

    def picked(self, name: str) -> bool:
        """Whether a part's deviation is its own for having been measured: binned."""
        return self.shape(self.parts[name], self.own.get(name)).law == "binned"


def kind_of(part: Resistor | Capacitor) -> Kind:
    """Its kind in the catalogue."""
    return "resistor" if isinstance(part, Resistor) else "capacitor"


def _about_zero(figure: Figure | None) -> Distribution | None:
    """Of a size of either sign."""
    return None if figure is None else Normal(*figure.about_zero)


def _slope(figure: Figure | None) -> float:
    return 0.0 if figure is None else figure.usual


def _of_figure(rule: DataSheet | tuple[float, float], figure: Figure) -> Distribution | None:
    """A section's figure from board to board; None: the typical one on all.

    A bound that the data sheet does not give is as far from the typical figure, as a ratio, as the
    one that it gives.
    """
    if rule == "typical":
        return None
    if not isinstance(rule, str):
        return Uniform(*rule)
    low, middle, high = figure.min, figure.typ, figure.max
    if middle is None:
        return None if low is None or high is None else Uniform(low, high)
    if low is None and high is None:
        return None
    if low is None:
        assert high is not None
        low = _mirrored(high, middle)
    return Split(low, middle, _mirrored(low, middle) if high is None else high)


def _mirrored(bound: float, middle: float) -> float:
    same_sign = bound * middle > 0.0
    return middle * middle / bound if same_sign else 2.0 * middle - bound
