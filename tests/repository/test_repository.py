"""Rules that the repository as a whole keeps: locked requirements, no traces of one machine."""

from __future__ import annotations

import re
import subprocess
import tomllib
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from PIL import Image

from designer.report.design_page import dimensionless_equations
from tests.dynamics.test_modal_tables import PAPER

ROOT = Path(__file__).resolve().parents[2]
CONSTRAINTS = ROOT / "requirements" / "constraints.txt"

# Put together from parts, so that this file does not hold what it forbids.
MACHINE_PATHS = [
    "/" + "root" + "/",
    "/opt" + "/pypi",
    "/opt" + "/wheels",
    "/work" + "/main",
    "/work" + "/shared",
]
REGISTRY_HOSTS = ["pypi" + ".org", "python" + "hosted"]
SHARED = ".." + "/shared"


def _pyproject() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def _locked() -> dict[str, tuple[str, list[str]]]:
    """Name to version and hashes, as the constraints file states them."""
    text = CONSTRAINTS.read_text(encoding="utf-8").replace("\\\n", " ")
    locked: dict[str, tuple[str, list[str]]] = {}
    for line in text.splitlines():
        requirement = line.split("#", 1)[0].split()
        if not requirement:
            continue
        pin = re.fullmatch(r"([A-Za-z0-9][A-Za-z0-9._-]*)==([^\s;]+)", requirement[0])
        assert pin, f"neither a pinned requirement nor a comment: {line!r}"
        locked[canonicalize_name(pin[1])] = (pin[2], requirement[1:])
    return locked


def _tracked() -> list[Path]:
    # With what git would take up next, so that a new file is seen before its first commit.
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    out = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    paths = [ROOT / name for name in out.split("\0") if name]
    # A tracked file may be gone from the working tree.
    return [path for path in paths if path.is_file()]


def _files_with(needles: list[str]) -> list[str]:
    found = []
    for path in _tracked():
        content = path.read_bytes()
        found += [f"{path.relative_to(ROOT)}: {n}" for n in needles if n.encode() in content]
    return found


def test_every_requirement_is_locked_with_hashes() -> None:
    locked = _locked()
    assert len(locked) > 30
    for name, (_, hashes) in locked.items():
        assert hashes, f"{name} has no hash"
        for item in hashes:
            assert re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", item), f"{name}: {item}"


def test_constraints_name_no_host_and_no_path() -> None:
    text = CONSTRAINTS.read_text(encoding="utf-8")
    assert not re.findall(r".*(?:://|file:|\bwww\.|index-url|find-links|trusted-host).*", text)
    assert not re.findall(r"^.*(?:^|\s)[./~]*/\S+.*$", text, re.MULTILINE)


def test_every_dependency_is_locked_at_an_allowed_version() -> None:
    pyproject = _pyproject()
    locked = _locked()
    project = pyproject["project"]
    requirements = [
        *pyproject["build-system"]["requires"],
        *project["dependencies"],
        *(r for extra in project["optional-dependencies"].values() for r in extra),
    ]
    for requirement in map(Requirement, requirements):
        name = canonicalize_name(requirement.name)
        assert name in locked, f"{name} is in pyproject.toml, but not in {CONSTRAINTS.name}"
        assert requirement.specifier.contains(locked[name][0], prereleases=True), requirement


def test_no_file_names_a_path_of_one_machine() -> None:
    assert _files_with(MACHINE_PATHS) == []


def test_no_file_names_a_package_registry() -> None:
    assert _files_with(REGISTRY_HOSTS) == []


def test_nothing_reads_outside_the_repository() -> None:
    assert _files_with([SHARED]) == []


@pytest.mark.parametrize("name", ["scripts/ensure-ngspice", "scripts/make-reports", "scripts/lock"])
def test_scripts_are_executable_and_parse(name: str) -> None:
    script = ROOT / name
    assert script.stat().st_mode & 0o111
    subprocess.run(["sh", "-n", str(script)], check=True)


def test_citation_names_the_version_and_the_licence_of_the_package() -> None:
    import designer

    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["cff-version"] == "1.2.0"
    assert citation["version"] == designer.__version__
    assert citation["license"] == _pyproject()["project"]["license"]
    assert f"## [{designer.__version__}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_paper_s_picture_and_table_are_of_the_same_boards() -> None:
    """``scripts/make-picture`` writes the counts that it draws into the file."""
    with Image.open(ROOT / "docs" / "images" / "paper.png") as picture:
        drawn = picture.info["Yields"].splitlines()
    text = (ROOT / "docs" / "paper-case.md").read_text(encoding="utf-8")
    table = text[text.index("Responses, 200 samples") :].split("\n\n", 1)[0].splitlines()[2:]
    told = []
    for line in table:
        omega, *_, rate, _interval, lost, grazing, failed = line.split()
        assert grazing == failed == "0"
        ok = 200 - int(lost)
        assert float(rate) == round(100 * ok / 200, 1)
        told.append(f"{omega} {ok} of 200")
    assert len(told) == 9
    assert drawn == told


def _script(name: str) -> ModuleType:
    path = ROOT / "scripts" / name
    loader = SourceFileLoader(name.replace("-", "_"), str(path))
    spec = spec_from_loader(loader.name, loader)
    assert spec is not None
    module = module_from_spec(spec)
    loader.exec_module(module)
    return module


def test_scripts_in_python_import_what_there_is() -> None:
    """No target runs the one that draws the picture; here at least its names are looked up."""
    assert callable(_script("make-picture").main)


def test_the_picture_of_the_model_is_what_the_script_draws() -> None:
    script = _script("make-model-picture")
    assert script.PICTURE.read_text(encoding="utf-8") == script.picture()
    assert script.RIG.read_text(encoding="utf-8") == script.rig()
    for page in ("docs/paper-case.md", "docs/model-file.md"):
        text = (ROOT / page).read_text(encoding="utf-8")
        assert "images/model.svg)" in text
        for line in dimensionless_equations(PAPER):
            assert f"    {line}\n" in text, page
