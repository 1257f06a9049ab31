"""What ngspice said of the boards of a search, by response."""

from __future__ import annotations

from dataclasses import replace

from designer.centering.result_json import confirmation_json
from designer.verdicts.verdict import Verdict
from tests.verdicts.test_ngspice_sampling import BLANK, HEARD


def test_what_ngspice_cannot_decide_is_no_difference() -> None:
    said = ("1-2-2", "1-2-2", "grazing", "undecided", "failed", "1-1-1", "grazing")
    exact = ("1-2-2",) * 6 + ("clipped",)
    checks = [replace(HEARD, sample=k, response=one, reason=one) for k, one in enumerate(said)]
    answers = {
        (k, 0): replace(BLANK, sample=k, response=one, verdict=Verdict.OK if k else Verdict.FAILED)
        for k, one in enumerate(exact)
    }
    none, row = confirmation_json(checks, answers, [1], 2)
    assert none["asked"] == 0
    assert (row["asked"], row["agreed"], row["ok_on_both"]) == (7, 2, 1)
    assert (row["undecided"], row["failed"]) == (2, 1)
    assert row["differences"] == [
        {"sample": 5, "exact": "1-2-2", "ngspice": "1-1-1", "reason": "1-1-1"},
        {"sample": 6, "exact": "clipped", "ngspice": "grazing", "reason": "grazing"},
    ]
