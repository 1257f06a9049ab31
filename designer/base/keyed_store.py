"""The one store of what need not be computed again: entries by name, each with its key and seal.

The key says which request an entry answers: equal keys, equal entries. An entry is a file
(``KeyedStore``) or a line of one (``Lines``). It appears whole or not at all, and its seal
(``base.seal``) shows every changed bit. What is damaged, or was written without a seal and is
vouched for by nobody, is missing: it is said and computed again, and nothing else is lost.

A seal is no signature: anyone can write an entry with one that is right. So its size is bounded,
and who reads it has it made into records that check their values (``base.record_check``).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from designer.base.atomic_write import appearing
from designer.base.errors import InputError
from designer.base.guarded_reading import UNREADABLE, parse_json, read_bytes, reading
from designer.base.progress import quiet
from designer.base.seal import BLANK, intact, sealed

Entry = TypeVar("Entry")
Made = TypeVar("Made")
Note = Callable[[str], None]
"""Is told what a user ought to know, a line at a time."""
Vouch = Callable[[str, bytes], bool]
"""Whether somebody else, such as a manifest, knows that a file of this name has this content."""
SEAL = "seal"
"""Name of the seal in an entry."""
DAMAGED = "damaged, computed again"
LARGEST = 200_000_000
"""Bytes of a file of entries."""
UNSEALED = "written without a checksum, computed again"
"""Said of an entry that a version of the tool without checksums wrote."""


def nobody(_name: str, _content: bytes) -> bool:
    """Vouches for nothing."""
    return False


class OtherFormError(ValueError):
    """An entry whose head can be read, and whose value has another form or size."""

    def __init__(self, head: Mapping[str, Any], found: str) -> None:
        super().__init__(found)
        self.head = head


class EntryCodec(Protocol[Entry]):
    """How an entry is written."""

    def encode(self, head: Mapping[str, Any], value: Entry) -> bytes:
        """The bytes of an entry. head : its key, and whatever else goes with it. After both comes
        ``seal.BLANK``."""

    def decode(self, content: bytes) -> tuple[Mapping[str, Any], Entry]:
        """Head and value of an entry; raises any of ``guarded_reading.UNREADABLE`` on other
        bytes, ``OtherFormError`` where the head at least is one."""


@dataclass
class KeyedStore(Generic[Entry]):
    """Entries in the files of a folder.

    Names are relative to the folder, such as ``samples.parquet/block-000000.parquet``.
    """

    root: Path
    codec: EntryCodec[Entry]
    """How an entry is written."""
    note: Note = quiet
    """Is told of entries that are not taken."""
    vouch: Vouch = nobody
    """Asked about entries without a seal."""
    put: Callable[[str, bytes], None] | None = None
    """Writes the file of this name; by default whole, into the folder."""
    foreign: set[str] = field(default_factory=set)
    """Names of entries that answer another request."""
    unsealed: set[str] = field(default_factory=set)
    """Names of entries that were taken without a seal, because they are vouched for."""
    noted: set[str] = field(default_factory=set)
    """Names of entries that ``note`` was told of."""

    def names(self, pattern: str) -> list[str]:
        """Names of the files that are there, in order. pattern : as of ``Path.glob``."""
        return sorted(p.relative_to(self.root).as_posix() for p in self.root.glob(pattern))

    def read(self, name: str, key: Mapping[str, Any]) -> Entry | None:
        """The entry that answers this request; None where there is none, or a damaged one."""
        return self.read_as(name, key, lambda entry: entry)

    def read_as(
        self, name: str, key: Mapping[str, Any], make: Callable[[Entry], Made]
    ) -> Made | None:
        """What is made of the entry that answers this request; None as of ``read``.

        make : raises any of ``guarded_reading.UNREADABLE`` on an entry that nobody wrote so: it
        then counts as damaged.
        """
        path = self.root / name
        try:
            content = read_bytes(path, "a stored result", most=LARGEST)
        except InputError:
            if path.exists():
                self._damaged(name, DAMAGED)
            return None
        state = intact(content)
        if not (state or self.vouch(name, content)):
            self._damaged(name, UNSEALED if state is None else DAMAGED)
            return None
        try:
            head, value = self.codec.decode(content)
            made = make(value) if _answers(head, key) else None
        except (*UNREADABLE, InputError) as error:
            # The work of another request has other columns, or more of them: that is no damage.
            if isinstance(error, OtherFormError) and not _answers(error.head, key):
                self.foreign.add(name)
            else:
                self._damaged(name, DAMAGED)
            return None
        if not _answers(head, key):
            self.foreign.add(name)
            return None
        if not state:
            self.unsealed.add(name)
        return made

    def write(
        self,
        name: str,
        key: Mapping[str, Any],
        value: Entry,
        more: Mapping[str, Any] | None = None,
    ) -> None:
        """Write an entry, all at once. more : what else its head says.

        Raises
        ------
        InputError : it cannot be written.
        """
        content = sealed(self.codec.encode({**key, **(more or {})}, value))
        if self.put is not None:
            self.put(name, content)
        else:
            self._put(name, content)
        self.unsealed.discard(name)

    def _put(self, name: str, content: bytes) -> None:
        path = self.root / name
        with appearing(path) as partial:
            path.parent.mkdir(exist_ok=True)
            partial.write_bytes(content)

    def _damaged(self, name: str, why: str) -> None:
        if name not in self.noted:
            self.noted.add(name)
            self.note(f"{self.root / name}: {why}")


def _answers(head: Mapping[str, Any], key: Mapping[str, Any]) -> bool:
    """Whether an entry with this head answers the request with this key."""
    return {k: head.get(k) for k in key} == dict(key)


@dataclass(frozen=True)
class Lines:
    """Entries that share one JSON file: an object of objects, one of these a line.

    ``{"format": 1, "NAME": {`` is its first line, ``}}`` its last.
    """

    name: str
    """Under which the entries stand in the object."""
    key: str
    """The request's key, on every line."""

    def text(self, entries: Mapping[str, Mapping[str, Any]]) -> str:
        """The file, in ASCII. entries : plain data by name."""
        lines = [self._line(name, entry) for name, entry in entries.items()]
        return "\n".join([self._head(), ",\n".join(lines), "}}\n"])

    def read(self, content: bytes) -> tuple[dict[str, dict[str, Any]], int]:
        """The entries of this key that are whole, and how many lines are not."""
        entries: dict[str, dict[str, Any]] = {}
        first, *lines = content.splitlines() or [b""]
        damaged = int(first != self._head().encode("ascii"))
        for line in _entries(lines):
            try:
                ((name, entry),) = _checked(b"{%b}" % line).items()
            except (*UNREADABLE, InputError):
                damaged += 1
                continue
            entry.pop(SEAL)
            if entry.pop("key") == self.key:
                entries[name] = entry
        return entries, damaged

    def load(
        self, path: Path, note: Note = quiet, vouch: Vouch = nobody
    ) -> dict[str, dict[str, Any]]:
        """The entries in the file; none where there is none. Lines that are damaged are left out,
        which ``note`` is told. vouch : asked about a file that has no seal in it."""
        try:
            content = read_bytes(path, "stored results", most=LARGEST)
        except InputError:
            if path.exists():
                note(f"{path}: {DAMAGED}")
            return {}
        if content == self.text({}).encode("ascii"):
            return {}
        if intact(content) is None:
            if vouch(path.name, content):
                return self._plain(content, path)
            note(f"{path}: {UNSEALED}")
            return {}
        entries, damaged = self.read(content)
        if damaged:
            lines = "1 entry is" if damaged == 1 else f"{damaged} entries are"
            note(f"{path}: {lines} {DAMAGED}")
        return entries

    def _head(self) -> str:
        return json.dumps({"format": 1, self.name: {}})[:-2]

    def _line(self, name: str, entry: Mapping[str, Any]) -> str:
        fields = {**entry, "key": self.key, SEAL: BLANK}
        text = json.dumps({name: fields}, allow_nan=False)
        return sealed(text.encode("ascii")).decode("ascii")[1:-1]

    def _plain(self, content: bytes, path: Path) -> dict[str, dict[str, Any]]:
        """A file of an earlier version, which somebody vouches for."""
        with reading(path, "stored results"):
            entries = parse_json(content, path)[self.name]
            return {str(name): dict(entry) for name, entry in entries.items()}


def sealed_line(values: Iterable[Any]) -> str:
    """A JSON list on one line, its seal the last of its values."""
    return sealed(json.dumps([*values, BLANK], allow_nan=False).encode("ascii")).decode("ascii")


def read_line(line: bytes) -> list[Any] | None:
    """The values of a sealed line, without the seal; None where it is damaged or none."""
    try:
        values = _checked(line)
    except (*UNREADABLE, InputError):
        return None
    return values[:-1] if isinstance(values, list) else None


def _checked(line: bytes) -> Any:
    if not intact(line):
        raise ValueError("a line without its seal")
    return parse_json(line, None)


def _entries(lines: Iterable[bytes]) -> Iterator[bytes]:
    """The lines but the last, without the comma at their ends."""
    for line in lines:
        if line.strip() not in (b"", b"}}"):
            yield line.strip().removesuffix(b",")
