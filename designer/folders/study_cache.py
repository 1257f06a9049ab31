"""What a study need not do again when it gets another layer: its checks and its attribution.

One file in the design folder, beside the rows, and another with the parts of an attribution, of
maps and of estimates of rare losses that are not whole yet: each item under a name with a hash of
all that decides it, and it counts for that hash alone. Numbers are kept to the last bit, so that a
study made in two goes is the one made at once. A file that cannot be read, or was damaged, holds
nothing (``base.keyed_store``).
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from dataclasses import fields
from enum import Enum
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from designer.base.arrays import Array
from designer.base.keyed_store import KeyedStore, Note, Vouch, nobody
from designer.base.parquet_entry import MOST_BYTES
from designer.base.progress import quiet
from designer.base.record_check import checked_record
from designer.base.seal import BLANK
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.distributions import Normal
from designer.spice.deck import SolverSettings
from designer.spice.equation_check import EquationCheck, EquationFinding
from designer.spice.numerics_gate import GateResult
from designer.spice.read_orbit import Read
from designer.spread.spread import OpAmpDrift
from designer.verdicts.verdict import Verdict
from designer.yields.loss_attribution import Attribution, NearLimit, ResponseAttribution
from designer.yields.loss_replay import PartAttribution
from designer.yields.margins import Crossing, Limit, Prediction
from designer.yields.rare_losses import LossRegion, RareLosses, ToleranceMargin
from designer.yields.stored_parts import GivenAnswers
from designer.yields.worst_corner import Corner, Index
from designer.yields.yield_maps import Axis, YieldMap

CACHE = "kept.npz"
FORMAT = 1
_KEY = {"format": FORMAT}
_ITEMS = "items"
_Items = Mapping[str, tuple[str, Any]]
_RECORDS: dict[str, type[Any]] = {
    "Blame": Attribution,
    "BlamedPart": PartAttribution,
    "ResponseBlame": ResponseAttribution,
} | {
    kind.__name__: kind
    for kind in (
        Axis, Corner, Crossing, EquationCheck, EquationFinding, GateResult, GivenAnswers, Index,
        Limit, LossRegion, NearLimit, Normal, OpAmpDrift, Orbit, Prediction, RareLosses, Read,
        SolverSettings, ToleranceMargin, YieldMap,
    )
}  # fmt: skip
"""The records by their names in the file, which are not to change."""
_NAMES = {kind: name for name, kind in _RECORDS.items()}
_WORDS: dict[str, type[Enum]] = {kind.__name__: kind for kind in (OrbitStatus, Verdict)}


class StudyCache:
    """The items in the file at ``path``.

    write : puts the file of this name there. note, vouch : as of ``KeyedStore``.
    """

    def __init__(
        self,
        path: Path,
        write: Callable[[str, bytes], None],
        note: Note = quiet,
        vouch: Vouch = nobody,
    ) -> None:
        self._store: KeyedStore[_Items] = KeyedStore(path.parent, _Npz(), note, vouch, write)
        self._name = path.name
        self._items = dict(self._store.read(self._name, _KEY) or {})
        self._used: set[str] = set()

    def get(self, name: str, key: str) -> Any | None:
        """The value of this name, if it was stored under this key; None else."""
        stored_key, value = self._items.get(name, ("", None))
        if stored_key != key:
            return None
        self._used.add(name)
        return value

    def put(self, name: str, key: str, value: Any) -> None:
        """Store it, in the place of any other of this name."""
        self.put_all({name: value}, key)

    def put_all(self, values: Mapping[str, Any], key: str) -> None:
        """Store several that one key decides."""
        self._items |= {name: (key, value) for name, value in values.items()}
        self._used.update(values)
        self._store.write(self._name, _KEY, self._items)

    def forget_unused(self) -> None:
        """Drop what nobody has got or put since: it is of another design or study."""
        if not self._used.issuperset(self._items):
            self._items = {name: self._items[name] for name in self._used}
            self._store.write(self._name, _KEY, self._items)


class _Npz:
    """An archive of arrays, its seal in the archive's comment (``keyed_store.EntryCodec``)."""

    def encode(self, head: Mapping[str, Any], value: _Items) -> bytes:
        arrays: list[Array] = []
        items = {name: [key, _plain(item, arrays)] for name, (key, item) in sorted(value.items())}
        text = json.dumps({**head, _ITEMS: items}, sort_keys=True)
        stream = io.BytesIO()
        named = {f"array{k}": array for k, array in enumerate(arrays)}
        np.savez_compressed(stream, **{_ITEMS: np.array(text)}, **named)  # type: ignore[arg-type]
        with ZipFile(stream, "a") as archive:
            archive.comment = BLANK.encode("ascii")
        return stream.getvalue()

    def decode(self, content: bytes) -> tuple[Mapping[str, Any], _Items]:
        with ZipFile(io.BytesIO(content)) as packed:
            if sum(member.file_size for member in packed.infolist()) > MOST_BYTES:
                raise ValueError(f"more than {MOST_BYTES} bytes")
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = dict(archive)  # each once, however often an item names it
        head = json.loads(str(arrays[_ITEMS]))  # nan is a number here
        items = {name: (key, _decoded(v, arrays)) for name, (key, v) in head[_ITEMS].items()}
        if not all(isinstance(key, str) for key, _ in items.values()):
            raise TypeError("a key that is no text")
        return head, items


def _plain(value: Any, arrays: list[Array]) -> Any:
    """JSON data that says the same; arrays go into the list."""
    if isinstance(value, Enum):
        return {"word": [type(value).__name__, value.value]}
    if type(value) in _NAMES:
        named = {f.name: _plain(getattr(value, f.name), arrays) for f in fields(value)}
        return {"record": [_NAMES[type(value)], named]}
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, tuple):
        return {"tuple": [_plain(v, arrays) for v in value]}
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise TypeError(f"{type(value).__name__} cannot be stored")


def _decoded(value: Any, arrays: Mapping[str, Any]) -> Any:
    """The value that ``_plain`` encoded."""
    if not isinstance(value, dict):
        return value
    ((kind, content),) = value.items()
    if kind == "word":
        return _WORDS[content[0]](content[1])
    if kind == "record":
        named = {name: _decoded(v, arrays) for name, v in content[1].items()}
        return checked_record(_RECORDS[content[0]], named)
    if kind == "array":
        return arrays[f"array{content}"]
    if kind == "tuple":
        return tuple(_decoded(v, arrays) for v in content)
    raise ValueError(f"a value of kind {kind!r}")
