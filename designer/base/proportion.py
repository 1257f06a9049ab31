"""The interval of a proportion: every yield, rate and share has this one."""

from __future__ import annotations

import math

from scipy.special import ndtri

Z = float(ndtri(0.975))


def wilson(count: float, of: int) -> tuple[float, float]:
    """Two-sided 95 % interval of count/of (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927, 209).

    ``count`` need not be whole. (0, 1) where nothing was asked.
    """
    if of == 0:
        return 0.0, 1.0
    p, n, z2 = count / of, float(of), Z * Z
    centre = (p + z2 / (2.0 * n)) / (1.0 + z2 / n)
    half = Z * math.sqrt(max(p * (1.0 - p), 0.0) / n + z2 / (4.0 * n * n)) / (1.0 + z2 / n)
    # At the ends the limit is exact, and the difference of equals only rounding.
    return (
        0.0 if count <= 0.0 else max(centre - half, 0.0),
        1.0 if count >= n else min(centre + half, 1.0),
    )
