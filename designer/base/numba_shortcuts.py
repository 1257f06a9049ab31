"""Shortcuts through numba: our kernels compile in less time, and stored ones load in little.

**Callees are optimised once, within their callers.** numba optimises each function together with
all that it calls, and makes machine code of it, whether Python calls it or not; its callers do the
same again. Here a callee of our kernels is only linked: the function that Python calls is optimised
with all that it calls, once. Its machine code is that of a kernel from the cache, which brings its
callees too.

**Flags are told apart by their hash.** numba looks functions up by its compiler's flags, hundreds
of thousands of times. All flags have one hash there, so that each is compared with many others.

**A stored kernel needs no types.** Before it loads one numba declares all functions and types that
it can compile, which takes longer than all of our kernels take to load. Here it does so when
something is compiled.

This reaches into numba, so it is done for the releases that it was tested with, and for our kernels
alone. Elsewhere numba goes its usual way, with the same results.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from weakref import WeakSet

import numba
from numba.core.caching import Cache
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.environment import lookup_environment
from numba.core.event import Listener, register
from numba.core.runtime import rtsys
from numba.core.targetconfig import TargetConfig


class CompileWatch(Listener):  # type: ignore[misc]
    """Calls ``tell`` with the name of a function's module when its compilation begins, and with
    None when it ends; a callee is within its caller. numba compiles on one thread at a time."""

    def __init__(self, tell: Callable[[str | None], None]) -> None:
        self._tell = tell
        self._depth = 0

    def on_start(self, event: Any) -> None:
        """As numba calls it."""
        self._depth += 1
        if self._depth == 1:
            self._tell(str(event.data["dispatcher"].py_func.__module__))

    def on_end(self, event: object) -> None:
        """As numba calls it."""
        self._depth -= 1
        if self._depth == 0:
            self._tell(None)


TESTED = ("0.68.",)
"""Releases of numba."""
OURS = "designer."
FOR_PYTHON, ENVIRONMENT = "_ZN7cpython", "_ZN08NumbaEnv"
"""How numba begins the names of functions that Python calls, and of what a function's exceptions
are made from."""

_linked: WeakSet[Any] = WeakSet()
"""Libraries of callees, without machine code of their own."""


def install() -> bool:
    """Take them; False where numba's release is not a tested one."""
    if not numba.__version__.startswith(TESTED):
        return False
    _link_callees_late()
    _hash_flags()
    _load_without_types()
    return True


def _hash_flags() -> None:
    values_of = TargetConfig.values

    def told_apart(flags: Any) -> int:
        """Equal for equal flags: what is set to its default is as if it were not set."""
        options = flags.options
        return hash(frozenset(k for k, v in flags._values.items() if v != options[k].default))

    def equal(flags: Any, other: object) -> Any:
        if not isinstance(other, TargetConfig):
            return NotImplemented
        return flags._values == other._values or values_of(flags) == values_of(other)

    TargetConfig.__hash__ = told_apart
    TargetConfig.__eq__ = equal


def _load_without_types() -> None:
    usual = Cache.load_overload

    def load(cache: Any, signature: Any, target: Any) -> Any:
        if not cache._py_func.__module__.startswith(OURS):
            return usual(cache, signature, target)
        rtsys.initialize(target)
        with cache._guard_against_spurious_io_errors():
            return cache._load_overload(signature, target)

    Cache.load_overload = load


def _link_callees_late() -> None:
    compiling: str | None = None
    """Module of the outermost function that is compiled now."""

    def tell(module: str | None) -> None:
        nonlocal compiling
        compiling = module

    register("numba:compile", CompileWatch(tell))
    finalize, pointer = JITCodeLibrary.finalize, JITCodeLibrary.get_pointer_to_function
    set_environment = JITCPUCodegen.set_env

    def finalize_late(library: Any) -> None:
        ours = compiling is not None and compiling.startswith(OURS)
        if ours and not _called_from_python(library):
            _link(library)
            return
        finalize(library)
        for variable in library._final_module.global_variables:
            if variable.name.startswith(ENVIRONMENT):
                environment = lookup_environment(variable.name)
                if environment is not None:
                    set_environment(library._codegen, variable.name, environment)

    def pointer_of(library: Any, name: str) -> Any:
        library._ensure_finalized()
        return 0 if library in _linked else pointer(library, name)

    def set_known_environment(generator: Any, name: str, environment: object) -> None:
        # A callee's stands in the library of its caller, which sets it when it is there.
        if generator._engine.is_symbol_defined(name):
            set_environment(generator, name, environment)

    JITCodeLibrary.finalize = finalize_late
    JITCodeLibrary.get_pointer_to_function = pointer_of
    JITCPUCodegen.set_env = set_known_environment


def _called_from_python(library: Any) -> bool:
    return any(
        function.name.startswith(FOR_PYTHON) and not function.is_declaration
        for function in library._final_module.functions
    )


def _link(library: Any) -> None:
    """Put what it calls beside a callee, as numba does, and leave the rest to its callers."""
    library._raise_if_finalized()
    for other in dict.fromkeys(library._linking_libraries):
        library._reload_init.update(other._reload_init)
        library._final_module.link_in(other._get_module_for_linking(), preserve=True)
    library._finalized = True
    _linked.add(library)
