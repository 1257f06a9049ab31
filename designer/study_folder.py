"""The study stage of a design folder: its layers, their inputs, their folders of blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.blocks import BlockStore
from designer.folder import REPORTS, TOLERANCE, Folder
from designer.hearing import Hearing
from designer.layers import CHUNK
from designer.study import Stores
from designer.study_hash import study_hash
from designer.verdict import BLOCK, Answer, StudyPlan

if TYPE_CHECKING:
    from designer.options import Options

SAMPLES, NGSPICE = "samples.parquet", "ngspice.parquet"
ALL_IN_NGSPICE = "ngspice of every board"


def layers_of(options: Options) -> list[str]:
    """Names of the layers that are asked for, sorted."""
    names = {"samples"}
    if options.rung != "exact":
        names.add("ngspice")
    if options.rung == "ngspice":
        names.add(ALL_IN_NGSPICE)
    return sorted(names)


def merged(folder: Folder, inputs: Mapping[str, Any], options: Options) -> Options:
    """The options with every layer that the folder's study has already, if it is one of the same
    inputs otherwise: a study gets more layers, it loses none."""
    stage = folder.manifest.stages.get("study") if folder.manifest else None
    known = {} if stage is None else stage.inputs
    if {k: v for k, v in known.items() if k != "layers"} != dict(inputs):
        return options
    names = {*known.get("layers", ()), *layers_of(options)}
    rung = options.rung
    if "ngspice" in names:
        rung = "ngspice" if ALL_IN_NGSPICE in names else "auto"
    return replace(options, rung=rung)


def study_files(options: Options) -> list[str]:
    """What the stage writes; a name that ends in "/" is a folder of blocks."""
    folders = [f"{SAMPLES}/"]
    if "ngspice" in layers_of(options):
        folders.append(f"{NGSPICE}/")
    return [TOLERANCE, *REPORTS, *folders]


class FolderStores(Stores):
    """The layers of one study in a design folder; ``guard`` is asked before each write."""

    def __init__(self, root: Path, guard: Callable[[], None]) -> None:
        self._root, self._guard = root, guard
        self._stores: dict[str, BlockStore[Any]] = {}

    def samples(self, plan: StudyPlan) -> BlockStore[Answer]:
        return self._store(plan, SAMPLES, Answer, "samples", BLOCK)

    def ngspice(self, plan: StudyPlan) -> BlockStore[Hearing]:
        return self._store(plan, NGSPICE, Hearing, "ngspice", CHUNK)

    @property
    def names(self) -> Iterable[str]:
        """Every file of a block, relative to the folder."""
        return sorted({name for store in self._stores.values() for name in store.names})

    def _store(
        self,
        plan: StudyPlan,
        folder: str,
        row: type[Any],
        layer: str,
        size: int,
        more: Mapping[str, Any] | None = None,
    ) -> BlockStore[Any]:
        if folder not in self._stores:
            self._stores[folder] = BlockStore(
                self._root,
                folder,
                row,
                study_hash(plan, layer, more),
                omegas=[q.spec.omega for q in plan.questions],
                size=size,
                guard=self._guard,
            )
        return self._stores[folder]
