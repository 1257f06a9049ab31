"""A spread in words, as a report states it."""

from __future__ import annotations

from designer.base.natural_sort import natural_key
from designer.base.si_unit import celsius_text
from designer.circuit.netlist import Circuit
from designer.model.distributions import Binned, Distribution, Normal, Split, Uniform
from designer.report.words import quantity
from designer.spread.spread import NO_BANDWIDTH, OpAmpDrift, Spread


def words_of(spread: Spread, circuit: Circuit, *, bandwidth: bool = False) -> str:
    """What varies from board to board of a circuit, by how much: part of a sentence.

    bandwidth : whether the boards' op-amps lag, so that its spread enters their yield.
    """
    parts = [
        f"resistors {_grade(spread.resistor_shape, spread.resistor)}",
        f"capacitors {_grade(spread.capacitor_shape, spread.capacitor)}",
        f"op-amp offset normal with σ = {quantity(spread.offset_sigma, 'V')}, cut at "
        f"{quantity(spread.offset_limit, 'V')}"
        if spread.offset_sigma
        else "no op-amp offset",
        f"saturation uniform within ± {_percent(spread.saturation)}, each section and rail its own",
    ]
    if circuit.references:
        grade = max(spread.grade_of(r) for r in circuit.references)
        parts.append(f"references uniform within ± {_percent(grade)}, diodes exact")
    for quantity_name, law, unit in (
        ("bias current", spread.bias, "A"),
        ("gain-bandwidth", spread.gain_bandwidth, "Hz"),
    ):
        parts += [f"{quantity_name} {_between(law, unit)}"] if law is not None else []
    if spread.gain_bandwidth is not None and not bandwidth:
        parts[-1] += f" (which {NO_BANDWIDTH})"
    if spread.supply:
        parts.append(f"supply uniform within ± {_percent(spread.supply)}, each rail its own")
    if spread.temperature is not None:
        low, high = spread.temperature
        within = f"{'uniform from' if low < high else 'of'} {celsius_text(low, high)}"
        moved = warm_words(spread.opamps, bandwidth=bandwidth)
        parts.append(f"temperature {within}, which moves parts and, of the op-amps, {moved}")
    if spread.ageing:
        parts.append(f"ageing of {_ageing(spread)}")
    if spread.opamps.ageing is not None:
        parts.append(f"ageing of op-amp offsets {_about_zero(spread.opamps.ageing, 'V')}")
    better = sorted(spread.wanted_grades, key=natural_key)
    for grade in sorted({spread.grades[name] for name in better}):
        names = ", ".join(name for name in better if spread.grades[name] == grade)
        parts.append(f"bought, and drawn, at a better grade of {_percent(grade)}: {names}")
    single = sorted({*spread.grades, *spread.shapes} - {*better}, key=natural_key)
    parts += [f"with a grade or distribution of their own: {', '.join(single)}"] if single else []
    networks = [g for g in spread.groups if not g.reel]
    parts += [f"{', '.join(g.parts)} share {_percent(g.share)} of a deviation" for g in networks]
    for share in sorted({g.share for g in spread.groups if g.reel}):
        parts.append(f"parts of one value share {_percent(share)} of a deviation")
    if spread.measured is not None:
        boards, values = len(spread.measured.boards), len(spread.measured.values)
        of = f" of {boards} boards, taken in turn" if boards > 1 else ""
        parts.append(f"{values} measured value{'s' * (values != 1)}{of}")
    return "; ".join(parts)


def warm_words(drift: OpAmpDrift, *, bandwidth: bool = False) -> str:
    """What temperature does to op-amps: part of a sentence. bandwidth : as of ``words_of``."""
    changes = []
    if drift.offset is not None:
        changes.append(f"offsets by a slope {_about_zero(drift.offset, 'V/K')}")
    if drift.bias_doubling is not None:
        changes.append(f"bias currents by a doubling every {quantity(drift.bias_doubling, 'K')}")
    if drift.limit:
        changes.append(f"output limits by {quantity(drift.limit, 'V/K')}")
    for name, slope, enters in (
        ("gain-bandwidth", drift.gain_bandwidth, bandwidth),
        ("slew rate", drift.slew, False),
    ):
        more = "" if enters else " (which does not enter the yield)"
        changes += [f"{name} by {_percent(slope)}/K{more}"] if slope else []
    return ", ".join(changes) or "nothing that the catalogue knows"


def _about_zero(law: Distribution, unit: str) -> str:
    assert isinstance(law, Normal)
    return f"normal with σ = {quantity(law.sigma, unit)}, cut at {quantity(law.limit, unit)}"


def _ageing(spread: Spread) -> str:
    """Ranges of ageing, and the kinds of part that have each."""
    kinds = {"R": "resistors", "C": "capacitors", "V": "references"}
    by: dict[tuple[str, str], list[str]] = {}
    for part, law in sorted(spread.ageing.items(), key=lambda item: natural_key(item[0])):
        by.setdefault((kinds.get(part[0], part), _change(law)), []).append(part)
    of = [kind for kind, _ in by]
    return ", ".join(
        f"{kind if of.count(kind) == 1 else ' '.join(parts)} {within}"
        for (kind, within), parts in by.items()
    )


def _grade(shape: Distribution, grade: float) -> str:
    width = f"within ± {_percent(grade)}"
    if isinstance(shape, Normal):
        return f"normal with σ = {_percent(grade * shape.sigma)}, cut at ± {_percent(grade)}"
    if isinstance(shape, Binned):
        return f"uniform {width} without those within ± {_percent(grade * shape.inner)}"
    return f"uniform {width}"


def _between(law: Distribution, unit: str) -> str:
    low, high = (quantity(v, unit) for v in _ends(law))
    middle = f", half of them below {quantity(law.middle, unit)}" if isinstance(law, Split) else ""
    return f"from {low} to {high}{middle}"


def _ends(law: Distribution) -> tuple[float, float]:
    if isinstance(law, Uniform | Split):
        return law.low, law.high
    raise TypeError(law)


def _change(law: Distribution) -> str:
    if isinstance(law, Normal):
        return f"normal with σ = {_percent(law.sigma)}, cut at {_percent(law.limit)}"
    low, high = (f"{100 * end:.4g}" for end in _ends(law))
    return f"from {low} to {high} %"


def _percent(value: float) -> str:
    return f"{100 * value:.4g} %"
