"""What the report of strangers' runs says of a system."""

from __future__ import annotations

from typing import Any

from benchmarks import bench_stranger_runs

SHOWN: dict[str, Any] = {
    "model": "1-1-1",
    "circuit": "1-1-1",
    "ngspice": "1-1-1",
    "engines_agree": True,
    "rate": 0.97,
    "agreement": {"asked": 20, "agreed": 20, "undecided": 0},
}
ROW: dict[str, Any] = {
    "commit": "0d3f48e3",
    "number": 3,
    "masses": 1,
    "clearances": 1,
    "kinds": [],
    "size": "plain numbers",
    "exit": 0,
    "cpu": 20.0,
    "wall": 15.0,
    "max_error": 0.001,
    "equations": True,
    "responses": [SHOWN],
    "open": 0,
    "complete": True,
    "rules": {},
}


def test_what_is_wrong_is_listed_by_cause() -> None:
    other = {**SHOWN, "circuit": "1-0-1", "agreement": {"asked": 3, "agreed": 1, "undecided": 1}}
    bad = ROW | {"equations": False, "responses": [other], "open": 2, "rules": {"swing": "14 V"}}
    assert list(bench_stranger_runs.causes(ROW)) == []
    assert list(bench_stranger_runs.causes(bad)) == [
        "the deck fails its equation check",
        "the nominal circuit shows another response",
        "engines disagree on boards",
        "rule swing fails",
        "connections stay open",
    ]
    blamed = ROW | {"exit": -24}
    assert list(bench_stranger_runs.causes(blamed)) == ["blame has no end within 900 s of CPU"]
    told = ("commit", "number", "masses", "clearances", "kinds", "size")
    silent = {key: ROW[key] for key in told}
    silent |= {"exit": -24, "cpu": 901.0, "wall": 600.0, "said": "…"}
    assert list(bench_stranger_runs.causes(silent)) == ["no end within 900 s of CPU"]
    rows = [ROW, bad, silent, blamed]
    found = bench_stranger_runs.figures(rows, [ROW])
    assert (found["runs"], found["whole"], found["shown"], found["boards_routed"]) == (4, 2, 2, 2)
    assert found["yield_stated"] == 3
    assert (found["reached"], found["in_time"]) == (1, 1)
    limit = {"limited_by": {"line": "grazing: contact 2"}}
    below, above = {**SHOWN, **limit, "rate": 0.94}, {**SHOWN, **limit}
    for response, said in ((below, True), (above, False)):
        search = {**ROW, "responses": [response], "warnings": []}
        text = bench_stranger_runs.report(rows, [search], 1)
        assert ("grazing: contact 2" in text) is said
    text = bench_stranger_runs.report(rows, [], 1)
    assert "| no end within 900 s of CPU " in text
    assert "`search`" not in text.partition("## System by system")[2]
