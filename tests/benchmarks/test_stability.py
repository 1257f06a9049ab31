"""The report on stability in small: scenes of the exact flow, a design in ngspice, the tables."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import bench_stability, stability_flow, stability_spice
from benchmarks.stability_flow import BASE, Scene, critical_damping
from benchmarks.stability_spice import Case
from designer.base.plain_json import plain
from designer.spice.pool import SpicePool


def test_critical_damping_is_where_two_eigenvalues_meet() -> None:
    zeta = critical_damping()

    def gap(zeta: float) -> float:
        """Of the two nearest eigenvalues, by the modulus of the discriminant's root."""
        roots = np.linalg.eigvals(np.array(replace(BASE, zeta=zeta).matrices(float, 0)[0]))
        return float(min(abs(a - b) for i, a in enumerate(roots) for b in roots[:i]))

    # Where roots meet they part with the square root of the distance in ζ.
    assert gap(zeta) < 1e-6
    assert gap(zeta * 1.01) / gap(zeta * 1.0001) == pytest.approx(10.0, rel=0.1)


@pytest.mark.parametrize(
    "scene",
    [
        Scene("1 - k0", 1e-8, replace(BASE, k0=1.0 - 1e-8)),
        Scene("b", 1e-6, replace(BASE, b=1e-6), scale=1e-6),
        Scene("omega", 0.01, replace(BASE, omega=0.01), periods=1),
        Scene("off critical", 0.0, replace(BASE, zeta=critical_damping())),
    ],
    ids=lambda s: s.axis,
)
def test_an_error_is_rounding_as_the_flow_magnifies_it(scene: Scene) -> None:
    row = stability_flow.measure(scene)
    assert row["counts_agree"]
    assert row["impacts"] > 0
    own = stability_flow.ratio(row)
    assert own is not None
    assert own < 1e3
    assert row["first_error"] <= row["bound"] < 1e-8
    assert stability_flow.trusted(row)


def test_a_scene_that_is_called_not_to_be_trusted() -> None:
    row = stability_flow.measure(
        Scene("1 - k0", 2.0**-52, replace(BASE, k0=1.0 - 2.0**-52), settled=False)
    )
    assert not stability_flow.trusted(row)
    assert row["first_error"] <= row["bound"]
    assert stability_flow.ratio(row) < 100.0  # type: ignore[operator]


def test_each_piece_has_a_name_of_its_own() -> None:
    names = [scene.name for scene in stability_flow.scenes()]
    names += [case.name for case in (*stability_spice.cases(), *stability_spice.edges())]
    assert len(set(names)) == len(names)
    assert not any("/" in name for name in names)


def test_a_coefficient_out_of_reach_says_what_binds() -> None:
    """All resistors at most 1.2 kΩ and at least 1 kΩ: no ratio of the paper's case is there."""
    narrow = Case("resistors", 1.2e3, 0.85, {}, {"resistor_range": [1e3, 1.2e3]})
    row = stability_spice.synthesis_only(narrow)
    assert "expected" in row["refused"]
    wide = stability_spice.synthesis_only(Case("resistors", 1e6, 0.85, {}, {}))
    assert "refused" not in wide
    assert 0.0 < wide["max_error"] < 0.05


@pytest.mark.slow
def test_report(tmp_path: Path) -> None:
    """One design asked in ngspice, with boards, and all tables and pictures made of it."""
    with SpicePool(1) as pool:
        case = Case("spread", 0.05, 0.85, {}, {}, ("ideal",), 0.05)
        spice: list[dict[str, Any]] = [plain(stability_spice.measure(case, pool))]
    (said,) = spice[0]["rungs"].values()
    assert said["passed"]
    assert said["rms"] <= said["rms_bound"]
    assert spice[0]["equation"]["passed"]
    boards = spice[0]["boards"]
    assert len(boards["exact"]) == stability_spice.BOARDS
    assert len(boards["asked"]) == len(boards["ngspice"]) > 0
    refused = {**said, "passed": False, "why": "so it is"}
    spice.append({**spice[0], "value": 9.0, "rungs": {"ideal": refused}, "boards": None})
    scenes = [
        Scene("1 - k0", 1.0 - k0, replace(BASE, k0=k0), settled=False)
        for k0 in (0.9, 0.99, 1.0 - 2.0**-52)
    ]
    pieces = {
        "flow": [plain(stability_flow.measure(s)) for s in scenes],
        "spice": spice,
        "edges": [{"axis": "edge b", "value": 1.0, "refused": "no", "cost": {"seconds": 1.0}}],
    }
    bench_stability.write(tmp_path, pieces, 1.0)
    text = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert "| exact flow, 1 - k0" in text
    assert "2e-16: rounding" in text
    assert "9: so it is" in text
    assert {p.name for p in tmp_path.iterdir()} == set(bench_stability.FILES)
