"""Blocks of samples on disk: read back as written, never another study's, never half a block."""

from __future__ import annotations

import errno
import math
import os
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from designer.base.errors import InputError
from designer.circuit.netlist import Capacitor, Circuit, Excitation, Generator, Resistor, Section
from designer.dynamics.counts import Counts
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.response_table import Response
from designer.spice.deck import SolverSettings
from designer.spread.spread import Spread
from designer.verdicts.verdict import BLOCK, Answer, BoardRow, Question, StudyPlan, Verdict
from designer.yields.layers import LocalRunner, fill
from designer.yields.row_store import BlockStore
from designer.yields.study_identity import RULES, study_hash
from tests.shared.exploring import quick
from tests.shared.resealed import Change, reseal, with_value


@pytest.fixture
def plan() -> StudyPlan:
    circuit = Circuit(
        parts=(
            Section("U1A", "s1", "0", "v1", "integrator"),
            Capacitor("C1", "v1", "s1", 1e-8, "integrator"),
            Resistor("R1", "vg", "s1", 1e4, "force"),
        ),
        generator=Generator("VM1", "vg"),
        states=("C1",),
        state_nets=("v1",),
        stops=(),
        opamp="TL074C",
        gain=2e5,
        bias=0.0,
        supply=15.0,
        saturation=13.0,
    )
    question = Question(
        Response(0.85, Counts(1, ((2, 2),))),
        Excitation(300.0, 2.0),
        Orbit(OrbitStatus.PERIODIC, n=1, p=2, q=2, start=np.array([0.25])),
        SolverSettings("trap", 1e-5),
    )
    return StudyPlan(circuit, Spread(0.01, 0.01, 0.003, 0.01), 1, BLOCK + 3, (question,))


def _answers(block: range) -> list[Answer]:
    return [
        Answer(
            sample=i,
            question=0,
            verdict=Verdict.OK if i % 2 else Verdict.LOST,
            response="1-2-2",
            reason="",
            radius=0.1 + i / 3.0,
            penetration=math.inf,
            miss=1e-300,
            asymmetry=5e-17,
            periods=40,
            waveform=0.01,
        )
        for i in block
    ]


def _store(root: Path, plan: StudyPlan, **more: Any) -> BlockStore[Answer]:
    omegas = [q.spec.omega for q in plan.questions]
    study = study_hash(plan)
    return BlockStore(root, "samples.parquet", Answer, study, omegas=omegas, **more)


def test_round_trip_is_exact(tmp_path: Path, plan: StudyPlan) -> None:
    store = _store(tmp_path, plan)
    for block in plan.blocks():
        assert store.read(block) == []
        store.put(block, _answers(block))
        assert _store(tmp_path, plan).read(block) == _answers(block)
    names = sorted(p.name for p in (tmp_path / "samples.parquet").iterdir())
    assert names == ["block-000000.parquet", "block-000001.parquet"]
    assert store.names == {f"samples.parquet/{name}" for name in names}
    table = pq.read_table(tmp_path / "samples.parquet")
    assert table.column("omega").to_pylist() == [0.85] * plan.samples


class Colour(StrEnum):
    RED = "red"


@dataclass(frozen=True)
class Flat(BoardRow):
    """Every kind of field that a row may have."""

    name: str
    colour: Colour
    size: float
    good: bool


def test_any_flat_dataclass_is_a_row(tmp_path: Path) -> None:
    head = (0, Verdict.OK, "1-1-1", "")
    rows = [Flat(i, *head, "ω", Colour.RED, math.nan if i else -0.0, bool(i % 2)) for i in range(3)]
    BlockStore(tmp_path, "flat.parquet", Flat, "x", size=3).put(range(3), rows)
    back = BlockStore(tmp_path, "flat.parquet", Flat, "x", size=3).read(range(3))
    assert [repr(row) for row in back] == [repr(row) for row in rows]
    assert BlockStore(tmp_path, "flat.parquet", Flat, "y", size=3).read(range(3)) == []


def test_equal_blocks_are_equal_files(tmp_path: Path, plan: StudyPlan) -> None:
    block = next(plan.blocks())
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        _store(tmp_path / name, plan).put(block, _answers(block))
    name = _store(tmp_path, plan).name(block)
    assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_a_block_that_holds_the_same_is_left_alone(tmp_path: Path, plan: StudyPlan) -> None:
    block = next(plan.blocks())
    _store(tmp_path, plan).put(block, _answers(block))
    writes: list[int] = []
    store = _store(tmp_path, plan, guard=lambda: writes.append(1))
    store.put(block, store.read(block))
    assert writes == []
    assert store.names == {store.name(block)}
    store.put(block, store.read(block)[:-1])
    assert writes == [1]


def test_a_longer_study_takes_over_what_is_there(tmp_path: Path, plan: StudyPlan) -> None:
    store = _store(tmp_path, plan)
    for block in plan.blocks():
        store.put(block, _answers(block))
    longer = replace(plan, samples=3 * BLOCK)
    assert study_hash(longer) == study_hash(plan)
    known = [len(_store(tmp_path, longer).read(block)) for block in longer.blocks()]
    assert known == [BLOCK, plan.samples - BLOCK, 0]
    shorter = range(BLOCK, BLOCK + 1)
    assert _store(tmp_path, plan).read(shorter) == _answers(shorter)


def test_fill_computes_only_what_is_missing(tmp_path: Path, plan: StudyPlan) -> None:
    """A study of 260 after one of 253: the last block's first three are kept; and then of 251."""
    for samples, computed in ((plan.samples, [range(250), range(250, 253)]),
                              (260, [range(253, 260)]), (251, [])):  # fmt: skip
        asked: list[range] = []

        def task(indices: range, asked: list[range] = asked) -> Any:
            asked.append(indices)
            return lambda jobs, step: _answers(indices)

        study = replace(plan, samples=samples)
        rows = fill(study, _store(tmp_path, study), BLOCK, task, LocalRunner(1), lambda: None)
        assert asked == computed
        assert rows == _answers(range(samples))
    fresh = tmp_path / "fresh"
    fresh.mkdir()
    study = replace(plan, samples=251)
    fill(study, _store(fresh, study), BLOCK, task, LocalRunner(1), lambda: None)
    for path in (fresh / "samples.parquet").iterdir():
        assert path.read_bytes() == (tmp_path / "samples.parquet" / path.name).read_bytes()


def test_another_study_is_not_read(
    tmp_path: Path, plan: StudyPlan, monkeypatch: pytest.MonkeyPatch
) -> None:
    block = next(plan.blocks())
    _store(tmp_path, plan).put(block, _answers(block))
    (question,) = plan.questions
    others = [
        replace(plan, seed=2),
        replace(plan, spread=replace(plan.spread, resistor=0.02)),
        replace(plan, circuit=replace(plan.circuit, saturation=12.0)),
        replace(plan, questions=(replace(question, excitation=Excitation(301.0, 2.0)),)),
        replace(plan, questions=(question, question)),
    ]
    assert len({study_hash(p) for p in [plan, *others]}) == len(others) + 1
    assert all(_store(tmp_path, other).read(block) == [] for other in others)
    # ngspice's settings are no matter of the exact circuit's.
    other = replace(plan, questions=(replace(question, settings=None),))
    assert study_hash(other) == study_hash(plan)
    assert study_hash(other, "ngspice") != study_hash(plan, "ngspice")
    assert study_hash(plan, "tuned", {"a": 1}) != study_hash(plan, "tuned", {"a": 2})
    before = study_hash(plan)
    monkeypatch.setitem(RULES, "samples", RULES["samples"] + 1)
    assert study_hash(plan) != before


@pytest.mark.parametrize("damage", ["cut", "other", "empty"])
def test_a_damaged_block_is_nothing(tmp_path: Path, plan: StudyPlan, damage: str) -> None:
    store, block = _store(tmp_path, plan), next(plan.blocks())
    store.put(block, _answers(block))
    path = tmp_path / store.name(block)
    content = path.read_bytes()
    path.write_bytes({"cut": content[:-40], "other": b"PAR1 nonsense", "empty": b""}[damage])
    assert _store(tmp_path, plan).read(block) == []


def test_a_full_disk_is_said_and_loses_nothing(
    tmp_path: Path, plan: StudyPlan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The write fails half-way as on a full disk: some bytes are there, then ENOSPC."""
    first, second = plan.blocks()
    store = _store(tmp_path, plan)
    store.put(first, _answers(first))

    write = Path.write_bytes

    def full(path: Path, content: bytes) -> None:
        write(path, content[:4])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InputError, match=r"No space left on device.*--resume") as raised:
        store.put(second, _answers(second))
    assert raised.value.exit_status == 2
    monkeypatch.undo()
    assert _store(tmp_path, plan).read(first) == _answers(first)
    assert [p.name for p in (tmp_path / "samples.parquet").iterdir()] == ["block-000000.parquet"]


def test_a_folder_that_is_gone_is_said(tmp_path: Path, plan: StudyPlan) -> None:
    block = next(plan.blocks())
    with pytest.raises(InputError, match="No such file"):
        _store(tmp_path / "gone", plan).put(block, _answers(block))
    assert not (tmp_path / "gone").exists()


def test_last_digits_of_what_is_computed_do_not_make_another_study(plan: StudyPlan) -> None:
    """Another machine's linear algebra rounds otherwise; a part's value is not computed by it."""
    (one,) = plan.questions

    def with_start(factor: float) -> StudyPlan:
        start = replace(one.start, start=one.start.start / 3.0 * factor)
        excitation = Excitation(300.0 / 7.0 * factor, 2.0 / 7.0 * factor)
        assert one.settings is not None
        settings = replace(one.settings, max_step=1e-5 / 7.0 * factor)
        question = replace(one, start=start, excitation=excitation, settings=settings)
        return replace(plan, questions=(question,))

    def hashes(factor: float) -> list[str]:
        of = with_start(factor)
        return [
            study_hash(of, "ngspice"),
            study_hash(of, "reached", {"recipes": [2e3 / 7 * factor]}),
        ]

    assert hashes(1.0) == hashes(1.0 + 4e-15)
    assert not set(hashes(1.0)) & set(hashes(1.0 + 1e-8))
    first, *rest = plan.circuit.parts
    assert isinstance(rest[-1], Resistor)
    parts = (first, *rest[:-1], replace(rest[-1], value=rest[-1].value * (1.0 + 4e-15)))
    other = replace(plan, circuit=replace(plan.circuit, parts=parts))
    assert study_hash(other) != study_hash(plan)


def test_blocks_of_another_study_are_ignored_aloud(tmp_path: Path, plan: StudyPlan) -> None:
    def store(study: str, notes: list[str]) -> BlockStore[Answer]:
        return BlockStore(tmp_path, "samples.parquet", Answer, study, note=notes.append)

    def made(study: str) -> list[str]:
        notes: list[str] = []
        task = lambda block: lambda jobs, step: _answers(block)  # noqa: E731
        fill(plan, store(study, notes), BLOCK, task, LocalRunner(1), lambda: None)
        return notes

    assert made("a" * 64) == []
    assert made("a" * 64) == []
    (said,) = made("b" * 64)
    assert said == "samples.parquet: 2 blocks of another study ignored, computed again"
    assert made("b" * 64) == []


STRANGE: dict[str, Change] = {
    "a sample of another block": with_value("sample", BLOCK),
    "a sample below none": with_value("sample", -1),
    "a sample twice": with_value("sample", 0),
    "no sample": with_value("sample", None),
    "a question that is not asked": with_value("question", 1),
    "a question below none": with_value("question", -1),
    "an unknown verdict": with_value("verdict", "maybe"),
    "no verdict": with_value("verdict", None),
    "an unknown response": with_value("response", "1-2"),
    "no response": with_value("response", None),
    "no reason": with_value("reason", None),
    "no margin": with_value("miss", None),
    "no periods": with_value("periods", None),
    "rows without end": lambda rows: rows * 1000,
}


@pytest.mark.parametrize("what", quick(STRANGE, len(STRANGE) - 1))
def test_rows_that_no_study_writes(tmp_path: Path, plan: StudyPlan, what: str) -> None:
    """With a seal that is right: they are said and computed again."""
    block = next(plan.blocks())
    _store(tmp_path, plan).put(block, _answers(block))
    path = tmp_path / _store(tmp_path, plan).name(block)
    reseal(path, STRANGE[what])
    notes: list[str] = []
    assert _store(tmp_path, plan, note=notes.append).read(block) == []
    assert notes == [f"{path}: damaged, computed again"]


def test_rows_in_another_order_are_not_taken(tmp_path: Path, plan: StudyPlan) -> None:
    """A block is its first samples, question by question: else one would be counted twice."""
    task = lambda block: lambda jobs, step: _answers(block)  # noqa: E731
    changes: tuple[Change, ...] = (lambda rows: rows[::-1], lambda rows: rows[1:])
    for change in changes:
        made = fill(plan, _store(tmp_path, plan), BLOCK, task, LocalRunner(1), lambda: None)
        assert made == _answers(range(plan.samples))
        reseal(tmp_path / _store(tmp_path, plan).name(range(1)), change)
