"""Says when a part of the exact engine is about to be compiled: a start that takes a while, not a
hang.

Each part is compiled when something first needs it, so another verb may compile another one. The
compiled code is kept in a cache: this happens once after an installation or an update, and at every
use where nowhere may be written. numba announces each compilation, and only those: what is loaded
from the cache is silent.
"""

from __future__ import annotations

import signal
import sys
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
    announced_parts: set[str] = set()

    def tell(module: str | None) -> None:
        again()
        if module is None or not module.startswith("designer."):
            return
        part = PARTS.get(module.rpartition(".")[2], MOTION)
        if part not in announced_parts:
            announced_parts.add(part)
            say(TEXT.format(part=part))

    with _interruptible() as again, jit.compilation_watched(tell):
        yield


@contextmanager
def _interruptible() -> Iterator[Callable[[], None]]:
    """Ctrl-C is not lost where the compiler would lose it.

    It is put off for a moment while the compiler calls back through C. Where it ends unheard in a
    destructor or a callback, it is repeated. Where compiled code clears it, the function that is
    given raises it again: who compiles calls it with each compilation.
    """
    usual = signal.getsignal(signal.SIGINT)
    main = threading.current_thread() is threading.main_thread()
    if not main or usual is not signal.default_int_handler:
        yield lambda: None
        return
    asked = False

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        inner = frame
        while frame is not None:
            if frame.f_globals.get("__name__") == CALLS_BACK:
                _soon()
                return
            frame = frame.f_back
        asked = True
        signal.default_int_handler(number, inner)

    def unheard(failure: sys.UnraisableHookArgs) -> None:
        if issubclass(failure.exc_type, KeyboardInterrupt):
            _soon()
        else:
            usual_hook(failure)

    def again() -> None:
        if asked and threading.current_thread() is threading.main_thread():
            raise KeyboardInterrupt

    usual_hook, sys.unraisablehook = sys.unraisablehook, unheard
    signal.signal(signal.SIGINT, handle)
    try:
        yield again
    finally:
        signal.signal(signal.SIGINT, usual)
        sys.unraisablehook = usual_hook


def _soon() -> None:
    """Ctrl-C a moment later, in the main thread, whatever it waits for."""
    main = threading.main_thread().ident
    threading.Timer(0.02, signal.pthread_kill, (main, signal.SIGINT)).start()
