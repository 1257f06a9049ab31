"""The exact flow of a model under its drive."""

from __future__ import annotations

from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.mechanics import MechanicalModel


def model_flow(model: MechanicalModel, omega: float, *, fast: bool = True) -> Flow:
    """The flow of the model driven at ``omega``. fast : as ``Flow`` says."""
    return Flow(model.second_order().piecewise_linear(omega), Drive(omega), fast=fast)
