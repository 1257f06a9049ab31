"""scripts/ensure-ngspice: silent where ngspice is there, clear and exit 3 where it cannot be."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "ensure-ngspice"


def _run(path: str | None = None) -> subprocess.CompletedProcess[str]:
    shell = shutil.which("sh")
    assert shell is not None
    return subprocess.run(
        [shell, str(SCRIPT)],
        capture_output=True,
        text=True,
        check=False,
        env=None if path is None else {"PATH": path},
    )


def _programs(directory: Path, *names: str) -> Path:
    """A directory for PATH with only the named programs."""
    for name in names:
        program = shutil.which(name)
        assert program is not None
        (directory / name).symlink_to(program)
    return directory


def _fake(directory: Path, name: str, body: str) -> None:
    (directory / name).write_text(f"#!/bin/sh\n{body}\n", encoding="utf-8")
    (directory / name).chmod(0o755)


def test_does_nothing_where_ngspice_is_installed() -> None:
    for _ in range(2):
        done = _run()
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_says_what_to_install_where_there_is_no_apt(tmp_path: Path) -> None:
    done = _run(str(_programs(tmp_path, "sed", "grep", "head")))
    assert done.returncode == 3
    assert "ngspice is not installed" in done.stderr
    for command in ("apt-get install ngspice libngspice0", "dnf install", "brew install"):
        assert command in done.stderr


def test_refuses_an_old_ngspice(tmp_path: Path) -> None:
    _fake(_programs(tmp_path, "sed", "grep", "head"), "ngspice", "echo '** ngspice-35 : x'")
    done = _run(str(tmp_path))
    assert done.returncode == 3
    assert "ngspice 35 is installed, but 36 or newer is needed" in done.stderr


@pytest.mark.parametrize("uid", [0, 1000])
def test_a_failed_installation_is_exit_3(tmp_path: Path, uid: int) -> None:
    programs = _programs(tmp_path, "sed", "grep", "head", "mktemp", "rm", "cat", "env")
    _fake(programs, "id", f"echo {uid}")
    _fake(programs, "apt-get", "echo 'E: no network'; exit 100")
    _fake(programs, "sudo", "exit 1")
    done = _run(str(programs))
    assert done.returncode == 3
    assert ("E: no network" in done.stderr) == (uid == 0)
    assert "apt-get install ngspice libngspice0" in done.stderr
