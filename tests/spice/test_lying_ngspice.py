"""A program that calls itself ngspice and says nothing true, hangs or dies: a message, in time."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from designer.base.errors import EnvironmentMissing
from designer.cli import entry
from designer.spice import batch_backend
from designer.spice.batch_backend import program_version

VERSION = "case $* in *--version*) echo '** ngspice-46 : Circuit level simulation'; exit;; esac\n"
RAW = (
    b"Title: t\nDate: today\nPlotname: Transient Analysis\nFlags: real\n"
    b"No. Variables: 1\nNo. Points: 2       \nVariables:\n\t0\ttime\ttime\nBinary:\n"
    + np.arange(2.0).tobytes()
)
"""Whole, but of no node."""


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What stands first in the path."""
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setattr(batch_backend, "LONGEST_START", 1.0)
    monkeypatch.setattr(batch_backend, "LONGEST_RUN", 1.0)
    return tmp_path / "ngspice"


def written(program: Path, script: str) -> None:
    program.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    program.chmod(0o755)


@pytest.mark.timeout(60)
@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("exec sleep 50", "does not say its version within 1 s"),
        (f"echo '** ngspice-{'9' * 5000}'", "ngspice 9999"),
        ("printf '** ngspice-\\377\\377'", "of unknown version"),
        ("kill -9 $$", "of unknown version"),
    ],
)
def test_one_without_a_version_is_missing(script: str, said: str, program: Path) -> None:
    written(program, script)
    with pytest.raises(EnvironmentMissing, match=said):
        program_version()


@pytest.mark.timeout(60)
@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("exec sleep 50", "no answer within 1 s"),
        ("kill -9 $$", "ngspice exit -9"),
        ("echo nonsense > deck.raw", "no binary data"),
        ("echo 'Error: no such vector'; exit 1", "no such vector"),
        ("cp {folder}/its.raw deck.raw", "ngspice's answer is none"),
    ],
)
def test_one_that_answers_nothing_measures_no_op_amp(
    script: str, said: str, program: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (program.parent / "its.raw").write_bytes(RAW)
    written(program, VERSION + script.format(folder=program.parent))
    assert entry.status(["catalog", "--check", "TL074C"]) == 1
    told = capfd.readouterr().err
    assert said in told
    assert "Traceback" not in told
    assert "internal error" not in told
