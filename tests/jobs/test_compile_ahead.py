"""The kernels for circuits are compiled by another process where none is compiled yet."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

from designer.base import jit
from designer.circuit import kernel_nodal
from designer.jobs import compile_ahead
from designer.jobs.compile_ahead import compile_circuits, compiling_ahead, grounded
from designer.kernels import kernel_boards, kernel_propagators
from tests.shared.stages import PAPER

SYSTEM = grounded(3).second_order()


class Process:
    """A process that is only said to run."""

    def __init__(self, said: list[str]) -> None:
        self.said = said
        self.stdout = self

    def readline(self) -> None:
        self.said.append("motion")

    def communicate(self) -> None:
        self.said.append("end")

    def kill(self) -> None:
        self.said.append("kill")

    def wait(self) -> None:
        self.said.append("wait")


@pytest.mark.parametrize(
    ("jobs", "files", "expected"),
    [
        (2, [], ["start", "motion", "work", "wait", "circuit", "kill", "end"]),
        (2, ["circuits-2.whole"], ["start", "motion", "work", "wait", "circuit", "kill", "end"]),
        (2, ["circuits-3.whole"], ["work", "circuit"]),
        (1, [], ["work", "circuit"]),
    ],
)
def test_a_process_works_beside_a_first_run_of_so_many_masses(
    jobs: int,
    files: list[str],
    expected: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said: list[str] = []

    def start(*_: Any, **__: Any) -> Process:
        said.append("start")
        return Process(said)

    for name in files:
        (tmp_path / name).touch()
    monkeypatch.setattr(jit, "CACHE", tmp_path)
    monkeypatch.setattr(subprocess, "Popen", start)
    with compiling_ahead(jobs, SYSTEM) as compiled:
        said.append("work")
        compiled()
        said.append("circuit")
    assert said == expected


def test_no_file_of_the_working_directory_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "numpy.py").write_text("open('planted', 'w')")
    (tmp_path / "cache").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(jit, "CACHE", tmp_path / "cache")
    monkeypatch.setattr(compile_ahead, "CALL", "import numpy; numpy.zeros(1)")
    popen, processes = subprocess.Popen, []

    def start(*words: Any, **more: Any) -> Any:
        processes.append(popen(*words, **more))
        return processes[-1]

    monkeypatch.setattr(subprocess, "Popen", start)
    with compiling_ahead(2, SYSTEM):
        assert processes[0].wait(timeout=60) == 0
    assert not (tmp_path / "planted").exists()


def test_it_compiles_what_a_circuit_of_so_many_masses_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jit, "CACHE", tmp_path)
    compile_circuits(1)
    kernels: list[Any] = [
        kernel_nodal.solve_all,
        kernel_propagators.advance,
        kernel_boards.answer_all,
    ]
    assert all(kernel.signatures for kernel in kernels)
    assert 2 in {len(types[-2]) for types in kernels[2].signatures}
    assert jit.stored_whole("circuits-1")
    assert not jit.stored_whole("circuits-2")


def test_a_model_that_goes_the_modal_way_does_not_wait_for_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(jit, "CACHE", tmp_path)
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: Process(said))
    with compiling_ahead(2, PAPER.second_order()):
        said.append("work")
    assert said == ["work", "kill", "end"]
