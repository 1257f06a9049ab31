"""What a user reads while a part of the engine is compiled."""

from __future__ import annotations

from types import SimpleNamespace

from numba.core import event

from designer import circuit_kernel, flow_kernel, modal_kernel
from designer.first_use import MOTION, PARTS, announced


def _compile(function: object) -> None:
    data = {"dispatcher": SimpleNamespace(py_func=function)}
    with event.trigger_event("numba:compile", data):
        pass


def _of(module: object) -> object:
    return SimpleNamespace(__module__=getattr(module, "__name__", module))


def test_each_part_is_announced_once_and_by_name() -> None:
    said: list[str] = []
    with announced(said.append):
        _compile(_of("somebody.elses"))
        assert said == []
        for module in (flow_kernel, modal_kernel, circuit_kernel, circuit_kernel, flow_kernel):
            _compile(_of(module))
    _compile(_of("designer.sweep_kernel"))
    assert len(said) == 2
    assert MOTION in said[0]
    assert PARTS["circuit_kernel"] in said[1]
    assert all("first use of this part" in line and "busy machine" in line for line in said)
