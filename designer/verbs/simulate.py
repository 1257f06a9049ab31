"""The verb ``simulate``."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Annotated, Any, Literal

from designer.base.defaults import DRAWN_STARTS, SEED, Fidelity
from designer.base.errors import InputError
from designer.base.frames import frame
from designer.base.progress import Progress, reported, stage, watched
from designer.base.si_unit import DIGITS, value_text
from designer.verbs.console import say, table
from designer.verbs.declared import Jobs, Seed, Source, Verb, option
from designer.verbs.tables import YES_NO, pictures, response_cells, untrusted

if TYPE_CHECKING:
    import pandas as pd

    from designer.answers.shared_rows import ShareRow
    from designer.answers.simulate_answer import (
        ClearanceReach,
        ResponseRow,
        SimulateAnswer,
        StartsRow,
    )
    from designer.base.arrays import Array
    from designer.check.simulation import Simulated
    from designer.check.stick_phases import Sticking
    from designer.check.synthesis_result import Synthesis
    from designer.model.model_file import ModelFile
    from designer.model.si_units import Reader


@dataclass(frozen=True, repr=False)
class SimulationResult:
    """What the verb ``simulate`` answers. It is a sequence of the responses too."""

    answer: SimulateAnswer
    """The JSON object (docs/contract.md)."""
    simulated: tuple[Simulated, ...]
    """Each response with its orbits."""
    model: Path | None
    """The model file or design folder that was asked about, where it is one."""
    plots: Path | None
    """The directory of the pictures, if there are some."""

    @property
    def satisfied(self) -> bool:
        """Whether every wanted response was found and can be trusted."""
        return all(s.found and s.trust.trusted is True for s in self.simulated)

    def table(self) -> pd.DataFrame:
        """A row for each orbit: each response, its twin and the others that coexist with it, in
        model units."""
        return frame(row for s in self.simulated for row in s.rows())

    def __repr__(self) -> str:
        shown = ", ".join(f"{s.orbit.response} at ω = {s.omega:g}" for s in self)
        return f"<SimulationResult: {shown}>"

    def __iter__(self) -> Iterator[Simulated]:
        return iter(self.simulated)

    def __len__(self) -> int:
        return len(self.simulated)

    def __getitem__(self, index: int) -> Simulated:
        return self.simulated[index]

    def _repr_html_(self) -> str:
        return "".join(s._repr_html_() for s in self.simulated)


@reported
def simulate(
    model: Source,
    omega: Annotated[
        float | str | Iterable[float | str],
        option(
            "--omega",
            "W",
            "Frequency in the model's own units; may be repeated.",
            reads=list[float],
        ),
    ] = (),
    *,
    frequency: Annotated[
        float | str | Iterable[float | str],
        option(
            "--frequency",
            "F",
            'Of a model file with SI values, such as "10 Hz" or "62.8 rad/s"; may be repeated.',
            reads=list[str],
        ),
    ] = (),
    engine: Annotated[
        Literal["model", "circuit", "ngspice"], option("--engine", None, "What simulates.")
    ] = "model",
    rung: Annotated[
        Fidelity,
        option("--rung", None, "Fidelity of the op-amps' model, with --engine ngspice."),
    ] = "ideal",
    starts: Annotated[
        int,
        option("--starts", "N", "Initial states that are drawn: the attractors' shares; 0: none."),
    ] = DRAWN_STARTS,
    seed: Seed = SEED,
    start: Annotated[
        Simulated | Mapping[str, float | str] | Iterable[float | str] | None,
        option(
            "--start",
            "STATE=VALUE",
            "Begin here instead of at rest, where the drive's phase is 0; may be repeated.",
            reads=list[str],
        ),
    ] = (),
    plots: Annotated[
        Path | str | None, option("--plots", "DIR", "Draw each response: PNG and SVG.", Path)
    ] = None,
    overwrite: Annotated[
        bool, option("--overwrite", None, "Replace pictures of the same names.")
    ] = False,
    jobs: Jobs = None,
    progress: Progress | None = None,
) -> SimulationResult:
    """Name the responses: those that the model file wants, or those reached from rest at
    --omega and --frequency.

    omega, frequency : one value or several. An omega is a number in the model's units, a frequency
    a text such as "10 Hz" or a number in Hz. start : a response of an earlier answer, states by
    their names (the others are 0), all states in their order, or texts such as "x1=0.2"; where
    the base moves, counted from it.

    Raises
    ------
    InputError : as ``simulation.simulate``, or pictures that are in the way.
    """
    from designer.base.plain_json import plain
    from designer.catalog.parts_catalog import load_catalog
    from designer.check import simulation
    from designer.folders.json_answers import simulate_json
    from designer.folders.model_source import model_of
    from designer.folders.origin import provenance
    from designer.jobs.options import Options
    from designer.model.model_file import ModelFile
    from designer.model.si_units import Reader, units_of

    Options(seed, jobs).check()
    began, catalog = time.perf_counter(), load_catalog()
    synthesis: Synthesis | None = None
    path = None if isinstance(model, ModelFile) else Path(model)
    modelfile = model_of(model)
    if path is not None and path.is_dir() and engine != "model":
        from designer.folders.design_source import read_design

        synthesis = read_design(path, catalog, watched())
    read = Reader(modelfile.model, modelfile.si)
    omegas = tuple(read.value("--omega", "omega", w) for w in _several("omega", omega, "0.85"))
    frequencies = _several("frequency", frequency, "'10 Hz'")
    omegas += tuple(read.frequency("--frequency", f) for f in frequencies)
    begin = _start(start, read)
    if begin is not None and not omegas:
        expected = "--omega or --frequency too: a wanted response is looked for from many starts"
        raise InputError(None, "--start", ", ".join(f"{x:g}" for x in begin), expected)
    wanted: tuple[float | None, ...] = omegas or tuple(r.omega for r in modelfile.responses)
    place = None if plots is None else Path(plots)
    names: tuple[str, ...] = ()
    if place is not None:
        from designer.plots import simulate_plots

        digits = simulate_plots.DIGITS if modelfile.si is None else DIGITS
        names = simulate_plots.names([w for w in wanted if w is not None], digits)
        simulate_plots.check(place, names, overwrite)
    simulated = simulation.simulate(
        modelfile,
        omegas,
        engine=engine,
        synthesis=synthesis,
        jobs=jobs,
        traces=place is not None,
        fidelity=rung,
        starts=starts,
        seed=seed,
        start=begin,
        choose=_chosen,
    )
    settings = {**simulation.engine_settings(engine, rung), "drawn_starts": starts}
    settings |= {} if begin is None else {"start": begin}
    origin = provenance(modelfile, catalog.hash, seed=seed, settings=settings)
    seconds = time.perf_counter() - began
    answer = simulate_json(simulated, engine, origin, seconds, modelfile.si)
    if place is not None:
        stage("pictures")
        units = units_of(modelfile.si, modelfile.model)
        answer["files"] = simulate_plots.write(place, names, simulated, overwrite, units)
    return SimulationResult(plain(answer), simulated, path, place)


def _chosen(modelfile: ModelFile) -> Synthesis:
    """Parts as ``synthesise`` chooses them, whatever the model shows."""
    from designer.centering import stage_choice

    return stage_choice.synthesise(modelfile, all_found=False)


def _start(given: object, read: Reader) -> Array | None:
    """(states,) the start that an argument gives, in model units; None where it is rest.

    Raises
    ------
    InputError : it gives none.
    """
    import numpy as np

    from designer.base.schema import one_of
    from designer.check.simulation import Simulated
    from designer.model.find_responses import LARGEST_START
    from designer.model.mechanics import state_names

    names = state_names(read.model.second_order().size)
    expected = f"a response of this model, or values of {', '.join(names)}, such as x1=0.2"
    found = shorten(repr(given), 80)
    if isinstance(given, SimulationResult) and len(given) == 1:
        given = given[0]
    if isinstance(given, Simulated):
        given = given.orbit.start.tolist() or given.orbit.response
    if isinstance(given, Mapping):
        given = [f"{name}={value}" for name, value in given.items()]
    if given is None or (isinstance(given, tuple | list) and not given):
        return None
    values = list(given) if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    state = dict[str, float]()
    if values and all(isinstance(value, str) and "=" in value for value in values):
        for text in map(str, values):
            name, value = (word.strip() for word in text.split("=", 1))
            if name not in names or name in state:
                raise InputError(None, "--start", text, f"each once, {one_of(name, names)}")
            state[name] = read.value("--start", name, value)
    elif len(values) == len(names):
        kinds = float, int, np.number
        if any(isinstance(value, bool) or not isinstance(value, kinds) for value in values):
            raise InputError(None, "--start", found, expected)
        state = dict(zip(names, np.array(values, dtype=float).tolist(), strict=True))
    else:
        raise InputError(None, "--start", found, expected)
    out = np.array([state.get(name, 0.0) for name in names])
    if not (np.abs(out) <= LARGEST_START).all():
        raise InputError(None, "--start", found, f"numbers of at most {LARGEST_START:g} in size")
    return out


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
        values.append(value if isinstance(value, str) else _float(name, value))
    return values


def _float(name: str, value: Real) -> float:
    try:
        return float(value)
    except OverflowError:
        raise InputError(None, name, value, "a number that a float can hold") from None


def tables(answer: SimulateAnswer) -> None:
    """The responses on one engine."""
    from designer.check.curved_laws import misfits_in
    from designer.check.stick_phases import sticking_in

    head = f"Responses of the {answer['engine']}" if answer["engine"] != "ngspice" else "In ngspice"
    rows = answer["responses"]
    masses = answer.get("masses", ())
    table(
        head,
        (
            {
                **(_response_cells_in_si if masses else response_cells)(r, rows),
                "response": r["response"]
                + (" (not to be trusted)" if r["trust"]["trusted"] is False else ""),
                "symmetric": YES_NO[r["symmetric"]],
                **_reach(r, rows, masses),
                "twin": "-" if r["twin"] is None else r["twin"]["response"],
                "others": ", ".join(o["response"] for o in r["others"]) or "-",
            }
            for r in rows
        ),
        gap=1,
    )
    in_si = bool(masses) and all("frequency_hz" in r for r in rows)
    if any("base_amplitude" in r for r in rows):
        from_base = [_from_base(r, masses, in_si=in_si) for r in rows]
        table("Displacements from the base", from_base, gap=1)
    met = [(r, each) for r in rows for each in r.get("in_clearances", ())]
    if met:
        sides = [side for side in SIDES if any(one[side] for _, one in met)]
        in_them = (_in_clearance(r, one, sides, in_si=in_si) for r, one in met)
        table("In the clearances: furthest into each stop, and fastest impact", in_them, gap=1)
    held = [(r, each) for r in rows for each in sticking_in(r)]
    if held:
        frictions = (_holding(r, each, in_si=in_si) for r, each in held)
        table("Dry friction: how often and how long it holds", frictions, gap=1)
    for r in rows:
        place = _place(r, in_si=in_si)
        if r["starts"] is not None:
            say(f"{place}: {coexisting(r['starts'], masses, in_si=in_si)}")
        if r["reason"]:
            say(f"{place}: {r['response']}: {r['reason']}")
        for each in (r, *r["others"]):
            for misfit in misfits_in(each):
                say(f"{place}: {misfit.text(each['response'], in_si=in_si)}")
        if pair := r["frequencies"]:
            say(f"{place}: {_frequencies(pair, r.get('frequencies_hz'))}")
        for other in r["others"]:
            if pair := other["frequencies"]:
                words = _frequencies(pair, other.get("frequencies_hz"))
                say(f"{place}: of the others, {words}")
        if r["lyapunov_error"] is not None:
            growth = f"{r['lyapunov']:.4g} ± {r['lyapunov_error']:.1g}{' 1/s' if in_si else ''}"
            say(f"{place}: largest exponent {growth} (standard error)")
        for line in untrusted({"this response": r["trust"]}):
            say(f"{place}: {line}")


SIDES: Sequence[Literal["upper", "lower"]] = ("upper", "lower")


def _place(row: ResponseRow, *, in_si: bool) -> str:
    """The drive frequency that a response belongs to."""
    return value_text(row["frequency_hz"], "Hz", 6) if in_si else f"ω = {row['omega']:g}"


def _from_base(row: ResponseRow, masses: Sequence[str], *, in_si: bool) -> dict[str, str]:
    """How far the masses go from a base that moves, and how far that goes."""
    lows, highs = row["from_base_min"], row["from_base_max"]
    cells = {"at": _place(row, in_si=in_si), "response": row["response"]}
    for i, name in enumerate(masses):
        ends = () if lows is None or highs is None else (lows[i], highs[i])
        cells[f"x{i + 1} − y ({name})"] = _between(ends, in_si=in_si)
    y = row["base_amplitude"]
    return {**cells, "y (base)": f"± {value_text(y, 'm') if in_si else format(y, '.6g')}"}


def _holding(row: ResponseRow, held: Sticking, *, in_si: bool) -> dict[str, str]:
    """What a friction does over a response."""
    often = "always" if held.share else "never"
    if held.phases:
        periods = "a drive period" if held.periods == 1 else f"{held.periods} drive periods"
        often = f"{held.phases} times in {periods}"
    return {
        "at": _place(row, in_si=in_si),
        "response": row["response"],
        "friction": held.friction,
        "holds": often,
        "of the time": f"{100.0 * held.share:.3g} %",
        "longest, in drive periods": f"{held.longest:.3g}",
        "creeps at most": value_text(held.creep, "m/s") if in_si else f"{held.creep:.3g}",
    }


def _in_clearance(
    row: ResponseRow,
    met: ClearanceReach,
    sides: Iterable[Literal["upper", "lower"]],
    *,
    in_si: bool,
) -> dict[str, str]:
    """How far a response goes in a clearance and into its stops, and the fastest impact on each."""
    stated = "max_m" in met  # beside the values of a dimensionless model

    def text(value: float | None, unit: str) -> str:
        if value is None:
            return "-"
        return value_text(value, unit) if stated or in_si else f"{value:.6g}"

    low, high = (met["min_m"], met["max_m"]) if stated else (met["min"], met["max"])
    cells = {
        "at": _place(row, in_si=in_si),
        "response": row["response"],
        "clearance": met["clearance"],
        "displacement": "-" if low is None else f"{text(low, 'm')} to {text(high, 'm')}",
    }
    for side in sides:
        stop, depth, speed = met[side], None, None
        if stop is not None:
            depth, speed = stop["depth"], stop["speed"]
            if stated:
                depth, speed = stop["depth_m"], stop["speed_m_s"]
        cells[f"{side} depth"] = text(depth if (depth or 0.0) > 0.0 else None, "m")
        cells[f"{side} speed"] = text(speed, "m/s")
    return cells


def _between(ends: Sequence[float], *, in_si: bool) -> str:
    return " to ".join(value_text(x, "m") if in_si else f"{x:.6g}" for x in ends) or "-"


def _frequencies(pair: Sequence[float], in_hertz: Sequence[float] | None) -> str:
    """The two frequencies of a quasi-periodic motion, and their ratio."""
    drive, second = pair
    if in_hertz is None:
        words = f"ω {drive:.6g} of the drive and {second:.7g}"
    else:
        first, other = value_text(in_hertz[0], "Hz"), value_text(in_hertz[1], "Hz", 7)
        words = f"{first} of the drive and {other}"
    return f"quasi-periodic with the frequencies {words}, {second / drive:.7g} times the drive's"


def _reach(row: ResponseRow, rows: Sequence[ResponseRow], masses: Sequence[str]) -> dict[str, str]:
    """How far the masses go: the first one, or each of those that have names."""
    in_si = "frequency_hz" in rows[0]
    cells = {}
    for i, name in enumerate(masses):
        low, high = row["x_min"], row["x_max"]
        ends = () if low is None or high is None else (low[i], high[i])
        cells[f"x{i + 1} ({name})"] = _between(ends, in_si=in_si)
    if masses:
        return cells
    for head, end in {"x1 max": row["x1_max"], "x1 min": row["x1_min"]}.items():
        cells[head] = "-" if end is None else f"{end:.6g}"
    if in_si:
        for head, end in {"x1 max": row["x1_max_m"], "x1 min": row["x1_min_m"]}.items():
            cells[f"{head} (SI)"] = "-" if end is None else value_text(end, "m")
    return cells


def coexisting(starts: StartsRow, masses: Sequence[str] = (), *, in_si: bool = False) -> str:
    """Where the starts that were drawn from a box end, the largest share first.

    masses : their names, if they have some. in_si : whether numbers are SI values.
    """

    def text(value: float, unit: str, digits: int = 4) -> str:
        return value_text(value, unit, digits) if in_si else f"{value:.{digits}g}"

    parts = []
    names = Counter(a["response"] for a in starts["attractors"])
    for a in sorted(starts["attractors"], key=lambda a: -a["share"]):
        name = a["response"] + (" (with its twin)" if a["on_twin"] is not None else "")
        low, high = a["x1_min"], a["x1_max"]
        if names[a["response"]] > 1 and low is not None and high is not None:
            name += f" (x1 {text(low, 'm')} to {text(high, 'm')})"
        parts.append(f"{name} {_share(a)}")
    if starts["not_settled"]["count"]:
        parts.append(f"not settled {_share(starts['not_settled'])}")
    named = {f"x{i + 1}": f" ({mass})" for i, mass in enumerate(masses)}
    box = starts["box"].items()
    units = {x: "m/s" if x.endswith("'") else "m" for x, _ in box}
    halves = ", ".join(f"{x}{named.get(x, '')} ± {text(half, units[x], 3)}" for x, half in box)
    count = str(starts["count"])
    if starts["count"] < starts["asked"]:
        count += f" (of {starts['asked']}: the others would take too many steps)"
    return f"of {count} starts at drive phase 0 in the box {halves}: {'; '.join(parts)}"


def _response_cells_in_si(
    row: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]
) -> dict[str, str]:
    """The same cells for a model whose plain numbers are SI values, where it has any."""
    cells = response_cells(row, rows)
    if "mechanism" not in cells:
        return cells
    return {"frequency": cells["mechanism"], "expected": cells["expected"]}


def _share(counted: ShareRow) -> str:
    """A share with its 95 % interval."""
    low, high = 100 * counted["low"], 100 * counted["high"]
    return f"{100 * counted['share']:.3g} % ({low:.3g} to {high:.3g})"


def show(result: SimulationResult) -> None:
    """The tables, where the pictures are, and what may be done next."""
    tables(result.answer)
    if result.plots is not None:
        pictures(result.plots, result.answer["files"])
    if result.model is not None:
        from designer.verbs import next_steps

        next_steps.show(next_steps.after_response(result.model, result.answer["responses"]))


VERB = Verb(
    simulate,
    "Explore",
    "designer simulate model.toml --omega 0.85 --plots pictures",
    show=show,
)
