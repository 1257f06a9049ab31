"""The house: which package may use which, what is public, what stands once."""

from __future__ import annotations

import ast
import importlib
import re
import subprocess
import sys
import textwrap
from collections import Counter, defaultdict
from functools import cache
from graphlib import TopologicalSorter

import pytest

from designer.base import jit
from tests.shared.house import (
    HOUSE,
    LISTED,
    ORDER,
    ROOT,
    Import,
    arrows,
    imports,
    public,
    reached_by,
    sources,
    trees,
)

DRAWS = "matplotlib takes a second to import, and nothing before a picture needs it"
STARTS = "most verbs do not need it"
AFTER = "parts stand sooner without it"
LAZY = {
    DRAWS: {
        ("schematic.schematic_drawing", "base.figure_style"),
        ("jobs.bench_job", "base.figure_style"),
        ("jobs.bench_job", "report.record_page"),
        ("jobs.bench_job", "plots.record_plots"),
        ("jobs.bifurcation_job", "base.figure_style"),
        ("jobs.bifurcation_job", "plots.bifurcation_plots"),
        ("folders.board_files", "schematic.schematic_drawing"),
        ("jobs.repair_job", "base.figure_style"),
        ("jobs.repair_job", "centering.repair_plots"),
        ("folders.report_sections", "report.inserted"),
        ("folders.report_sections", "report.verb_sections"),
        ("folders.study_stores", "plots.map_plots"),
        ("jobs.study_stage", "report.data"),
        ("jobs.study_stage", "report.write"),
        ("jobs.bifurcation_job", "plots.curve_plots"),
        ("jobs.synthesise_job", "base.figure_style"),
        ("jobs.synthesise_job", "report.compare_plots"),
        ("jobs.trade_job", "base.figure_style"),
        ("jobs.trade_job", "fidelity.trade_files"),
    },
    STARTS: {
        ("folders.json_answers", "check.curved_laws"),
        ("folders.json_answers", "circuit.design"),
        ("folders.json_answers", "model.mechanics"),
        ("folders.json_answers", "model.si_units"),
        ("folders.origin", "spice.batch_backend"),
        ("check.simulation", "check.synthesis_result"),
        ("jobs.bifurcation_job", "folders.design_source"),
        ("jobs.job_outcome", "jobs.study_stage"),
        ("jobs.open_design", "jobs.search_stage"),
        ("jobs.study_stage", "jobs.dask_runner"),
        ("jobs.writing_process", "base.jit"),
        ("jobs.writing_process", "model.find_responses"),
        ("model.model_file", "model.measured_values"),
        ("model.model_file", "model.rules_table"),
    },
    AFTER: {
        ("jobs.stage_runner", "folders.kicad_files"),
    },
}
"""Imports inside functions, outside the verbs and the command line, each with its reason."""
REACH = {
    "catalog": 6_200,
    "new": 11_700,
    "simulate": 28_350,
    "bifurcation": 35_150,
    "reproduce": 57_500,
    "rules": 53_900,
    "explore": 52_250,
    "bench": 57_250,
    "trade": 61_450,
    "export": 59_950,
    "synthesise": 51_950,
    "run": 69_050,
    "tolerance": 69_150,
    "search": 74_300,
}
"""Lines that each verb may import whenever it is called; fewer is better."""


@pytest.fixture(scope="module")
def every() -> tuple[Import, ...]:
    return imports()


def test_every_module_stands_in_a_package() -> None:
    """Beside the packages stand only the public list, ``python -m designer`` and ``py.typed``."""
    assert {p.name for p in HOUSE.iterdir() if p.name != "__pycache__"} == {
        *ORDER,
        "__init__.py",
        "__init__.pyi",
        "__main__.py",
        "py.typed",
    }


@pytest.mark.parametrize("package", ORDER)
def test_no_package_grows_beyond_a_reader(package: str) -> None:
    """7000 lines with stubs: past that a package is two."""
    files = (HOUSE / package).glob("*.py*")
    assert sum(len(path.read_text("utf-8").splitlines()) for path in files) <= 7000


def test_no_module_grows_beyond_a_sitting() -> None:
    """1000 lines: a file is one subject, cut at its joints."""
    longer = {
        path.relative_to(HOUSE).as_posix(): count
        for path in HOUSE.rglob("*.py")
        if (count := len(path.read_text("utf-8").splitlines())) > 1000
    }
    assert longer == {}


def test_a_module_name_stands_once() -> None:
    """A name that two packages use says in neither what the module is."""
    names = Counter(module.split(".")[1] for module in sources())
    assert [name for name, count in names.items() if count > 1] == []


def test_no_import_runs_back(every: tuple[Import, ...]) -> None:
    """Every import goes to the own package or to one that stands before it."""
    place = {package: number for number, package in enumerate(ORDER)}
    assert len(every) > 1000
    back = [
        f"{i.importer}:{i.line} uses {i.module}"
        for i in every
        if i.module and place[i.module.split(".")[0]] > place[i.importer.split(".")[0]]
    ]
    assert back == []


def test_packages_use_modules_and_not_the_public_list_of_the_whole(
    every: tuple[Import, ...],
) -> None:
    """``designer`` and the packages' lists are for users: inside, an import names its module."""
    assert [f"{i.importer}:{i.line}" for i in every if "." not in i.module] == []


@pytest.mark.parametrize("package", ORDER)
def test_no_circle_inside_a_package(package: str, every: tuple[Import, ...]) -> None:
    graph: dict[str, set[str]] = defaultdict(set)
    for i in every:
        if i.importer.split(".")[0] == i.module.split(".")[0] == package:
            graph[i.importer].add(i.module)
    TopologicalSorter(graph).prepare()  # CycleError names the circle


def test_no_private_name_crosses_a_module(every: tuple[Import, ...]) -> None:
    private = [f"{i.importer}:{i.line} {i.name}" for i in every if re.match(r"_[^_]", i.name)]
    assert private == []


@pytest.mark.parametrize("package", LISTED)
def test_what_others_use_is_listed(package: str, every: tuple[Import, ...]) -> None:
    """What another package imports of one that can be used alone is in its list."""
    listed = public(package)
    used = (i for i in every if i.module.startswith(f"{package}."))
    others = {i for i in used if not i.importer.startswith(f"{package}.")}
    homes = {(i.name, i.module) if i.name else (i.module, "") for i in others}
    missing = {
        (name, home)
        for name, home in homes
        if listed.get(name.split(".")[-1]) != home.removeprefix(f"{package}.")
    }
    assert missing == set()


@pytest.mark.parametrize("package", LISTED)
def test_what_is_listed_is_there(package: str) -> None:
    """Every listed name can be imported, and none hides a module of the same name."""
    module = importlib.import_module(f"designer.{package}")
    assert module.__doc__
    listed = public(package)
    assert sorted(module.__all__) == sorted(listed)
    for name, home in listed.items():
        value = getattr(module, name)
        if home:
            assert not (HOUSE / package / f"{name}.py").exists(), name
            assert value is getattr(importlib.import_module(f"designer.{package}.{home}"), name)
        else:
            assert value.__name__ == f"designer.{package}.{name}"


def test_imports_inside_functions_have_a_reason(every: tuple[Import, ...]) -> None:
    """Start-up time is the only one; whatever a verb uses may wait until it is called."""
    waits = ("cli.", "verbs.")
    lazy = {(i.importer, i.module) for i in every if i.lazy and not i.importer.startswith(waits)}
    assert lazy == {pair for pairs in LAZY.values() for pair in pairs}


@cache
def lines_of(module: str) -> int:
    return len(sources()[module].read_text("utf-8").splitlines())


@pytest.mark.parametrize("verb", REACH)
def test_a_verb_imports_what_it_uses(verb: str) -> None:
    """Lines of the modules that a verb imports when it is called, with all that those import."""
    lines = sum(lines_of(m) for m in reached_by(verb))
    assert lines <= REACH[verb]


def test_a_class_name_stands_once() -> None:
    """Private classes and those of tests aside."""
    homes: dict[str, list[str]] = defaultdict(list)
    for module, tree in trees().items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(module)
    assert {name: found for name, found in homes.items() if len(found) > 1} == {}


TIME_OF_DAY = re.compile(
    r"time\.(time|time_ns|ctime|localtime|gmtime|strftime)"
    r"|(datetime\.)?(datetime|date)\.(now|today|utcnow)"
)


def test_nothing_asks_for_the_time_of_day() -> None:
    """So a clock that is set back while work goes on changes nothing: what is measured is measured
    on clocks that only go forward, and no file says when it was made."""
    asked = [
        f"{module}:{node.lineno}"
        for module, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and TIME_OF_DAY.fullmatch(ast.unparse(node))
    ]
    assert asked == []


ALONE = {"base", "kernels", "dynamics", "bifurcations"}


def test_dynamics_and_bifurcations_import_no_other_package() -> None:
    """But for the types of answers, which they do not need to run."""
    assert {used for user, used in arrows() if user in ALONE} <= ALONE | {"answers"}


@pytest.mark.slow
def test_dynamics_and_bifurcations_stand_alone() -> None:
    """Shaw and Holmes' oscillator, built by hand where no other package can be imported."""
    script = f"ALONE = {ALONE}" + textwrap.dedent(
        """
        import sys

        class Forbidden:
            def find_spec(self, name, path=None, target=None):
                parts = name.split(".")
                if parts[0] == "designer" and len(parts) > 1 and parts[1] not in ALONE:
                    raise ImportError(f"{name} is another package")

        sys.meta_path.insert(0, Forbidden())
        from tests.shared.shaw_holmes import main

        main()
        """
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["orbits", "points"]


def test_the_picture_is_of_this_house() -> None:
    """``scripts/draw-architecture`` draws it; an arrow that imports no longer say is an error."""
    text = (ROOT / "docs" / "images" / "architecture.svg").read_text("utf-8")
    assert set(re.findall(r'id="package-(\w+)"', text)) == set(ORDER)
    assert set(re.findall(r'id="use-(\w+)-(\w+)"', text)) == arrows()


def test_the_page_has_a_paragraph_for_each_package() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    assert re.findall(r"(?m)^- \*\*`(\w+)`\*\*", page) == list(ORDER)


def test_a_changed_kernel_empties_the_cache() -> None:
    """Every file with a compiled function is in the hash that names the cache's folder."""
    hashed = {p for pattern in jit.KERNELS for p in jit.PACKAGE.glob(pattern)}
    users = {p for p in HOUSE.rglob("*.py") if "designer.base.jit import" in p.read_text("utf-8")}
    assert users == hashed
