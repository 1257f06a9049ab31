"""Tables of part values, against what a loop over their rows finds."""

from __future__ import annotations

from random import Random

import numpy as np
from hypothesis import given, strategies as st

from designer.synthesis.value_program import TableRows, fewest
from designer.synthesis.value_tables import ValueTable, fewest_of_each

VALUES = st.sampled_from([1.0, 2.0, 3.0, 4.0, 6.0])
ROWS = st.lists(st.tuples(VALUES, VALUES, VALUES), max_size=40)


def obvious(rows: list[tuple[float, ...]], free: frozenset[float], loud: bool) -> list[int]:
    """Places of the rows that are kept."""
    groups: dict[float, list[int]] = {}
    for k, row in enumerate(rows):
        groups.setdefault(float(np.round(np.log(row[0] / row[1]), 11)), []).append(k)
    out = []
    for key in sorted(groups):
        members = groups[key]
        kept = {min(members, key=lambda k: len(set(rows[k]) - free))}
        if loud:
            kept.add(max(members, key=lambda k: rows[k][2]))
        out += sorted(kept)
    return out


@given(ROWS, st.frozensets(VALUES, max_size=2), st.booleans())
def test_the_fewest_new_values_of_each_ratio_are_kept(
    rows: list[tuple[float, ...]], free: frozenset[float], loud: bool
) -> None:
    """And the largest of the third part, where that counts; the first one of equals."""
    table = ValueTable(("R1", "R2", "R3"), np.array(rows).reshape(-1, 3))
    logs = np.log(table["R1"] / table["R2"])
    found = fewest_of_each(table, logs, free, table["R3"] if loud else None)
    np.testing.assert_array_equal(found.values, table.values[obvious(rows, free, loud)])


@given(ROWS, st.frozensets(VALUES, max_size=2), st.integers(1, 8), st.randoms())
def test_the_rows_of_fewest_new_values(
    rows: list[tuple[float, ...]], free: frozenset[float], most: int, random: Random
) -> None:
    """By the sets of their values, then by their errors; the first ones of equals."""
    error = [random.choice([0.0, 0.1, 0.2]) for _ in rows]
    table = ValueTable(("R1", "R2", "R3"), np.array(rows).reshape(-1, 3))
    found = fewest(TableRows(table, np.array(error), np.zeros(len(rows), int)), free, most)
    ranks = sorted(range(len(rows)), key=lambda k: (len(set(rows[k]) - free), error[k]))
    assert found.tolist() == ranks[:most]
