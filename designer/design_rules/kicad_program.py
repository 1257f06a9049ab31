"""The program ``kicad-cli``: whether it is here, how new it is, and one call of it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

from designer.base.printed import one_line

PROGRAM = "kicad-cli"
MISSING = "kicad-cli is not installed (KiCad 9 or newer)"
NEEDED = 9
"""KiCad's major version: older ones write another report and lack options."""
PATIENCE = 600.0
"""Seconds that one call may take."""


class KicadFailed(Exception):
    """KiCad gave no answer that counts; says why."""


def kicad_version() -> str | None:
    """The version of the installed ``kicad-cli``; None where there is none."""
    if shutil.which(PROGRAM) is None:
        return None
    try:
        process = subprocess.run(
            [PROGRAM, "--version"],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=60,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return process.stdout.strip() or None


def needed_version() -> str:
    """The version of ``kicad-cli``, where it is one that does.

    Raises
    ------
    KicadFailed : there is none, or it is too old.
    """
    version = kicad_version()
    if version is None:
        raise KicadFailed(MISSING)
    major = re.match(r"\d{1,4}(?!\d)", version, re.ASCII)
    if major is None or int(major[0]) < NEEDED:
        raise KicadFailed(f"kicad-cli {one_line(version[:40])} is older than KiCad {NEEDED}")
    return version


def call(*arguments: str, place: Path) -> subprocess.CompletedProcess[str]:
    """One call, with ``place`` as its home, so that no setting of the user's counts.

    Raises
    ------
    KicadFailed : it cannot be started, or gave no answer in time.
    """
    environment = {"HOME": str(place), "KICAD_CONFIG_HOME": str(place / "config"), "LC_ALL": "C"}
    try:
        return subprocess.run(
            [PROGRAM, *arguments],
            capture_output=True,
            text=True,
            errors="replace",
            env={**os.environ, **environment},
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise KicadFailed(f"kicad-cli gave no answer within {PATIENCE:g} s") from None
    except OSError as error:
        raise KicadFailed(f"kicad-cli could not be started: {error.strerror}") from None


def last_words(process: subprocess.CompletedProcess[str]) -> str:
    """The last line that a call wrote, for messages."""
    lines = (process.stderr or process.stdout).strip().splitlines()
    return lines[-1] if lines else "no reason"
