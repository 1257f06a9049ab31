"""Samples on disk: one Parquet file for each finished block of a study.

Block edges follow from the sample index alone, and every file says which study it belongs to, so
that an interrupted study goes on where it stopped and a longer one takes over what is there. A
file appears whole or not at all.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from designer import __version__, confirmation
from designer.errors import InputError
from designer.verdict import BLOCK, Answer, StudyPlan, Verdict

FORMAT = 1
FOLDER = "samples.parquet"
_KEY = b"designer"
_SCHEMA = pa.schema(
    [
        ("sample", pa.int64()),
        ("question", pa.int64()),
        ("omega", pa.float64()),
        ("verdict", pa.string()),
        ("response", pa.string()),
        ("reason", pa.string()),
        ("radius", pa.float64()),
        ("penetration", pa.float64()),
        ("miss", pa.float64()),
        ("asymmetry", pa.float64()),
        ("periods", pa.int64()),
        ("waveform", pa.float64()),
        ("ngspice", pa.string()),
        ("ngspice_reason", pa.string()),
        ("ngspice_remedies", pa.string()),
        ("ngspice_nominal", pa.string()),
        ("ngspice_nominal_reason", pa.string()),
        ("ngspice_nominal_remedies", pa.string()),
        ("ngspice_nominal_periods", pa.int64()),
    ]
)


def block_name(block: range) -> str:
    """File name of the block, inside the design folder."""
    return f"{FOLDER}/block-{block.start // BLOCK:06d}.parquet"


def block_names(samples: int) -> list[str]:
    """File names of a study of so many samples."""
    return [
        block_name(range(first, min(first + BLOCK, samples))) for first in range(0, samples, BLOCK)
    ]


def study_hash(plan: StudyPlan) -> str:
    """Hash of everything that decides an answer; not of how many there are."""
    circuit = plan.circuit
    said = {
        "version": __version__,
        "parts": [[type(p).__name__, asdict(p)] for p in circuit.parts],
        "opamp": [circuit.opamp, circuit.gain, circuit.bias, circuit.supply, circuit.saturation],
        "spread": plan.spread.as_dict(),
        "seed": plan.seed,
        "ngspice": [
            confirmation.OWN_SAMPLES,
            confirmation.OWN_REFINEMENTS,
            confirmation.NOMINAL_SAMPLES,
            confirmation.NOMINAL_REFINEMENTS,
            confirmation.SLOW,
            confirmation.MOST_PERIODS,
        ],
        "questions": [
            {
                "spec": asdict(q.spec),
                "excitation": asdict(q.excitation),
                "start": [float(v) for v in q.start.start],
                "nominal": q.start.response,
                "settings": None if q.settings is None else q.settings.as_dict(),
            }
            for q in plan.questions
        ],
    }
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode("ascii")).hexdigest()


@dataclass(frozen=True)
class BlockStore:
    """The blocks of one study in a design folder; root is the design folder."""

    root: Path
    plan: StudyPlan
    study: str

    @classmethod
    def of(cls, root: Path, plan: StudyPlan) -> BlockStore:
        """The store of this plan's study."""
        return cls(root, plan, study_hash(plan))

    def read(self, block: range) -> list[Answer] | None:
        """The answers of a finished block of this very study; None where there is none."""
        path = self.root / block_name(block)
        if not path.is_file():
            return None
        try:
            table = pq.read_table(path, schema=_SCHEMA, partitioning=None)
            said = json.loads((pq.read_schema(path).metadata or {}).get(_KEY, b"{}"))
            rows: list[dict[str, Any]] = table.to_pylist()
        except (OSError, ValueError, pa.ArrowException):
            return None
        if said != self._said(block) or len(rows) != len(block) * len(self.plan.questions):
            return None
        for row in rows:
            del row["omega"]
            row["verdict"] = Verdict(row["verdict"])
        return [Answer(**row) for row in rows]

    def write(self, block: range, answers: Sequence[Answer]) -> None:
        """Put a finished block where it belongs, all at once."""
        path = self.root / block_name(block)
        rows = [
            {
                **asdict(a),
                "verdict": str(a.verdict),
                "omega": self.plan.questions[a.question].spec.omega,
            }
            for a in answers
        ]
        schema = _SCHEMA.with_metadata({_KEY: json.dumps(self._said(block), sort_keys=True)})
        partial = path.with_name(f".{path.name}.part")
        try:
            path.parent.mkdir(exist_ok=True)
            pq.write_table(pa.Table.from_pylist(rows, schema=schema), partial)
            os.replace(partial, path)
        except OSError as error:
            expected = "a place that can be written"
            raise InputError(path, "--out", error.strerror or str(error), expected) from None
        finally:
            with contextlib.suppress(OSError):
                partial.unlink(missing_ok=True)

    def _said(self, block: range) -> dict[str, Any]:
        return {
            "format": FORMAT,
            "study": self.study,
            "first": block.start,
            "stop": block.stop,
        }
