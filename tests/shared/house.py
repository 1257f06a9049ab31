"""The packages of ``designer`` in the order in which data flows, and the imports between them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HOUSE = ROOT / "designer"
ORDER = (
    "base",
    "answers",
    "kernels",
    "dynamics",
    "bifurcations",
    "catalog",
    "laws",
    "model",
    "circuit",
    "linear_network",
    "synthesis",
    "spread",
    "spice",
    "check",
    "verdicts",
    "board",
    "schematic",
    "routing",
    "yields",
    "design_rules",
    "fabrication",
    "centering",
    "fidelity",
    "workbench",
    "plots",
    "report",
    "folders",
    "jobs",
    "explorer",
    "paper",
    "verbs",
    "cli",
)
"""A package may use those before it. The picture in docs/architecture.md is drawn from this."""
LISTED = ("dynamics", "bifurcations")
"""Packages that can be used alone, and list what they are for."""


@dataclass(frozen=True)
class Import:
    """One name that a module takes from another of the same project."""

    importer: str
    """The importing module, as "package.module"."""
    module: str
    """The module that it is taken from, as "package.module"; "package" for a package's own list."""
    name: str
    """The name; "" where the module itself is imported."""
    lazy: bool
    """Whether the import stands inside a function."""
    line: int
    """Of the importing file."""
    for_types: bool = False
    """Whether only a type checker imports it."""


@cache
def sources() -> dict[str, Path]:
    """Every module in a package, as "package.module"."""
    return {
        f"{path.parent.name}.{path.stem}": path
        for package in ORDER
        for path in sorted((HOUSE / package).glob("*.py"))
        if path.stem != "__init__"
    }


@cache
def trees() -> dict[str, ast.Module]:
    """The parsed text of every module in a package, as "package.module"."""
    return {module: ast.parse(path.read_text("utf-8")) for module, path in sources().items()}


@cache
def imports() -> tuple[Import, ...]:
    """All imports between modules of the project, lazy ones and those for types only too."""
    return tuple(_imports())


def _imports() -> Iterator[Import]:
    modules = trees()
    for importer, tree in modules.items():
        lazy = {
            id(node)
            for function in ast.walk(tree)
            if isinstance(function, ast.FunctionDef)
            for node in ast.walk(function)
        }
        for_types = {
            id(node)
            for condition in ast.walk(tree)
            if isinstance(condition, ast.If) and ast.unparse(condition.test) == "TYPE_CHECKING"
            for node in ast.walk(condition)
        }
        for node in ast.walk(tree):
            if not isinstance(node, ast.ImportFrom) or node.module is None:
                continue
            if node.module != "designer" and not node.module.startswith("designer."):
                continue
            source = node.module.removeprefix("designer").removeprefix(".")
            for alias in node.names:
                whole = f"{source}.{alias.name}".removeprefix(".")
                module, name = (whole, "") if whole in modules else (source, alias.name)
                where = id(node) in lazy, node.lineno, id(node) in for_types
                yield Import(importer, module, name, *where)


@cache
def _directly() -> dict[str, set[str]]:
    """What each module imports when it is imported."""
    out: dict[str, set[str]] = {module: set() for module in trees()}
    for each in imports():
        if not (each.lazy or each.for_types):
            out[each.importer].add(each.module)
    return out


def reached(start: str) -> set[str]:
    """The modules that importing this one imports."""
    found, todo = {start}, [start]
    while todo:
        more = _directly().get(todo.pop(), set()) - found
        found |= more
        todo += more
    return found & trees().keys()


def reached_by(verb: str) -> set[str]:
    """The modules that a verb imports whenever it is called: those at the top of its module, of its
    function and of its with blocks, with all that they import."""
    module = f"verbs.{verb}"
    (function,) = (
        node
        for node in trees()[module].body
        if isinstance(node, ast.FunctionDef) and node.name == verb
    )
    withs = (node for node in function.body if isinstance(node, ast.With))
    blocks: list[ast.FunctionDef | ast.With] = [function, *withs]
    nodes = [node for block in blocks for node in block.body]
    lines = {node.lineno for node in nodes if isinstance(node, ast.ImportFrom)}
    found = reached(module)
    for each in imports():
        if each.importer == module and each.line in lines:
            found |= reached(each.module)
    return found


@cache
def public(package: str) -> dict[str, str]:
    """The names that a package lists, each with its module; a listed module with ""."""
    listed: dict[str, str] = {}
    for node in ast.parse((HOUSE / package / "__init__.pyi").read_text("utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            listed |= {alias.name: node.module or "" for alias in node.names}
    return listed


def uses() -> dict[str, set[str]]:
    """The packages that each package imports."""
    found: dict[str, set[str]] = {package: set() for package in ORDER}
    for i in imports():
        here, there = i.importer.split(".")[0], i.module.split(".")[0]
        if here != there:
            found[here].add(there)
    return found


def arrows() -> set[tuple[str, str]]:
    """Which package uses which, without those that a way over other packages says too."""
    used = uses()
    over: dict[str, set[str]] = {}
    for package in ORDER:
        over[package] = used[package].union(*(over[u] for u in used[package]))
    return {
        (package, other)
        for package in ORDER
        for other in used[package]
        if not any(other in over[u] for u in used[package])
    }
