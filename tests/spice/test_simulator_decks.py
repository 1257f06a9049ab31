"""Decks for other simulators: the same responses and waves as circuit.cir, in ngspice."""

from __future__ import annotations

import json
import re
import subprocess
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from designer.base.defaults import DIALECTS, Dialect
from designer.check.deck_runs import response_runs
from designer.check.synthesis_result import Synthesis
from designer.circuit.board_values import nominal_board
from designer.circuit.nominal import nominal_reduction, on_circuit
from designer.folders import design_files
from designer.jobs.export_job import deck_text
from designer.model.find_responses import find
from designer.model.response_table import Response
from designer.spice import numerics_gate, simulator_decks
from designer.spice.read_orbit import read
from designer.spice.simulator import Waveforms
from designer.spice.worker import open_simulator
from tests.folders.test_stage_files import made
from tests.jobs.test_kicad_export import MODEL, designer, snapshot

WAVE_BOUND = 1e-3
"""Root mean square of the difference, of each state's peak: what docs/ngspice.md states."""
PERIODS = 8
CASES = ("saturation, upper", "rectifier")


@cache
def design(name: str) -> Synthesis:
    """With two responses, the second one wanted at another frequency."""
    with TemporaryDirectory() as place:
        one = made(name, Path(place))
    (first,) = one.model_responses
    wanted = [Response(first.omega), Response(1.1 * first.omega)]
    return replace(one, model_responses=find(one.design.model, wanted))


def switched(deck: str, number: int) -> str:
    """The deck with this response on and the others off, as its comment says."""
    out, block = [], 0
    for line in deck.splitlines():
        head = re.match(r"\* Response (\d+) of", line)
        block = int(head[1]) if head else block
        if head is None and block and line != ".end":
            bare = line.removeprefix("*")
            line = bare if block == number else f"*{bare}"
        out.append(line)
    return "\n".join(out) + "\n"


def waves(deck: str, made: Synthesis, stop: float) -> Waveforms:
    """What ngspice makes of a deck; a shorter run, and every net that it shows is kept."""
    deck = re.sub(r"(?m)^\.print tran ", ".save ", deck)
    deck = re.sub(r"(?m)^\.tran (\S+) \S+", rf".tran \1 {stop!r}", deck)
    circuit = made.design.circuit
    nets = (*circuit.state_nets, circuit.generator.net)
    return open_simulator("batch").run(deck, nets, stop)


@cache
def by_circuit_cir(name: str, number: int) -> Waveforms:
    """circuit.cir with the response's generator and start, at the same step."""
    chosen = alone(name, number)
    run = response_runs(chosen)[0]
    deck = design_files.circuit_deck(chosen)
    deck = re.sub(r"(?m)^\.print .*\n", "", deck)
    step = repr(run.settings.max_step)
    deck = re.sub(r"(?m)^\.tran \S+ (\S+) 0 \S+", rf".tran {step} \1 0 {step}", deck)
    return waves(deck.replace("reltol=0.0001", "reltol=1e-05"), chosen, stop_of(name, number))


def alone(name: str, number: int) -> Synthesis:
    whole = design(name)
    return replace(whole, model_responses=(whole.model_responses[number - 1],))


def stop_of(name: str, number: int) -> float:
    return PERIODS / response_runs(design(name))[number - 1].excitation.frequency


def named(name: str, number: int, found: Waveforms) -> str:
    """n-p-q of a wave, by what reads those of circuit.cir."""
    whole = design(name)
    run = response_runs(whole)[number - 1]
    reduction = nominal_reduction(whole.design)
    orbit = on_circuit(reduction.system(), whole.design, whole.model_responses[number - 1])
    subject = numerics_gate.GateSubject(reduction, run.excitation, orbit)
    reduce = numerics_gate.job(subject, run.settings).reduce
    assert isinstance(reduce, partial)
    # Of the op-amps' outputs these decks save the states alone.
    answer = read(found, replace(reduce.keywords["reading"], outputs=()))
    assert answer.orbit.response == orbit.response
    return str(answer.orbit.response)


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("dialect", DIALECTS)
@pytest.mark.parametrize("name", CASES)
def test_the_deck_shows_what_circuit_cir_shows(name: str, dialect: Dialect, number: int) -> None:
    stop = stop_of(name, number)
    ours = by_circuit_cir(name, number)
    theirs = waves(switched(deck_text(design(name), dialect), number), design(name), stop)
    assert named(name, number, theirs) == named(name, number, ours)
    grid = np.linspace(0.0, stop, 10_001)
    for net in design(name).design.circuit.state_nets:
        x, y = (np.interp(grid, w.axis, w.signals[net]) for w in (ours, theirs))
        assert np.sqrt(np.mean((x - y) ** 2)) < WAVE_BOUND * np.abs(x).max(), net


@pytest.mark.parametrize("name", CASES)
def test_the_portable_deck_has_nothing_that_simulators_do_not_share(name: str) -> None:
    lines = deck_text(design(name), "portable").splitlines()
    assert lines[-1] == ".end"
    kinds = {line[0] for line in lines[:-1] if line[0] not in "*."}
    assert kinds <= set("RCDVIEG")
    assert {line.split()[0] for line in lines if line[0] == "."} == {
        ".model", ".options", ".print", ".tran", ".end",
    }  # fmt: skip
    for line in lines:
        assert not line.startswith("+")
        assert line.isascii()
        assert not set(line) & set("{}'\"$;`")
        assert re.match(r"\*|\.|\w+ ", line)
    sine = next(line for line in lines if line.startswith("VM1"))
    assert re.search(r"SIN\(\S+ -\S+ \S+\)$", sine), "no phase: the amplitude is negative"


def test_every_response_is_in_the_deck_and_one_is_on() -> None:
    whole = design("rectifier")
    for dialect in DIALECTS:
        deck = deck_text(whole, dialect)
        for mark, count in (("VM1 ", 2), ("C1 ", 2), (".tran ", 2)):
            lines = [line for line in deck.splitlines() if line.lstrip("*").startswith(mark)]
            assert len(lines) == count
            assert [line.startswith("*") for line in lines] == [False, True]
        runs = response_runs(whole)
        for run in runs:
            assert f"{run.excitation.frequency!r})" in deck
        assert runs[0].excitation.frequency != runs[1].excitation.frequency
        assert switched(deck, 1) == deck


@pytest.mark.parametrize(
    ("dialect", "mode"), [("ltspice", "ltps"), ("ltspice", "lt"), ("portable", "")]
)
def test_the_deck_as_it_is_runs_in_the_plain_program(
    dialect: Dialect, mode: str, tmp_path: Path
) -> None:
    (tmp_path / ".spiceinit").write_text(f"set ngbehavior={mode}\n" if mode else "")
    (tmp_path / "deck.cir").write_text(deck_text(design("rectifier"), dialect))
    done = subprocess.run(
        ["ngspice", "-b", "-r", "out.raw", "deck.cir"],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    head = (tmp_path / "out.raw").read_bytes().split(b"Binary:")[0].decode("ascii", "replace")
    points = re.search(r"No\. Points: (\d+)", head)
    assert points is not None
    assert int(points[1]) > 1000
    assert "v(fv)" in head


def test_circuit_cir_says_what_it_is_for_and_what_it_holds() -> None:
    whole = design("rectifier")
    lines = design_files.circuit_deck(whole).splitlines()
    first = next(i for i, line in enumerate(lines) if not line.startswith("*"))
    assert lines[first].startswith("VM1 vg 0 SIN(")
    head = " ".join(line[2:] for line in lines[:first])
    frequency = response_runs(whole)[0].excitation.frequency
    for words in (
        "ngspice", "XSPICE", "limit", whole.design.circuit.opamp, "dead zone: rectifier",
        "number 1 of 2", "omega 1.55", f"{frequency:.6g} Hz", "v1 x1, v2 dx1/dt, v3 x2, v4 dx2/dt",
        "fv output", "setup.csv", "IC=", "designer export DIR --deck", "circuit-ltspice.cir",
    ):  # fmt: skip
        assert words in head, words
    assert "the model file wants none" in design_files.circuit_deck(
        replace(whole, model_responses=())
    )


@pytest.mark.parametrize("dialect", DIALECTS)
def test_foreign_text_stays_in_its_comment(dialect: Dialect) -> None:
    whole = design("rectifier")
    hostile = "x\n.include /etc/passwd\n*ng_script `id` ${HOME} ; {x}"
    circuit = replace(whole.design.circuit, opamp=hostile)
    changed = replace(
        whole,
        modelfile=replace(whole.modelfile, title=hostile),
        design=replace(whole.design, circuit=circuit),
    )
    plain = deck_text(whole, dialect).splitlines()
    deck = deck_text(changed, dialect).splitlines()
    assert len(deck) == len(plain)
    differ = [line for line, other in zip(deck, plain, strict=True) if line != other]
    assert all(line.startswith("* ") and not set(line) & set("`${};") for line in differ)
    assert 1 <= len(differ) <= 2


def test_a_rail_that_nothing_uses_has_a_load() -> None:
    lines = deck_text(design("rectifier"), "portable").splitlines()
    for rail in ("vcc", "vee"):
        assert sum(f" {rail} " in line for line in lines if line[0] not in "*.") >= 2


def test_offsets_and_unequal_limits_reach_both_decks(monkeypatch: pytest.MonkeyPatch) -> None:
    """The decks are of the nominal board; were it to have offsets, both would have them."""
    whole = design("saturation, upper")
    circuit = whole.design.circuit
    nominal = nominal_board(circuit)
    name = circuit.sections[0].name
    board = replace(
        nominal,
        offset={**nominal.offset, name: 5e-3},
        rails={**nominal.rails, name: (-12.0, 13.5)},
    )
    monkeypatch.setattr(simulator_decks, "nominal_board", lambda circuit: board)
    stop = stop_of("saturation, upper", 1)
    found = [waves(deck_text(whole, dialect), whole, stop) for dialect in DIALECTS]
    net = circuit.state_nets[0]
    grid = np.linspace(0.0, stop, 2001)
    one, other = (np.interp(grid, w.axis, w.signals[net]) for w in found)
    before = by_circuit_cir("saturation, upper", 1)
    nominal_wave = np.interp(grid, before.axis, before.signals[net])
    moved = np.sqrt(np.mean((one - nominal_wave) ** 2))
    assert moved > 3e-3
    assert np.sqrt(np.mean((one - other) ** 2)) < 1e-2 * moved


# ---------------------------------------------------------------------------------------------
# The verb


@pytest.mark.slow
def test_export_writes_a_deck_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "pair.toml").write_text(MODEL, encoding="utf-8")
    folder = tmp_path / "design"
    done = designer(
        "export", tmp_path / "pair.toml", "--out", folder, "--deck", "portable", "--json"
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["files"] == ["circuit-portable.cir"]
    before = snapshot(folder)
    deck = folder / "circuit-portable.cir"
    assert deck.read_text().startswith("* title: Linear pair\n")
    # The other one comes beside it.
    assert designer("export", folder, "--deck", "ltspice", "-q").returncode == 0
    after = snapshot(folder)
    new = {Path(name).name for name in after.keys() - before.keys()}
    assert new == {"circuit-ltspice.cir"}
    assert {Path(n).name for n in before if before[n] != after[n]} == {"manifest.json"}
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["complete"]
    assert manifest["files"]["circuit-portable.cir"]["stage"] == "deck-portable"
    assert manifest["files"]["circuit-ltspice.cir"]["stage"] == "deck-ltspice"
    # Once more: nothing changes. What somebody has changed is not replaced without a word.
    both = ("export", folder, "--deck", "portable", "--deck", "ltspice")
    assert designer(*both, "-q").returncode == 0
    assert snapshot(folder) == after
    deck.write_text("mine")
    refused = designer(*both)
    assert refused.returncode == 2
    assert "circuit-portable.cir" in refused.stderr
    assert deck.read_text() == "mine"
    assert designer(*both, "--overwrite", "-q").returncode == 0
    assert snapshot(folder) == after
    wrong = designer("export", folder, "--deck", "pspice")
    assert wrong.returncode == 2
    assert "pspice" in wrong.stderr
    assert snapshot(folder) == after
