"""Blocks of samples on disk: read back as written, never another study's, never half a block."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from designer.blocks import BlockStore, block_name, block_names, study_hash
from designer.circuit import Capacitor, Circuit, Generator, Resistor, Section
from designer.deck import Excitation, SolverSettings
from designer.modelfile import Expect, Response
from designer.orbit import Orbit, OrbitStatus
from designer.spread import Spread
from designer.verdict import BLOCK, Answer, Question, StudyPlan, Verdict


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
        Response(0.85, Expect(1, 2, 2)),
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
            ngspice="failed",
            ngspice_reason="singular matrix",
        )
        for i in block
    ]


def test_round_trip_is_exact(tmp_path: Path, plan: StudyPlan) -> None:
    store = BlockStore.of(tmp_path, plan)
    for block in plan.blocks():
        assert store.read(block) is None
        store.write(block, _answers(block))
        assert store.read(block) == _answers(block)
    names = sorted(p.name for p in (tmp_path / "samples.parquet").iterdir())
    assert names == ["block-000000.parquet", "block-000001.parquet"]


def test_equal_blocks_are_equal_files(tmp_path: Path, plan: StudyPlan) -> None:
    block = next(plan.blocks())
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        BlockStore.of(tmp_path / name, plan).write(block, _answers(block))
    one, two = ((tmp_path / name / block_name(block)).read_bytes() for name in ("one", "two"))
    assert one == two


def test_names_follow_from_the_index_alone() -> None:
    assert block_names(BLOCK) == ["samples.parquet/block-000000.parquet"]
    assert block_names(2 * BLOCK + 1) == block_names(3 * BLOCK)
    assert block_names(3 * BLOCK)[:2] == block_names(2 * BLOCK)


def test_a_longer_study_takes_over_whole_blocks_only(tmp_path: Path, plan: StudyPlan) -> None:
    store = BlockStore.of(tmp_path, plan)
    for block in plan.blocks():
        store.write(block, _answers(block))
    longer = replace(plan, samples=3 * BLOCK)
    assert study_hash(longer) == study_hash(plan)
    known = [BlockStore.of(tmp_path, longer).read(block) is not None for block in longer.blocks()]
    assert known == [True, False, False]


def test_another_study_is_not_read(tmp_path: Path, plan: StudyPlan) -> None:
    block = next(plan.blocks())
    BlockStore.of(tmp_path, plan).write(block, _answers(block))
    (question,) = plan.questions
    others = [
        replace(plan, seed=2),
        replace(plan, spread=replace(plan.spread, resistor=0.02)),
        replace(plan, circuit=replace(plan.circuit, saturation=12.0)),
        replace(plan, questions=(replace(question, settings=None),)),
        replace(plan, questions=(replace(question, excitation=Excitation(301.0, 2.0)),)),
        replace(plan, questions=(question, question)),
    ]
    assert len({study_hash(p) for p in [plan, *others]}) == len(others) + 1
    assert all(BlockStore.of(tmp_path, other).read(block) is None for other in others)


@pytest.mark.parametrize("damage", ["cut", "other", "empty"])
def test_a_damaged_block_is_none(tmp_path: Path, plan: StudyPlan, damage: str) -> None:
    store, block = BlockStore.of(tmp_path, plan), next(plan.blocks())
    store.write(block, _answers(block))
    path = tmp_path / block_name(block)
    content = path.read_bytes()
    path.write_bytes({"cut": content[:-40], "other": b"PAR1 nonsense", "empty": b""}[damage])
    assert store.read(block) is None


def test_too_few_rows_are_none(tmp_path: Path, plan: StudyPlan) -> None:
    store, block = BlockStore.of(tmp_path, plan), next(plan.blocks())
    store.write(block, _answers(block)[:-1])
    assert store.read(block) is None
