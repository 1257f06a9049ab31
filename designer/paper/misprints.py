"""The paper's misprints, each applied alone to the corrected circuit.

docs/errata.md lists them. Those that stand in the nomenclature, in steps between two equations or
in the theory of the impact map reach no part and no setting of the generator; the others do, and
each is here what would be on the bench had it been the only one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from designer.catalog.parts_catalog import Catalog
from designer.circuit import paper_values
from designer.circuit.paper_values import ComparedCircuit
from designer.model.model import Dimensionless
from designer.paper.circuits import Built, built

Values = dict[str, float]
MUCH_LESS = 0.1
"""What "≪" is taken for."""


@dataclass(frozen=True)
class Misprint:
    """A misprint of the paper, by docs/errata.md."""

    where: str
    """Where in the paper it stands."""
    printed: str
    """What the paper prints."""
    right: str
    """What ought to be printed."""
    note: str = ""
    """How the print is read, where that is not plain."""
    build: Callable[[Catalog], ComparedCircuit] | None = None
    """The circuit with this misprint alone; None where it reaches no part."""
    run: bool = True
    """Whether the responses of the circuit with this misprint are computed."""


def corrected(catalog: Catalog) -> ComparedCircuit:
    """The circuit that each misprint is applied to."""
    return _built({}, catalog)


def apply(misprint: Misprint, catalog: Catalog) -> Built:
    """The circuit with the misprint; a wrong sign leaves it with the corrected circuit's scales."""
    assert misprint.build is not None
    return built(misprint.build(catalog), built(corrected(catalog)).volts)


def _built(
    changed: Mapping[str, float],
    catalog: Catalog,
    *,
    model: Dimensionless = paper_values.MODEL,
    frequency: float | None = None,
    amplitude: float | None = None,
) -> ComparedCircuit:
    """The corrected circuit with these values, generator as corrected unless it is given."""
    right = paper_values.corrected()
    own_frequency, own_amplitude = paper_values.generator(paper_values.MODEL, right)
    values = right | dict(changed)
    return ComparedCircuit(
        "",
        "",
        paper_values.circuit(model, values, catalog.opamp(paper_values.OPAMP)),
        own_frequency if frequency is None else frequency,
        own_amplitude if amplitude is None else amplitude,
    )


def _parts(changed: Callable[[Values], Values]) -> Callable[[Catalog], ComparedCircuit]:
    return lambda catalog: _built(changed(paper_values.corrected()), catalog)


def _second_mass(
    *, mass: bool = False, damping: bool = False, stiffness: bool = False
) -> Callable[[Catalog], ComparedCircuit]:
    """Eq. (4) as printed for M2: 1 - m, 2ζ, 1 - k in the place of m/(1 - m), 2ζ/(1 - c), 1/(1 - k),
    turned into parts by Eq. (14) as corrected."""
    m = paper_values.MODEL

    def change(v: Values) -> Values:
        out: Values = {}
        ratio = (1.0 - m.m) / (m.m / (1.0 - m.m)) if mass else 1.0
        # R7 carries the mass; damping terms of x2' are R7 C3 over R3 C2 and R9 C4.
        out |= {"R7": v["R7"] * ratio, "R3": v["R3"] * ratio, "R9": v["R9"] * ratio}
        if damping:
            out["R9"] /= 1.0 - m.c
        if stiffness:
            out["R11"] = v["R11"] / (1.0 - m.k) ** 2
        return out

    return _parts(change)


def _inverse_mass(v: Values) -> Values:
    """1/M1 = R1 C1: ζ = C1/(2√(K1 M1)) then makes R2, R3, R8, R9 smaller by R1 C1."""
    share = v["R1"] * v["C1"]
    return {name: v[name] * share for name in ("R2", "R3", "R8", "R9")}


def _in_phase(v: Values) -> Values:
    """Gains 1 + R201/R200 and 1 + R203/R202, as two stages in phase would have."""
    return {"R201": v["R201"] + v["R200"], "R203": v["R203"] + v["R202"]}


def _other_mass(catalog: Catalog) -> ComparedCircuit:
    return _built({}, catalog, model=replace(paper_values.MODEL, f20=1.0))


def _twice(catalog: Catalog) -> ComparedCircuit:
    return _built({}, catalog, frequency=2.0 * corrected(catalog).frequency)


MISPRINTS: tuple[Misprint, ...] = (
    Misprint("Nomenclature", "stiffness in Ns/m", "N/m"),
    Misprint(
        "Eq. (4), mass", "1 − m", "m/(1 − m)", "Eq. (14) as corrected", _second_mass(mass=True)
    ),
    Misprint(
        "Eq. (4), damping", "2ζ", "2ζ/(1 − c)", "Eq. (14) as corrected", _second_mass(damping=True)
    ),
    Misprint(
        "Eq. (4), stiffness",
        "1 − k",
        "1/(1 − k)",
        "Eq. (14) as corrected",
        _second_mass(stiffness=True),
    ),
    Misprint("Eq. (4), force", "1 − f20 and 0", "1 − f20 and f20", "the same where f20 = 0"),
    Misprint(
        "Eq. (4), all of it",
        "see above",
        "see above",
        "Eq. (14) as corrected",
        _second_mass(mass=True, damping=True, stiffness=True),
    ),
    Misprint("below Eq. (6)", "H2 = X2 + B", "H2 = X1 + B", "of the theory; Eq. (2) has it right"),
    Misprint("Eq. (9)", "all n", "odd n", "of the theory"),
    Misprint("n-p-q", "p and q at A1", "p at A1, q at A2", "a name, not a part"),
    Misprint("Eq. (13)", "R1 C1 v1′", "R1 C1 v1″", "a step between Eq. (12) and Eq. (14)"),
    Misprint(
        "Eq. (14), masses",
        "1/M1 = R1 C1",
        "M1 = R1 C1",
        "R1 C1 and R4 C2 as chosen, R2, R3, R8 and R9 from ζ: 2.2 Ω and 1.1 Ω; its responses are "
        "not computed: ζ = 1000 holds x₁ within about 1/(2ζω), a hundredth of b",
        _parts(_inverse_mass),
        run=False,
    ),
    Misprint(
        "Eq. (14), last line",
        "R9 C4 ≪ R3 C2, R11 ≪ R10",
        "C1 + C2 = R7 C3/(R9 C4), K1 + K2 = 1/(R11 C4)",
        "≪ taken as a tenth",
        _parts(lambda v: {"R9": MUCH_LESS * v["R3"], "R11": MUCH_LESS * v["R10"]}),
    ),
    Misprint("Eq. (14), missing", "no K0, no P2", "K0 = slope/(R50 C2)", "R50 is below"),
    Misprint("Eq. (15)", "V_M2", "V_M1", "the same amplitude through R12 onto M2", _other_mass),
    Misprint(
        "Eq. (15) with Eq. (18)",
        "B = 0.064 V, 1.28 V",
        "B = 0.0617 V, 1.235 V",
        "",
        lambda catalog: _built({}, catalog, amplitude=paper_values.PRINTED_AMPLITUDE),
    ),
    Misprint("Eq. (16), formula", "ω = πf√…", "ω = 2πf√…", "f = 711.8 ω", _twice),
    Misprint(
        "Eq. (16), number",
        "f = 357.419 ω",
        "f = 355.88 ω",
        "",
        lambda catalog: _built({}, catalog, frequency=paper_values.PRINTED_FREQUENCY),
    ),
    Misprint("Eq. (18), middle row", "no v1", "with v1", "no stage has this curve"),
    Misprint(
        "R50",
        "20.88 kΩ",
        "22.17 kΩ",
        "",
        _parts(lambda _: {"R50": paper_values.PRINTED["R50"]}),
    ),
    Misprint(
        "R208 … R210",
        "no value; divider taken as unloaded",
        "load counted, R204 = 8.911 kΩ",
        "R204 = 9 kΩ, the three at 100 kΩ",
        _parts(lambda _: {"R204": paper_values.PRINTED["R204"]}),
    ),
    Misprint(
        "R208 … R210, at 10 kΩ",
        "no value; divider taken as unloaded",
        "load counted",
        "R204 = 9 kΩ, the three at 10 kΩ",
        _parts(
            lambda _: {
                "R204": paper_values.PRINTED["R204"],
                **dict.fromkeys(("R208", "R209", "R210"), 10e3),
            }
        ),
    ),
    Misprint("below Eq. (15)", "coefficients in Eq. (19)", "Eq. (14)", "a reference in the text"),
    Misprint(
        "Section 5.2",
        "two in-phase amplifiers",
        "two inverting stages",
        "gains 21 and 11.53 in the place of 20 and 10.53",
        _parts(_in_phase),
    ),
)
