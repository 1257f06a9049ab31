"""What the verb ``bifurcation`` has to compute, and what decides it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from designer.base.design_folder import Folder
from designer.base.progress import Progress
from designer.base.si_unit import Unit
from designer.bifurcations.basin_shares import SharePlan
from designer.bifurcations.border_curves import CurvePlan
from designer.bifurcations.sweep import SweepPlan
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.swept_board import BoardSubject
from designer.folders.origin import provenance
from designer.folders.sweep_store import work_hash
from designer.folders.work_files import WorkFiles
from designer.jobs.bifurcation_request import Plan, Request, curve_plan, region_at, share_plan
from designer.model.model_file import ModelFile
from designer.spread.part_rules import spread_of
from designer.spread.spread import Spread

Files = dict[str, str | bytes]
"""Contents of files by name."""
Made = tuple[dict[str, Any], dict[str, Any], Callable[[], Files]]
"""What is in the JSON object, what it cost, and what makes the pictures and tables."""


class BifurcationWork:
    """What is to be computed, and what decides it."""

    def __init__(
        self, request: Request, plan: Plan, modelfile: ModelFile, jobs: int, progress: Progress
    ) -> None:
        self.request, self.plan, self.jobs, self.progress = request, plan, jobs, progress
        self.title = modelfile.title
        self.curves: CurvePlan | None = None
        self.region: float | None = None
        self.spread: Spread | None = None
        self.shares: SharePlan | None = None
        more: dict[str, Any] = {}
        if isinstance(plan, SweepPlan):
            self.curves = curve_plan(request, plan, modelfile)
            more = {"points": request.points}
            more |= {} if self.curves is None else {"and": self.curves.as_dict()}
            self.region = region_at(request, plan, modelfile)
            more |= {} if self.region is None else {"region": self.region}
            if self.region is not None and isinstance(plan.subject, BoardSubject):
                circuit = plan.subject.design.circuit
                self.spread = spread_of(modelfile, circuit, load_catalog())
                more |= {"spread": self.spread.as_dict(), "seed": request.seed}
            self.shares = share_plan(request, plan, modelfile)
            more |= {} if self.shares is None else {"shares": self.shares.as_dict()}
        self.decides = {"kind": request.kind, **plan.as_dict(), **more}
        self.hash = work_hash(self.decides)
        self.provenance = provenance(
            modelfile,
            load_catalog().hash,
            seed=self._seed,
            settings={"bifurcation": self.decides},
        )

    @property
    def _seed(self) -> int | None:
        """Seed of the random starts; those of ``--starts`` are always the same."""
        if self.shares is not None:
            return self.shares.seed
        return None if self.request.starts is None else 0

    def files(self, folder: Folder) -> WorkFiles:
        """Where the finished blocks lie in a folder."""
        note = self.progress.note
        return WorkFiles(folder.path, self.hash, self.provenance, note, folder.vouches)


def with_si(row: dict[str, Any], unit: Unit | None) -> dict[str, Any]:
    """The row, and the values of the swept quantity in its SI unit too, if it has one."""
    if unit is None:
        return row
    keys = [key for key in ("from", "to", "value") if row.get(key) is not None]
    return {**row, **{f"{key}_{unit.suffix}": row[key] * unit.scale for key in keys}}


def image_files(kind: str, figure: Any) -> Files:
    from designer.base.figure_style import to_png, to_svg

    return {f"{kind}.png": to_png(figure, 200.0), f"{kind}.svg": to_svg(figure)}
