"""The exact engine's part for circuits, compiled by a process of its own where none is stored yet.

After an installation or an update the compiler takes longer than the choice of the parts, on one
core, and once more for each number of masses. The part for circuits is needed last: another process
compiles it while this one compiles what comes first, and stores it where `base.jit` finds it. What
carries a circuit also carries a model that no faster way fits: that it compiles before all else,
and this process waits for it rather than compile the same.
"""

from __future__ import annotations

import subprocess
import sys
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
from designer.laws.element_keys import GROUND
from designer.model.circuit_table import CircuitSpec
from designer.model.lumped_elements import Damper, Force, Gap, Mass, Spring
from designer.model.lumped_system import LumpedSystem
from designer.model.mechanics import SecondOrderSystem
from designer.synthesis.part_checks import unit_circuit

CALL = "from designer.jobs.compile_ahead import compile_circuits; compile_circuits({masses})"


@contextmanager
def compiling_ahead(jobs: int, system: SecondOrderSystem) -> Iterator[Callable[[], None]]:
    """The other process works, where the part for circuits of as many masses as the system has is
    not stored yet and there is a core for it; it ends with the block at the latest.

    Yields what waits for its end: to be called before a circuit moves. Whoever does not wait
    compiles the same once more, beside a process that is ahead with it.
    """
    masses = system.size
    if jobs < 2 or jit.stored_whole(jit.CIRCUITS.format(masses=masses)):
        yield lambda: None
        return
    process = subprocess.Popen(
        python_command("-c", CALL.format(masses=masses)),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,  # what goes wrong here goes wrong again where it is needed
        start_new_session=True,  # Ctrl-C is for the run, which ends this one
    )

    def wait() -> None:
        doing("compiling the exact engine's part for circuits")
        process.wait()

    try:
        if Flow(system.piecewise_linear(1.0), Drive(1.0)).kernel == "tabulated":
            doing("compiling the exact engine's part for motion between the stops")
            assert process.stdout is not None
            process.stdout.readline()
        yield wait
    finally:
        process.kill()
        process.communicate()


def compile_circuits(masses: int) -> None:
    """Compile it by using it once: a model of so many masses, after which a line is printed, and
    one board of its circuit with every value 1."""
    model = grounded(masses)
    drive, rest = Drive(1.0), np.zeros(2 * masses)
    Flow(model.second_order().piecewise_linear(), drive).run(rest, 1)
    sys.stdout.write("motion\n")
    sys.stdout.flush()
    circuit = unit_circuit(model, CircuitSpec(), load_catalog())
    boards = Ensemble(Boards.of(circuit, [nominal_board(circuit)]))
    boards.settle([0], [drive], rest[None])
    boards.swept(0, [(drive, 1)], rest[None])
    jit.note_stored(jit.CIRCUITS.format(masses=masses))


def grounded(masses: int) -> LumpedSystem:
    """So many masses, each on a spring and a damper to ground, of which the first meets stops."""
    names = [f"m{k + 1}" for k in range(masses)]
    return LumpedSystem(
        tuple(Mass(name, 1.0) for name in names),
        tuple(Spring((name, GROUND), 1.0) for name in names),
        tuple(Damper((name, GROUND), 0.5) for name in names),
        (Gap("A", (names[0], GROUND), upper=0.5, lower=0.5, stiffness=5.0),),
        (Force(names[0], 0.1),),
    )
