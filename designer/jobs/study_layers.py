"""The layers of a study: what is asked for, what the folder has, and which files they make."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from designer.answers.attribution_noise import lacks_noise
from designer.base.defaults import OVERS
from designer.base.design_folder import REPORTS, TOLERANCE, Folder
from designer.base.manifest import StageName
from designer.folders.study_cache import CACHE
from designer.folders.study_stores import BLOCK_FOLDERS, BOARDS, MAPS, PIECES
from designer.jobs.options import Options

MAP = "map:"
ALL_IN_NGSPICE = "ngspice of every board"
WITHOUT_ATTRIBUTION, ATTRIBUTION_BUDGET = "without blame", "blame budget "
NOISE = "noise of the blame"
"""The layer that makes anew the noise of an attribution which an earlier version stored without
it."""


def layers_of(options: Options) -> list[str]:
    """Names of the layers that are asked for, sorted."""
    budget = options.blame_budget if options.blame else None
    names = {
        "samples": True,
        "ngspice": options.rung != "exact",
        ALL_IN_NGSPICE: options.rung == "ngspice",
        "tuned": options.tuned,
        "trimmed": options.trimmed,
        "reached": options.reached,
        "rare": options.rare,
        WITHOUT_ATTRIBUTION: not options.blame,
        NOISE: options.blame and options.attribution_anew,
        f"{ATTRIBUTION_BUDGET}{budget}": budget is not None,
        **{f"{MAP}{over}": True for over in options.map_},
    }
    return sorted(name for name, wanted in names.items() if wanted)


def attributed(layers: Iterable[str]) -> bool:
    """Whether a study of these layers has an attribution."""
    return WITHOUT_ATTRIBUTION not in layers


def attribution_budget(layers: Iterable[str]) -> int | None:
    """The largest budget among these layers; None where none is stated."""
    budgets = [
        int(n.removeprefix(ATTRIBUTION_BUDGET)) for n in layers if n.startswith(ATTRIBUTION_BUDGET)
    ]
    return max(budgets, default=None)


def merged(
    folder: Folder,
    inputs: Mapping[str, Any],
    options: Options,
    name: StageName = "study",
    prefix: str = "",
) -> Options:
    """The options with every layer that the folder's study has already, if it is one of the same
    inputs otherwise: a study gets more layers, it loses none. name : of the study's stage.
    prefix : of its files."""
    stage = folder.manifest.stages.get(name) if folder.manifest else None
    stored = {} if stage is None else stage.inputs
    if {k: v for k, v in stored.items() if k != "layers"} != dict(inputs):
        return replace(options, attribution_anew=False)
    complete = stage is not None and stage.complete
    if options.attribution_anew:
        lacking = complete and lacks_noise(folder.json(prefix + TOLERANCE))
        options = replace(options, attribution_anew=lacking)
    names = {*stored.get("layers", ()), *layers_of(options)}
    fidelity = options.rung
    if "ngspice" in names and fidelity != "bandwidth":
        fidelity = "ngspice" if ALL_IN_NGSPICE in names else "auto"
    has_attribution = complete and attributed(stored["layers"])
    with_attribution = options.blame or has_attribution
    return replace(
        options,
        rung=fidelity,
        tuned="tuned" in names,
        reached="reached" in names,
        rare="rare" in names,
        map_=tuple(over for over in OVERS if f"{MAP}{over}" in names),
        blame=with_attribution,
        attribution_anew=NOISE in names,
        blame_budget=attribution_budget(names) if with_attribution else None,
    )


def study_files(options: Options, responses: int, census: bool) -> list[str]:
    """What the stage writes; a name that ends in "/" is a folder of blocks. census : whether it is
    of all the boards of a list."""
    names = layers_of(options)
    blocks = [f"{folder}/" for name, folder in BLOCK_FOLDERS.items() if name in names]
    boards = [BOARDS] if census else []
    pieces = [PIECES] if options.blame or options.map_ or options.rare else []
    maps = [f"map-{over}-{i + 1}.png" for over in options.map_ for i in range(responses)]
    maps += [MAPS] if maps else []
    return [TOLERANCE, *REPORTS, CACHE, *boards, *pieces, *maps, *blocks]
