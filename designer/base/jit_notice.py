"""Says when a part of the exact engine is about to be compiled: a start that takes a while, not a
hang.

Each part is compiled when something first needs it, so another verb may compile another one. The
compiled code is kept in a cache: this happens once after an installation or an update, and at every
use where nowhere may be written. numba announces each compilation, and only those: what is loaded
from the cache is silent.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from designer.base import jit

CALLS_BACK = "llvmlite.binding.executionengine"
PARTS = {
    "kernel_completions": "the choice of parts",
    "kernel_linear": "the choice of parts",
    "kernel_rounding": "the choice of parts",
    "kernel_terms": "the choice of parts",
    "kernel_nodal": "equations of boards",
    "kernel_boards": "circuits",
    "kernel_propagators": "circuits, and models of any size",
    "kernel_sweep": "sweeps",
    "kernel_router": "tracks of boards",
}
"""What a kernel's module is for; all others are for ``MOTION``."""
MOTION = "motion between the stops"
TEXT = (
    "compiling the exact engine's part for {part} "
    "(once after an installation, for this kind of model; up to half a minute, longer on a busy "
    "machine)…"
)


@contextmanager
def announced(say: Callable[[str], None]) -> Iterator[None]:
    """Calls ``say`` with one line when the first kernel of a part is compiled inside."""
    told: set[str] = set()

    def tell(module: str | None) -> None:
        if module is None or not module.startswith("designer."):
            return
        part = PARTS.get(module.rpartition(".")[2], MOTION)
        if part not in told:
            told.add(part)
            say(TEXT.format(part=part))

    with _interruptible(), jit.compilation_watched(tell):
        yield


@contextmanager
def _interruptible() -> Iterator[None]:
    """Ctrl-C is put off for a moment while the compiler calls back through C, where it is lost."""
    usual = signal.getsignal(signal.SIGINT)
    main = threading.current_thread() is threading.main_thread()
    if not main or usual is not signal.default_int_handler:
        yield
        return

    def handle(number: int, frame: FrameType | None) -> None:
        inner = frame
        while frame is not None:
            if frame.f_globals.get("__name__") == CALLS_BACK:
                threading.Timer(0.02, signal.raise_signal, (number,)).start()
                return
            frame = frame.f_back
        signal.default_int_handler(number, inner)

    signal.signal(signal.SIGINT, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
