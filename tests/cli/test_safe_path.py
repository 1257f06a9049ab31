"""Files of the working directory that are named as modules are data, whatever starts there."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from designer.base.environment import python_command
from designer.cli.app import VERBS
from designer.explorer.job_processes import JobProcesses
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE

ROOT = Path(__file__).resolve().parents[2]
LIBRARIES = (
    "numpy scipy numba llvmlite lazy_loader rich typer click yaml pyarrow cvxpy highspy matplotlib "
    "platformdirs jinja2 bokeh tornado distributed dask PySpice ply cffi schemdraw six packaging "
    "dateutil sitecustomize usercustomize"
).split()
BEFORE = set(
    "importlib collections contextlib functools keyword operator reprlib types warnings".split()
)
"""What ``python -m`` itself imports before it looks for its module: SECURITY.md says so."""
RAN = "RAN"
COMMAND = "from designer.cli.entry import main\nif __name__ == '__main__':\n    main()\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A model's folder with a file for every module's name; each notes that it was run."""
    folder = tmp_path / "model"
    folder.mkdir()
    for name in sys.stdlib_module_names | {*LIBRARIES}:
        line = f"open({str(folder / RAN)!r}, 'a').write({name!r} + '\\n')\nraise ImportError\n"
        (folder / f"{name}.py").write_text(line)
    (folder / "paper.toml").write_text(f"format = 1\n{PAPER_TABLE}{COARSE_RECTIFIER}")
    return folder


def ran(folder: Path) -> str:
    path = folder / RAN
    return path.read_text() if path.exists() else ""


def script(folder: Path, text: str = COMMAND) -> str:
    """The command as pip installs it: a script in another folder."""
    path = folder.with_name("bin") / "designer_script.py"
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return str(path)


def call(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
    environment.pop("PYTHONSAFEPATH", None)
    return subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True
    )


@pytest.mark.slow
def test_workers_of_the_command(folder: Path) -> None:
    done = call(
        folder,
        script(folder),
        *"simulate paper.toml --omega 1.55 --engine ngspice --starts 1".split(),
    )
    assert (done.returncode, ran(folder)) == (0, ""), done.stderr


@pytest.mark.slow
def test_python_m(folder: Path) -> None:
    for name in BEFORE:
        (folder / f"{name}.py").unlink()
    done = call(folder, *"-m designer simulate paper.toml --omega 1.55 --starts 1".split())
    assert (done.returncode, ran(folder)) == (0, ""), done.stderr


def test_python_m_of_another_module_keeps_its_folder(folder: Path) -> None:
    """Only ``-m designer`` takes the folder from the path: a user's module may have siblings."""
    for path in folder.glob("*.py"):
        path.unlink()
    (folder / "mine.py").write_text("import designer, sibling, designer.base\nprint(sibling.X)\n")
    (folder / "sibling.py").write_text("X = 7\n")
    done = call(folder, "-m", "mine", "designer")
    assert done.stdout == "7\n", done.stderr


OWN = """
import sys
import sibling
from designer.spice.pool import SpiceJob, SpicePool

def length(waves):
    return sibling.doubled(len(waves.signals))

if __name__ == "__main__":
    deck = "rc\\nV1 a 0 1\\nR1 a 0 1k\\n.tran 1u 1m\\n.end\\n"
    with SpicePool(1) as pool:
        print(*pool.map([SpiceJob(deck, ("a",), 1e-3, length)]))
"""


def test_a_script_of_the_user_has_its_siblings_in_the_workers(folder: Path) -> None:
    own = script(folder, OWN)
    Path(own).with_name("sibling.py").write_text("def doubled(x):\n    return 2 * x\n")
    done = call(folder, own)
    assert (done.stdout, ran(folder)) == ("(0, 2)\n", ""), done.stderr


def test_jobs_of_explore(folder: Path) -> None:
    """They run in the model's folder."""
    (folder / "paper.toml").write_text("format = 9\n")
    told: list[object] = []
    jobs = JobProcesses(told.append)
    job = jobs.start("run", folder / "paper.toml")
    deadline = time.monotonic() + 60.0
    while job.status is None and time.monotonic() < deadline:
        time.sleep(0.05)
    jobs.close()
    assert (job.status, ran(folder)) == (2, "")
    assert "format" in job.line


def test_other_processes(folder: Path) -> None:
    """Those of the compiler, and of every pool that is made with ``spawn_context``."""
    text = """
from concurrent.futures import ProcessPoolExecutor
from designer.base.environment import spawn_context
if __name__ == "__main__":
    with ProcessPoolExecutor(1, mp_context=spawn_context()) as pool:
        print(pool.submit(abs, -3).result())
"""
    done = call(folder, script(folder, text))
    assert (done.stdout, ran(folder)) == ("3\n", ""), done.stderr
    words = python_command("-c", "import designer.base.jit, threading, typer")[1:]
    done = call(folder, *words)
    assert (done.returncode, ran(folder)) == (0, ""), done.stderr


def test_settings_of_numba_in_the_folder_are_not_read(folder: Path) -> None:
    """One of them is where compiled code lies, which numba unpickles."""
    settings = f"cache_dir: {folder}\ndisable_jit: 1\nopt: 0\n"
    (folder / ".numba_config.yaml").write_text(settings)
    text = (
        "from designer.base import jit\nimport numba\n"
        "numba.core.config.reload_config()\n"
        "c = numba.config\nprint(int(c.OPT), c.DISABLE_JIT, c.CACHE_DIR)\n"
    )
    done = call(folder, script(folder, text))
    assert done.stdout.startswith("3 0 "), done.stderr
    assert str(folder) not in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS)
def test_every_verb(folder: Path, verb: str) -> None:
    """Each begins, with what it imports: most refuse what they are given."""
    words = [verb] if verb in ("catalog", "explore") else [verb, "paper.toml"]
    if verb in ("run", "synthesise", "synthesize", "bifurcation", "tolerance", "search", "trade"):
        words += ["--out", "out"]
    if verb in ("explore", "reproduce"):
        words = [verb, "no-such-file.toml"]
    if verb in ("run", "synthesise", "synthesize"):
        (folder / "paper.toml").write_text("format = 1\n[model]\nm = 2\n")
    done = call(folder, script(folder), *words)
    assert ran(folder) == "", done.stderr
    assert "Traceback" not in done.stderr
    assert "internal error" not in done.stderr
