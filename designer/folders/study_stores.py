"""The stores of a study in a design folder: its folders of blocks, its attribution, its maps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from designer.base.keyed_store import Vouch, nobody
from designer.folders.study_cache import StudyCache
from designer.model.model_file import ModelFile
from designer.verdicts.verdict import StudyPlan
from designer.yields.layers import LAYERS, LayerName
from designer.yields.loss_attribution import Attribution
from designer.yields.row_store import BlockStore
from designer.yields.stored_parts import StoredParts
from designer.yields.study import Study
from designer.yields.study_identity import attribution_hash, study_hash
from designer.yields.tolerance_study import LongWork, Stores

SAMPLES, NGSPICE = "samples.parquet", "ngspice.parquet"
TUNED, TRIMMED, REACHED = "tuned.parquet", "trimmed.parquet", "reached.parquet"
BLOCK_FOLDERS: dict[LayerName, str] = {
    "samples": SAMPLES,
    "ngspice": NGSPICE,
    "tuned": TUNED,
    "trimmed": TRIMMED,
    "reached": REACHED,
}
"""Folder of blocks by layer."""
MAPS = "maps.json"
BOARDS = "boards.csv"
"""A row for each measured board."""
PIECES = "study-pieces.npz"
"""What is known of an attribution, of maps and of estimates of rare losses that are not whole."""


class FolderStores(Stores):
    """The layers of one study in a design folder; ``guard`` is asked before each write, ``note`` is
    told of blocks that are damaged or of another study. kept : where the attribution is; pieces :
    where what is known of one that is not whole. prefix : of the names in the folder, "" or ending
    in "/". vouch : asked about blocks of earlier versions (``Folder.vouches``). noise : whether an
    attribution counts only if the noise of its indices is known."""

    def __init__(
        self,
        root: Path,
        guard: Callable[[], None],
        note: Callable[[str], None] = lambda _: None,
        cache: StudyCache | None = None,
        pieces: StudyCache | None = None,
        prefix: str = "",
        vouch: Vouch = nobody,
        noise: bool = False,
    ) -> None:
        self._vouch, self._noise = vouch, noise
        self._root, self._guard, self._note, self._cache = root, guard, note, cache
        self._pieces, self._prefix = pieces, prefix
        self._stores: dict[str, BlockStore[Any]] = {}

    def rows(
        self, layer: LayerName, plan: StudyPlan, more: Mapping[str, Any] | None = None
    ) -> BlockStore[Any]:
        folder, (row, size) = BLOCK_FOLDERS[layer], LAYERS[layer]
        if folder not in self._stores:
            self._stores[folder] = BlockStore(
                self._root,
                self._prefix + folder,
                row,
                study_hash(plan, layer, more),
                omegas=[q.spec.omega for q in plan.questions],
                labels=plan.labels,
                size=size,
                guard=self._guard,
                note=self._note,
                vouch=self._vouch,
            )
        return self._stores[folder]

    def attribution(self, plan: StudyPlan, budget: int) -> Attribution | None:
        if self._cache is None:
            return None
        result: Attribution | None = self._cache.get("blame", attribution_hash(plan))
        if result is None or (result.share < 1.0 and (result.budget or 0) < budget):
            return None
        if self._noise and not result.noise_known:
            return None
        return result

    def put_attribution(self, plan: StudyPlan, attribution: Attribution) -> None:
        if self._cache is not None:
            self._guard()
            self._cache.put("blame", attribution_hash(plan), replace(attribution, seconds=0.0))

    def parts(self, work: LongWork, plan: StudyPlan) -> StoredParts:
        file = self._cache if work == "rare" else self._pieces
        if file is None:
            return StoredParts()
        layer = work.removesuffix(" answers")
        key = attribution_hash(plan) if layer == "attribution" else study_hash(plan, layer)
        return _FolderPieces(file, key, self._guard)

    @property
    def names(self) -> Iterable[str]:
        """Every file of a block, relative to the folder."""
        return sorted({name for store in self._stores.values() for name in store.names})


class _FolderPieces(StoredParts):
    """Pieces of what ``key`` decides, in a file."""

    def __init__(self, file: StudyCache, key: str, guard: Callable[[], None]) -> None:
        self._file, self._key, self._guard = file, key, guard

    def get(self, name: str) -> Any | None:
        return self._file.get(name, self._key)

    def put(self, values: Mapping[str, Any]) -> None:
        if values:
            self._guard()
            self._file.put_all(values, self._key)


def map_files(study: Study, file: ModelFile, provenance: Mapping[str, Any]) -> dict[str, bytes]:
    """``maps.json`` and a picture of each map, by name; none where there are no maps. Times are in
    ``tolerance.json``."""
    if not study.maps:
        return {}
    from designer.plots.map_plots import map_files as files  # Matplotlib takes a while to import

    labels = [
        f"{file.drive_text(q.omega)} {q.spec.expect or q.start.response}"
        for q in study.plan.questions
    ]
    timeless = [replace(each, seconds=0.0) for each in study.maps]
    return files(timeless, labels, {"provenance": provenance}, angular=file.angular)
