"""A Monte Carlo run as spicelib does it: the deck with new values, a process of ngspice each time.

It draws resistors and capacitors only, knows nothing of a steady state, and gives a waveform from
rest; so that is what is timed: ``periods`` drive periods, of which the last is read, in the steps
with which a study begins.
"""

from __future__ import annotations

import importlib
import logging
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Excitation
from designer.spice.deck import SolverSettings, write
from designer.spice.numerics_gate import RELTOL, STEPS_PER_PERIOD
from designer.verdicts.verdict import StudyPlan


def seconds_a_board(
    plan: StudyPlan, excitation: Excitation, *, runs: int, periods: int, jobs: int
) -> float | None:
    """Wall seconds a board with ``jobs`` processes at once; None where spicelib is not installed.

    Raises
    ------
    RuntimeError : a run of ngspice gave no waveform.
    """
    try:
        toolkit: Any = importlib.import_module("spicelib.sim.tookit.montecarlo")
        simulator: Any = importlib.import_module("spicelib.simulators.ngspice_simulator")
        runner: Any = importlib.import_module("spicelib.sim.sim_runner")
        editor: Any = importlib.import_module("spicelib.editor.spice_editor")
    except ImportError:
        return None
    # It does not find what it needs not look into, and says so at every run.
    logging.getLogger("spicelib").setLevel(logging.CRITICAL)
    period = 1.0 / excitation.frequency
    stop = periods * period
    deck = write(
        plan.circuit,
        nominal_board(plan.circuit),
        excitation,
        SolverSettings("trap", period / STEPS_PER_PERIOD, RELTOL),
        title="Monte Carlo by spicelib",
        stop_time=stop,
        kept_from=stop - period,
    )
    with tempfile.TemporaryDirectory() as folder:
        netlist = Path(folder) / "deck.net"
        library = Path(folder) / "opamp.lib"
        main, models = apart(deck)
        library.write_text(models, encoding="ascii")
        netlist.write_text(
            main.replace(".end\n", f'.include "{library}"\n.end\n'), encoding="ascii"
        )
        run = runner.SimRunner(
            output_folder=folder, simulator=simulator.NGspiceSimulator, parallel_sims=jobs
        )
        study = toolkit.Montecarlo(editor.SpiceEditor(str(netlist)), run)
        study.set_tolerance("R", plan.spread.resistor)
        study.set_tolerance("C", plan.spread.capacitor)
        began = time.perf_counter()
        study.run_analysis(callback=_peak, num_runs=runs)
        peaks = study.simulation_results["callback_returns"]
        took = time.perf_counter() - began
    if len(peaks) != runs or not all(np.isfinite(p) and p > 0.0 for p in peaks):
        raise RuntimeError(f"spicelib's runs gave peaks {peaks}")
    return took / runs


def apart(deck: str) -> tuple[str, str]:
    """A deck without its subcircuits, and these: spicelib does not read ngspice's code models."""
    main: list[str] = []
    models, inside = ["* op-amps"], False
    for line in deck.splitlines():
        inside = inside or line.lower().startswith(".subckt")
        (models if inside else main).append(line)
        inside = inside and not line.lower().startswith(".ends")
    return "\n".join(main) + "\n", "\n".join(models) + "\n"


def _peak(raw: Path, _log: Path) -> float:
    """Of the first state over what was kept."""
    reader: Any = importlib.import_module("spicelib.raw.raw_read")
    read = reader.RawRead(str(raw), dialect="ngspice")
    wave = read.get_trace(read.get_trace_names()[1]).get_wave()
    return float(np.abs(wave).max())
