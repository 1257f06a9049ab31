"""Synthesis of many masses: error, proved bound and gap of the linear block of random chains.

Every mass has a spring and a damper to the next, the last one to ground. Times are CPU seconds of
the process that solved one chain, compiled code cached.
"""

from __future__ import annotations

import json
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks.bench_flow import commit, machine, table
from designer.base.arrays import Array
from designer.base.environment import spawn_context
from designer.base.eseries import series_values
from designer.linear_network.linear_search import best
from designer.linear_network.linear_terms import Bounds, LinearBlock, Targets

CHAINS = (*((3, seed) for seed in range(10)), (4, 0), (5, 0), (6, 0))
"""Masses and seed of each chain."""
BAND, SIGNAL = (50.0, 1000.0), (4.7e3, 5e5)
"""Hz of ω = 1; range of the resistors [ohm]."""
LEVEL, SHARE = 4.0, 1.6
"""Of the side condition ``level``, every peak being 1."""
WORKERS = 4
"""Chains that are solved at a time."""
REPORT = Path(__file__).parent.parent / "reports" / "synthesis"


@dataclass(frozen=True)
class Chain:
    """One answer; NaN where none was found."""

    masses: int
    seed: int
    error: float
    bound: float
    seconds: float


def state_matrix(masses: int, seed: int) -> Array:
    """(2n, 2n) state matrix of a chain: masses and stiffnesses about 1, dampings about 0.2, each
    times exp of a uniform number in ± 0.7."""
    rng = np.random.default_rng(seed)
    m, k, c = np.exp(rng.uniform(-0.7, 0.7, (3, masses))) * np.array([[1.0], [1.0], [0.2]])
    step = np.eye(masses) - np.eye(masses, k=1)
    A = np.zeros((2 * masses, 2 * masses))
    A[0::2, 1::2] = np.eye(masses)
    A[1::2, 0::2] = -(step.T * k @ step) / m[:, None]
    A[1::2, 1::2] = -(step.T * c @ step) / m[:, None]
    return A


def solve(chain: tuple[int, int]) -> Chain:
    """The linear block of one chain, E96 resistors and E12 capacitors."""
    masses, seed = chain
    seconds = (1.0 / (2.0 * np.pi * BAND[1]), 1.0 / (2.0 * np.pi * BAND[0]))
    capacitors = series_values(["E12"], 1e-9, 1e-6)
    before = time.process_time()
    answer = best(
        Targets.from_state_matrix(state_matrix(masses, seed)),
        series_values(["E96"], *SIGNAL),
        capacitors,
        np.ones(len(capacitors)),
        Bounds(seconds, LEVEL, SHARE, 0.0, np.ones(2 * masses)),
    )
    error, bound = np.nan, np.nan
    if isinstance(answer, LinearBlock):
        error, bound = answer.error, answer.bound
    return Chain(masses, seed, error, bound, time.process_time() - before)


def report(rows: list[Chain]) -> str:
    """chains.md."""
    body = [
        [str(r.masses), str(r.seed), f"{r.error:.3g}", f"{r.bound:.3g}",
         f"{r.error - r.bound:.2g}", f"{r.seconds:.0f}"]
        for r in rows
    ]  # fmt: skip
    lines = [
        "# Error and gap of chains of masses",
        "",
        "Made by `python -m benchmarks chains` (`make bench`); the data are in `chains.json`.",
        "",
        f"- Commit: {commit()}",
        f"- Machine: {machine()}",
        "",
        "Random chains, every mass with a spring and a damper to the next, the last one to ground;",
        "resistors E96, 4.7 kΩ to 500 kΩ, capacitors E12, 1 nF to 1 µF, ω = 1 at 50 to 1000 Hz,",
        "side condition `level` for equal peaks. The error is the largest coefficient error, the",
        "bound is proved, the gap is what lies between. Seconds are CPU seconds of one chain,",
        f"{WORKERS} being solved at a time.",
        "",
        *table(["masses", "seed", "error", "bound", "gap", "CPU seconds"], body),
    ]
    return "\n".join(lines) + "\n"


def main() -> str:
    """Measure, print, write chains.md and chains.json; returns a line of results."""
    with ProcessPoolExecutor(WORKERS, mp_context=spawn_context()) as pool:
        rows = list(pool.map(solve, CHAINS[::-1]))[::-1]
    text = report(rows)
    print(text)
    REPORT.mkdir(parents=True, exist_ok=True)
    (REPORT / "chains.md").write_text(text, encoding="utf-8")
    data = {"format": 1, "commit": commit(), "rows": [asdict(row) for row in rows]}
    (REPORT / "chains.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    gap = max(row.error - row.bound for row in rows if row.masses == 3)
    return f"largest gap of three masses {gap:.2g}, slowest {max(r.seconds for r in rows):.0f} s"
