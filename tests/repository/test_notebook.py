"""The example notebooks run, and show what they are stored with."""

from __future__ import annotations

import copy
import shutil
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from tests.shared.doc_commands import ROOT

pytestmark = [pytest.mark.docs, pytest.mark.slow]

EXAMPLES = ROOT / "examples"


def shown(notebook: nbformat.NotebookNode) -> list[list[str]]:
    """What each cell of code shows: texts, and of a picture that there is one. What is printed is
    left out: it has errors that are rounding."""
    return [
        ["picture" if "image/png" in o.data else o.data["text/plain"] for o in values(cell)]
        for cell in notebook.cells
        if cell.cell_type == "code"
    ]


def values(cell: nbformat.NotebookNode) -> list[nbformat.NotebookNode]:
    return [output for output in cell.outputs if output.output_type != "stream"]


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("*.ipynb")))
def test_a_notebook_shows_what_it_is_stored_with(name: str, tmp_path: Path) -> None:
    shutil.copy(EXAMPLES / "rig.toml", tmp_path)
    stored = nbformat.read(EXAMPLES / name, as_version=4)  # type: ignore[no-untyped-call]
    fresh = copy.deepcopy(stored)
    for cell in fresh.cells:
        if cell.cell_type == "code":
            cell.outputs = []
    NotebookClient(fresh, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert shown(fresh) == shown(stored)
