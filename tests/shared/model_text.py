"""The paper's model as the table ``[model]`` of a model file, and parts that are quickly chosen."""

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
