"""KiCad's own module, in the interpreter that it is built for."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path


def asked_of_pcbnew(script: str, folder: Path, *arguments: Path) -> str:
    """What a script that imports pcbnew prints; its home and settings are in the folder."""
    home = {**os.environ, "HOME": str(folder), "KICAD_CONFIG_HOME": str(folder / "config")}
    home = {name: text for name, text in home.items() if name not in ("VIRTUAL_ENV", "PYTHONPATH")}
    for place in os.environ["PATH"].split(os.pathsep):
        # The environment of the tests has its own interpreter, which KiCad is not built for.
        python = shutil.which("python3", path=place)
        if python is None or (Path(place).parent / "pyvenv.cfg").exists():
            continue
        done = subprocess.run(
            [python, "-c", script, *map(str, arguments)],
            capture_output=True,
            text=True,
            env=home,
            check=False,
        )
        if done.returncode == 0:
            return done.stdout
    raise AssertionError("no python3 on the path has KiCad's module pcbnew")
