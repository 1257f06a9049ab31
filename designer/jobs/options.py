"""What a verb that writes is asked for, from the command line or from Python."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from designer.base.defaults import SAMPLES, SEED, Over, StudyEngine, at_least, cores
from designer.base.errors import InputError

MOST_SAMPLES = 1_000_000


@dataclass(frozen=True)
class Options:
    """Options of the verbs that write."""

    seed: int = SEED
    """Seed of the boards."""
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
    maps: tuple[Over, ...] = ()
    """Yield maps that are asked for."""
    cluster: str | None = None
    """Address of a Dask scheduler, or None."""
    blamed: bool = True
    """Whether the blame is worked out."""
    blame_budget: int | None = None
    """Steps of the blame; None for ``blame_extent.BUDGET``."""
    measured: Path | None = None
    """File of a list of boards that are studied instead of random ones."""

    @property
    def workers(self) -> int:
        """How many work at a time."""
        return cores() if self.jobs is None else self.jobs

    def check(self) -> None:
        """InputError for a number that cannot be."""
        at_least("--samples", self.samples, 1)
        if self.samples > MOST_SAMPLES:
            raise InputError(None, "--samples", self.samples, f"at most {MOST_SAMPLES}")
        if self.until is not None and not 0.0 < self.until <= 1.0:
            raise InputError(None, "--until", self.until, "a width above 0, at most 1")
        if self.cluster is not None and not self.cluster.startswith(("tcp://", "tls://")):
            raise InputError(None, "--cluster", self.cluster, "a scheduler's address, tcp://…")
        at_least("--seed", self.seed, 0)
        if self.blame_budget is not None:
            at_least("--blame-budget", self.blame_budget, 1)
            if not self.blamed:
                expected = "no such option with --no-blame"
                raise InputError(None, "--blame-budget", self.blame_budget, expected)
        if self.jobs is not None:
            at_least("--jobs", self.jobs, 1)

    def command(self, verb: str, model: Path, out: Path | None) -> str:
        """The command line that makes the same results again.

        Files by their last names, so that no path of this machine stands in it; without options
        that change no result.
        """
        study, blame = verb == "tolerance", verb in ("tolerance", "run")
        words = ["designer", verb, _base(model)]
        for option, value, applies in (
            ("--out", None if out is None else _base(out), True),
            ("--samples", self.samples, self.measured is None),
            ("--measured", None if self.measured is None else _base(self.measured), True),
            ("--seed", self.seed, True),
            ("--rung", self.rung, self.rung != "auto" and verb in ("tolerance", "search")),
            ("--until", None if self.until is None else f"{self.until:g}", study),
            ("--tuned", "", study and self.tuned),
            ("--reached", "", study and self.reached),
            *(("--map", over, study) for over in self.maps),
            ("--no-blame", "", blame and not self.blamed),
            ("--blame-budget", self.blame_budget, blame),
        ):
            if applies and value is not None:
                words += [option, *([] if value == "" else [str(value)])]
        return shlex.join(words)


def stated_options(words: Mapping[str, Any]) -> dict[str, Any]:
    """The options that have a value."""
    return {name: value for name, value in words.items() if value is not None}


def _base(path: Path) -> str:
    """The last name of a path, never an option; ``.`` and ``..`` by the names they stand for."""
    name = os.path.basename(os.path.abspath(path)) or "."
    name = name.encode("utf-8", "replace").decode("utf-8")  # a name that is no text
    return f"./{name}" if name.startswith("-") else name
