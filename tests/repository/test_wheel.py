"""The wheel, installed alone: complete, and of use far from the checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.wheel


def _run(*command: str | Path, cwd: Path) -> str:
    # Nothing of this environment may lead the other Python to the checkout.
    env = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=env,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{command}: {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("wheel")
    # Isolation would download the build backend.
    options = ("--wheel", "--no-isolation", "--outdir", out)
    # Not from the checkout, where `-m build` could find a directory of that name.
    _run(sys.executable, "-m", "build", *options, ROOT, cwd=out)
    (built,) = out.glob("designer_circuits-*.whl")
    return built


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A new environment with the wheel, which finds its dependencies in the present one."""
    home = tmp_path_factory.mktemp("elsewhere")
    venv = home / "venv"
    _run(sys.executable, "-m", "venv", venv, cwd=home)
    python = venv / "bin" / "python"
    _run(python, "-m", "pip", "install", "--no-index", "--no-deps", "--quiet", wheel, cwd=home)
    # A path added by a .pth file comes after the new site-packages, and the .pth files in it
    # (such as that of an editable installation) are not obeyed.
    paths = dict.fromkeys(sysconfig.get_path(name) for name in ("purelib", "platlib"))
    site = Path(
        _run(
            python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=home
        ).strip()
    )
    (site / "dependencies.pth").write_text("\n".join(paths) + "\n", encoding="utf-8")
    return venv


def _names(wheel: Path) -> set[str]:
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def _files(directory: Path) -> list[Path]:
    if not directory.is_dir():
        return []
    return [p for p in directory.rglob("*") if p.is_file() and "__pycache__" not in p.parts]


def test_wheel_holds_the_whole_package(wheel: Path) -> None:
    names = _names(wheel)
    assert "designer/py.typed" in names
    expected = {p.relative_to(ROOT).as_posix() for p in _files(ROOT / "designer")}
    assert expected - names == set()


def test_wheel_holds_the_catalogues(wheel: Path) -> None:
    catalogs = {f"designer/{p.relative_to(ROOT).as_posix()}" for p in _files(ROOT / "catalogs")}
    assert catalogs
    assert catalogs - _names(wheel) == set()


def test_wheel_holds_nothing_else(wheel: Path) -> None:
    tops = {name.split("/", 1)[0] for name in _names(wheel)}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"designer"}
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in _names(wheel))


def test_package_is_imported_from_the_wheel(environment: Path) -> None:
    code = "import designer; print(designer.__file__)"
    found = _run(environment / "bin" / "python", "-c", code, cwd=environment.parent)
    assert Path(found.strip()).resolve().is_relative_to(environment.resolve())


def test_version(environment: Path) -> None:
    import designer

    shown = _run(environment / "bin" / "designer", "--version", cwd=environment.parent)
    assert designer.__version__ in shown
    module = _run(
        environment / "bin" / "python", "-m", "designer", "--version", cwd=environment.parent
    )
    assert module == shown


def test_catalogues_are_found(environment: Path) -> None:
    shown = _run(environment / "bin" / "designer", "catalog", "--json", cwd=environment.parent)
    assert '"TL074C"' in json.dumps(json.loads(shown))
    code = (
        "from designer.catalog.parts_catalog import load_catalog;"
        "print(*(a.name for a in load_catalog().opamps))"
    )
    names = _run(environment / "bin" / "python", "-c", code, cwd=environment.parent)
    assert "TL074C" in names.split()
