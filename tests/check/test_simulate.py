"""``designer simulate``: what its JSON says of an orbit, its pictures, and what it refuses."""

from __future__ import annotations

import json
import math
import os
import pickle
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer import InputError, parse_model_file, read_model_file
from designer.check import simulation, synthesis_result
from designer.check.simulation import Simulated
from designer.cli import entry
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowResult
from designer.dynamics.piecewise_linear import Drive
from designer.model.model import Dimensionless
from designer.model.model_file import ModelFile
from designer.plots import simulate_plots
from designer.verbs.simulate import tables
from tests.shared.exploring import quick
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE
from tests.shared.oracles import Plain
from tests.shared.system_text import clearance, system_text, table

pytestmark = pytest.mark.usefixtures("designs_are_made_once")

BASE = "format = 1\n" + PAPER_TABLE
REQUIRED = (
    "omega response status symmetric x1_max x1_min impact_velocities multipliers lyapunov others "
    "cost"
)
ADDED = (
    "n p q start asymmetry twin impacts penetration miss extremes reason engine trust frequencies"
)
Captured = pytest.CaptureFixture[str]


def _model(folder: Path, text: str = BASE) -> str:
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def _answer(arguments: list[str], capfd: Captured, status: int = 0) -> Any:
    assert entry.status([*arguments, "--json", "-q"]) == status
    said = capfd.readouterr()
    assert said.err == ""
    return json.loads(said.out)


def _refused(arguments: list[str], capfd: Captured, *words: str) -> None:
    assert entry.status(arguments) == 2
    said = capfd.readouterr()
    assert said.out == ""
    assert "Traceback" not in said.err
    for word in words:
        assert word in said.err


def _flow(omega: float) -> Flow:
    model = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
    return Flow(model.second_order().piecewise_linear(), Drive(omega), fast=False)


# ---------------------------------------------------------------------------------------------
# JSON


@pytest.mark.parametrize("engine", quick(["model", "circuit"]))
def test_an_asymmetric_orbit(tmp_path: Path, capfd: Captured, engine: str) -> None:
    model = _model(tmp_path, BASE + COARSE_RECTIFIER.replace("E12", "E24"))
    words = ["simulate", model, "--omega", "1.43", "--engine", engine, "--starts", "2"]
    answer = _answer(words, capfd)
    (r,) = answer["responses"]
    assert set(REQUIRED.split()) | set(ADDED.split()) <= set(r)
    assert (r["response"], r["n"], r["p"], r["q"]) == ("1-1-1", 1, 1, 1)
    assert r["symmetric"] is False
    assert r["asymmetry"] > 0.1
    # The orbit, from its start, by the general kernel.
    run = _flow(1.43).run(np.array(r["start"]), 1, measure=True)
    near = {"model": 1e-9, "circuit": 3e-3}[engine]
    assert run.strobes[-1] == pytest.approx(r["start"], abs=near)
    assert list(r["extremes"]) == ["x1", "x1'", "x2", "x2'"]
    for extremes, found in zip(r["extremes"].values(), run.extremes, strict=True):
        assert extremes == pytest.approx(list(found), abs=near)
    assert r["extremes"]["x1"] == [r["x1_min"], r["x1_max"]]
    assert [i["side"] for i in r["impacts"]] == ["upper", "lower"]
    assert [i["velocity"] for i in r["impacts"]] == r["impact_velocities"]
    assert [i["time"] for i in r["impacts"]] == pytest.approx(list(run.impacts.time), abs=near)
    (inside,) = r["in_clearances"]
    assert (inside["min"], inside["max"]) == pytest.approx((r["x1_min"], r["x1_max"]), abs=near)
    for side, end, velocity in zip(
        ("upper", "lower"), (r["x1_max"], -r["x1_min"]), r["impact_velocities"], strict=True
    ):
        assert inside[side]["depth"] == pytest.approx(end - 0.25, abs=near)
        assert inside[side]["speed"] == pytest.approx(abs(velocity), abs=near)
    if engine == "model":
        assert r["penetration"] == pytest.approx(run.penetration, abs=near)
    # The twin: the mirror image, half a period on.
    half = _flow(1.43).run(np.array(r["start"]), 1, points=2).strobes[1]
    assert r["twin"]["response"] == "1-1-1"
    assert r["twin"]["start"] == pytest.approx(list(-half), abs=near)
    assert set(r["cost"]) == {"periods", "seconds"}
    assert r["cost"]["periods"] > 20
    assert r["engine"]["kernel"] in ("modal", "circuit", "general")
    assert 0.0 < r["engine"]["undecided_below"] < 1e-9
    assert answer["provenance"]["settings"]["strobe_tolerance"] == 1e-8


def test_a_symmetric_orbit_is_its_own_twin(tmp_path: Path, capfd: Captured) -> None:
    (r,) = _answer(["simulate", _model(tmp_path), "--omega", "0.85"], capfd)["responses"]
    assert r["symmetric"] is True
    assert r["twin"] is None
    (other,) = r["others"]
    assert other["response"] == "1-1-1"
    assert {"twin", "impacts", "extremes", "start"} <= set(other)
    times = [i["time"] for i in r["impacts"]]
    assert times == sorted(times)
    assert len(times) == r["p"] + r["q"] == 4
    assert times[-1] < 2.0 * math.pi / 0.85


def test_an_orbit_without_a_period(tmp_path: Path, capfd: Captured) -> None:
    words = ["simulate", _model(tmp_path), "--omega", "0.93", "--starts", "1"]
    (r,) = _answer(words, capfd)["responses"]
    assert r["response"] == r["status"] == "aperiodic"
    assert r["lyapunov"] > 0.0
    assert r["twin"] is r["penetration"] is None
    assert r["impacts"] == []
    assert r["x1_max"] > 0.25


@pytest.mark.slow
def test_a_motion_on_a_torus(tmp_path: Path, capfd: Captured) -> None:
    """What its frequencies are is in tests/dynamics/test_quasi_periodic.py."""
    free = clearance("A", "m1", "ground", upper=0.2, stiffness=8.0)
    text = system_text(
        {"m1": "1 kg", "m2": 1.4},
        {("m1", "ground"): 1.0, ("m2", "m1"): 1.3},
        {("m1", "ground"): 0.05, ("m2", "m1"): 0.05},
        free,
        table("force", on="m1", amplitude=1.0),
    )
    words = ["simulate", _model(tmp_path, text), "--omega", "1.25", "--starts", "1"]
    answer = _answer(words, capfd)
    (r,) = answer["responses"]
    assert (r["response"], r["status"], r["n"]) == ("quasi-periodic", "quasi-periodic", 0)
    assert (r["found"], r["trust"]["trusted"]) == (True, True)
    assert r["frequencies"] == pytest.approx([1.25, 0.5309084], rel=1e-6)
    hertz = [w / (2.0 * math.pi) for w in r["frequencies"]]
    assert r["frequencies_hz"] == pytest.approx(hertz, rel=1e-12)
    assert abs(r["lyapunov"]) < 4.0 * r["lyapunov_error"]
    assert [a["response"] for a in r["starts"]["attractors"]] == ["quasi-periodic"]
    tables(answer)
    said = " ".join(capfd.readouterr().err.split())
    assert "quasi-periodic with the frequencies 0.1989 Hz of the drive and 84.49669 mHz" in said


def test_without_stops(tmp_path: Path, capfd: Captured) -> None:
    model = _model(tmp_path, BASE.replace("k0 = 0.95", "k0 = 0.0"))
    out = tmp_path / "p"
    words = ["simulate", model, "--omega", "1", "--starts", "1", "--plots", str(out)]
    (r,) = _answer(words, capfd)["responses"]
    assert (r["response"], r["impacts"], r["miss"]) == ("1-0-0", [], None)
    assert len(list(out.iterdir())) == 10


def test_a_mass_that_nothing_moves(tmp_path: Path, capfd: Captured) -> None:
    """Its peak is 0, and no distance may be a share of that."""
    k, c, omega, force = 1.0, 0.2, 0.8, 0.5
    text = system_text(
        {"hammer": 1.0, "anvil": 0.7},
        {("hammer", "ground"): k, ("anvil", "ground"): 1.3},
        {("hammer", "ground"): c, ("anvil", "ground"): 0.15},
        clearance("G", "hammer", "anvil", upper=5.0, stiffness=12.0),
        table("force", on="hammer", amplitude=force),
        table("response", omega=omega),
    )
    (found,) = _answer(["simulate", _model(tmp_path, text)], capfd)["responses"]
    peak = force / abs(k - omega**2 + 1j * c * omega)
    assert found["x_max"] == pytest.approx([peak, 0.0], rel=1e-9)
    assert (found["response"], found["symmetric"], found["others"]) == ("1-0-0", True, [])
    assert [each["share"] for each in found["starts"]["attractors"]] == [1.0]


def test_chattering_ends_with_a_status(
    tmp_path: Path, capfd: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Flow.run

    def nervous(self: Flow, *arguments: Any, **more: Any) -> FlowResult:
        return run(self, *arguments, **{**more, "max_events": 2})

    monkeypatch.setattr(Flow, "run", nervous)
    model, out = _model(tmp_path), tmp_path / "p"
    answer = _answer(
        ["simulate", model, "--omega", "0.3", "--starts", "1", "--plots", str(out)], capfd, 1
    )
    (r,) = answer["responses"]
    assert r["response"] == r["status"] == "not settled"
    assert r["reason"] == "too many events"
    assert r["x1_max"] is None
    assert r["found"] is False
    assert answer["files"] == []
    assert entry.status(["simulate", model, "--omega", "0.3", "--starts", "1"]) == 1
    assert "not settled: too many events" in capfd.readouterr().err


# ---------------------------------------------------------------------------------------------
# Pictures


@pytest.mark.slow
def test_pictures(tmp_path: Path, capfd: Captured) -> None:
    model, out = _model(tmp_path), tmp_path / "far" / "p"
    arguments = ["simulate", model, "--omega", "1.43", "--omega", "0.85", "--starts", "1"]
    arguments += ["--plots", str(out)]
    files = _answer(arguments, capfd)["files"]
    wanted = {
        f"omega-{w}-{kind}.{file_format}"
        for w in ("1.43", "0.85")
        for kind in ("phase", "time", "section", "spectrum")
        for file_format in ("png", "svg")
    } | {f"omega-{w}-{k}.csv" for w in ("1.43", "0.85") for k in ("section", "spectrum")}
    assert set(files) == wanted == {p.name for p in out.iterdir()}
    for path in out.glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")
    # Black and red where there are twins, black alone where there are none.
    for kind in ("phase", "time", "section"):
        assert "#d40000" in (out / f"omega-1.43-{kind}.svg").read_text()
        plain = (out / f"omega-0.85-{kind}.svg").read_text()
        assert "#d40000" not in plain
        assert "http" not in re.sub(r'xmlns(:\w+)?="[^"]*"', "", plain)
    # The same again: refused, then replaced by equal ones; nothing else is touched.
    (out / "mine.svg").write_text("mine")
    before = {p.name: p.read_bytes() for p in out.iterdir()}
    _refused([*arguments, "-q"], capfd, "omega-1.43-phase.png", "--overwrite")
    _answer([*arguments, "--overwrite"], capfd)
    assert {p.name: p.read_bytes() for p in out.iterdir()} == before


def test_the_drawn_twin_is_the_mirror_image(tmp_path: Path) -> None:
    (found,) = simulation.simulate(parse_model_file(BASE), [1.43], traces=True)
    one, two = (t.states for t in found.traces)
    half = (len(one) - 1) // 2
    assert np.abs(two[:half] + one[half:-1]).max() < 1e-8
    figure = simulate_plots.portrait(found)
    assert len(figure.axes[0].lines) == 2 + 2 + 4  # stops, curves, impacts by side


def test_names_of_pictures() -> None:
    assert simulate_plots.names([1.43, 0.5, 1.43, 1e-3]) == (
        "omega-1.43",
        "omega-0.5",
        "omega-1.43-2",
        "omega-0.001",
    )


def test_where_pictures_cannot_go(tmp_path: Path, capfd: Captured) -> None:
    model = _model(tmp_path)
    file = tmp_path / "file"
    file.write_text("mine")
    for out in (file, file / "below", file / "far" / "below"):
        for more in ([], ["--overwrite"]):
            arguments = ["simulate", model, "--omega", "1", "--plots", str(out), "-q", *more]
            _refused(arguments, capfd, "--plots", "expected a directory")
    assert file.read_text() == "mine"
    blocked = tmp_path / "blocked"
    (blocked / "omega-1-time.svg").mkdir(parents=True)
    arguments = ["simulate", model, "--omega", "1", "--plots", str(blocked), "-q", "--overwrite"]
    _refused(arguments, capfd, "omega-1-time.svg")
    assert [p.name for p in blocked.iterdir()] == ["omega-1-time.svg"]


def test_a_directory_without_the_right_to_write(
    tmp_path: Path, capfd: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Rights do not bind the superuser, so the answer of the system is put in its mouth.
    monkeypatch.setattr(os, "access", lambda _, mode, **__: not mode & os.W_OK)
    arguments = ["simulate", _model(tmp_path), "--omega", "1", "--plots", str(tmp_path), "-q"]
    _refused(arguments, capfd, "--plots", "no right to write")


@pytest.mark.slow
def test_a_full_disk_leaves_no_half_picture(
    tmp_path: Path, capfd: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Path.write_bytes

    def full(self: Path, content: bytes) -> int:
        if "svg" in self.name:
            self.touch()
            raise OSError(28, "No space left on device")
        return write(self, content)

    model, out = _model(tmp_path), tmp_path / "p"
    monkeypatch.setattr(Path, "write_bytes", full)
    arguments = ["simulate", model, "--omega", "1.43", "--plots", str(out), "-q"]
    _refused(arguments, capfd, "--plots", "No space left")
    assert {p.name for p in out.iterdir()} == {"omega-1.43-phase.png"}


# ---------------------------------------------------------------------------------------------
# Bad input


@pytest.mark.parametrize(
    "omega", ["0", "-1", "nan", "inf", "-inf", "1e-9", "1e9", "fast", "", "1,5"]
)
def test_frequencies_that_are_none(tmp_path: Path, capfd: Captured, omega: str) -> None:
    out = tmp_path / "p"
    arguments = ["simulate", _model(tmp_path), f"--omega={omega}", "-q", "--plots", str(out)]
    _refused(arguments, capfd, "--omega")
    assert not out.exists()


def test_a_response_too_slow_to_wait_for(tmp_path: Path, capfd: Captured) -> None:
    model = _model(tmp_path, BASE + "[[response]]\nomega = 1e-7\n")
    _refused(["simulate", model, "-q"], capfd, "model.toml", "response[1].omega", "0.001")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("m", "0.0"),
        ("m", "1.0"),
        ("k", "0.0"),
        ("k0", "1.0"),
        ("k0", "-0.1"),
        ("c", "1.0"),
        ("zeta", "0.0"),
        ("zeta", "nan"),
        ("zeta", '"much"'),
        ("f20", "1.5"),
        ("b", "0.0"),
        ("b", "-0.25"),
        ("b", "inf"),
    ],
)
def test_parameters_outside_their_domain(
    tmp_path: Path, capfd: Captured, key: str, value: str
) -> None:
    text = re.sub(rf"^{key} = .*$", f"{key} = {value}", BASE, flags=re.MULTILINE)
    arguments = ["simulate", _model(tmp_path, text), "--omega", "1", "-q"]
    _refused(arguments, capfd, "model.toml", f"model.{key}", "expected")


def test_a_motion_at_any_times_is_what_an_integrator_finds() -> None:
    """DOP853 from the orbit's own start; times that are no knots, contacts among them. Of the base
    of another model the displacement is given too."""
    (found,) = simulation.simulate(parse_model_file(BASE), [0.85], starts=1)
    times = np.random.default_rng(3).uniform(0.0, 2.0 * math.pi / 0.85, 40)
    plain = Plain(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
    truth = solve_ivp(
        lambda t, y: plain.rhs(t, y, 0.85, plain.side_of(y[0])),
        (0.0, times.max()),
        found.orbit.start,
        method="DOP853",
        rtol=1e-10,
        atol=1e-12,
        max_step=0.005,
        t_eval=np.sort(times),
    ).y.T
    motion = found.motion(np.sort(times))
    assert list(motion.columns) == ["time", "x1", "x1'", "x2", "x2'"]
    assert motion[["x1", "x1'", "x2", "x2'"]].to_numpy() == pytest.approx(truth, abs=2e-6)
    whole = found.motion()
    assert len(whole) == 1025  # 1-2-2
    assert whole.iloc[-1, 1:].to_numpy() == pytest.approx(whole.iloc[0, 1:].to_numpy(), abs=1e-9)
    assert whole.x1.max() == pytest.approx(found.orbit.extremes[0, 1], abs=2e-5)
    late = found.motion([1.0 + 1e6 * 2.0 * math.pi / 0.85])
    assert late.iloc[0, 1:].to_list() == pytest.approx(found.motion([1.0]).iloc[0, 1:], abs=1e-7)
    for wrong in ([-1.0], [math.nan], [], [[0.0]], ["a"], [1j], [[1.0], [2.0, 3.0]]):
        with pytest.raises(InputError, match="times"):
            found.motion(wrong)
    with pytest.raises(InputError, match="orbit"):
        found.motion(orbit=replace(found.orbit))


def test_a_motion_without_a_period_goes_on_from_period_to_period() -> None:
    """Each lap begins where the one before ended; single times are those of all."""
    (found,) = simulation.simulate(parse_model_file(BASE), [0.93], starts=1)
    assert found.orbit.response == "aperiodic"
    times = np.linspace(0.0, 40.0, 9)
    whole = found.motion(times)
    for row, time in enumerate(times):
        assert found.motion([time]).iloc[0].to_list() == pytest.approx(whole.iloc[row].to_list())
    assert len(found.motion()) == 30 * 1024 + 1
    with pytest.raises(InputError, match="times up to"):
        found.motion([1e9])


def test_what_was_simulated_is_the_same_in_another_process() -> None:
    simulated = simulation.simulate(parse_model_file(BASE), [0.85], starts=1)
    again = pickle.loads(pickle.dumps(simulated))
    assert again[0].motion([0.3]).equals(simulated[0].motion([0.3]))


def test_a_moving_base_stands_beside_the_states_that_are_counted_from_it() -> None:
    file = Path(__file__).parents[2] / "examples" / "hammer-base.toml"
    modelfile = read_model_file(file)
    omega = modelfile.responses[0].omega
    assert omega is not None
    (found,) = simulation.simulate(modelfile, [omega], starts=1)
    motion = found.motion()
    assert motion.y.max() == pytest.approx(found.base, rel=1e-5)
    absolute = motion.x1 + motion.y
    ends = pytest.approx(tuple(found.absolute[0][0]), abs=1e-4 * found.base)
    assert (absolute.min(), absolute.max()) == ends


@cache
def gap() -> tuple[ModelFile, Simulated]:
    """A model with two attractors, and what rest leads to."""
    text = (Path(__file__).parents[2] / "examples" / "duffing-gap.toml").read_text("utf-8")
    file = parse_model_file(text)
    (rest,) = simulation.simulate(file, [0.58], starts=50)
    return file, rest


@pytest.mark.parametrize("engine", quick(["model", "circuit"]))
def test_what_is_reached_from_a_start_comes_first(engine: Any) -> None:
    """Rest leads to one of two attractors; the other one's own state leads to it."""
    file, rest = gap()
    (other,) = rest.others
    assert {rest.orbit.response, other.response} == {"1-2-2", "1-1-1"}
    made = None if engine == "model" else synthesis_result.synthesise(file)
    words: dict[str, Any] = {"starts": 1, "engine": engine, "synthesis": made}
    (found,) = simulation.simulate(file, [0.58], **words, start=other.start)
    assert found.orbit.response == other.response
    assert found.orbit.extremes == pytest.approx(other.extremes, rel=1e-2)
    assert rest.orbit.response in [o.response for o in found.others]


@pytest.mark.parametrize(
    ("start", "words"),
    [
        (["--omega", "0.85", "--start", "x3=1"], ("--start: found x3", "x1, x1', x2, x2'")),
        (["--omega", "0.85", "--start", "x1"], ("--start", "such as x1=0.2")),
        (["--omega", "0.85", "--start", "x1=1 mm"], ("--start: found 1 mm", "dimensionless")),
        (["--omega", "0.85", "--start", "x1=inf"], ("--start", "at most 1e+09")),
        (["--omega", "0.85", "--start", "x1=1e308"], ("--start", "at most 1e+09")),
        (
            ["--omega", "0.85", "--start", "x1=1", "--start", "x1=2"],
            ("found x1=2", "once"),
        ),
        (["--start", "x1=0.1"], ("--start", "--omega or --frequency too")),
    ],
)
def test_what_is_no_start_is_refused(
    tmp_path: Path, capfd: Captured, start: list[str], words: tuple[str, ...]
) -> None:
    _refused(["simulate", _model(tmp_path), *start], capfd, *words)


def test_a_start_is_stated_with_what_it_led_to(tmp_path: Path, capfd: Captured) -> None:
    arguments = ["simulate", _model(tmp_path), "--omega", "0.85", "--starts", "1"]
    answer = _answer([*arguments, "--start", "x2'=-0.5", "--start", "x1 = 0.2"], capfd)
    assert answer["provenance"]["settings"]["start"] == [0.2, 0.0, 0.0, -0.5]
    assert "start" not in _answer(arguments, capfd)["provenance"]["settings"]
