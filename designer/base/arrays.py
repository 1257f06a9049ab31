"""The types of numeric arrays, and the different ones of many indices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


Index = NDArray[np.intp]


Mask = NDArray[np.bool_]


def distinct_indices(indices: Index) -> Index:
    """(m,) the different ones of (n,) indices from 0 on, ascending.

    For indices below a few times n: ``np.unique`` of numpy 2.3 and later hashes whole numbers,
    which takes ten to a hundred times as long.
    """
    return np.flatnonzero(np.bincount(indices))
