"""What a study keeps comes back to the last bit, for its own key alone."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast
from zipfile import ZipFile

import numpy as np
import pytest

from designer.base.seal import BLANK, sealed
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.folders import study_stores
from designer.folders.study_cache import StudyCache
from designer.spice.deck import SolverSettings
from designer.spice.equation_check import EquationCheck, EquationFinding
from designer.spice.numerics_gate import GateResult
from designer.spice.read_orbit import Read
from designer.verdicts.verdict import StudyPlan, Verdict
from designer.yields.loss_attribution import Attribution, NearLimit, ResponseAttribution
from designer.yields.loss_replay import PartAttribution
from designer.yields.margins import Crossing, Limit, Prediction
from designer.yields.worst_corner import Corner, Index
from designer.yields.yield_maps import Axis, YieldMap
from tests.shared.bench_plans import question

EARLIER = Path(__file__).parents[1] / "jobs" / "folders" / "0.1.0" / "format-1.zip"
"""A design folder as version 0.1.0 wrote it."""
RECORD = r'"record": \["(\w+)"'
ORBIT = question(1).start
READ = Read(ORBIT, np.arange(12.0).reshape(3, 4) / 7.0, (np.array([0.1]), np.ones((1, 4))))
GATE = GateResult(SolverSettings("trap", 1e-6), True, 1e-4 / 3.0, READ, (200, 400))
CHECK = EquationCheck(
    (EquationFinding("slope", 0.1 / 3.0, 1e-2), EquationFinding("threshold", 0.0, 1.0))
)
ATTRIBUTED = ResponseAttribution(
    0,
    3,
    (PartAttribution("R1", "resistor", 1, 3, 0, 2),),
    (Index("R1", "R1", 0.1, float("nan")),),
    (NearLimit("a fold", 1.0 / 3.0),),
    Prediction(1, 2, 3, 4),
    2,
    1,
    Corner(("R1",), ("low",), -0.1, Verdict.LOST, "1-1-1", 3, 4),
    "words",
)
CROSSING = Crossing(4, 1, 0.5, 0.75, ORBIT)
LIMIT = Limit("a contact", "contact", 0.1 / 3.0, 2.0, np.array([0.1, -0.2]), 4)
MAP = YieldMap(
    "grade", 0, (Axis("grade", (0.01, 0.05)),), np.array([True, False]), np.array([3, 0]),
    np.array([1, 4]), np.array([0, 0]), np.array([0, 0]), 4, 9, 0.01, None, (False, False), 8, 0.0,
)  # fmt: skip
ATTRIBUTION = Attribution((ATTRIBUTED,), 200, 1, 10, 20, 0.0)


def kept(path: Path) -> StudyCache:
    def write(name: str, content: bytes) -> None:
        (path.parent / name).write_bytes(content)

    return StudyCache(path, write)


def same(a: Any, b: Any) -> bool:
    """Equal to the last bit, nan and types included."""
    if isinstance(a, np.ndarray):
        return bool(a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind in "fc"))
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(same(v, getattr(b, k)) for k, v in vars(a).items())
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(same, a, b))
    return type(a) is type(b) and repr(a) == repr(b)


@pytest.mark.parametrize(
    "value",
    [
        ORBIT,
        Orbit(OrbitStatus.CLIPPED),
        (GATE, None),
        CHECK,
        ATTRIBUTION,
        CROSSING,
        ((LIMIT, LIMIT), 12),
        MAP,
    ],
)
def test_what_is_kept_comes_back_to_the_last_bit(value: Any, tmp_path: Path) -> None:
    path = tmp_path / "kept.npz"
    kept(path).put("it", "key", value)
    assert same(kept(path).get("it", "key"), value)
    again = tmp_path / "again.npz"
    kept(again).put("it", "key", kept(path).get("it", "key"))
    assert again.read_bytes() == path.read_bytes()


def test_only_its_own_key_opens_an_item(tmp_path: Path) -> None:
    path = tmp_path / "kept.npz"
    one = kept(path)
    one.put("gates", "old", (GATE,))
    one.put("blame", "mine", ATTRIBUTION)
    assert kept(path).get("gates", "new") is None
    assert kept(path).get("other", "old") is None
    one.put("gates", "new", (GATE, GATE))
    assert kept(path).get("gates", "old") is None
    assert len(kept(path).get("gates", "new") or ()) == 2
    assert same(kept(path).get("blame", "mine"), ATTRIBUTION)


def test_a_file_names_its_records_as_an_earlier_version_did(tmp_path: Path) -> None:
    """Some of their classes have had other names since."""
    with ZipFile(EARLIER) as folder:
        content = folder.read("kept.npz")
    path, (key, _) = tmp_path / "kept.npz", items_in(content)["blame"]
    path.write_bytes(content)
    kept(path).put("blame", key, kept(path).get("blame", key))
    before, after = (
        re.findall(RECORD, json.dumps(items_in(c)["blame"])) for c in (content, path.read_bytes())
    )
    assert before == after
    assert {"Blame", "ResponseBlame"} < set(before)


def items_in(content: bytes) -> dict[str, Any]:
    """What a file says of each item."""
    with np.load(io.BytesIO(content)) as archive:
        items: dict[str, Any] = json.loads(str(archive["items"]))["items"]
        return items


def test_an_attribution_without_noise_counts_unless_noise_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study_stores, "attribution_hash", lambda plan: "key")
    cache, plan = kept(tmp_path / "kept.npz"), cast(StudyPlan, None)
    plain, noisy = (
        study_stores.FolderStores(tmp_path, lambda: None, cache=cache, noise=noise)
        for noise in (False, True)
    )
    for index, there in (
        (Index("R1", "R1", 0.1, 0.2), False),
        (Index("R1", "R1", 0.1, 0.2, 0.01, 0.02), True),
        (Index("R1", "R1", float("nan"), float("nan")), True),  # a margin that nothing moves
    ):
        plain.put_attribution(
            plan, replace(ATTRIBUTION, responses=(replace(ATTRIBUTED, indices=(index,)),))
        )
        assert plain.attribution(plan, 1) is not None
        assert (noisy.attribution(plan, 1) is not None) == there


def test_what_nobody_used_is_forgotten(tmp_path: Path) -> None:
    path = tmp_path / "kept.npz"
    for name in ("one", "two", "three"):
        kept(path).put(name, "key", CHECK)
    later = kept(path)
    assert same(later.get("one", "key"), CHECK)
    assert later.get("two", "other") is None
    later.put("three", "new", CHECK)
    later.forget_unused()
    assert same(kept(path).get("one", "key"), CHECK)
    assert kept(path).get("two", "key") is None
    assert same(kept(path).get("three", "new"), CHECK)


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04 cut", None])
def test_a_file_that_cannot_be_read_holds_nothing(content: bytes | None, tmp_path: Path) -> None:
    path = tmp_path / "kept.npz"
    if content is None:
        kept(path).put("it", "key", ATTRIBUTION)
        path.write_bytes(path.read_bytes()[:-100])
    else:
        path.write_bytes(content)
    assert kept(path).get("it", "key") is None


def test_no_changed_byte_of_a_file_ends_in_an_error(tmp_path: Path) -> None:
    path = tmp_path / "kept.npz"
    kept(path).put("it", "key", ATTRIBUTION)
    whole = path.read_bytes()
    for place in range(0, len(whole), 7):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x41]) + whole[place + 1 :])
        assert kept(path).get("it", "key") is None


def unsealed(path: Path) -> bytes:
    """The archive as versions without a seal wrote it."""
    with ZipFile(path, "a") as archive:
        archive.comment = b""
    return path.read_bytes()


def test_a_file_without_a_seal_counts_where_somebody_vouches_for_it(tmp_path: Path) -> None:
    path = tmp_path / "kept.npz"
    kept(path).put("it", "key", ATTRIBUTION)
    content = unsealed(path)
    notes: list[str] = []
    assert StudyCache(path, lambda *_: None, notes.append).get("it", "key") is None
    assert [str(path) in note for note in notes] == [True]

    def vouch(name: str, there: bytes) -> bool:
        return name == "kept.npz" and there == content

    assert same(StudyCache(path, lambda *_: None, vouch=vouch).get("it", "key"), ATTRIBUTION)
    path.write_bytes(content[:-1] + b"x")
    assert StudyCache(path, lambda *_: None, vouch=vouch).get("it", "key") is None


def test_what_would_not_come_back_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="object"):
        kept(tmp_path / "kept.npz").put("it", "key", object())
    assert not (tmp_path / "kept.npz").exists()


# ---------------------------------------------------------------------------------------------
# Items that a stranger wrote, with a seal that is right


def strange(path: Path, change: Callable[[dict[str, Any], dict[str, Any]], None]) -> list[str]:
    """What is said of a file in which an orbit's items and arrays are changed."""
    kept(path).put("it", "key", ORBIT)
    with np.load(path) as archive:
        arrays: dict[str, Any] = dict(archive)
    head = json.loads(str(arrays.pop("items")))
    change(head, arrays)
    stream = io.BytesIO()
    np.savez_compressed(stream, items=np.array(json.dumps(head)), **arrays)
    with ZipFile(stream, "a") as archive:
        archive.comment = BLANK.encode("ascii")
    path.write_bytes(sealed(stream.getvalue()))
    notes: list[str] = []
    assert StudyCache(path, lambda *_: None, notes.append).get("it", "key") is None
    return notes


def with_field(name: str, value: Any) -> Callable[[dict[str, Any], dict[str, Any]], None]:
    def change(head: dict[str, Any], _arrays: dict[str, Any]) -> None:
        head["items"]["it"][1]["record"][1][name] = value

    return change


def with_item(value: Any) -> Callable[[dict[str, Any], dict[str, Any]], None]:
    def change(head: dict[str, Any], _arrays: dict[str, Any]) -> None:
        head["items"]["it"] = value

    return change


def swollen(head: dict[str, Any], arrays: dict[str, Any]) -> None:
    """100 kB of an archive are 100 MB."""
    arrays["array0"] = np.zeros(12_500_000)


def of_text(head: dict[str, Any], arrays: dict[str, Any]) -> None:
    arrays["array0"] = np.array(["a", "b"])


@pytest.mark.parametrize(
    "change",
    [
        with_field("n", "1"),
        with_field("n", None),
        with_field("p", True),
        with_field("status", "periodic"),
        with_field("status", {"word": ["OrbitStatus", "asleep"]}),
        with_field("status", {"word": ["Other", "ok"]}),
        with_field("start", {"array": 99}),
        with_field("start", 0.5),
        with_field("start", {"tuple": [0.5]}),
        with_field("start", {"other": []}),
        with_field("reason", 3),
        with_field("more", {"tuple": [1]}),
        with_field("nothing", 1),
        with_item(["key"]),
        with_item([["key"], 1]),
        with_item(["key", {"record": ["Path", {}]}]),
        with_item(["key", {}]),
        swollen,
        of_text,
    ],
)
def test_what_is_no_item_holds_nothing(
    tmp_path: Path, change: Callable[[dict[str, Any], dict[str, Any]], None]
) -> None:
    path = tmp_path / "kept.npz"
    assert strange(path, change) == [f"{path}: damaged, computed again"]
    assert path.stat().st_size < 200_000


def test_an_array_that_is_named_often_is_unpacked_once(tmp_path: Path) -> None:
    path = tmp_path / "kept.npz"
    many = 100_000

    def change(head: dict[str, Any], arrays: dict[str, Any]) -> None:
        arrays["array0"] = np.zeros(10_000)
        head["items"]["other"] = ["key", {"tuple": [{"array": 0}] * many}]
        head["items"]["it"] = ["none", 0]

    assert strange(path, change) == []
    value = kept(path).get("other", "key")
    assert value is not None
    assert len({id(each) for each in value}) == 1
