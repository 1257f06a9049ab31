"""Both ways to run ngspice, by one suite; what must fail fails; nothing lying about matters."""

from __future__ import annotations

import math
import os
import pickle
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import designer
from designer.base.errors import EnvironmentMissing
from designer.catalog.netlist_guard import check_netlist
from designer.spice import batch_backend
from designer.spice.batch_backend import BatchNgspice, program_version, read_raw
from designer.spice.pool import SpicePool
from designer.spice.shared_backend import SharedNgspice
from designer.spice.simulator import (
    Analysis,
    Backend,
    SimulationFailed,
    Simulator,
    SpiceJob,
    Waveforms,
    accept,
    offending_line,
    require_version,
)
from designer.spice.worker import open_simulator

BACKENDS: tuple[Backend, ...] = ("shared", "batch")

STEP = """RC step
V1 in 0 PULSE(0 1 0 1n 1n 1 2)
R1 in out 1k
C1 out 0 1u
.options reltol=1e-6 abstol=1e-15 vntol=1e-9
.tran 5u 5m 0 5u
.end
"""
RING = """RLC from initial conditions
L1 a 0 10m IC=0
C1 a 0 1u IC=2
R1 a 0 1k
.options reltol=1e-6 abstol=1e-15 vntol=1e-9
.tran 0.2u 1m 0 0.2u uic
.end
"""
LIMIT = """XSPICE code model
V1 a 0 SIN(0 2 1k)
R1 a 0 1k
A1 a b lim
.model lim limit(gain=2 out_lower_limit=-1 out_upper_limit=1.5 limit_range=1u fraction=FALSE)
R2 b 0 1k
.tran 2u 2m 0 2u
.end
"""
CLIP = """Arbitrary source
V1 a 0 SIN(0 2 1k)
R1 a 0 1k
B1 b 0 V=max(-1,min(1.5,2*V(a)))
R2 b 0 1k
.tran 2u 2m 0 2u
.end
"""
MODEL = """Subcircuit, parameter, function and diode
.param ohms=1k
.func twice(x) {2*x}
.subckt branch p n
R1 p n {twice(ohms)}
.ends branch
.model DX D(IS=1e-14
+ RS=1)
V1 a 0 SIN(0 2 1k)
* a comment
X1 a b branch
D1 b 0 DX
.tran 5u 2m 0 5u
.end
"""


@pytest.fixture(params=BACKENDS)
def simulator(request: pytest.FixtureRequest) -> Simulator:
    return open_simulator(request.param)


def test_rc_step_is_the_exponential(simulator: Simulator) -> None:
    waves = simulator.run(STEP, ["out", "IN", "v1#branch"], 5e-3)
    np.testing.assert_allclose(waves.signals["out"], -np.expm1(-waves.axis / 1e-3), atol=1e-5)
    assert list(waves.signals) == ["out", "IN", "v1#branch"]
    current = (waves.signals["out"] - waves.signals["IN"]) / 1e3
    np.testing.assert_allclose(waves.signals["v1#branch"], current, atol=1e-12)
    assert np.all(np.diff(waves.axis) > 0.0)
    assert waves.axis[-1] == pytest.approx(5e-3, rel=1e-9)
    assert waves.seconds > 0.0
    assert "No. of Data Rows" in waves.log


def test_initial_conditions_hold_and_rlc_rings(simulator: Simulator) -> None:
    waves = simulator.run(RING, ["a"], 1e-3)
    alpha = 1.0 / (2.0 * 1e3 * 1e-6)
    omega = math.sqrt(1.0 / (10e-3 * 1e-6) - alpha**2)
    t = waves.axis
    exact = 2.0 * np.exp(-alpha * t) * (np.cos(omega * t) - alpha / omega * np.sin(omega * t))
    np.testing.assert_allclose(waves.signals["a"], exact, atol=2e-3)


@pytest.mark.parametrize("deck", [LIMIT, CLIP], ids=["code model", "arbitrary source"])
def test_clipping(simulator: Simulator, deck: str) -> None:
    waves = simulator.run(deck, ["a", "b"], 2e-3)
    exact = np.clip(2.0 * waves.signals["a"], -1.0, 1.5)
    np.testing.assert_allclose(waves.signals["b"], exact, atol=1e-5)


LOW_PASS = """RC low pass
V1 in 0 DC 0.5 AC 2
R1 in out 1k
C1 out 0 1u
R2 out 0 3k
{analysis}
.end
"""


def test_ac_sweep_is_the_transfer_function(simulator: Simulator) -> None:
    deck = LOW_PASS.format(analysis=".ac dec 10 10 1k")
    found = simulator.run(deck, ["out", "IN"], 1e3, "ac")
    assert found.axis[[0, -1]] == pytest.approx([10.0, 1e3])
    assert len(found.axis) == 21
    exact = 2.0 * 0.75 / (1.0 + 2j * np.pi * found.axis * 750.0 * 1e-6)
    np.testing.assert_allclose(found.signals["out"], exact, rtol=1e-9)
    np.testing.assert_allclose(found.signals["IN"], 2.0, rtol=1e-12)


def test_dc_sweep_is_the_curve(simulator: Simulator) -> None:
    deck = LIMIT.replace("SIN(0 2 1k)", "DC 0").replace(".tran 2u 2m 0 2u", ".dc V1 -2 2 0.1")
    found = simulator.run(deck, ["a", "b"], 2.0, "dc")
    np.testing.assert_allclose(found.axis, np.linspace(-2.0, 2.0, 41), atol=1e-12)
    exact = np.clip(2.0 * found.signals["a"].real, -1.0, 1.5)
    np.testing.assert_allclose(found.signals["b"], exact, atol=1e-5)


@pytest.mark.parametrize(
    ("deck", "stop", "analysis", "reason"),
    [
        (LOW_PASS.format(analysis=".ac dec 10 10 1k"), 2e3, "ac", "ends at 1000 Hz, not 2000 Hz"),
        (LOW_PASS.format(analysis=".dc V1 0 1 0.1"), 2.0, "dc", "ends at 1 V, not 2 V"),
        (LOW_PASS.format(analysis=".dc V1 0 1 0.1"), 1.0, "ac", "no ac analysis"),
        (LOW_PASS.format(analysis=".ac dec 10 10 1k"), 1.0, "dc", "no dc analysis"),
        (LOW_PASS.format(analysis=".tran 1u 1m"), 1.0, "dc", "no dc analysis"),
        (LOW_PASS.format(analysis=".dc V2 0 1 0.1"), 1.0, "dc", "(?i)not in the circuit|no such"),
        (
            LOW_PASS.format(analysis=".ac dec 10 10 1k").replace("R2 out", "C2 out b 1u\nR2 out"),
            1e3,
            "ac",
            "singular matrix",
        ),
        (LOW_PASS.format(analysis=".dc V1 0 1 0.1").replace(" out ", " x "), 1.0, "dc", "no node"),
    ],
)
def test_sweeps_that_do_not_count(
    simulator: Simulator, deck: str, stop: float, analysis: Analysis, reason: str
) -> None:
    with pytest.raises(SimulationFailed, match=reason):
        simulator.run(deck, ["out"], stop, analysis)


@pytest.mark.parametrize(
    ("deck", "node", "stop"),
    [
        (STEP, "out", 5e-3),
        (RING, "a", 1e-3),
        (LIMIT, "b", 2e-3),
        (CLIP, "b", 2e-3),
        (MODEL, "b", 2e-3),
        (STEP.replace(".end\n", ".save v(out)\n.end"), "out", 5e-3),
    ],
    ids=["step", "ring", "limit", "clip", "model", "save"],
)
def test_both_give_the_same(deck: str, node: str, stop: float) -> None:
    shared, batch = (open_simulator(b).run(deck, [node], stop) for b in BACKENDS)
    np.testing.assert_allclose(shared.axis, batch.axis, rtol=1e-12)
    np.testing.assert_allclose(shared.signals[node], batch.signals[node], rtol=1e-9, atol=1e-12)


# ---------------------------------------------------------------------------------------------
# What must not count


def last_time(waves: Waveforms) -> float:
    return float(waves.axis[-1])


@pytest.fixture(scope="module", params=BACKENDS)
def pool(request: pytest.FixtureRequest) -> Iterator[SpicePool]:
    with SpicePool(1, request.param) as pool:
        yield pool


def test_an_undefined_parameter_ends_the_session(pool: SpicePool) -> None:
    """ngspice wants to exit; the worker takes no other job, the next one gets a new worker."""
    deck = STEP.replace("R1 in out 1k", "R1 in out {nosuch}")
    jobs = [SpiceJob(d, ("out",), 5e-3, last_time) for d in (deck, STEP, deck, STEP)]
    results = dict(pool.map(jobs))
    for i in (0, 2):
        failure = results[i]
        assert isinstance(failure, SimulationFailed)
        assert failure.reason == "ngspice said: Undefined parameter [nosuch]"
    assert results[1] == results[3] == pytest.approx(5e-3)


FLOATING = """Floating node between capacitors
V1 a 0 SIN(0 1 1k)
C1 a b 1u
C2 b 0 1u
.tran 10u 5m 0 10u
.end
"""
STIFF = """No operating point, no step small enough
V1 a 0 SIN(0 1 1k)
R1 a b 1k
B1 b 0 I=V(b)>0.5 ? -1e6*V(b) : 1e6*(1-V(b))
C1 b 0 1p
.tran 10u 5m 0 10u
.end
"""
LATE = """Fails on the way
V1 a 0 SIN(0 1 1k)
B1 b 0 V=sqrt(V(a))
R1 b 0 1k
.tran 10u 5m 0 10u
.end
"""


@pytest.mark.parametrize(
    ("deck", "reason"),
    [
        (FLOATING, "singular matrix"),
        (STIFF, "source stepping failed"),
        (LATE, "out of range for sqrt"),
        (STEP.replace("R1 in out 1k", "R1 in out 1k foo=bar"), "Undefined parameter"),
        (STEP.replace("R1 in out 1k", "R1 in out {1k"), "(?i)error"),
        (STEP.replace("R1 in out 1k", "R1 in out 1k\nR1 in out 2k"), "(?i)error"),
        (STEP.replace("R1 in out 1k", "R1 out"), "(?i)warning"),
        (STEP.replace("C1 out 0 1u", "D1 out 0 NOSUCH"), "can't find model 'nosuch'"),
        (STEP.replace("C1 out 0 1u", "X1 out 0 NOSUCH"), "unknown subckt"),
        (STEP.replace("V1 in 0 PULSE(0 1 0 1n 1n 1 2)", "V1 in 0 PULS"), "."),
        (STEP.replace("V1 in", "V2 in 0 3\nV1 in"), "singular matrix"),
        (STEP.replace(".tran 5u 5m 0 5u", ".tran 5u 4.9m 0 5u"), "ends at 0.0049 s, not 0.005 s"),
        (STEP.replace(".tran 5u 5m 0 5u", ".tran 5u"), "(?i)error"),
        (STEP.replace(".tran 5u 5m 0 5u\n", ""), "No job|no transient analysis"),
        (STEP.replace(".tran 5u 5m 0 5u\n", ".dc V1 0 1 0.1\n"), "no transient analysis"),
        (STEP.replace(".tran 5u 5m 0 5u\n", ".ac dec 10 1 1k\n"), "no transient analysis"),
        (STEP.replace(" out ", " other "), "no node 'out'"),
        (STEP.replace(".end\n", ".save v(in)\n.end"), "no node 'out'"),
    ],
)
def test_runs_that_do_not_count(pool: SpicePool, deck: str, reason: str) -> None:
    # In a worker, for some of these decks leave libngspice with a corrupt heap.
    node = "out" if deck.startswith("RC step") else "b"
    jobs = [SpiceJob(deck, (node,), 5e-3, last_time), SpiceJob(STEP, ("out",), 5e-3, last_time)]
    results = dict(pool.map(jobs))
    failure = results[0]
    assert isinstance(failure, SimulationFailed)
    assert re.search(reason, failure.reason)
    assert failure.log
    assert results[1] == pytest.approx(5e-3)  # the next run is none the worse for it


def test_floating_node_looks_normal_but_for_the_log(tmp_path: Path) -> None:
    """Why the log is read: exit status 0, a full time vector, finite values."""
    (tmp_path / "deck.cir").write_text(FLOATING)
    done = subprocess.run(
        ["ngspice", "-n", "-b", "-r", "deck.raw", "deck.cir"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "singular matrix" in done.stderr
    (plot,) = read_raw((tmp_path / "deck.raw").read_bytes())
    accept(plot.vectors, ["b"], 5e-3, "", 0.0)


def test_acceptance_of_vectors() -> None:
    time = np.array([0.0, 1.0, 2.0])
    fine = {"time": time, "a": np.zeros(3)}
    assert accept(fine, ["A"], 2.0, "", 0.5).seconds == 0.5
    accept(fine, ["a"], 2.0 + 1e-10, "", 0.0)
    bad = [
        ({"a": time}, "no transient"),
        ({"time": time[:0]}, "no transient"),
        ({"time": np.array([0.0, 1.0, 1.0, 2.0])}, "does not increase"),
        ({"time": np.array([0.0, np.nan, 2.0])}, "does not increase"),
        ({"time": time[:2]}, "ends at 1 s, not 2 s"),
        ({"time": time, "a": np.array([0.0, np.inf, 0.0])}, "not finite"),
        ({"time": time, "a": np.array([0.0, np.nan, 0.0])}, "not finite"),
        ({"time": time, "a": np.zeros(2)}, "not finite"),
        ({"time": time, "b": time}, "no node 'a'"),
    ]
    for vectors, reason in bad:
        with pytest.raises(SimulationFailed, match=reason):
            accept(vectors, ["a"], 2.0, "", 0.0)


@pytest.mark.parametrize(
    ("log", "found"),
    [
        ("Note: No compatibility mode selected!", None),
        ("Reducing trtol to 1 for xspice 'A' devices", None),
        ("Circuit: error amplifier\n error_1        0.5\nwarning      -1.2e-05", None),
        ("Trying gmin =   1.0000E-03 Warning: Further gmin increment", None),
        ("Warning: Dynamic gmin stepping failed\nWarning: True gmin stepping failed", None),
        ("Warning: source stepping failed", "Warning: source stepping failed"),
        (
            "Trying gmin = 1E-03 Warning: singular matrix:  check node b",
            "Trying gmin = 1E-03 Warning: singular matrix:  check node b",
        ),
        ("fine\n  doAnalyses: TRAN:  stopped ", "doAnalyses: TRAN:  stopped"),
        ("Note: v1: has no value, DC 0 assumed", "Note: v1: has no value, DC 0 assumed"),
        ("Undefined parameter [f]", "Undefined parameter [f]"),
        ("TIMESTEP TOO SMALL", "TIMESTEP TOO SMALL"),
    ],
)
def test_what_in_a_log_is_an_offence(log: str, found: str | None) -> None:
    assert offending_line(log) == found


def test_names_in_the_deck_are_no_offence(simulator: Simulator) -> None:
    deck = STEP.replace("RC step", "an error amplifier").replace(" out ", " error ")
    assert simulator.run(deck, ["error"], 5e-3).signals["error"][-1] > 0.9


def test_failures_survive_pickling() -> None:
    failure = SimulationFailed("why", "log")
    copy = pickle.loads(pickle.dumps(failure))
    assert (copy.reason, copy.log, str(copy)) == ("why", "log", "why")
    assert copy.exit_status == 1
    long = pickle.loads(pickle.dumps(SimulationFailed("why", "x" * 1_000_000)))
    assert len(long.log) < 30_000


# ---------------------------------------------------------------------------------------------
# What may reach ngspice


@pytest.mark.parametrize("deck", [STEP, RING, LIMIT, CLIP, MODEL, FLOATING, STIFF, LATE])
def test_good_decks_pass(deck: str) -> None:
    check_netlist(deck)
    check_netlist(deck.replace("\nR1", "\n\n   \n\t* indented\n  R1") + "\n \n")


@pytest.mark.parametrize(
    "line",
    [
        ".control",
        "  .CONTROL",
        "\t.control",
        ".endc",
        ".include other.cir",
        ".inc other.cir",
        ".lib 'models.lib'",
        ".meas tran x max v(out)",
        ".print tran v(out)",
        ".modelx m D",
        ".ends_",
        "*# shell touch planted",
        "  *#shell touch planted",
        "*ng_script",
        "R2 out 0 `touch planted`",
        "R2 out 0 $HOME",
        "R2 out 0 1k ; hidden",
        "R2 out 0 1k \\\\",
        "R2 out 0 1k\r",
        "R2 out 0 1k\x0b.control",
        "R2 out 0 1k\x00",
        "R2 out 0 1k\u2028.control",
        "R2 out 0 1kΩ",
        "! ls",
        "1R out 0 1k",
        "R",
        "+ 3",
        '.model fs filesource(file="/etc/passwd")',
        ".model fs filesource(file=secret)",
        ".model fs\n+ filesource(file=secret)",
        ".MODEL fs FileSource (file=secret)",
        ".model p d_process(process_file=sh)",
        ".model p d_cosim(simulation=evil)",
        ".model t table2D(file=secret)",
        ".model x",
        ".model x {kind}(a=1)",
        ".model x akO:DX D(is=1)",
    ],
)
def test_other_decks_are_refused(simulator: Simulator, line: str) -> None:
    deck = STEP.replace("V1 in", f"{line}\nV1 in")
    with pytest.raises(ValueError, match=r"netlist: line 2 is refused"):
        check_netlist(deck)
    with pytest.raises(ValueError, match=r"netlist: line 2 is refused"):
        simulator.run(deck, ["out"], 5e-3)


@pytest.mark.parametrize(
    ("deck", "where"),
    [
        ("", "line 1"),
        ("\n" + STEP, "line 1"),
        ("*ng_script\n" + STEP, "line 1"),
        ("*ng_script_with_params\n" + STEP, "line 1"),
        ("*# shell ls\n" + STEP, "line 1"),
        (".control\nshell ls\n.endc\n" + STEP, "line 1"),
        (STEP.replace(".end\n", ""), "no .end line"),
        (STEP + ".control\nshell ls\n.endc\n", r"line 8 .*text after .end \(line 7\)"),
        (STEP + "* more\n", "line 8"),
        ("title\n* comment\n+ .control\n.end", "line 3"),
    ],
)
def test_the_frame_of_a_deck(deck: str, where: str) -> None:
    with pytest.raises(ValueError, match=where):
        check_netlist(deck)


def test_ngspice_would_execute_such_comments(tmp_path: Path) -> None:
    """Why ``*#`` is refused."""
    deck = STEP.replace("V1 in", "*# shell touch planted\nV1 in")
    (tmp_path / "deck.cir").write_text(deck)
    subprocess.run(
        ["ngspice", "-n", "-b", "-r", "x", "deck.cir"], cwd=tmp_path, capture_output=True
    )
    assert (tmp_path / "planted").exists()


# ---------------------------------------------------------------------------------------------
# Settings lying about

_PRINT_RESULT = """
import sys
from designer.spice.worker import open_simulator
waves = open_simulator(sys.argv[1]).run(sys.stdin.read(), ["b"], 2e-3)
print(waves.axis.size, waves.axis.sum().hex(), waves.signals["b"].sum().hex())
"""
_COMMANDS = "option trtol=1 reltol=0.5 method=gear\nset interp\nshell touch planted\necho planted\n"


def _result(backend: Backend, cwd: Path, environment: dict[str, str]) -> str:
    root = str(Path(designer.__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", _PRINT_RESULT, backend],
        input=LIMIT,
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": root, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


@pytest.mark.parametrize("backend", BACKENDS)
def test_hostile_settings_change_nothing(tmp_path: Path, backend: Backend) -> None:
    clean, hostile = tmp_path / "clean", tmp_path / "hostile"
    clean.mkdir()
    hostile.mkdir()
    for name in (".spiceinit", "spinit", "spice.rc"):
        (hostile / name).write_text(_COMMANDS)
    # the file does harm where nothing keeps it out
    (hostile / "deck.cir").write_text(LIMIT)
    subprocess.run(["ngspice", "-b", "-r", "x", "deck.cir"], cwd=hostile, capture_output=True)
    assert (hostile / "planted").exists()
    (hostile / "planted").unlink()

    expected = _result(backend, clean, {})
    variables = ("HOME", "SPICE_USERINIT_DIR", "SPICE_SCRIPTS", "SPICE_LIB_DIR")
    settings = {name: str(hostile) for name in variables} | {"SPICE_ASCIIRAWFILE": "1"}
    assert _result(backend, hostile, settings) == expected
    assert not (hostile / "planted").exists()
    assert list(clean.iterdir()) == []


def test_a_session_leaves_the_process_where_it_was() -> None:
    folder, home = Path.cwd(), os.environ.get("HOME")
    open_simulator("shared")
    assert Path.cwd() == folder
    assert os.environ.get("HOME") == home


# ---------------------------------------------------------------------------------------------
# The session


def test_one_session_a_process() -> None:
    session = open_simulator("shared")
    assert open_simulator("shared") is session
    with pytest.raises(RuntimeError, match="has an ngspice session already"):
        SharedNgspice()
    session.run(STEP, ["out"], 5e-3)


def test_nothing_is_left_from_run_to_run() -> None:
    session = open_simulator("shared")
    before = session.run(RING, ["a"], 1e-3)
    heat = RING.replace(
        ".options reltol=1e-6",
        ".param q=3\n.temp 90\n.save v(a)\n.options method=gear trtol=50 reltol=0.1",
    )
    other = session.run(heat, ["a"], 1e-3)
    assert not np.array_equal(other.signals["a"], before.signals["a"])
    for deck in (FLOATING, STIFF, MODEL.replace("DX D", "DY D")):
        with pytest.raises(SimulationFailed):
            session.run(deck, ["b"], 2e-3)
    after = session.run(RING, ["a"], 1e-3)
    np.testing.assert_array_equal(after.axis, before.axis)
    np.testing.assert_array_equal(after.signals["a"], before.signals["a"])


def _resident_megabytes() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def test_memory_stays_flat() -> None:
    session = open_simulator("shared")
    for _ in range(20):
        session.run(STEP, ["out"], 5e-3)
    before = _resident_megabytes()
    for _ in range(200):
        session.run(STEP, ["out"], 5e-3)
    # kept plots would be 200 runs × 1000 points × 4 vectors × 8 bytes = 6.4 MB and more
    assert _resident_megabytes() - before < 3.0


# ---------------------------------------------------------------------------------------------
# What is installed


def test_versions_agree() -> None:
    assert program_version() == open_simulator("batch").version
    assert int(program_version().split(".")[0]) == int(open_simulator("shared").version)
    assert [open_simulator(b).name for b in BACKENDS] == ["ngspice-shared", "ngspice-batch"]
    assert require_version("36") == "36"
    for old in ("35", "", "new"):
        with pytest.raises(EnvironmentMissing, match="install"):
            require_version(old)
    with pytest.raises(ValueError, match="backend"):
        open_simulator("other")  # type: ignore[arg-type]


def test_missing_program_is_said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    for attempt in (BatchNgspice, program_version):
        with pytest.raises(EnvironmentMissing, match=r"install .* ngspice"):
            attempt()
    old = tmp_path / "ngspice"
    old.write_text("#!/bin/sh\necho '** ngspice-34 : Circuit level simulation program'\n")
    old.chmod(0o755)
    with pytest.raises(EnvironmentMissing, match="ngspice 34 found"):
        BatchNgspice()
    batch_backend._version_of.cache_clear()


def test_missing_library_is_said(tmp_path: Path) -> None:
    script = """
import ctypes.util, os
from designer.base.errors import EnvironmentMissing
from designer.spice.worker import open_simulator
for how in ("nowhere", "unloadable"):
    if how == "nowhere":
        ctypes.util.find_library, find = (lambda name: None), ctypes.util.find_library
    else:
        ctypes.util.find_library = find
        os.environ["NGSPICE_LIBRARY_PATH"] = os.devnull
    try:
        open_simulator("shared")
    except EnvironmentMissing as error:
        assert "libngspice" in str(error) and "install" in str(error)
        print(how)
"""
    root = str(Path(designer.__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": root},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.split() == ["nowhere", "unloadable"], done.stderr


# ---------------------------------------------------------------------------------------------
# The raw file

_HEADER = (
    "Title: t\nDate: today\nPlotname: Transient Analysis\nFlags: real\n"
    "No. Variables: 2\nNo. Points: 3       \nVariables:\n"
    "\t0\ttime\ttime\n\t1\tv(A)\tvoltage\nBinary:\n"
)


def test_raw_file() -> None:
    data = np.arange(6.0).tobytes()
    complex_header = _HEADER.replace("Flags: real", "Flags: complex").replace("Transient", "AC")
    content = complex_header.encode() + data + data + _HEADER.encode() + data
    ac, plot = read_raw(content)
    assert ac.name == "AC Analysis"
    np.testing.assert_array_equal(ac.vectors["a"], [2.0 + 3.0j, 0.0 + 1.0j, 4.0 + 5.0j])
    assert plot.name == "Transient Analysis"
    assert list(plot.vectors) == ["time", "a"]
    np.testing.assert_array_equal(plot.vectors["a"], [1.0, 3.0, 5.0])
    assert read_raw(b"") == []


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (_HEADER.encode() + bytes(47), "cut short"),
        (_HEADER.encode() + bytes(48) + b"more", "no binary data"),
        (b"what is this", "no binary data"),
        (_HEADER.replace("No. Points: 3", "No. Points: x").encode() + bytes(48), "bad header"),
        (_HEADER.replace("Flags: real\n", "").encode() + bytes(48), "bad header"),
        (_HEADER.replace("s: 2", "s: 3").encode() + bytes(72), "3 variables announced, 2 named"),
        (_HEADER.replace("s: 3", "s: -3").encode() + bytes(48), "-3|announced"),
    ],
)
def test_bad_raw_files(content: bytes, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        read_raw(content)
