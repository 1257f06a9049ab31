"""How the engine's kernels are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile with numba: no GIL, cached where the user may write, else for this process only.

    Of fast-math only what keeps infinities and NaN. A kernel and all that it calls stand in one
    file, because a callee edited in another file would leave a stale cache.
    """
    options: dict[str, Any] = {
        "nogil": True,
        "fastmath": {"contract", "nsz", "arcp"},
        "error_model": "numpy",
    }
    try:
        kernel = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # nowhere to keep compiled code
        kernel = numba.njit(**options)(function)
    return kernel  # type: ignore[no-any-return]
