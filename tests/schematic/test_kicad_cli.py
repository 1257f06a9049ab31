"""The project as KiCad 9 sees it: electrical rules, netlists, design rules, parity, SPICE."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from designer.board.sexpr import read
from designer.check import checked_design
from designer.check.deck_runs import FirstRun
from designer.circuit import nominal
from designer.circuit.board_values import nominal_board
from designer.dynamics.orbit import Orbit
from designer.schematic.kicad_project import files
from designer.spice import deck, numerics_gate
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import Read
from designer.spice.simulator import SpiceJob
from tests.shared.kicad_cases import CASES, case, case_files, kicad, project, written
from tests.shared.paper_cases import OMEGA, synthesised

pytestmark = pytest.mark.kicad

Netlist = dict[str, set[tuple[str, str]]]
Parts = dict[str, tuple[str, str, frozenset[str]]]


def one(folder: Path, ending: str) -> str:
    """Name of the project's file of this kind."""
    (found,) = folder.glob(f"*{ending}")
    return found.name


def electrical(folder: Path) -> list[str]:
    """What the electrical rule check finds."""
    done = kicad(
        folder, "sch", "erc", "--severity-all", "--exit-code-violations", "--format", "json",
        "-o", "erc.json", one(folder, ".kicad_sch"),
    )  # fmt: skip
    found = json.loads((folder / "erc.json").read_text())
    out = [v["type"] for sheet in found["sheets"] for v in sheet["violations"]]
    assert done.returncode == (5 if out else 0), done.stderr
    return out


def design(folder: Path) -> tuple[list[str], list[str], int]:
    """What the design rule check finds: violations, parity issues, number of open connections."""
    kicad(
        folder, "pcb", "drc", "--severity-all", "--schematic-parity", "--format", "json",
        "-o", "drc.json", one(folder, ".kicad_pcb"),
    )  # fmt: skip
    found = json.loads((folder / "drc.json").read_text())
    return (
        [v["type"] for v in found["violations"]],
        [v["type"] for v in found["schematic_parity"]],
        len(found["unconnected_items"]),
    )


def netlist(text: str) -> tuple[Parts, Netlist]:
    """Components and nets of a ``.net`` file."""
    tree = read(text)
    parts = {
        c.get("ref").text(0): (
            c.get("value").text(0),
            c.get("footprint").text(0),
            frozenset(c.get("tstamps").atoms),
        )
        for c in tree.get("components").all("comp")
    }
    nets = {
        n.get("name").text(0): {
            (node.get("ref").text(0), node.get("pin").text(0)) for node in n.all("node")
        }
        for n in tree.get("nets").all("net")
    }
    return parts, nets


@pytest.mark.parametrize("name", CASES)
def test_kicad_finds_nothing_wrong_and_the_same_nets(name: str, tmp_path: Path) -> None:
    folder = written(case_files(name), tmp_path)
    assert electrical(folder) == []
    ours = (folder / one(folder, ".net")).read_text()
    kicad(folder, "sch", "export", "netlist", "-o", "theirs.xnet", one(folder, ".kicad_sch"))
    (parts, nets), (their_parts, their_nets) = (
        netlist(ours),
        netlist((folder / "theirs.xnet").read_text()),
    )
    assert nets == their_nets
    assert parts.keys() == their_parts.keys()
    for reference, (value, footprint, ids) in parts.items():
        assert their_parts[reference][:2] == (value, footprint)
        assert ids <= their_parts[reference][2]
    violations, parity, unconnected = design(folder)
    assert violations == []
    assert parity == []
    board = read((folder / one(folder, ".kicad_pcb")).read_text())
    pads = Counter(
        pad.get("net").text(1)
        for footprint in board.all("footprint")
        for pad in footprint.all("pad")
        if pad.find("net") is not None
    )
    assert pads.keys() == {name for name, joined in nets.items() if joined}
    assert unconnected == pads.total() - len(pads), (
        "nothing is routed: every pad but the first of each net"
    )


def test_the_checks_see_what_is_wrong(tmp_path: Path) -> None:
    """The same project with one wire less, a pad on another net, two parts on one another."""
    made = case_files("paper")
    sheet = next(n for n in made if n.endswith(".kicad_sch"))
    board = next(n for n in made if n.endswith(".kicad_pcb"))
    label = re.search(r'\t\(label "v2n".*?\n\t\)\n', made[sheet], re.DOTALL)
    assert label is not None
    broken = {**made, sheet: made[sheet].replace(label[0], "", 1)}
    assert electrical(written(broken, tmp_path / "sheet"))

    resistor = re.search(
        r'\t\(footprint(?:(?!\n\t\)).)*?"Reference"\s+"R1".*?\n\t\)\n', made[board], re.DOTALL
    )
    other = re.search(r'\(net \d+\s+"/s2"\)', made[board])
    assert resistor is not None
    assert other is not None
    moved = re.sub(r'\(net \d+\s+"/s1"\)', other[0], resistor[0])
    assert moved != resistor[0]
    text = made[board].replace(resistor[0], moved)
    _, parity, _ = design(written({**made, board: text}, tmp_path / "net"))
    assert parity == ["net_conflict"]

    tree = read(made[board])
    first, second, *_ = (f for f in tree.all("footprint") if f.text(0).endswith("1608Metric"))
    here = f"(at {' '.join(first.get('at').atoms)})"
    there = f"(at {' '.join(second.get('at').atoms)})"
    assert made[board].count(there) == 1
    violations, _, _ = design(
        written({**made, board: made[board].replace(there, here)}, tmp_path / "place")
    )
    assert "courtyards_overlap" in violations


def test_a_title_does_nothing_to_the_sheet(tmp_path: Path) -> None:
    title = 'a "title") (text ".include x" \\ ${HOME} \n.tran 1 2'
    folder = written(files(replace(case("paper"), title=title)), tmp_path)
    assert electrical(folder) == []
    kicad(folder, "sch", "export", "netlist", "--format", "spice", "-o", "deck.cir",
          one(folder, ".kicad_sch"))  # fmt: skip
    text = (folder / "deck.cir").read_text()
    assert ".include x" not in text
    assert text.count(".tran") == 1


def spice(folder: Path) -> str:
    """KiCad's SPICE netlist with the library in it and the circuit's own names; KiCad takes every
    reference as annotated."""
    sheet = one(folder, ".kicad_sch")
    done = kicad(folder, "sch", "export", "netlist", "--format", "spice", "-o", "deck.cir", sheet)
    assert "annotation" not in done.stdout + done.stderr
    library = (folder / one(folder, ".lib")).read_text()
    lines = (folder / "deck.cir").read_text().splitlines()
    (include,) = (i for i, line in enumerate(lines) if line.startswith(".include"))
    assert Path(lines[include].split('"')[1]).name == one(folder, ".lib")
    # The first line of a deck is its title.
    text = "\n".join(
        [lines[0].replace(".title", "*"), *lines[1:include], library, *lines[include + 1 :]]
    )
    return re.sub(r"(?<=[ (])/", "", text) + "\n"


@pytest.mark.slow
def test_kicads_own_deck_shows_the_same_responses(tmp_path: Path) -> None:
    """An independent netlister for ours: at the gate's settings, the n-p-q of ``circuit.cir``."""
    made = synthesised()
    wanted = [r for r in made.model_responses if r.omega in (OMEGA[1], OMEGA[3], OMEGA[8])]
    assert [r.orbit.response for r in wanted] == ["1-1-1", "1-3-3", "1-8-8"]
    reduction = nominal.nominal_reduction(made.design)
    with SpicePool(1) as pool:
        checked = checked_design.check(made.design, wanted, pool)
        jobs = []
        for answer in checked:
            assert answer.gate is not None
            assert answer.gate.passed
            subject = numerics_gate.GateSubject(reduction, answer.excitation, answer.circuit)
            own = numerics_gate.job(subject, answer.gate.settings)
            run = FirstRun(answer.excitation, answer.gate.settings, own.stop, answer.circuit.start)
            sheet = replace(project(made.design.circuit, title=made.modelfile.title), run=run)
            folder = written(files(sheet), tmp_path / f"{answer.model.omega:g}")
            cir = deck.write(
                made.design.circuit, nominal_board(made.design.circuit), answer.excitation,
                answer.gate.settings, title="circuit.cir", stop_time=own.stop,
                initial=answer.circuit.start, also=own.signals,
            )  # fmt: skip
            texts = (cir, spice(folder))
            jobs += [SpiceJob(t, own.signals, own.stop, own.reduce) for t in texts]
        found = dict(pool.map(jobs))
    for i, answer in enumerate(checked):
        ours, theirs = found[2 * i], found[2 * i + 1]
        assert isinstance(ours, Read)
        assert isinstance(theirs, Read), theirs
        assert theirs.orbit.response == ours.orbit.response == answer.circuit.response
        same(ours.orbit, theirs.orbit)


def same(ours: Orbit, theirs: Orbit) -> None:
    """The same orbit within what ngspice repeats at the gate's settings."""
    assert theirs.extremes == pytest.approx(ours.extremes, rel=2e-3)
