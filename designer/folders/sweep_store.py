"""The finished blocks of sweeps, maps, basins, counted basins and curves in a folder, as Parquet.

Every file says which work it belongs to and carries the provenance; it appears whole or not at
all, and one that was damaged since is not taken (``base.keyed_store``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

import pyarrow as pa

from designer.base.keyed_store import KeyedStore, Note, Vouch, nobody
from designer.base.parquet_entry import ParquetCodec, Rows, columns_of
from designer.base.progress import quiet
from designer.base.record_check import Record, read_record
from designer.base.seal import json_hash
from designer.bifurcations.basin_shares import AttractorShare, SharePlan, Step
from designer.bifurcations.basins import BasinPlan
from designer.bifurcations.border_curve import BorderCurve, CurveMeeting, CurveOrigin, read_curve
from designer.bifurcations.border_curves import BLOCKS, CurvePlan
from designer.bifurcations.curve_switch import OtherCurve
from designer.bifurcations.grazing_contact import GrazingContact
from designer.bifurcations.parameter_map import MapCell, MapPlan
from designer.bifurcations.sweep import BLOCK, Sweep, SweepPlan
from designer.dynamics.orbit import Motion
from designer.dynamics.steady_state import SteadyMotion

FORMAT = 1
RULES = 4
"""Raised whenever a rule changes that decides what a step shows: then old blocks are not reused."""
Kept = TypeVar("Kept")
Place = tuple[Any, ...]
"""Of a block in its work: a number, or a track and a number."""
_STEP = columns_of(
    SteadyMotion,
    "status n p q symmetric lyapunov lyapunov_error radius start end minima velocities "
    "periods".split(),
)
_CELL = columns_of(MapCell, "status n p q symmetric lyapunov strobe".split())
_MORE = pa.schema(columns_of(MapCell, ["more"]))
"""The column of systems with more clearances than one."""
_FURTHER = pa.schema(columns_of(SteadyMotion, ["more", "further"]))
"""The same, and the column of sweeps that show more stops than one."""
_SHARE = columns_of(
    AttractorShare, "attractor status n p q more symmetric twin count strobes".split()
)
_TOUCH = [
    *columns_of(GrazingContact, "clearance side tip".split()),
    *columns_of(OtherCurve, "phase size".split()),
]
_OTHER = [
    *columns_of(OtherCurve, "kind n state stable".split()),
    pa.field("touch", pa.struct(_TOUCH)),
]
_KIND, _VALUES = pa.field("kind", pa.string()), *columns_of(CurveMeeting, ["values"])
_MEETING = pa.struct([_KIND, _VALUES, pa.field("other", pa.struct(_OTHER))])
_ORIGIN = pa.struct([*columns_of(CurveOrigin, ["curve"]), _KIND, _VALUES])
_CURVE = [
    *columns_of(BorderCurve, "kind response symmetric".split()),
    pa.field("points", pa.list_(pa.list_(pa.float64()))),
    *columns_of(BorderCurve, "stable ends".split()),
    pa.field("codimension_two", pa.list_(_MEETING)),
    pa.field("begun_at", _ORIGIN),
]


def work_hash(settings: Mapping[str, Any]) -> str:
    """Hash of what decides a result."""
    return json_hash({"rules": RULES, **settings})


@dataclass(frozen=True)
class WorkFiles:
    """Where the blocks of one work lie, and what each of them says."""

    root: Path
    """Folder that they lie in."""
    work: str
    """Hash of what decides the work."""
    provenance: Mapping[str, Any]
    """Versions, seed and settings, which go into every file."""
    note: Note = quiet
    """Is told of entries that are not taken."""
    vouch: Vouch = nobody
    """Asked about entries without a seal."""
    noted: set[str] = field(default_factory=set)
    """Names of blocks that ``note`` was told of."""


@dataclass(frozen=True)
class Blocks(Generic[Kept]):
    """The blocks of a plan in a folder (``bifurcations.block_store``)."""

    files: WorkFiles
    """Where they lie."""
    file: str
    """Name of a block's file, inside the folder, with its place left open."""
    places: Sequence[Place]
    """Of all blocks."""
    codec: ParquetCodec
    """How a block is written."""
    rows: Callable[[Kept, Place], Rows]
    make: Callable[[Rows, Place], Kept]
    """The block of these rows, as of ``KeyedStore.read_as``."""
    words: tuple[str, ...] = ("block",)
    """What a file calls the parts of its place."""

    @property
    def names(self) -> list[str]:
        """File names of all blocks."""
        return [self.name(*place) for place in self.places]

    def name(self, *place: Any) -> str:
        """File name of a block."""
        return self.file.format(*place).replace(" ", "-")

    def read(self, *place: Any) -> Kept | None:
        """A finished block of this very work, or None."""
        key, make = self._key(place), lambda rows: self.make(rows, place)
        return self._store.read_as(self.name(*place), key, make)

    def write(self, block: Kept, *place: Any) -> None:
        """Keep a finished block.

        Raises
        ------
        InputError : it cannot be written.
        """
        more = {"provenance": self.files.provenance}
        self._store.write(self.name(*place), self._key(place), self.rows(block, place), more)

    @property
    def _store(self) -> KeyedStore[Rows]:
        files = self.files
        return KeyedStore(files.root, self.codec, files.note, files.vouch, noted=files.noted)

    def _key(self, place: Place) -> dict[str, Any]:
        named = zip(self.words, place, strict=True)
        return {"format": FORMAT, "work": self.files.work, **dict(named)}


def sweep_blocks(plan: SweepPlan, files: WorkFiles) -> Blocks[list[SteadyMotion]]:
    """Steps of a sweep in the order in which they are made."""
    name = plan.parameter

    def rows(steps: Sequence[SteadyMotion], place: Place) -> Rows:
        track, block = place
        return _steps(name, track, plan.blocks(track)[block].tolist(), steps)

    return Blocks(
        files,
        "sweep.parquet/{}-{:06d}.parquet",
        [(track, k) for track in plan.tracks for k in range(len(plan.blocks(track)))],
        _sweep_codec(name, BLOCK),
        rows,
        lambda rows, _: [_record(SteadyMotion, row, "track", name) for row in rows],
        ("track", "block"),
    )


def write_sweep(path: Path, sweep: Sweep, provenance: Mapping[str, Any]) -> None:
    """A whole sweep as one Parquet file, with the columns of the blocks: track after track, the
    values ascending.

    Raises
    ------
    InputError : it cannot be written.
    """
    name, values = sweep.plan.parameter, sweep.plan.values.tolist()
    each = (_steps(name, track, values, steps) for track, steps in sweep.steps.items())
    rows = [row for track in each for row in track]
    store = KeyedStore(path.parent, _sweep_codec(name, len(rows)))
    key = {"format": FORMAT, "work": work_hash(sweep.plan.as_dict())}
    store.write(path.name, key, rows, {"provenance": provenance})


def _sweep_codec(parameter: str, most: int) -> ParquetCodec:
    schema = pa.schema([pa.field("track", pa.string()), pa.field(parameter, pa.float64()), *_STEP])
    return ParquetCodec(schema, _FURTHER, most)


def _steps(
    parameter: str, track: str, values: Iterable[float], steps: Sequence[SteadyMotion]
) -> Rows:
    pairs = zip(values, steps, strict=True)
    return [{"track": track, parameter: value, **_columns(step)} for value, step in pairs]


def _columns(motion: Motion) -> dict[str, Any]:
    return {**motion.__dict__, "status": str(motion.status)}


def _record(kind: type[Record], row: Mapping[str, Any], *places: str) -> Record:
    """A record from a row that says its places too."""
    return read_record(kind, {name: value for name, value in row.items() if name not in places})


def grid_blocks(plan: MapPlan | BasinPlan, files: WorkFiles) -> Blocks[list[MapCell]]:
    """Rows of a map or of basins."""
    x, y = plan.x, plan.y
    at = [pa.field(name, pa.float64()) for name in (x, y)]
    schema = pa.schema([*columns_of(MapCell, "ij"), *at, *_CELL])

    def rows(cells: Sequence[MapCell], _: Place) -> Rows:
        return [{x: plan.xs[c.j], y: plan.ys[c.i], **_columns(c)} for c in cells]

    def cells(rows: Rows, place: Place) -> list[MapCell]:
        out = [_record(MapCell, row, x, y) for row in rows]
        if [(cell.i, cell.j) for cell in out] != [(*place, j) for j in range(len(plan.xs))]:
            raise ValueError("cells of other places")
        return out

    kind = "map" if isinstance(plan, MapPlan) else "basins"
    file, places = f"{kind}.parquet/row-{{:06d}}.parquet", [(i,) for i in range(len(plan.ys))]
    codec = ParquetCodec(schema, _MORE, len(plan.xs))
    return Blocks(files, file, places, codec, rows, cells, ("row",))


def share_blocks(plan: SharePlan, files: WorkFiles) -> Blocks[list[Step]]:
    """Counted basins, a row for each attractor at each value."""
    name, blocks = plan.parameter, plan.blocks()

    def rows(steps: Sequence[Step], place: Place) -> Rows:
        pairs = zip(blocks[place[0]].tolist(), steps, strict=True)
        return [{name: value, **_columns(share)} for value, step in pairs for share in step]

    def steps(rows: Rows, _: Place) -> list[Step]:
        by_value: dict[float, list[AttractorShare]] = {}
        for row in rows:
            by_value.setdefault(row[name], []).append(_record(AttractorShare, row, name))
        return [tuple(step) for step in by_value.values()]

    codec = ParquetCodec(pa.schema([pa.field(name, pa.float64()), *_SHARE]))
    places = [(k,) for k in range(len(blocks))]
    return Blocks(files, "shares.parquet/block-{:06d}.parquet", places, codec, rows, steps)


def curve_blocks(plan: CurvePlan, files: WorkFiles) -> Blocks[list[BorderCurve]]:
    """Bifurcation curves, a row each."""
    return Blocks(
        files,
        "curves.parquet/block-{:06d}.parquet",
        [(k,) for k in range(BLOCKS * (1 + plan.depth))],
        ParquetCodec(pa.schema(_CURVE)),
        lambda curves, _: [curve.as_dict() for curve in curves],
        lambda rows, _: list(map(read_curve, rows)),
    )
