"""Boards that the KiCad project is tested on, and KiCad's own program."""

from __future__ import annotations

import os
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from designer.board.board_parts import fitted
from designer.board.component import components
from designer.board.kicad_rules import board_rules, rules_text
from designer.catalog.entries import Mounting
from designer.check.deck_runs import FirstRun
from designer.circuit.netlist import Circuit, Excitation
from designer.model.board_table import BoardChoice, BoardSpec, Connectors
from designer.schematic.kicad_project import Project, files
from designer.spice.deck import SolverSettings
from tests.base.test_views import CIRCUITS
from tests.shared.stages import CATALOG

RUN = FirstRun(Excitation(300.0, 1.0), SolverSettings("trap", 1e-6), 0.01, np.zeros(4))
CASES: dict[str, tuple[str, Mounting]] = {
    **{name: (name, "mixed") for name in CIRCUITS},
    "protected": ("paper", "mixed"),
    "SMA jacks": ("paper", "mixed"),
    "BNC jacks": ("rectifier", "mixed"),
    "through-hole": ("rectifier", "tht"),
    "surface": ("rectifier", "smd"),
    "duals on the surface": ("duals", "smd"),
    "singles on the surface": ("singles", "smd"),
}
"""Circuit and mounting."""
JACKS: dict[str, Connectors] = {"SMA jacks": "sma", "BNC jacks": "bnc"}
"""Cases with coaxial jacks in the place of pins."""
PROTECTED = ("surface", "protected", "through-hole")
"""Cases with a diode in each rail; the others are connected straight to it."""


def project(
    circuit: Circuit,
    mounting: Mounting = "mixed",
    title: str = "a board",
    dc_trim: str = "fitted",
    reverse_protection: str = "",
    connectors: Connectors = "pins",
) -> Project:
    """The project of a circuit with everything that its board needs."""
    catalog = CATALOG.mounted(mounting)
    spec = BoardSpec(
        mounting=mounting,
        dc_trim=dc_trim,  # type: ignore[arg-type]
        reverse_protection=reverse_protection,
        connectors=connectors,
    )
    choice = BoardChoice(spec)
    board = fitted(circuit, choice, catalog)
    found = components(board, catalog, choice)
    run = replace(RUN, initial=np.zeros(len(circuit.states)))
    return Project(title, board, found, run, rules_text(board_rules(board)), {})


@cache
def case(name: str) -> Project:
    circuit, mounting = CASES[name]
    return project(
        CIRCUITS[circuit],
        mounting,
        dc_trim="unfitted" if name == "paper" else "fitted",
        reverse_protection="1N5819" if name in PROTECTED else "",
        connectors=JACKS.get(name, "pins"),
    )


@cache
def case_files(name: str) -> dict[str, str]:
    return files(case(name))


def written(made: dict[str, str], folder: Path) -> Path:
    """The files on disk."""
    for name, text in made.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder


def kicad(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """KiCad's program in this folder, with no settings but its own."""
    home = folder / "home"
    home.mkdir(exist_ok=True)
    environment = {**os.environ, "HOME": str(home), "KICAD_CONFIG_HOME": str(home), "LC_ALL": "C"}
    return subprocess.run(
        ["kicad-cli", *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
