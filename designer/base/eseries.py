"""The preferred values of IEC 60063: E3 to E192.

Values are held as three-digit integers, 100 to 999, and become floats through decimal text, so
that 22.1 kΩ from a series is the same float as ``22.1e3``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from designer.base.errors import InputError

_E24 = (
    10, 11, 12, 13, 15, 16, 18, 20, 22, 24, 27, 30,
    33, 36, 39, 43, 47, 51, 56, 62, 68, 75, 82, 91,
)  # fmt: skip

SERIES = ("E3", "E6", "E12", "E24", "E48", "E96", "E192")
"""Names of the series, coarse to fine."""


@cache
def eseries(name: str) -> tuple[int, ...]:
    """One decade of a series as three-digit integers: "E3" is (100, 220, 470).

    E24 is the table of the standard, and E12, E6 and E3 are every 2nd, 4th and 8th of it. E48 to
    E192 are 10**(i/N) to three digits, with the one exception of the standard: 9.20, not 9.19.

    Raises
    ------
    InputError : no such series.
    """
    if name not in SERIES:
        raise InputError(None, "series", name, "one of " + ", ".join(SERIES))
    count = int(name[1:])
    if count <= 24:
        return tuple(10 * value for value in _E24[:: 24 // count])
    rounded = (round(100.0 * 10.0 ** (i / count)) for i in range(count))
    return tuple(920 if value == 919 else value for value in rounded)


def series_values(names: Sequence[str], lo: float, hi: float) -> NDArray[np.float64]:
    """Distinct values of the union of the series in the closed range, ascending.

    Parameters
    ----------
    names : names of series, such as ("E24", "E96").
    lo, hi : the ends of the range, in ohm or farad; both are values if the series hold them.

    Raises
    ------
    InputError : an unknown series, or a range that is not 0 < lo <= hi.
    """
    if not 0.0 < lo <= hi < math.inf:
        raise InputError(None, "range", f"[{lo!r}, {hi!r}]", "0 < low <= high, both finite")
    mantissas = {mantissa for name in names for mantissa in eseries(name)}
    first, last = math.floor(math.log10(lo)) - 1, math.floor(math.log10(hi)) + 1
    values = {
        float(f"{mantissa}e{decade - 2}")
        for decade in range(first, last + 1)
        for mantissa in mantissas
    }
    return np.array(sorted(value for value in values if lo <= value <= hi), dtype=np.float64)
