"""What a user reads while a part of the engine is compiled."""

from __future__ import annotations

from types import SimpleNamespace

from numba.core import event

from designer.base.jit_notice import MOTION, PARTS, announced
from designer.kernels import kernel_general, kernel_modal, kernel_propagators
from tests.shared.house import HOUSE


def _dispatcher(module: object) -> object:
    function = SimpleNamespace(__module__=getattr(module, "__name__", module))
    return SimpleNamespace(py_func=function)


def _compile(module: object) -> None:
    with event.trigger_event("numba:compile", data={"dispatcher": _dispatcher(module)}):
        pass


def test_each_part_is_announced_once_and_by_name() -> None:
    said: list[str] = []
    with announced(said.append):
        _compile("somebody.elses")
        assert said == []
        for module in (
            kernel_general,
            kernel_modal,
            kernel_propagators,
            kernel_propagators,
            kernel_general,
        ):
            _compile(module)
        with event.trigger_event("numba:compile", {"dispatcher": _dispatcher(kernel_general)}):
            _compile("designer.linear_network.kernel_linear")  # a callee: no part of its own
    _compile("designer.kernels.kernel_sweep")
    assert len(said) == 2
    assert MOTION in said[0]
    assert PARTS["kernel_propagators"] in said[1]
    assert all("once after an installation" in line and "busy machine" in line for line in said)


def test_every_kernel_that_is_not_of_motion_is_named() -> None:
    """What stands outside ``kernels`` is no motion between the stops."""
    kernels = [path for path in HOUSE.glob("*/kernel_*.py") if path.parent.name != "kernels"]
    assert {path.stem for path in kernels} <= PARTS.keys()
