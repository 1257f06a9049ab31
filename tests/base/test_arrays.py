"""Distinct indices against a set of them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, strategies as st

from designer.base.arrays import distinct_indices


@given(indices=st.lists(st.integers(0, 50)))
def test_distinct_indices_are_those_of_the_set(indices: list[int]) -> None:
    assert distinct_indices(np.array(indices, dtype=np.intp)).tolist() == sorted(set(indices))
