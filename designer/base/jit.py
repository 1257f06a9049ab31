"""How the engine's kernels are compiled, and where compiled code is stored.

numba stores a kernel under the time stamp of its own file and does not see that a kernel which it
calls, or a record that it takes, was changed in another one. So the folder is named by a hash of
all kernels: whatever changes in one of them, none is taken from before.
"""

from __future__ import annotations

import gc
import hashlib
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numba
import platformdirs
from numba.core.event import install_listener, register
from numba.core.types.misc import unliteral

from designer.base import numba_shortcuts
from designer.base.numba_shortcuts import CompileWatch

Function = TypeVar("Function", bound=Callable[..., Any])

PACKAGE = Path(__file__).resolve().parents[1]
KERNELS = ("*/kernel_*.py", "fidelity/*runge_kutta.py")
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


# numba would take its settings from a file in the working directory, a stranger's folder maybe: the
# place of compiled code among them, which it unpickles.
numba.core.config._config_fname = os.devnull
numba.core.config.reload_config()
numba_shortcuts.install()
CACHE = cache_folder()
if CACHE is not None:
    numba.config.CACHE_DIR = str(CACHE)


CIRCUITS = "circuits-{masses}"
"""What is noted once the code for circuits of so many masses is stored."""


def stored_whole(what: str) -> bool:
    """Whether ``note_stored`` was called for this, by any process; True where nothing is stored."""
    return CACHE is None or (CACHE / f"{what}.whole").exists()


def note_stored(what: str) -> None:
    """Note that the compiled code for this is stored."""
    if CACHE is not None:
        (CACHE / f"{what}.whole").touch()


@contextmanager
def compilation_watched(tell: Callable[[str | None], None]) -> Iterator[None]:
    """Call ``tell`` with the name of a function's module whenever numba begins to compile it, on
    the thread that does, and with None when that is done; not for what is loaded from ``CACHE``."""
    with install_listener("numba:compile", CompileWatch(tell)):
        yield


RARE = (100_000, 20, 100)
"""``gc`` thresholds while numba compiles: little of what it makes can go before a kernel is done,
and looking for it takes a good part of the time."""


def _collect_rarely() -> Callable[[str | None], None]:
    usual = gc.get_threshold()

    def tell(module: str | None) -> None:
        nonlocal usual
        if module is not None:
            usual = gc.get_threshold()
        gc.set_threshold(*(usual if module is None else RARE))

    return tell


register("numba:compile", CompileWatch(_collect_rarely()))

OPTIONS: dict[str, Any] = {
    "nogil": True,
    "fastmath": {"contract", "nsz", "arcp"},
    "error_model": "numpy",
}
"""Of fast-math only what keeps infinities and NaN."""


def compiled(function: Function) -> Function:
    """Compile with numba a function that Python calls.

    Stored in ``CACHE`` with all that it calls, or for this process only where there is none.
    """
    return numba.njit(cache=CACHE is not None, **OPTIONS)(function)  # type: ignore[no-any-return]


def callee(function: Function) -> Function:
    """Compile with numba a function that only compiled functions call.

    It costs less time than ``compiled``: nothing is built for a call from Python, nothing is stored
    for it alone, and it is compiled for the types of its arguments, not for each literal number.
    """
    return _callee(function, {})


def leaf(function: Function) -> Function:
    """``callee`` that makes no array: it does without the counts of references to its arguments,
    each of which is an atomic operation."""
    return _callee(function, {"_nrt": False})


def embedded(function: Function) -> Function:
    """``leaf`` whose machine code stands in that of its callers: innermost parts of a kernel."""
    return _callee(function, {"_nrt": False, "forceinline": True})


def _callee(function: Function, more: dict[str, Any]) -> Function:
    options = OPTIONS | more | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    dispatcher = numba.njit(**options)(function)
    template = dispatcher.get_call_template

    def of_types(arguments: Iterable[Any], by_name: dict[str, Any]) -> Any:
        plain = tuple(unliteral(argument) for argument in arguments)
        return template(plain, {name: unliteral(t) for name, t in by_name.items()})

    dispatcher.get_call_template = of_types
    return dispatcher  # type: ignore[no-any-return]
