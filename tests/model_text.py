"""The paper's model as the table ``[model]`` of a model file."""

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
