"""The design folder on disk: its manifest, what may be replaced, what is complete.

``manifest.json`` lists every file that the tool wrote, with its hash, and the stages (``design``,
``kicad``, ``study``, ``comparison``) with the hash of their inputs. A stage with the same inputs is
not done again; one with others only with ``--overwrite``, which touches listed files and no others.
Where only a list among the inputs has grown (``layers`` of a study) the stage is extended. A
stage's files are listed before the first of them is written, so that interrupted work can be told
from foreign files; a name that ends in "/" stands for a folder of blocks until the stage is
finished.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Any

from designer.base.atomic_write import appearing, partial_of, writing
from designer.base.errors import InputError
from designer.base.guarded_reading import decode
from designer.base.manifest import (
    MANIFEST as MANIFEST,
    REPLACED_STAGE,
    Manifest,
    ManifestStage,
    StageName as StageName,
    Stages,
    State,
    file_hash as file_hash,
    grown,
    object_hash,
    of_design,
    read_json as read_json,
    read_manifest,
)
from designer.base.plain_json import dumps, plain
from designer.base.progress import note
from designer.base.schema import literal
from designer.base.seal import sha256
from designer.base.toml_reader import parse_toml

OPTIONS = {
    "seed": "--seed",
    "samples": "--samples",
    "until": "--until",
    "rung": "--rung",
    "yield": "--yield",
    "budget": "--budget",
    "without": "--without",
    "boards": "--boards",
    "truth": "--truth",
    "fabs": "--fab",
    "accepted": "--accept",
    "parameter": "--over",
    "from": "--from",
    "to": "--to",
    "steps": "--steps",
    "region": "--region",
}
"""Inputs that an option gives, by their names."""
THINGS = {
    "model": "model file",
    "catalogue": "catalogue",
    "version": "version of designer",
    "list": "list of measured boards",
    "measured": "list of measured values",
    "board": "board file",
    "parts": "list of parts",
    "work": "sweep",
    "kicad": "KiCad",
    "rules": "rules",
}
"""Inputs that are no option, in words."""
MOST = 4
"""Differences that a message has words for; the rest is counted."""
_HASH = re.compile(r"[0-9a-f]{64}")
_LONGEST = 40


def differences(
    made: Mapping[str, Any], asked: Mapping[str, Any], behind: Mapping[str, tuple[Any, Any]]
) -> str:
    """ "made with --steps 226, asked for 227": every input that differs.

    made, asked : inputs of a stage. behind : what a hash among them is of, as it was made and as it
    is asked for, where both are known.
    """
    parts = []
    for key in sorted({*made, *asked}):
        before, now = made.get(key), asked.get(key)
        if before == now:
            continue
        known = behind.get(key)
        inner = [] if known is None else list(_leaves("", *known))
        if inner:
            parts += inner
        elif known is not None:
            apart = "in its comments alone" if key == "model" else "by the rules of another version"
            parts.append(f"made with another {_name(key)}, {apart}")
        elif _is_hash(before) or _is_hash(now):
            parts.append(_of_hash(key, before, now))
        else:
            parts += _leaves(key, before, now)
    more = len(parts) - MOST
    shown = [*parts[:MOST], *([f"{more} more"] if more > 0 else [])]
    return "; ".join(shown)


def _leaves(place: str, made: Any, asked: Any) -> Iterator[str]:
    """Each value in which two records differ."""
    if made == asked:
        return
    if isinstance(made, Mapping) and isinstance(asked, Mapping):
        for key in dict.fromkeys([*made, *asked]):
            inner = f"{place}.{key}" if place else str(key)
            yield from _leaves(inner, made.get(key), asked.get(key))
    elif _are_tables(made) and _are_tables(asked):
        for index in range(max(len(made), len(asked))):
            pair = [rows[index] if index < len(rows) else None for rows in (made, asked)]
            yield from _leaves(f"{place}[{index + 1}]", *pair)
    elif made is None:
        yield f"made without {_name(place)}, asked for {_text(asked)}"
    elif asked is None:
        yield f"made with {_name(place)} {_text(made)}, asked for without"
    else:
        yield f"made with {_name(place)} {_text(made)}, asked for {_text(asked)}"


def _of_hash(key: str, made: Any, asked: Any) -> str:
    if made is None or asked is None:
        return f"made {'with' if asked is None else 'without'} a {_name(key)}"
    return f"made with another {_name(key)}"


def _name(key: str) -> str:
    return OPTIONS.get(key) or THINGS.get(key) or key


def _is_hash(value: Any) -> bool:
    return isinstance(value, str) and _HASH.fullmatch(value) is not None


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, Mapping) for v in value)


def _text(value: Any) -> str:
    """A value in few words."""
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list | tuple):
        listed = ", ".join(map(_text, value))
        return listed if len(listed) <= _LONGEST else f"{len(value)} values"
    text = value if isinstance(value, str) else literal(value)
    text = "".join(ch if ch.isprintable() else "?" for ch in text)
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "…"


MODEL, ASKED = "model.toml", "asked.toml"
MEASURED = "measured.csv"
"""Its copy of the values that were measured on boards."""
DESIGN = "design.json"
TOLERANCE = "tolerance.json"
REPORTS = ("report.html", "report.md")
COMPARISON, COMPARISON_PICTURES = "compare.json", ("compare.svg", "compare.png")
MADE_WITH = frozenset({"version", "catalogue"})
"""Inputs that nobody asks for: what the tool was when a stage was made."""
BLOCKS = "block-*.parquet"
"""Files of a folder of blocks; others in it are not ours."""
WORKED_ON = (".kicad_pcb", ".kicad_sch", ".kicad_pro", ".kicad_dru")
"""Endings of files that people go on working on."""
DESIGN_FILES = (MODEL, DESIGN, "circuit.cir", "setup.csv", "scales.csv")
"""The files of every design; ``board_files.names`` has those of its board."""


class Folder:
    """A design folder at ``path``, which need not exist yet.

    Raises
    ------
    InputError : there is something else at that place, or its manifest cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.manifest = read_manifest(path)
        if self.manifest is None:
            _check_free(path)
        listed = {} if self.manifest is None else self.manifest.files
        self._written: set[str] = set()
        self._digests = {name: digest for name, (_, digest) in listed.items() if digest}

    def __truediv__(self, name: str) -> Path:
        return self.path / name

    def state(self, stage: StageName, inputs: Mapping[str, Any]) -> State:
        """How far a stage with these inputs has come."""
        entry = None if self.manifest is None else self.manifest.stages.get(stage)
        if entry is None:
            return "new"
        if entry.hash == ManifestStage(dict(inputs)).hash:
            return "same" if entry.complete else "unfinished"
        if not grown(entry.inputs, inputs):
            return "other"
        return "more" if entry.complete else "unfinished"

    def decide(
        self,
        wanted: Stages,
        *,
        overwrite: bool,
        resume: bool,
        asked: Mapping[str, Any] | None = None,
    ) -> list[StageName]:
        """Which of the wanted stages are to be done.

        asked : what hashes among the inputs are of, by their names, so that a refusal can say what
        differs: the text of the ``model``, the settings of the ``work``.

        Raises
        ------
        InputError : what is there is of other inputs, unfinished or changed, or a file that the
            manifest does not list stands in the way, and the options do not say what to do.
        """
        todo: list[StageName] = []
        for stage, (inputs, _) in wanted.items():
            state = self.state(stage, inputs)
            if state == "other" and not overwrite:
                self._refuse(stage, inputs, asked or {})
            if state == "unfinished" and not (overwrite or resume):
                raise InputError(
                    self / MANIFEST,
                    f"stages.{stage}",
                    "unfinished work with the same inputs",
                    "--resume to go on with it, or --overwrite to begin anew",
                )
            changed = self.changed(stage) if state == "same" else None
            if changed is not None and not overwrite:
                raise InputError(
                    self / changed,
                    "its sha256",
                    "another than in manifest.json, or no file",
                    "the file as it was written, or --overwrite to make it again",
                )
            if state != "same" or changed is not None or ("design" in todo and of_design(stage)):
                todo.append(stage)
        listed = {} if self.manifest is None else self.manifest.files
        for stage in todo:
            for name in wanted[stage][1]:
                for foreign in [] if name in listed else self._there(name):
                    if foreign in listed:
                        continue
                    raise InputError(
                        self / foreign,
                        "the file",
                        "a file that manifest.json does not list",
                        "no file of this name: --overwrite replaces listed files only",
                    )
        return todo

    def changed(self, stage: StageName) -> str | None:
        """The first file of a finished stage that is not what the manifest says."""
        assert self.manifest is not None
        for name, (owner, digest) in sorted(self.manifest.files.items()):
            if owner != stage or digest is None:  # None: a later stage was about to improve it
                continue
            try:
                content = (self / name).read_bytes()
            except OSError:
                return name
            if digest != file_hash(name, content):
                return name
        return None

    def vouches(self, name: str, content: bytes) -> bool:
        """Whether the manifest, as it was when the folder was opened, knows a file of this name
        with this content."""
        return name in self._digests and self._digests[name] == file_hash(name, content)

    def begin(
        self,
        wanted: Stages,
        provenance: Mapping[str, Any] | None = None,
        resume_data: Mapping[str, Any] | None = None,
    ) -> None:
        """Create the folder if need be, and mark these stages as unfinished.

        A stage that depends on one that begins anew is forgotten; its files stay listed until
        ``finish`` removes them.

        provenance : None for the folder's own. resume_data : data that the stages need when they go
        on after an interruption.
        """
        manifest = self.manifest or Manifest()
        with writing(self.path):
            self.path.mkdir(parents=True, exist_ok=True)
        if "design" in wanted:
            manifest.stages = {n: s for n, s in manifest.stages.items() if not of_design(n)}
            manifest.files = {
                n: (REPLACED_STAGE if of_design(s) else s, d)
                for n, (s, d) in manifest.files.items()
            }
        for stage, (inputs, names) in wanted.items():
            manifest.files = {
                n: (REPLACED_STAGE if s == stage else s, d) for n, (s, d) in manifest.files.items()
            }
            manifest.stages[stage] = ManifestStage(inputs, resume_data=dict(resume_data or {}))
            manifest.files |= dict.fromkeys(names, (stage, None))
        with writing(self.path):
            for name in manifest.files:  # remains of a killed process
                if name.endswith("/"):
                    for left in (self / name).glob(f".{BLOCKS}.part"):
                        left.unlink(missing_ok=True)
                else:
                    partial_of(self / name).unlink(missing_ok=True)
        if provenance is not None:
            manifest.provenance = dict(provenance)
        self.manifest = manifest
        self._save()

    @contextlib.contextmanager
    def working(
        self, wanted: Stages, provenance: Mapping[str, Any] | None = None
    ) -> Iterator[None]:
        """A block that writes these stages: begun before it, finished where it ends without an
        error."""
        self.begin(wanted, provenance)
        yield
        for stage in wanted:
            self.finish(stage)

    def write(self, name: str, content: str | bytes) -> None:
        """Write one listed file, all at once."""
        assert self.manifest is not None
        stage, _ = self.manifest.files[name]
        data = content.encode("utf-8") if isinstance(content, str) else content
        path = self / name
        self._keep(name)
        self._written.add(name)
        with appearing(path) as partial:
            path.parent.mkdir(parents=True, exist_ok=True)
            partial.write_bytes(data)
        self.manifest.files[name] = (stage, file_hash(name, data))

    def _keep(self, name: str) -> None:
        """Keep a copy of a file that somebody has worked on, before it is replaced or removed: a
        board that was routed by hand cannot be made again."""
        digest = self._digests.get(name)
        if digest is None or name in self._written or not name.endswith(WORKED_ON):
            return
        path = self / name
        with writing(path):
            if not path.is_file() or file_hash(name, path.read_bytes()) == digest:
                return
            numbers = (path.with_name(f"{path.name}.kept-{k}") for k in count(1))
            kept = next(free for free in numbers if not free.exists())
            shutil.copy2(path, kept)
        note(f"{path} was changed since the tool wrote it: it is kept as {kept.name}")

    def rewrite(self, name: str, content: str | bytes) -> None:
        """Write a file of a finished stage anew, unless it has this content already.

        At no time does the manifest state a hash that is not the file's.
        """
        assert self.manifest is not None
        stage, digest = self.manifest.files[name]
        data = content.encode("utf-8") if isinstance(content, str) else content
        path = self / name
        if digest == file_hash(name, data) and path.is_file() and path.read_bytes() == data:
            return
        self.manifest.files[name] = (stage, None)
        self._save()
        self.write(name, content)
        self._save()

    def finish(self, stage: StageName, blocks: Iterable[str] = ()) -> None:
        """Mark a stage as complete and remove listed files that nothing writes any more.

        blocks : files in its folders of blocks that belong to it.
        """
        manifest = self.manifest
        assert manifest is not None
        folders = [
            name
            for name, (owner, _) in manifest.files.items()
            if name.endswith("/") and owner in (stage, REPLACED_STAGE)
        ]
        manifest.files |= dict.fromkeys(blocks, (stage, None))
        for name, (owner, _) in list(manifest.files.items()):
            if owner != stage or name in folders:
                continue
            if (self / name).exists():
                manifest.files[name] = (owner, file_hash(name, (self / name).read_bytes()))
            else:  # planned and not needed: a study of no response has no samples
                del manifest.files[name]
        manifest.stages[stage].complete = True
        manifest.stages[stage].resume_data = {}
        obsolete = [n for n, (owner, _) in manifest.files.items() if owner == REPLACED_STAGE]
        for name in folders:
            del manifest.files[name]
            obsolete += [n for n in self._there(name) if n not in manifest.files]
        for name in obsolete:
            if not name.endswith("/"):
                self._keep(name)
                with writing(self / name):
                    (self / name).unlink(missing_ok=True)
            manifest.files.pop(name, None)
            with contextlib.suppress(OSError):  # a folder that is empty now
                if "/" in name:
                    (self / name).parent.rmdir()
        self._save()

    def watch(self) -> Callable[[], None]:
        """A check that the folder is still the one that work began in. Long work calls it before
        each write.

        It raises InputError where the folder is gone, or somebody has changed its manifest, its
        model or its design.
        """
        assert self.manifest is not None
        hashes = {name: stage.hash for name, stage in self.manifest.stages.items()}
        digests = {name: self.manifest.files[name][1] for name in (MODEL, DESIGN)}
        stats: list[object] = []

        def look() -> None:
            try:
                now = [
                    (s.st_mtime_ns, s.st_size, s.st_ino)
                    for s in ((self / name).stat() for name in (MANIFEST, MODEL, DESIGN))
                ]
                if now == stats:
                    return
                for name, digest in digests.items():
                    if file_hash(name, (self / name).read_bytes()) != digest:
                        raise self._changed_under_work(name)
                manifest = read_manifest(self.path)
            except OSError as error:
                raise InputError(
                    self.path,
                    "the folder",
                    error.strerror or str(error),
                    "the design folder that this work began in: was it moved or deleted?",
                ) from None
            if manifest is None or {n: s.hash for n, s in manifest.stages.items()} != hashes:
                raise self._changed_under_work(MANIFEST)
            stats[:] = now

        return look

    def _changed_under_work(self, name: str) -> InputError:
        return InputError(
            self / name,
            "the file",
            "another than when this work began",
            "a folder that nobody changes meanwhile; finished blocks of the earlier design are "
            "not used for the new one",
        )

    def _there(self, name: str) -> Iterator[str]:
        """Files of this name, or the blocks in a folder of this name."""
        if name.endswith("/"):
            yield from (f"{name}{p.name}" for p in sorted((self / name).glob(BLOCKS)))
        elif (self / name).exists():
            yield name

    def json(self, name: str) -> Any:
        """The object in one of the folder's JSON files, of a type of ``answers``.

        Raises
        ------
        InputError : it is none, or another than the manifest says.
        """
        value = read_json(self / name)
        listed = {} if self.manifest is None else self.manifest.files
        _, digest = listed.get(name, ("", None))
        if digest is not None and digest != object_hash(value):
            raise InputError(
                self / name,
                "its sha256",
                "another than in manifest.json",
                "the file as it was written, or --overwrite to make it again",
            )
        return value

    def _save(self) -> None:
        assert self.manifest is not None
        with (
            appearing(self / MANIFEST) as partial,
            partial.open("w", encoding="ascii") as stream,
        ):
            stream.write(dumps(self.manifest.as_dict()))
            stream.flush()
            os.fsync(stream.fileno())

    def _refuse(
        self, stage: StageName, inputs: Mapping[str, Any], asked: Mapping[str, Any]
    ) -> None:
        assert self.manifest is not None
        stored = self.manifest.stages[stage].inputs
        differ = {key for key in {*stored, *inputs} if stored.get(key) != inputs.get(key)}
        behind: dict[str, tuple[Any, Any]] = {}
        with contextlib.suppress(InputError, OSError):  # damaged: less is said
            if "model" in asked and "model" in differ:
                behind |= self._models(str(stored.get("model")), asked["model"])
            if "work" in asked and "work" in differ:
                behind |= self._works(stage, asked["work"])
        differing = differences(stored, inputs, behind)
        way = (
            "the same: --overwrite makes it anew with what is here now"
            if MADE_WITH.issuperset(differ)
            else "the same; or another folder, or --overwrite to replace what manifest.json lists"
        )
        raise InputError(self / MANIFEST, f"stages.{stage}.inputs", f"a {stage} {differing}", way)

    def _models(self, made: str, asked: str) -> dict[str, tuple[Any, Any]]:
        """The model file that a stage was made with, and another text of one. made : its hash."""
        for path in (self / MODEL, self / ASKED):
            content = path.read_bytes() if path.is_file() else b""
            if sha256(content) == made:
                file = str(path)
                return {"model": (parse_toml(decode(content, file), file), parse_toml(asked, None))}
        return {}

    def _works(self, stage: StageName, asked: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
        """What decided a sweep, and what is to decide another: the provenance has it."""
        assert self.manifest is not None
        file = self / f"{stage}.json"
        origin = self.json(file.name).get("provenance") if file.is_file() else None
        for each in (origin, self.manifest.provenance):
            settings = each.get("settings") if isinstance(each, dict) else None
            made = settings.get("bifurcation") if isinstance(settings, dict) else None
            if isinstance(made, dict):
                return {"work": (made, plain(asked))}
        return {}


def is_design_folder(path: Path) -> bool:
    """Whether there is a folder with a manifest."""
    return (path / MANIFEST).is_file()


def _check_free(path: Path) -> None:
    """InputError unless a folder can be made here, or an empty one is here."""
    if path.is_dir():
        with writing(path):
            occupied = any(p.name != partial_of(path / MANIFEST).name for p in path.iterdir())
        if occupied:
            raise InputError(
                path,
                "--out",
                "a folder with files and no manifest.json",
                "a design folder, an empty folder, or a name that is free",
            )
        if not os.access(path, os.W_OK | os.X_OK):
            raise InputError(path, "--out", "a folder without write access", "one to write into")
        return
    nearest = path
    while not _exists(nearest) and nearest != nearest.parent:
        nearest = nearest.parent
    if not nearest.is_dir():
        raise InputError(
            path, "--out", f"{nearest} is no folder", "a path at which a folder can be made"
        )
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise InputError(
            path, "--out", f"no write access to {nearest}", "a path at which a folder can be made"
        )


def _exists(path: Path) -> bool:
    try:
        return path.exists() or path.is_symlink()
    except OSError:
        return False
