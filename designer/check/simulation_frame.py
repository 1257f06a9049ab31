"""Simulated responses as a pandas frame."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from designer.base.frames import frame
from designer.check.simulation import Simulated

if TYPE_CHECKING:
    import pandas as pd


def simulated_table(simulated: Iterable[Simulated]) -> pd.DataFrame:
    """What ``simulate`` gives, a row for each orbit: each response, its twin and the others that
    coexist with it, in model units."""
    return frame(row for s in simulated for row in s.rows())
