"""Two processes that study one folder at the same time: neither has an accident, and the folder is
afterwards, or after one more call, that of a study which nobody disturbed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.shared.folder_contents import differing
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE

ROOT = Path(__file__).resolve().parents[2]
MODEL = f'format = 1\n{PAPER_TABLE}[[response]]\nomega = 0.85\nexpect = "1-2-2"\n{COARSE_RECTIFIER}'


def begun(model: Path, out: Path) -> subprocess.Popen[str]:
    words = ["tolerance", str(model), "--out", str(out), "--samples", "40", "--rung", "exact"]
    return subprocess.Popen(
        [sys.executable, "-m", "designer", *words, "--no-blame", "--jobs", "1", "-q", "--resume"],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def ended(process: subprocess.Popen[str]) -> int:
    _, said = process.communicate(timeout=300)
    assert process.returncode in (0, 2), said
    assert "Traceback" not in said, said
    assert "internal error" not in said, said
    return process.returncode


@pytest.mark.slow
def test_both_end_and_the_study_is_whole(tmp_path: Path) -> None:
    model = tmp_path / "small.toml"
    model.write_text(MODEL, encoding="utf-8")
    whole, out = tmp_path / "whole" / "out", tmp_path / "two" / "out"
    assert ended(begun(model, whole)) == 0
    both = [begun(model, out) for _ in range(2)]
    assert {ended(process) for process in both} <= {0, 2}
    assert ended(begun(model, out)) == 0
    assert not differing(out, whole)
