"""How the engine's kernels are compiled, and where compiled code is stored.

numba stores a kernel under the time stamp of its own file and does not see that a kernel which it
calls, or a record that it takes, was changed in another one. So the folder is named by a hash of
all kernels: whatever changes in one of them, none is taken from before.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numba
import platformdirs

Function = TypeVar("Function", bound=Callable[..., Any])

PACKAGE = Path(__file__).resolve().parents[1]
KERNELS = ("*/kernel_*.py", "fidelity/runge_kutta.py")
"""Files with compiled functions, below the package."""


def cache_folder() -> Path | None:
    """The folder for compiled code; None where none can be written.

    The first that can be made of: where NUMBA_CACHE_DIR says, in ``__pycache__`` of the package, in
    the user's cache folder.
    """
    for place in _places():
        folder = place / f"kernels-{_digest()}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return None


def _places() -> Iterator[Path]:
    stated = os.environ.get("NUMBA_CACHE_DIR")
    if stated:
        yield Path(stated)
    yield PACKAGE / "__pycache__"
    yield Path(platformdirs.user_cache_dir("designer", appauthor=False))


def _digest() -> str:
    digest = hashlib.sha256()
    for pattern in KERNELS:
        for path in sorted(PACKAGE.glob(pattern)):
            digest.update(f"{path.relative_to(PACKAGE)}\n".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


CACHE = cache_folder()
if CACHE is not None:
    numba.config.CACHE_DIR = str(CACHE)


def compiled(function: Function) -> Function:
    """Compile with numba: no GIL; stored in ``CACHE``, or for this process only where there is
    none.

    Of fast-math only what keeps infinities and NaN.
    """
    options: dict[str, Any] = {
        "nogil": True,
        "fastmath": {"contract", "nsz", "arcp"},
        "error_model": "numpy",
    }
    return numba.njit(cache=CACHE is not None, **options)(function)  # type: ignore[no-any-return]
