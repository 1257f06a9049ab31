"""The ends of a sweep's windows, against an integrator that knows nothing of the package."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from designer.bifurcations import sweep, window_ends
from designer.bifurcations.continuation import End
from designer.bifurcations.points import Bifurcation, PointKind
from designer.bifurcations.sweep import Sweep, SweepPlan
from designer.bifurcations.window_ends import SweptEnd, WindowEnds
from designer.bifurcations.windows import NOT_LOCATED
from designer.cli import entry
from designer.dynamics.attractors import settle
from designer.dynamics.counts import period_of
from designer.dynamics.steady_state import TransientSettings
from designer.model.driven import model_flow
from designer.model.model_file import read_model_file
from designer.model.swept_model import ModelSubject
from tests.dynamics.test_modal_tables import PAPER
from tests.shared.event_integrator import GROUND, Array, Mechanism, integrate
from tests.shared.mechanism_file import mechanism_of
from tests.shared.mechanisms import absolute
from tests.shared.system_text import clearance, system_text, table

QUICK = TransientSettings(200, 16, 400)
TIP = 3e-4
"""Of a gap: how much wider and narrower a stop is set to see whether a tip touches it."""


def beam(gap: float = 0.452, force: float = 1.91, **stop: str) -> str:
    """A cantilever of three masses whose tip meets a stop on one side."""
    return system_text(
        {"root": "0.124 kg", "middle": "0.131 kg", "tip": "0.218 kg"},
        {
            ("root", "ground"): "5.79 kN/m",
            ("middle", "root"): "6.67 kN/m",
            ("tip", "middle"): "2.98 kN/m",
        },
        {
            ("root", "ground"): "0.654 N s/m",
            ("middle", "root"): "1.241 N s/m",
            ("tip", "middle"): "1.85 N s/m",
        },
        clearance("stop", "tip", "ground", upper=f"{gap} mm", stiffness="101.7 kN/m", **stop),
        table("force", on="tip", amplitude=f"{force} N"),
        table("response", frequency="20 Hz"),
    )


def drawn(seed: int) -> str:
    """Two masses in a chain, stops of the first on one side or both, driven at the second."""
    rng = np.random.default_rng(seed)
    m, k = rng.uniform(0.1, 0.3, 2).round(3), rng.uniform(2.0, 6.0, 2).round(2)
    c = rng.uniform(0.5, 2.0, 2).round(2)
    gaps = rng.uniform(0.2, 0.6, 2).round(3)
    stops = {"upper": f"{gaps[0]} mm"} | ({"lower": f"{gaps[1]} mm"} if seed % 2 else {})
    links = (("near", "ground"), ("far", "near"))
    return system_text(
        {"near": f"{m[0]} kg", "far": f"{m[1]} kg"},
        {link: f"{v} kN/m" for link, v in zip(links, k, strict=True)},
        {link: f"{v} N s/m" for link, v in zip(links, c, strict=True)},
        clearance("gap", "near", "ground", stiffness=f"{rng.uniform(20, 80):.1f} kN/m", **stops),
        table("force", on="far", amplitude=f"{rng.uniform(1, 3):.2f} N"),
        table("response", frequency="20 Hz"),
    )


def swept(path: Path, text: str, low: float, high: float, steps: int, *tracks: str) -> Sweep:
    """The sweep of a file over hertz."""
    path.write_text(text)
    subject = ModelSubject(read_model_file(path).model)
    values = 2.0 * math.pi * np.linspace(low, high, steps)
    return sweep.run(SweepPlan(subject, "omega", values, tracks, course=QUICK))


def ends(found: WindowEnds, *kinds: str) -> Iterator[SweptEnd]:
    for pair in found.ends:
        yield from (e for e in pair or () if not kinds or e.kind in kinds)


def leading(system: Mechanism, point: Bifurcation, size: float = 1e-7) -> Array:
    """Multipliers of the orbit at a point, by central differences of the integrated motion."""
    at = replace(system, omega=point.value)
    x, n = absolute(at, point.point.orbit.start), point.point.orbit.n
    scale = np.abs(x).max()
    duration = 2.0 * math.pi * n / point.value

    def after(k: int, sign: float) -> Array:
        y = x.copy()
        y[k] += sign * size * scale
        return integrate(at, y, duration, rtol=1e-11)[0]

    columns = [(after(k, 1.0) - after(k, -1.0)) / (2.0 * size * scale) for k in range(len(x))]
    multipliers = np.linalg.eigvals(np.column_stack(columns))
    return np.asarray(multipliers[np.argsort(-np.abs(multipliers))])


def touches(system: Mechanism, point: Bifurcation) -> tuple[int, int]:
    """Impacts in the period of the orbit at a point, with stops a little nearer and farther."""
    at = replace(system, omega=point.value)
    duration = 2.0 * math.pi * point.point.orbit.n / point.value

    def impacts(factor: float) -> int:
        gaps = [
            replace(
                gap,
                upper=tuple((place * factor, k) for place, k in gap.upper),
                lower=tuple((place * factor, k) for place, k in gap.lower),
            )
            for gap in at.gaps
        ]
        x = absolute(at, point.point.orbit.start)
        moved = replace(at, gaps=gaps)
        return len(integrate(moved, x, duration, rtol=1e-11, shorter=4.0)[1])

    return impacts(1.0 - TIP), impacts(1.0 + TIP)


def hold(system: Mechanism, point: Bifurcation) -> None:
    """A point against what the independent integrator finds there."""
    if point.kind is PointKind.GRAZING:
        near, far = touches(system, point)
        assert near != far
        return
    multipliers = leading(system, point)
    wanted = {
        PointKind.FOLD: lambda z: abs(z - 1.0),
        PointKind.PITCHFORK: lambda z: abs(z - 1.0),
        PointKind.DOUBLING: lambda z: abs(z + 1.0),
        PointKind.TORUS: lambda z: abs(abs(z) - 1.0) if abs(z.imag) > 1e-3 else math.inf,
    }[point.kind]
    assert min(map(wanted, multipliers.tolist())) < 2e-4, multipliers


def amplitude(system: Mechanism, omega: float) -> float:
    """Of the last mass of a system without stops, by its complex response."""
    impedance = np.diag(-(omega**2) * np.array(system.masses)).astype(complex)
    for links, factor in ((system.springs, 1.0), (system.dampers, 1j * omega)):
        for i, j, value in links:
            impedance[i, i] += factor * value
            if j != GROUND:
                impedance[j, j] += factor * value
                impedance[[i, j], [j, i]] -= factor * value
    return float(abs(np.linalg.solve(impedance, np.array(system.forces, dtype=complex))[-1]))


def point_of(found: WindowEnds, end: SweptEnd) -> Bifurcation:
    """The bifurcation that an end is."""
    assert end.value is not None
    same_kind = [p for p in found.points if str(p.kind) == end.kind]
    point = min(same_kind, key=lambda p: abs(p.value - (end.value or 0.0)))
    assert point.value == pytest.approx(end.value, rel=1e-7)
    return point


# ---------------------------------------------------------------------------------------------


def test_a_window_ends_between_two_steps_where_its_branch_folds() -> None:
    """The multiplier there is 1 by a difference of the period
    (tests/bifurcations/test_branch_points_independently.py has the integrator's)."""
    values = np.linspace(0.9, 0.93, 7)
    made = sweep.run(SweepPlan(ModelSubject(PAPER), "omega", values, ("up",), course=QUICK))
    found = window_ends.find(made)
    (both,) = [e for w, e in zip(made.windows, found.ends, strict=True) if w.response == "1-2-2"]
    assert both is not None
    low, high = both
    assert (low.kind, low.value) == (End.LIMIT, values[0])
    assert high.kind == "fold"
    assert high.value == pytest.approx(0.92006, abs=5e-6)


@pytest.mark.slow
def test_a_response_entered_from_chaos_ends_where_its_branch_folds() -> None:
    """Twelve steps past the last one that shows 1-2-2."""
    values = np.linspace(0.85, 1.0, 151)
    made = sweep.run(SweepPlan(ModelSubject(PAPER), "omega", values, course=QUICK))
    (window,) = [w for w in made.windows if w.response == "1-2-2"]
    assert window.high < 0.912
    found = window_ends.find(made)
    (fold,) = [p for p in found.points if p.kind is PointKind.FOLD]
    assert fold.value == pytest.approx(0.92006, abs=5e-6)
    both = found.ends[made.windows.index(window)]
    assert both is not None
    low, high = both
    assert (low.kind, low.value) == (End.LIMIT, values[0])
    assert (high.kind, high.value) == ("fold", fold.value)


@pytest.mark.slow
def test_a_hysteretic_window_ends_at_a_torus_outside_it(tmp_path: Path) -> None:
    """The beam comes down on 2-1-0 as late as 34.5 Hz, and has it up to a torus at 34.7061 Hz; up,
    it comes on 2-1-0 again at 36.5 Hz. At both ends a pair of multipliers has modulus 1."""
    made = swept(tmp_path / "beam.toml", beam(), 32.0, 40.0, 17, "up")
    found = window_ends.find(made)
    tori = list(ends(found, "torus"))
    assert tori
    system, _ = mechanism_of(tmp_path / "beam.toml", 1.0)
    for end in tori:
        hold(system, point_of(found, end))


@pytest.mark.slow
def test_an_end_that_is_not_located_is_a_row_that_says_so(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The force of a preloaded stop jumps where it is touched: the branch of 1-0-0 is lost at its
    first touch, where the free response fills the gap, and here nothing is near enough to a stop
    to be a touch."""
    monkeypatch.setattr("designer.bifurcations.points.TOUCHED", -1.0)
    path, out = tmp_path / "beam.toml", tmp_path / "out"
    path.write_text(beam(preload="0.2 N"))
    words = ["--from", "33 Hz", "--to", "45 Hz", "--steps", "13", "--periods", "200"]
    words += ["--out", str(out)]
    assert entry.status(["bifurcation", str(path), *words, "--json"]) == 0
    answer = json.loads(capfd.readouterr().out)
    rows = [p for p in answer["points"] if p["kind"] == NOT_LOCATED]
    (row,) = [p for p in rows if p["response"] == "1-0-0" and p["direction"] == -1]
    assert row["error"] is None
    assert "lost" in row["reason"]
    assert row["reason"] in row["caption"]
    system, _ = mechanism_of(path, 1.0)
    free = replace(system, gaps=[])
    assert amplitude(free, row["value"]) == pytest.approx(0.452e-3, rel=1e-4)
    assert row["value_hz"] == pytest.approx(row["value"] / (2.0 * math.pi))
    window = next(w for w in answer["windows"] if w["response"] == "1-0-0")
    keys = ("kind", "value", "value_hz", "error", "reason")
    assert [window["from_end"][k] for k in keys] == [row[k] for k in keys]
    assert window["to_end"]["kind"] == End.LIMIT
    points = list(csv.DictReader((out / "points.csv").read_text().splitlines()))
    assert [p["kind"] for p in points] == [p["kind"] for p in answer["points"]]
    lines = list(csv.DictReader((out / "windows.csv").read_text().splitlines()))
    assert [w["response"] for w in lines] == [w["response"] for w in answer["windows"]]
    assert any(w["from_end_kind"] == NOT_LOCATED for w in lines)
    in_hertz = [float(w["from_hz"]) for w in lines]
    assert in_hertz == [w["from_hz"] for w in answer["windows"]]
    assert [float(p["value_hz"]) for p in points] == [p["value_hz"] for p in answer["points"]]
    assert entry.status(["bifurcation", str(path), *words]) == 0
    shown = " ".join(capfd.readouterr().err.split())
    assert "lower end of 1-0-0 symmetric not located, known down to" in shown


@pytest.mark.slow
def test_every_end_of_a_drawn_system(tmp_path: Path) -> None:
    """Each is a point with the multipliers or the touch that its kind has, or says why not."""
    made = swept(tmp_path / "drawn.toml", drawn(2), 8.0, 40.0, 49, "down", "up")
    found = window_ends.find(made)
    system, _ = mechanism_of(tmp_path / "drawn.toml", 1.0)
    seen = set()
    for window, pair in zip(made.windows, found.ends, strict=True):
        assert (pair is None) == (not period_of(window.response))
    for end in ends(found):
        if end.kind in (window_ends.NOT_SOUGHT, End.LIMIT):
            continue
        if end.kind == NOT_LOCATED:
            assert end.reason
            assert any(m.value == end.value for m in found.missing)
            continue
        point = point_of(found, end)
        if point.value not in seen:
            hold(system, point)
        seen.add(point.value)
    assert seen


BASE_BEAM = system_text(
    {"root": "60 g", "middle": "45 g", "tip": "30 g"},
    {
        ("root", "ground"): "24 kN/m",
        ("middle", "root"): "12 kN/m",
        ("tip", "middle"): "6 kN/m",
    },
    {
        ("root", "ground"): "1.2 N s/m",
        ("middle", "root"): "0.6 N s/m",
        ("tip", "middle"): "0.3 N s/m",
    },
    clearance("stop", "tip", "ground", upper="0.6 mm", stiffness="60 kN/m"),
    '[base]\namplitude = "0.5 g"\n',
    table("response", frequency="44 Hz"),
)
"""A beam on a shaker. Right past its grazing 1-1-0 is unstable between two period doublings that
lie within one step of a branch that comes from above."""


@pytest.mark.slow
def test_stability_that_is_lost_and_had_again_within_a_step_ends_a_window(tmp_path: Path) -> None:
    made = swept(tmp_path / "beam.toml", BASE_BEAM, 37.0, 45.0, 9, "up")
    found = window_ends.find(made)
    ((low, _),) = [
        ends
        for window, ends in zip(made.windows, found.ends, strict=True)
        if window.response == "1-1-0" and ends is not None
    ]
    assert low.kind == str(PointKind.DOUBLING)
    assert low.value is not None
    hertz = low.value / (2.0 * math.pi)
    # The truth: just below it the response has twice the period.
    model = read_model_file(tmp_path / "beam.toml").model
    for step, response in ((-2e-3, "2-2-0"), (2e-3, "1-1-0")):
        flow = model_flow(model, low.value * (1.0 + step))
        assert settle(flow, np.zeros(6)).response == response, hertz
