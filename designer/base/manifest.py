"""What ``manifest.json`` of a design folder says: stages and inputs, files and hashes."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, Literal, get_args

from designer.base.defaults import DIALECTS, Dialect
from designer.base.errors import MISSING, InputError
from designer.base.guarded_reading import UNREADABLE, parse_json, read_bytes
from designer.base.seal import json_hash, sha256
from designer.base.version import __version__

FORMAT = 1
MANIFEST = "manifest.json"


class OrderStage(str):
    """The stage of what one fab is sent: ``fabrication/jlcpcb``."""

    @classmethod
    def of(cls, fab: str) -> OrderStage:
        return cls(f"{ORDERS}/{fab}")


class DeckStage(str):
    """The stage of a deck for another simulator: ``deck-ltspice``."""

    @classmethod
    def of(cls, dialect: Dialect) -> DeckStage:
        return cls(f"deck-{dialect}")


ORDERS = "fabrication"
"""Folder of what fabs are sent, one folder in it for each."""
_OfDesign = Literal[
    "kicad",
    "study",
    "measured",
    "comparison",
    "trade",
    "confirmation",
    "cure",
    "rules",
]
_Fixed = Literal["search", "design", _OfDesign, "sweep", "map", "basins"]
StageName = _Fixed | OrderStage | DeckStage
_DECKS = tuple(map(DeckStage.of, DIALECTS))
STAGES: tuple[StageName, ...] = (*get_args(_Fixed), *_DECKS)
Stages = dict[StageName, tuple[dict[str, Any], list[str]]]
"""Stages as a folder is asked for them: inputs, and names of files, by name."""
OF_DESIGN: tuple[StageName, ...] = (*get_args(_OfDesign), *_DECKS)
"""Stages that depend on the design, and on it alone."""


def of_design(stage: str) -> bool:
    """Whether a stage depends on the design, and on it alone."""
    return stage in OF_DESIGN or stage.startswith(f"{ORDERS}/")


REPLACED_STAGE = "replaced"
"""Of a file whose stage begins anew, until something is written in its place."""
REPLACED = ("without ", "blame budget ")
"""How items of an input's list begin that may give way to another: what is not there may come, and
a budget may grow."""
State = Literal["new", "same", "more", "unfinished", "other"]
_MAX_MANIFEST = 20_000_000


@dataclass
class ManifestStage:
    """A stage of the work, as the manifest records it."""

    inputs: dict[str, Any]
    """What decides the stage's files; equal inputs give equal files."""
    complete: bool = False
    """Whether all its files are written."""
    resume_data: dict[str, Any] = field(default_factory=dict)
    """Data that the stage computed when it began and needs when it goes on after an interruption;
    empty once it is complete."""

    @property
    def hash(self) -> str:
        return json_hash(self.inputs)


@dataclass
class Manifest:
    """What a design folder's ``manifest.json`` says."""

    stages: dict[str, ManifestStage] = field(default_factory=dict)
    files: dict[str, tuple[str, str | None]] = field(default_factory=dict)
    """(stage, hash or None while unfinished) by file name."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """Versions, seed and settings that the files were made with."""

    @property
    def complete(self) -> bool:
        return bool(self.stages) and all(s.complete for s in self.stages.values())

    def as_dict(self) -> dict[str, Any]:
        files = {
            name: {
                "stage": stage,
                "format": 1,
                "sha256": digest,
                **({"sha256_without": "cost"} if name.endswith(".json") else {}),
            }
            for name, (stage, digest) in sorted(self.files.items())
        }
        stages = {
            name: {
                "inputs": s.inputs,
                "inputs_sha256": s.hash,
                "complete": s.complete,
                **({"kept": s.resume_data} if s.resume_data else {}),
            }
            for name, s in sorted(self.stages.items())
        }
        return {
            "format": FORMAT,
            "tool": "designer",
            "complete": self.complete,
            "stages": stages,
            "files": files,
            "provenance": self.provenance,
        }


def grown(stored: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
    """Whether the inputs differ by longer lists alone, and by what may give way (`REPLACED`)."""
    if stored.keys() != wanted.keys():
        return False
    return all(
        before == after
        or (
            isinstance(before, list)
            and isinstance(after, list)
            and all(each in after for each in _lasting(before))
        )
        for before, after in ((stored[key], wanted[key]) for key in stored)
    )


def _lasting(items: list[Any]) -> list[Any]:
    return [i for i in items if not (isinstance(i, str) and i.startswith(REPLACED))]


def file_hash(name: str, content: bytes) -> str:
    """Hash of a file as the manifest states it: a JSON file's without its object ``cost``."""
    if name.endswith(".json"):
        with contextlib.suppress(*UNREADABLE):  # damaged: its bytes then
            return object_hash(json.loads(content))
    return sha256(content)


def object_hash(value: Mapping[str, Any]) -> str:
    """Hash of the object of a JSON file as the manifest states it."""
    return json_hash({key: part for key, part in value.items() if key != "cost"})


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file of a folder; InputError where there is none."""
    value = parse_json(read_bytes(path, "JSON"), path)
    if not isinstance(value, dict):
        raise InputError(path, "the file", type(value).__name__, "a JSON object")
    if value.get("format") != FORMAT:
        raise InputError(path, "format", value.get("format", MISSING), _known(value.get("format")))
    return value


def _known(found: object) -> str:
    """The format that this version reads, and what to do about a newer one."""
    newer = isinstance(found, int) and found > FORMAT
    return f"{FORMAT}" + (
        f": a newer version of designer wrote it, this is {__version__}; install that version"
        if newer
        else ""
    )


def read_manifest(path: Path) -> Manifest | None:
    file = path / MANIFEST
    if not file.is_file():
        return None
    if file.stat().st_size > _MAX_MANIFEST:
        raise InputError(file, "the file", "too large a file", "a manifest")
    value = read_json(file)
    if value.get("tool") != "designer":
        raise InputError(file, "tool", value.get("tool"), '"designer": a manifest of this tool')
    entries, listed = (_object(value.get(field), file, field) for field in ("stages", "files"))
    stages: dict[str, ManifestStage] = {
        name: _stage(entries[name], file, f"stages.{name}")
        for name in entries
        if name in STAGES or name.startswith(f"{ORDERS}/")
    }
    files: dict[str, tuple[str, str | None]] = {}
    for name, entry in listed.items():
        field = f"files.{name}"
        entry = _object(entry, file, field)
        stage, digest = entry.get("stage"), entry.get("sha256")
        if not (isinstance(stage, str) and (digest is None or isinstance(digest, str))):
            raise InputError(file, field, entry, "a stage and a sha256")
        if stage not in entries and stage != REPLACED_STAGE:
            raise InputError(file, f"{field}.stage", stage, f"one of {', '.join(entries)}")
        files[_inside(path, name)] = (stage, digest)
    if ORDERS in entries:
        stages |= _orders(_stage(entries[ORDERS], file, f"stages.{ORDERS}"))
        files = {name: (_order_of(name, stage), digest) for name, (stage, digest) in files.items()}
    return Manifest(stages, files, _object(value.get("provenance", {}), file, "provenance"))


def _orders(stage: ManifestStage) -> dict[str, ManifestStage]:
    """A stage for each fab of one that an earlier version wrote for all of them."""
    fabs = stage.inputs.get("fabs")
    inputs = {key: value for key, value in stage.inputs.items() if key != "fabs"}
    names = [name for name in fabs if isinstance(name, str)] if isinstance(fabs, list) else []
    return {OrderStage.of(name): ManifestStage(dict(inputs), stage.complete) for name in names}


def _order_of(file: str, stage: str) -> str:
    parts = file.split("/")
    return OrderStage.of(parts[1]) if stage == ORDERS and len(parts) > 2 else stage


def _stage(value: object, file: Path, field: str) -> ManifestStage:
    entry = _object(value, file, field)
    inputs = _object(entry.get("inputs"), file, f"{field}.inputs")
    resume_data = _object(entry.get("kept", {}), file, f"{field}.kept")
    complete = entry.get("complete")
    if not isinstance(complete, bool):
        raise InputError(file, f"{field}.complete", complete, "true or false")
    layers = inputs.get("layers", [])
    if not (isinstance(layers, list) and all(isinstance(each, str) for each in layers)):
        raise InputError(file, f"{field}.inputs.layers", layers, "a list of names")
    stage = ManifestStage(inputs, complete, resume_data)
    if entry.get("inputs_sha256", stage.hash) != stage.hash:  # a seed of one bit more, say
        found = "others than their inputs_sha256 says"
        raise InputError(file, f"{field}.inputs", found, "the manifest as it was written")
    return stage


def _object(value: object, file: Path, field: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(file, field, value, "an object")
    return value


def _inside(root: Path, name: str) -> str:
    """The name of a listed file, if it lies inside the folder: a manifest is untrusted input."""
    pure = PurePosixPath(name)
    if pure.is_absolute() or ".." in pure.parts or not pure.parts or name == MANIFEST:
        raise InputError(root / MANIFEST, "files", name, "names of files inside the folder")
    place = (root / pure).parent.resolve()
    if not place.is_relative_to(root.resolve()):
        raise InputError(root / MANIFEST, "files", name, "names of files inside the folder")
    return f"{pure}/" if name.endswith("/") else str(pure)
