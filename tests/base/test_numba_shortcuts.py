"""Callees are linked within their callers: the same results, and nothing for other packages."""

from __future__ import annotations

import gc
import subprocess
import textwrap
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest
from numba.core.codegen import JITCodeLibrary

from designer.base import numba_shortcuts
from designer.base.environment import python_command
from designer.base.jit import OPTIONS, callee

REFUSAL = "a negative number has no root here"


def sum_of_roots(module: str) -> tuple[Callable[..., float], Any]:
    """A compiled function of a module of that name, and the callee in it, which may raise."""

    def root(x: float) -> float:
        if x < 0.0:
            raise ValueError(REFUSAL)
        return float(np.sqrt(x))

    def total(x: Any) -> float:
        out = np.zeros(1)
        for i in range(len(x)):
            out[0] += compiled_root(x[i])
        return float(out[0])

    root.__module__ = total.__module__ = module
    compiled_root = callee(root)
    return numba.njit(**OPTIONS)(total), compiled_root


@pytest.mark.slow
@pytest.mark.parametrize(("module", "late"), [("designer.kernels.some", True), ("other", False)])
def test_only_callees_of_our_kernels_wait_for_their_callers(module: str, late: bool) -> None:
    total, root = sum_of_roots(module)
    assert total(np.array([1.0, 4.0, 9.0])) == 6.0
    (overload,) = root.overloads.values()
    assert (overload.library in numba_shortcuts._linked) == late
    gc.collect()
    with pytest.raises(ValueError, match=REFUSAL):
        total(np.array([-1.0]))


def test_two_kernels_have_one_callee() -> None:
    one, root = sum_of_roots("designer.kernels.some")

    def square(x: float) -> float:
        return float(root(x)) ** 2

    square.__module__ = "designer.kernels.other"
    two = numba.njit(**OPTIONS)(square)
    assert one(np.array([4.0, 16.0])) == 6.0
    assert two(9.0) == pytest.approx(9.0)
    assert len(root.overloads) == 1
    for call in (lambda: two(-1.0), lambda: one(np.array([-1.0]))):
        with pytest.raises(ValueError, match=REFUSAL):
            call()


def test_a_strangers_callback_has_an_address() -> None:
    @numba.cfunc("float64(float64)")
    def half(x: float) -> float:
        return x / 2

    assert half.ctypes(3.0) == 1.5


def test_an_untested_release_of_numba_goes_its_usual_way(monkeypatch: pytest.MonkeyPatch) -> None:
    finalize = JITCodeLibrary.finalize
    monkeypatch.setattr(numba, "__version__", "9.9.9")
    assert not numba_shortcuts.install()
    assert JITCodeLibrary.finalize is finalize


def test_a_stored_kernel_is_loaded_without_what_only_a_compiler_needs() -> None:
    script = textwrap.dedent(
        """
        import sys
        import numpy as np
        from designer.kernels.kernel_algebra import rows_of_terms

        out = np.zeros((2, 2))
        rows_of_terms(np.array([1.0, 2.0]), np.arange(8.0).reshape(2, 2, 2), out)
        print("numba.np.npyimpl" in sys.modules, out.tolist())
        """
    )
    command = python_command("-c", script)
    said = [subprocess.run(command, check=True, capture_output=True, text=True) for _ in range(2)]
    # Whatever the first has to compile, the second finds.
    assert said[1].stdout == f"False {[[4.0, 7.0], [16.0, 19.0]]}\n"
