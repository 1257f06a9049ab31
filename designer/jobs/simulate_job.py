"""The verb ``simulate``."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.defaults import DRAWN_STARTS, SEED
from designer.base.errors import InputError
from designer.base.frames import frame
from designer.base.plain_json import plain
from designer.base.progress import Progress
from designer.base.si_unit import DIGITS
from designer.catalog.catalog import load_catalog
from designer.check import simulation
from designer.check.simulation import Engine, Simulated
from designer.folders.json_answers import simulate_json
from designer.folders.model_source import model_file, source
from designer.folders.origin import provenance
from designer.jobs.options import Options
from designer.model.model_file import ModelFile
from designer.model.si_units import Reader, units_of
from designer.spice.opamp_model import Rung

if TYPE_CHECKING:
    import pandas as pd

    from designer.check.synthesis_result import Synthesis


@dataclass(frozen=True)
class SimulationResult:
    """What the verb ``simulate`` answers. It is a sequence of the responses too."""

    answer: dict[str, Any]
    """The JSON object (docs/contract.md)."""
    simulated: tuple[Simulated, ...]
    """Each response with its orbits."""

    @property
    def satisfied(self) -> bool:
        """Whether every wanted response was found and can be trusted."""
        return all(s.found and s.trust.trusted is True for s in self.simulated)

    def table(self) -> pd.DataFrame:
        """A row for each orbit: each response, its twin and the others that coexist with it, in
        model units."""
        return frame(row for s in self.simulated for row in s.rows())

    def __iter__(self) -> Iterator[Simulated]:
        return iter(self.simulated)

    def __len__(self) -> int:
        return len(self.simulated)

    def __getitem__(self, index: int) -> Simulated:
        return self.simulated[index]

    def _repr_html_(self) -> str:
        return "".join(s._repr_html_() for s in self.simulated)


def simulate(
    model: Path | str | ModelFile,
    omega: float | str | Iterable[float | str] = (),
    *,
    frequency: float | str | Iterable[float | str] = (),
    engine: Engine = "model",
    rung: Rung = "ideal",
    starts: int = DRAWN_STARTS,
    seed: int = SEED,
    plots: Path | str | None = None,
    overwrite: bool = False,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> SimulationResult:
    """The verb ``simulate``: the responses on one engine.

    model : a model file that was read, the path of one, or a design folder. omega, frequency : what
    is reached from rest there, instead of the responses of the model file: one value or several. An
    omega is a number in the model's units, a frequency a text such as "10 Hz" or a number in Hz.
    starts : initial states that are drawn. plots : a directory for pictures;
    ``overwrite`` replaces those of the same names.

    Raises
    ------
    InputError : as ``simulation.simulate``, or pictures that are in the way.
    """
    Options(seed, jobs).check()
    progress = Progress() if progress is None else progress
    began, catalog = time.perf_counter(), load_catalog()
    synthesis: Synthesis | None = None
    if isinstance(model, ModelFile):
        modelfile = model
    elif Path(model).is_dir():
        modelfile, folder = source(model, model)
        if engine != "model":
            from designer.folders.design_source import read_design

            synthesis = read_design(folder, catalog, progress)
    else:
        modelfile = model_file(Path(model))
    read = Reader(modelfile.model, modelfile.si)
    omegas = tuple(read.value("--omega", "omega", w) for w in _several("omega", omega, "0.85"))
    frequencies = _several("frequency", frequency, "'10 Hz'")
    omegas += tuple(read.frequency("--frequency", f) for f in frequencies)
    wanted: tuple[float | None, ...] = omegas or tuple(r.omega for r in modelfile.responses)
    names: tuple[str, ...] = ()
    if plots is not None:
        from designer.plots import simulate_plots

        digits = simulate_plots.DIGITS if modelfile.si is None else DIGITS
        names = simulate_plots.names([w for w in wanted if w is not None], digits)
        simulate_plots.check(Path(plots), names, overwrite)
    simulated = simulation.simulate(
        modelfile,
        omegas,
        engine=engine,
        synthesis=synthesis,
        jobs=jobs,
        progress=progress,
        traces=plots is not None,
        rung=rung,
        starts=starts,
        seed=seed,
        choose=_chosen,
    )
    settings = {**simulation.engine_settings(engine, rung), "drawn_starts": starts}
    origin = provenance(modelfile, catalog.hash, seed=seed, settings=settings)
    seconds = time.perf_counter() - began
    answer = simulate_json(simulated, engine, origin, seconds, modelfile.si)
    if plots is not None:
        progress.stage("pictures")
        units = units_of(modelfile.si, modelfile.model)
        answer["files"] = simulate_plots.write(Path(plots), names, simulated, overwrite, units)
    return SimulationResult(plain(answer), simulated)


def _chosen(modelfile: ModelFile) -> Synthesis:
    """Parts as ``synthesise`` chooses them, whatever the model shows."""
    from designer.centering import stage_choice

    return stage_choice.synthesise(modelfile, all_found=False)


def _several(name: str, given: object, example: str) -> list[float | str]:
    """The values of an argument that is one number or text, or several of them.

    Raises
    ------
    InputError : it is something else. example : a value, as it is written.
    """
    each = given if isinstance(given, Iterable) and not isinstance(given, str | bytes) else [given]
    values = []
    for value in each:
        if isinstance(value, bool) or not isinstance(value, Real | str):
            expected = f"one value or a list of them: {name}={example} or {name}=[{example}, …]"
            raise InputError(None, name, repr(value), expected)
        values.append(value if isinstance(value, str) else float(value))
    return values
