"""The study stage of a design folder: its layers, their inputs, their folders of blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.design_folder import REPORTS, TOLERANCE, Folder
from designer.base.keyed_store import Vouch, nobody
from designer.base.manifest import StageName
from designer.jobs.study_cache import CACHE, StudyCache
from designer.verdicts.verdict import StudyPlan
from designer.yields.blame_analysis import Blame
from designer.yields.layers import LAYERS, LayerName
from designer.yields.row_store import BlockStore
from designer.yields.stored_parts import StoredParts
from designer.yields.study import Study
from designer.yields.study_identity import blame_hash, study_hash
from designer.yields.tolerance_study import Stores
from designer.yields.yield_maps import OVERS

if TYPE_CHECKING:
    from designer.jobs.options import Options

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
MAPS, MAP = "maps.json", "map:"
ALL_IN_NGSPICE = "ngspice of every board"
WITHOUT_BLAME, BLAME_BUDGET = "without blame", "blame budget "
BOARDS = "boards.csv"
"""A row for each measured board."""
PIECES = "study-pieces.npz"
"""What is known of a blame and of maps that are not whole."""


def layers_of(options: Options) -> list[str]:
    """Names of the layers that are asked for, sorted."""
    budget = options.blame_budget if options.blamed else None
    names = {
        "samples": True,
        "ngspice": options.rung != "exact",
        ALL_IN_NGSPICE: options.rung == "ngspice",
        "tuned": options.tuned,
        "trimmed": options.trimmed,
        "reached": options.reached,
        WITHOUT_BLAME: not options.blamed,
        f"{BLAME_BUDGET}{budget}": budget is not None,
        **{f"{MAP}{over}": True for over in options.maps},
    }
    return sorted(name for name, wanted in names.items() if wanted)


def blamed(layers: Iterable[str]) -> bool:
    """Whether a study of these layers has a blame."""
    return WITHOUT_BLAME not in layers


def blame_budget(layers: Iterable[str]) -> int | None:
    """The largest budget among these layers; None where none is stated."""
    budgets = [int(n.removeprefix(BLAME_BUDGET)) for n in layers if n.startswith(BLAME_BUDGET)]
    return max(budgets, default=None)


def merged(
    folder: Folder, inputs: Mapping[str, Any], options: Options, name: StageName = "study"
) -> Options:
    """The options with every layer that the folder's study has already, if it is one of the same
    inputs otherwise: a study gets more layers, it loses none. name : of the study's stage."""
    stage = folder.manifest.stages.get(name) if folder.manifest else None
    stored = {} if stage is None else stage.inputs
    if {k: v for k, v in stored.items() if k != "layers"} != dict(inputs):
        return options
    names = {*stored.get("layers", ()), *layers_of(options)}
    rung = options.rung
    if "ngspice" in names and rung != "bandwidth":
        rung = "ngspice" if ALL_IN_NGSPICE in names else "auto"
    has_blame = stage is not None and stage.complete and blamed(stored["layers"])
    with_blame = options.blamed or has_blame
    return replace(
        options,
        rung=rung,
        tuned="tuned" in names,
        reached="reached" in names,
        maps=tuple(over for over in OVERS if f"{MAP}{over}" in names),
        blamed=with_blame,
        blame_budget=blame_budget(names) if with_blame else None,
    )


def study_files(options: Options, responses: int, census: bool) -> list[str]:
    """What the stage writes; a name that ends in "/" is a folder of blocks. census : whether it is
    of all the boards of a list."""
    names = layers_of(options)
    blocks = [f"{folder}/" for name, folder in BLOCK_FOLDERS.items() if name in names]
    boards = [BOARDS] if census else []
    pieces = [PIECES] if options.blamed or options.maps else []
    maps = [f"map-{over}-{i + 1}.png" for over in options.maps for i in range(responses)]
    maps += [MAPS] if maps else []
    return [TOLERANCE, *REPORTS, CACHE, *boards, *pieces, *maps, *blocks]


class FolderStores(Stores):
    """The layers of one study in a design folder; ``guard`` is asked before each write, ``note``
    is told of blocks that are damaged or of another study. kept : where the blame is; pieces :
    where what is known of one that is not whole. prefix : of the names in the folder, "" or ending
    in "/". vouch : asked about blocks of earlier versions (``Folder.vouches``)."""

    def __init__(
        self,
        root: Path,
        guard: Callable[[], None],
        note: Callable[[str], None] = lambda _: None,
        cache: StudyCache | None = None,
        pieces: StudyCache | None = None,
        prefix: str = "",
        vouch: Vouch = nobody,
    ) -> None:
        self._vouch = vouch
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

    def blame(self, plan: StudyPlan, budget: int) -> Blame | None:
        if self._cache is None:
            return None
        result: Blame | None = self._cache.get("blame", blame_hash(plan))
        if result is None or (result.share < 1.0 and (result.budget or 0) < budget):
            return None
        return result

    def put_blame(self, plan: StudyPlan, blame: Blame) -> None:
        if self._cache is not None:
            self._guard()
            self._cache.put("blame", blame_hash(plan), replace(blame, seconds=0.0))

    def blame_parts(self, plan: StudyPlan) -> StoredParts:
        return self._pieces_of(blame_hash(plan))

    def maps(self, plan: StudyPlan) -> StoredParts:
        return self._pieces_of(study_hash(plan, "maps"))

    def _pieces_of(self, key: str) -> StoredParts:
        if self._pieces is None:
            return StoredParts()
        return _FolderPieces(self._pieces, key, self._guard)

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


def map_files(study: Study, provenance: Mapping[str, Any]) -> dict[str, bytes]:
    """``maps.json`` and a picture of each map, by name; none where there are no maps. Times are in
    ``tolerance.json``."""
    if not study.maps:
        return {}
    from designer.report.map_plots import map_files as files  # Matplotlib takes a while to import

    labels = [
        f"ω = {q.spec.omega:g} {q.spec.expect or q.start.response}" for q in study.plan.questions
    ]
    timeless = [replace(each, seconds=0.0) for each in study.maps]
    return files(timeless, labels, {"provenance": provenance})
