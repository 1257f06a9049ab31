"""One thread that computes for all open pages: what was asked last comes first.

An answer is an iterator of messages. Its first message is what the page waits for; the others fill
in behind it, a piece at a time, whenever no page waits. A newer question of the same page on the
same topic takes the place of the old one, so what it overtakes is never begun, or goes no further.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass

from designer.base.errors import DesignerError
from designer.explorer.wire import Message

Answer = Callable[[], Iterator[Message]]
"""Begins the work and yields its messages."""
Send = Callable[[Message], None]
"""Takes a message to the page; called on the queue's thread."""
PAUSE = 0.15
"""Seconds that a page rests before what fills in behind its picture: a slider that is still moving
asks again before, and need not wait for a piece."""
DEFECT = "a defect of the tool; the terminal says more"


@dataclass
class _Question:
    number: int
    answer: Answer
    send: Send
    messages: Iterator[Message] | None = None
    rests_until: float = 0.0


class WorkQueue:
    """The thread and what it has to do."""

    def __init__(self, report: Callable[[BaseException], None] = lambda _: None) -> None:
        self._asked: dict[tuple[Hashable, str], _Question] = {}
        self._change = threading.Condition()
        self._open = True
        self._report = report
        self._turn = itertools.count()
        self._thread = threading.Thread(target=self._work, name="explorer", daemon=True)
        self._thread.start()

    def ask(
        self, page: Hashable, number: int, answer: Answer, send: Send, topic: str = "view"
    ) -> None:
        """Compute this next for the page, instead of what it asked before on the topic. What fills
        in on its other topics rests as after a first message.

        number : the ``id`` that every message then has.
        """
        with self._change:
            for (owner, _), question in self._asked.items():
                if owner == page:
                    question.rests_until = time.monotonic() + PAUSE
            self._asked[page, topic] = _Question(number, answer, send)
            self._change.notify()

    def forget(self, page: Hashable) -> None:
        """Do no more for a page."""
        with self._change:
            for key in [key for key in self._asked if key[0] == page]:
                del self._asked[key]

    def close(self) -> None:
        """End the thread once what it is at is done, which is not waited for longer than 5 s."""
        with self._change:
            self._open = False
            self._asked.clear()
            self._change.notify()
        self._thread.join(5.0)

    def _work(self) -> None:
        while (turn := self._next()) is not None:
            key, question = turn
            message = self._advance(question)
            with self._change:
                current = self._asked.get(key) is question
                if current and message is None:
                    del self._asked[key]
            # A first message is sent even if it is overtaken: a slider that moves on and on still
            # shows pictures.
            if message is not None and (current or message["first"]):
                question.send({**message, "id": question.number})

    def _next(self) -> tuple[tuple[Hashable, str], _Question] | None:
        """A question that nobody has begun, else the next piece of one that was; None at the
        end."""
        with self._change:
            while self._open:
                items, now = list(self._asked.items()), time.monotonic()
                unasked = [item for item in items if item[1].messages is None]
                ready = unasked or [item for item in items if item[1].rests_until <= now]
                if ready:
                    return ready[0] if unasked else ready[next(self._turn) % len(ready)]
                rests = [question.rests_until - now for _, question in items]
                self._change.wait(min(rests, default=None))
            return None

    def _advance(self, question: _Question) -> Message | None:
        """The next message; an error is one, and the last."""
        first = question.messages is None
        try:
            if question.messages is None:
                question.messages = iter(question.answer())
            message = next(question.messages, None)
            if first:
                question.rests_until = time.monotonic() + PAUSE
            return None if message is None else {**message, "first": first}
        except DesignerError as error:
            text = str(error)
        except Exception as error:
            self._report(error)
            text = DEFECT
        question.messages = iter(())
        return {"kind": "error", "text": text, "first": first}
