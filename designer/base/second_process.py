"""A second Python process for work that holds the interpreter, which threads cannot share.

It is started early, imports what it will need while the first one is busy, and is given functions
and their arguments. Whatever goes wrong there is done again here: nothing depends on it but time.
It ends at once when the first one does, however that ends.
"""

from __future__ import annotations

import gc
import importlib
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from queue import SimpleQueue
from threading import Thread
from typing import Any, BinaryIO, Generic, NoReturn, TypeVar

from designer.base.defaults import COLLECTION
from designer.base.environment import python_command

Result = TypeVar("Result")


class Awaited(Generic[Result]):
    """What a function gives, there or here; the result is kept.

    there : its result, in a tuple, or None where that process has none. None: it is called here,
    when its result is first asked for.
    """

    def __init__(
        self,
        function: Callable[..., Result],
        arguments: tuple[Any, ...],
        there: Future[tuple[Result] | None] | None = None,
    ) -> None:
        self._function, self._arguments, self._there = function, arguments, there
        self._known: tuple[Result] | None = None

    def __call__(self) -> Result:
        """The result, which is waited for; raises what the function raises."""
        if self._known is None:
            answered = None if self._there is None else self._there.result()
            self._known = (self._function(*self._arguments),) if answered is None else answered
        return self._known[0]

    def wait(self) -> bool:
        """Wait for the other process; whether it has an answer. False at once where it is called
        here, or where nobody is asked any more."""
        try:
            return self._there is not None and self._there.result() is not None
        except CancelledError:
            return False


Ask = Callable[..., Awaited[Any]]
_asked: ContextVar[Ask | None] = ContextVar("asked", default=None)
"""The process whose block this is."""
CALL = "from designer.base.second_process import serve; serve({modules!r})"


class OtherProcess:
    """The process, from this one's side.

    modules : names of modules that it imports at once. It takes no module from its working
    directory.
    """

    def __init__(self, modules: Sequence[str]) -> None:
        self._process = subprocess.Popen(
            python_command("-c", CALL.format(modules=list(modules))),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # what goes wrong there goes wrong again here
            start_new_session=True,  # Ctrl-C is for this process, which ends that one
        )
        self._one_at_a_time = ThreadPoolExecutor(1)

    def __call__(self, function: Callable[..., Result], *arguments: Any) -> Awaited[Result]:
        """function(*arguments), there; both must pickle. Here, once this is closed."""
        with suppress(RuntimeError):
            there = self._one_at_a_time.submit(self._answer, function, arguments)
            return Awaited(function, arguments, there)
        return Awaited(function, arguments)

    def _answer(self, function: Callable[..., Result], arguments: object) -> tuple[Result] | None:
        """The result; None where that process has none."""
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None
        assert stdout is not None
        try:
            pickle.dump(pickle.dumps((function, arguments)), stdin)
            stdin.flush()
            answered: tuple[Result] | None = pickle.load(stdout)
        except (OSError, EOFError, ValueError, pickle.PickleError, AttributeError, TypeError):
            self._process.kill()
            return None
        return answered

    def close(self) -> None:
        """End it, whatever it is at."""
        self._process.kill()
        self._one_at_a_time.shutdown(wait=True, cancel_futures=True)
        self._process.communicate()


@contextmanager
def other_process(jobs: int, *modules: str) -> Iterator[Ask]:
    """Asks another process where there is a core for it; with one job the function is called here,
    when its result is asked for. It ends with the block; within the block of another one that is
    asked, and no further one is started."""
    if jobs < 2:
        yield lambda function, *arguments: Awaited(function, arguments)
        return
    known = _asked.get()
    if known is not None:
        yield known
        return
    other = OtherProcess(modules)
    token = _asked.set(other)
    try:
        yield other
    finally:
        _asked.reset(token)
        other.close()


def serve(modules: Sequence[str]) -> NoReturn:
    """The process, from its own side: answers until nobody asks any more.

    A question is the bytes of a function with its arguments; an answer is a tuple with the result,
    or None where there is none.
    """
    questions: SimpleQueue[bytes] = SimpleQueue()
    asking = os.fdopen(os.dup(sys.stdin.fileno()), "rb")
    Thread(target=_listen, args=(asking, questions), daemon=True).start()
    gc.set_threshold(*COLLECTION)
    answers: BinaryIO = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a function prints is no answer
    for name in modules:
        importlib.import_module(name)
    while True:
        try:
            function, arguments = pickle.loads(questions.get())
            answer = pickle.dumps((function(*arguments),))
        except Exception:
            answer = pickle.dumps(None)
        answers.write(answer)
        answers.flush()


def _listen(asking: BinaryIO, questions: SimpleQueue[bytes]) -> NoReturn:
    """Takes questions as they come. Where they end, the first process has: even one that was killed
    leaves nobody at work.

    It makes no objects of the bytes: that imports modules, which the other thread does.
    """
    while True:
        try:
            questions.put(pickle.load(asking))
        except (EOFError, pickle.UnpicklingError):  # the second: cut off in a question
            os._exit(0)
