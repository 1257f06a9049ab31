"""What a verb that writes is asked for, from the command line or from Python.

A field has the name of the verbs' parameter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from designer.base.defaults import SAMPLES, SEED, Over, StudyEngine, check_count, check_seed, cores
from designer.base.errors import InputError

MOST_SAMPLES = 1_000_000


@dataclass(frozen=True)
class Options:
    """Options of the verbs that write."""

    seed: int = SEED
    jobs: int | None = None
    """Workers; None for one a core."""
    samples: int = SAMPLES
    """Boards of a study."""
    overwrite: bool = False
    """Whether files that the manifest lists may be replaced."""
    resume: bool = False
    """Whether unfinished work goes on."""
    until: float | None = None
    """Width that every interval shall have; None: the study stops at ``samples``."""
    rung: StudyEngine = "auto"
    """Which engine decides a study; "auto": it is chosen."""
    tuned: bool = False
    """Whether boards are tuned too."""
    reached: bool = False
    """Whether boards are powered up too."""
    trimmed: bool = False
    """Whether the model file has a trimmer fitted, whose layer every study has."""
    map_: tuple[Over, ...] = ()
    """Yield maps that are asked for."""
    rare: bool = False
    """Whether boards are drawn where they are lost."""
    cluster: str | None = None
    """Address of a Dask scheduler, or None."""
    blame: bool = True
    """Whether the attribution is worked out."""
    blame_budget: int | None = None
    """Steps of the attribution; None for ``loss_replay.BUDGET``."""
    attribution_anew: bool = False
    """Whether a stored attribution without noise is made anew: ``--blame`` was said."""
    measured: Path | None = None
    """File of a list of boards that are studied instead of random ones."""
    yield_: float | None = None
    """Of a search: the yield for which the found design is cured; None: it stays as it is."""
    ppm: float | None = None
    """The same as the boards of a million that may be lost."""
    budget: float | None = None
    """The most that the cure may cost [euro]."""
    without: tuple[str, ...] = ()
    """Kinds of upgrades that the cure is not to have."""

    @property
    def workers(self) -> int:
        """How many work at a time."""
        return cores() if self.jobs is None else self.jobs

    def check(self) -> None:
        """InputError for a number that cannot be."""
        check_count("--samples", self.samples, 1, MOST_SAMPLES)
        if self.until is not None and not 0.0 < self.until <= 1.0:
            raise InputError(None, "--until", self.until, "a width above 0, at most 1")
        if self.cluster is not None and not self.cluster.startswith(("tcp://", "tls://")):
            raise InputError(None, "--cluster", self.cluster, "a scheduler's address, tcp://…")
        check_seed(self.seed)
        check_count("--blame-budget", self.blame_budget, 1)
        if self.blame_budget is not None and not self.blame:
            expected = "no such option with --no-blame"
            raise InputError(None, "--blame-budget", self.blame_budget, expected)
        check_count("--jobs", self.jobs, 1)


def stated_options(words: Mapping[str, Any]) -> dict[str, Any]:
    """The options that have a value."""
    return {name: value for name, value in words.items() if value is not None}
