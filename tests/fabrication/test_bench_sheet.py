"""The sheet for the bench: voltages at rest are those that a board comes to by itself."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from designer.board.board_parts import probed_nets
from designer.circuit.board_modes import resting_voltages
from designer.circuit.reduction import Reduction
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.fabrication.bench_sheet import bench_sheet
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from tests.design_rules.test_rules_circuit import chain_subject
from tests.shared.rule_cases import base, with_circuit

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")


@pytest.mark.parametrize("which", ["two masses", "two clearances"])
def test_boards_come_to_the_voltages_that_are_stated(which: str) -> None:
    """The exact flow from zero, the generator off, until nothing moves."""
    subject = base()
    if which == "two clearances":
        subject = chain_subject()
    circuit, synthesis = subject.circuit, subject.synthesis
    spread = spread_of(synthesis.modelfile, circuit, synthesis.catalog)
    boards, nets = draw_many(circuit, spread, 7, range(6)), probed_nets(circuit)
    stated = resting_voltages(boards, nets)
    assert np.isfinite(stated).all()
    assert np.abs(stated).max() > 1e-3
    for i in range(len(boards)):
        reduction = Reduction(circuit, boards.board(i))
        system = reduction.system()
        omega = 2.0 * np.pi * 100.0
        run = Flow(system, Drive(omega, amplitude=0.0)).run(np.zeros(system.size), 600)
        x = run.strobes[-1]
        rows = [reduction.solution(run.mode).voltage[net] for net in nets]
        reached = [row[:-2] @ x + row[-1] for row in rows]
        assert reached == pytest.approx(stated[i], abs=2e-5)


def test_the_sheet_names_every_pad_and_every_response() -> None:
    sheet = bench_sheet(base())
    assert sheet is not None
    nets = [row[1] for row in sheet.rows]
    grounds = ["ground", "ground", "positive rail", "negative rail"]
    assert nets == [*probed_nets(base().circuit), *grounds]
    assert sheet.head == ["test point", "net", "generator off", "ω = 1.55"]
    assert sheet.rows[-2][2] == "+15 V (+14.7 to +15.3 V)"
    rest, moving = sheet.rows[0][2:4]
    low, high = map(float, re.findall(r"[-+0-9.]+(?= V)", rest)[1:])
    assert low < 0.0 < high
    down, up = map(float, re.findall(r"[-+0-9.]+(?= V)", moving))
    operating = base().each_run["1.55"]
    assert (down, up) == pytest.approx(
        (-operating.low["v1"].value, operating.high["v1"].value), rel=1e-2
    )
    milliamperes = [float(each) for each in re.findall(r"([0-9.]+) mA", sheet.before)]
    limit, usual, most = milliamperes
    assert usual < most < limit
    text = sheet.markdown
    assert text.count("\n| ") == 2 + len(sheet.rows)


def test_a_board_without_pads_has_no_sheet() -> None:
    circuit = base().circuit
    bare = tuple(p for p in circuit.fittings if not p.name.startswith("TP"))
    assert bench_sheet(with_circuit(replace(circuit, fittings=bare))) is None
