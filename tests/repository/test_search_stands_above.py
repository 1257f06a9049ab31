"""The chain knows nothing of the search that stands above it."""

from __future__ import annotations

import ast
from pathlib import Path

import designer

PACKAGE = Path(designer.__file__).parent
ABOVE = (
    "__main__",
    "cli",
    "commands",
    "cure",
    "limiting",
    "search",
    "show_search",
    "upgrade",
)
"""Beginnings of the names of modules that may import the search."""
BELOW = {"searchspec"}
"""The table of the model file: read with the others."""


def above(name: str) -> bool:
    return name.startswith(ABOVE) and name not in BELOW


def imported(path: Path) -> set[str]:
    """Modules of the package that a file imports, anywhere in it."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module == "designer":
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("designer."):
            found.add(str(node.module).split(".")[1])
        elif isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
            found |= {n[1] for n in names if n[0] == "designer" and len(n) > 1}
    return found


def test_no_module_of_the_chain_imports_it() -> None:
    modules = sorted(PACKAGE.glob("*.py"))
    guilty = {
        path.stem: sorted(filter(above, imported(path))) for path in modules if not above(path.stem)
    }
    assert {name: names for name, names in guilty.items() if names} == {}


def test_the_rule_sees_an_import() -> None:
    assert "search" in imported(PACKAGE / "search_job.py")
    assert above("search_job")
    assert not above("searchspec")
