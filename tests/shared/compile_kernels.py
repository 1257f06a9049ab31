"""The compiled parts of the exact engine, made before several processes of tests need them at once.

Two processes side by side, since the compiler uses one core. What is compiled already is not
compiled again, and what this does not compile, a test does.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from designer.base import jit
from designer.jobs import compile_ahead

ROOT = Path(__file__).resolve().parents[2]
MODELS = "from tests.shared.compile_kernels import use_models; use_models()"


def compile_kernels() -> None:
    """Compile what circuits of two masses and what models need, where that is not stored yet."""
    if jit.stored_whole(jit.CIRCUITS.format(masses=2)):
        return
    processes = [
        subprocess.Popen([sys.executable, "-c", call], cwd=ROOT, stdin=subprocess.DEVNULL)
        for call in (compile_ahead.CALL.format(masses=2), MODELS)
    ]
    for process in processes:
        process.wait()


def use_models() -> None:
    """Compile it by using it once: a run, a sweep, and the search for a linear block."""
    import numpy as np

    from designer.dynamics.attractors import settle
    from designer.dynamics.flow import Flow
    from designer.dynamics.piecewise_linear import Drive
    from designer.linear_network.linear_search import best
    from designer.model.model_file import parse_model_file
    from designer.verbs.bifurcation import bifurcation
    from tests.linear_network.test_linear_block import OPEN, targets_of
    from tests.shared.model_text import PAPER_TABLE, dimensionless

    read = parse_model_file(f'format = 1\ntitle = "compiled"\n{PAPER_TABLE}')
    model = dimensionless(read.model)
    settle(Flow(model.second_order().piecewise_linear(), Drive(1.55)), np.zeros(4))
    bifurcation(read, from_=1.5, to=1.51, steps=2, points=False, jobs=1)
    best(targets_of(model), np.array([1e4, 2e4]), np.array([1e-8]), np.ones(1), OPEN)
