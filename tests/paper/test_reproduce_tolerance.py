"""``designer reproduce tolerance`` on a few boards: what it writes, and that it goes on."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from designer.base.errors import InputError
from designer.catalog.parts_catalog import load_catalog
from designer.paper import reproduce_tolerance
from designer.paper.circuits import OMEGA
from designer.paper.reproduce_tolerance import KINDS, YieldRow, cases, reproduce
from designer.verdicts.exact_circuit import block
from designer.yields.yield_count import count

TWO = ("rectifier-r1-c1-offsets", "corrected-r0.1-c1-level")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, tuple[YieldRow, ...]]:
    out = tmp_path_factory.mktemp("tolerance")
    return out, reproduce(out, samples=3, seed=4, jobs=2, only=TWO, short=1)


@pytest.mark.slow
def test_every_yield_is_that_of_a_study_of_the_same_case(
    made: tuple[Path, tuple[YieldRow, ...]],
) -> None:
    _, rows = made
    assert len(rows) == 2 * len(KINDS) * len(OMEGA)
    case = next(c for c in cases(load_catalog(), samples=3, seed=4) if c.name == TWO[1])
    assert case.plan.spread.offset_sigma == 0.0
    assert (case.plan.spread.resistor, case.plan.spread.capacitor) == (0.001, 0.01)
    answers = block(case.plan, range(3), 1)
    for number, p in enumerate(case.asked):
        row = next(
            r
            for r in rows
            if (r.circuit, r.expect, r.kind) == (case.circuit, f"1-{p}-{p}", "as built")
        )
        assert row.there
        assert row.counted == count([a for a in answers if a.question == number])
    assert all(r.counted.samples == 1 for r in rows if r.there and r.kind != "as built")


@pytest.mark.slow
def test_the_files_say_the_same(made: tuple[Path, tuple[YieldRow, ...]]) -> None:
    out, rows = made
    said = json.loads((out / "tolerance.json").read_text(encoding="utf-8"))
    assert [r["ok"] for r in said["rows"]] == [r.ok for r in rows]
    assert set(said["blame"]) == {"rectifier"}
    assert said["provenance"]["seed"] == 4
    table = pq.read_table(out / "tolerance.parquet").to_pylist()
    assert [YieldRow(**r) for r in table] == list(rows)
    text = (out / "README.md").read_text(encoding="utf-8")
    assert "designer reproduce tolerance --samples 3 --seed 4" in text.splitlines()[2]
    assert "## Rectifier stage" in text
    assert "What limits it" in text
    assert (out / "yields.png").read_bytes()[:4] == b"\x89PNG"
    assert sorted(p.stem for p in (out / "cases").iterdir()) == sorted(TWO)


@pytest.mark.slow
def test_it_goes_on_where_it_was_and_refuses_what_is_not_its_own(
    made: tuple[Path, tuple[YieldRow, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    out, rows = made
    with pytest.raises(InputError, match="--resume"):
        reproduce(out, samples=3, seed=4, jobs=2, only=TWO, short=1)
    with pytest.raises(InputError, match="other settings"):
        reproduce(out, samples=3, seed=5, jobs=2, only=TWO, short=1, resume=True)
    before = {p.name: p.read_bytes() for p in out.iterdir() if p.is_file()}
    lost = out / "cases" / f"{TWO[1]}.json"
    content = json.loads(lost.read_text(encoding="utf-8"))
    lost.unlink()
    worked: list[str] = []
    real = reproduce_tolerance._case

    def counted(case: object, *rest: object) -> dict[str, object]:
        worked.append(case.name)  # type: ignore[attr-defined]
        return real(case, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(reproduce_tolerance, "_case", counted)
    again = reproduce(out, samples=3, seed=4, jobs=1, only=TWO, short=1, resume=True)
    assert worked == [TWO[1]]
    assert again == rows
    redone = json.loads(lost.read_text(encoding="utf-8"))
    for piece in (redone, content):  # the seal is of the whole file, its times among it
        assert piece.pop("cost")
        assert piece.pop("seal")
    assert redone == content
    for name in ("README.md", "yields.png", "tolerance.parquet"):
        assert (out / name).read_bytes() == before[name]


@pytest.mark.parametrize("name", ["README.md", "tolerance.json", "tolerance.parquet", "yields.png"])
@pytest.mark.parametrize("resume", [False, True])
def test_a_file_of_the_users_is_not_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, resume: bool
) -> None:
    """Whether or not it goes on: without a case of its own in the folder, the file is foreign."""
    monkeypatch.setattr(reproduce_tolerance, "cases", lambda *_, **__: iter(()))
    (tmp_path / name).write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=name):
        reproduce(tmp_path, samples=1, jobs=1, resume=resume)
    assert not (tmp_path / "cases").exists()
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "notes.txt").write_text("mine too", encoding="utf-8")
    with pytest.raises(InputError):
        reproduce(tmp_path, samples=1, jobs=1, resume=resume)
    assert (tmp_path / name).read_text(encoding="utf-8") == "mine"
    assert sorted(p.name for p in tmp_path.rglob("*")) == sorted(["cases", "notes.txt", name])


def test_numbers_that_cannot_be_are_refused(tmp_path: Path) -> None:
    for wrong in ({"samples": 0}, {"seed": -1}, {"jobs": 0}):
        with pytest.raises(InputError):
            reproduce(tmp_path / "out", **wrong)  # type: ignore[arg-type]
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError):
        reproduce(tmp_path / "file", samples=1)
    assert not (tmp_path / "out").exists()
