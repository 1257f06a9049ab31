"""The exact engine's part for circuits, compiled by a process of its own on a first run.

After an installation or an update the compiler takes longer than the choice of the parts, on one
core. The part for circuits is needed last: another process compiles it while this one compiles what
comes first, and stores it where `base.jit` finds it.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from designer.base import jit
from designer.base.environment import python_command
from designer.base.progress import doing
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import Ensemble
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.circuit_table import CircuitSpec
from designer.model.model import Dimensionless
from designer.synthesis.part_checks import unit_circuit

CALL = "from designer.jobs.compile_ahead import compile_circuits; compile_circuits()"


@contextmanager
def compiling_ahead(jobs: int) -> Iterator[Callable[[], None]]:
    """The other process works, where nothing is compiled yet and there is a core for it; it ends
    with the block at the latest.

    Yields what waits for its end: to be called before a circuit moves. Whoever does not wait
    compiles the same once more, beside a process that is ahead with it.
    """
    if jobs < 2 or not jit.nothing_compiled():
        yield lambda: None
        return
    process = subprocess.Popen(
        python_command("-c", CALL),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,  # what goes wrong here goes wrong again where it is needed
        start_new_session=True,  # Ctrl-C is for the run, which ends this one
    )

    def wait() -> None:
        doing("compiling the exact engine's part for circuits")
        process.wait()

    try:
        yield wait
    finally:
        process.kill()
        process.wait()


def compile_circuits() -> None:
    """Compile it by using it once: one board with every value 1."""
    model, spec, catalog = (
        Dimensionless(0.5, 0.5, 0.95, 0.5, 0.1, 0.0, 0.25),
        CircuitSpec(),
        load_catalog(),
    )
    circuit = unit_circuit(model, spec, catalog)
    boards = Ensemble(Boards.of(circuit, [nominal_board(circuit)]))
    drive, rest = Drive(1.0), np.zeros(len(circuit.states))
    Flow(boards.reduction(0).system(), drive).run(rest, 1)
    boards.settle([0], [drive], rest[None])
    boards.swept(0, [(drive, 1)], rest[None])
