"""The report's part on the model: its equations, and what its drawing shows."""

from __future__ import annotations

from designer.model import equations as model_equations
from designer.model.model import Dimensionless, Mechanical
from designer.report.data import ReportData


def drawn(data: ReportData) -> Dimensionless | Mechanical:
    """The parameters that the drawing shows: as the model file gives them."""
    return data.modelfile.mechanical or data.design.model


def equations(data: ReportData) -> list[tuple[str, tuple[str, ...]]]:
    """(what they are, lines) of each form of the equations of motion."""
    model, given = data.design.model, data.modelfile.mechanical
    forms = []
    if given is not None:
        forms.append(("As given, in SI units:", model_equations.mechanical_equations(given)))
    forms.append(("Dimensionless:", model_equations.dimensionless_equations(model)))
    forms.append(("With the numbers of this model:", model_equations.equations_with_numbers(model)))
    return forms


def drawing_note(data: ReportData) -> str:
    """The units of the drawing's values, and the words that the equations use."""
    text = "Values as the model file gives them. "
    if data.modelfile.mechanical is None:
        text = (
            "Values in units of M₁ and K₁, lengths in units of (P₁ + P₂)/K₁, dampers in units of "
            "√(K₁ M₁), forces in units of P₁ + P₂. "
        )
    if data.design.model.k0 and data.design.model.sides == "both":
        text += "clip(x, −b, b) is x, but no less than −b and no more than b. "
    return text + "t = T √(K₁/M₁), x = X K₁/(P₁ + P₂), ω = Ω √(M₁/K₁)."


def drawing_label(data: ReportData) -> str:
    """The drawing in words."""
    model = data.design.model
    stops = f"the {model.sides} side" if model.sides != "both" else "both sides"
    end = f" between stops on springs K0 at {stops}" if model.k0 else ", without stops"
    return (
        "The model: ground, spring K2"
        + (" and damper C2" if model.c else "")
        + f", mass M2, spring K1 and damper C1, mass M1{end}."
    )
