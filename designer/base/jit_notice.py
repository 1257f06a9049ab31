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
from typing import Any

CALLS_BACK = "llvmlite.binding.executionengine"
PARTS = {
    "kernel_completions": "the choice of parts",
    "kernel_linear": "the choice of parts",
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
    "(first use of this part; up to half a minute, longer on a busy machine)…"
)


@contextmanager
def announced(say: Callable[[str], None]) -> Iterator[None]:
    """Calls ``say`` with one line when the first kernel of a part is compiled inside."""
    from numba.core import event

    lock = threading.Lock()
    announced: set[str] = set()
    depth = threading.local()

    class Listener(event.Listener):  # type: ignore[misc]
        def on_start(self, event: Any) -> None:
            depth.now = getattr(depth, "now", 0) + 1
            name = str(event.data["dispatcher"].py_func.__module__)
            part = PARTS.get(name.rpartition(".")[2], MOTION)
            with lock:  # a callee belongs to the part that calls it
                if depth.now > 1 or part in announced or not name.startswith("designer."):
                    return
                announced.add(part)
            say(TEXT.format(part=part))

        def on_end(self, event: Any) -> None:
            depth.now -= 1

    with _interruptible(), event.install_listener("numba:compile", Listener()):
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
