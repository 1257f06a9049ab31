"""Nine records of boards of ``examples/paper.toml``, one of each wanted response, with the truth.

The boards are of ``bench-1``, run by ngspice with full op-amps (``benchmarks/record_boards.py``)
and sampled by `SimulatedScope`: 4000 points over nine drive periods. The file has what a scope's
converter has, the levels of 8 bits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from designer.workbench.record import Record

FILE = Path(__file__).parent / "records.npz"
COUNT = 9


@dataclass(frozen=True)
class StoredRecord:
    """A record and what is true of it. response : by ngspice. nets : at CH1, CH2, …. frequency : of
    the drive [Hz]."""

    record: Record
    response: str
    nets: tuple[str, ...]
    frequency: float


@cache
def stored(number: int) -> StoredRecord:
    """One of the records, 0 to 8, in the order of the model file's responses."""
    with np.load(FILE) as file:
        levels, scales = file[f"levels_{number}"], file[f"scales_{number}"]
        response, *nets = (str(word) for word in file[f"words_{number}"])
        time = float(file[f"interval_{number}"]) * np.arange(levels.shape[1])
        signals = {
            f"CH{k + 1}": low + step * level.astype(np.float64)
            for k, (level, (low, step)) in enumerate(zip(levels, scales, strict=True))
        }
        frequency = float(file[f"frequency_{number}"])
    return StoredRecord(Record(time, signals, f"record {number}"), response, tuple(nets), frequency)
