"""How kernels are compiled."""

from __future__ import annotations

import gc
from types import SimpleNamespace

import pytest
from numba.core import event

from designer.base.jit import RARE


def test_garbage_is_collected_rarely_while_numba_compiles() -> None:
    """From the first kernel's begin to its end, callees included, whether it compiles or not."""
    function = SimpleNamespace(__module__="designer.kernels.kernel_modal")
    data = {"dispatcher": SimpleNamespace(py_func=function)}
    usual, seen = gc.get_threshold(), []

    def fails() -> None:
        with event.trigger_event("numba:compile", data):
            with event.trigger_event("numba:compile", data):
                pass
            seen.append(gc.get_threshold())
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fails()
    assert seen == [RARE]
    assert gc.get_threshold() == usual != RARE
