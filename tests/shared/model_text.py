"""The paper's model as the table ``[model]`` of a model file, and parts that are quickly chosen."""

from designer.model.mechanics import MechanicalModel
from designer.model.model import Dimensionless

PAPER_TABLE = """\
[model]
m = 0.5
k = 0.5
k0 = 0.95
c = 0.5
zeta = 0.1
f20 = 0.0
b = 0.25
"""

COARSE_CIRCUIT = """\
[circuit]
saturation = 13.0
resistors = "E12"
capacitors = "E6"
side_conditions = ["swing", "load"]
"""
"""For tests that ask nothing of the parts: chosen in a tenth of the time that E24 takes with every
side condition, within half a per cent of the paper's model."""

COARSE_RECTIFIER = f'{COARSE_CIRCUIT}dead_zone = "rectifier"\n'
"""The same with the stage that is chosen for the paper's model where the file states none: half of
the search is for the other one."""

SMALL = (
    "format = 1\n"
    + PAPER_TABLE
    + """\
[[response]]
omega = 0.85
expect = "1-2-2"
"""
    + COARSE_RECTIFIER
)
"""A whole file: one response of the paper, coarse parts, no title."""


def dimensionless(model: MechanicalModel) -> Dimensionless:
    """A model of format 1, which has the paper's parameters."""
    assert isinstance(model, Dimensionless)
    return model
