"""A request to stop, which compiled work looks for between two pieces."""

from __future__ import annotations

import threading

interrupt = threading.Event()
"""Set to stop every flow of this process: compiled code hears no Ctrl-C by itself."""


def heed() -> None:
    """Stop here if ``interrupt`` is set."""
    if interrupt.is_set():
        raise KeyboardInterrupt
