"""The finished parts of long work, so that interrupted work goes on where it was."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from designer.base.seal import sha256

Value = TypeVar("Value")
EVERY = 10.0
"""Seconds between two times that answers are stored, at least: each time all are."""


class StoredParts:
    """Finished parts by name; this one forgets everything that is put into it."""

    def get(self, name: str) -> Any | None:
        """None where the part is not there."""
        return None

    def put(self, values: Mapping[str, Any]) -> None:
        """Store these parts."""


def counted(
    parts: StoredParts,
    name: str,
    progress: Callable[[], None],
    compute: Callable[[Callable[[], None]], Value],
) -> Value:
    """The part of this name, computed and stored where it is not there.

    compute : takes the callback for its steps. progress : called once a step, also for those of a
    part that is there, so that the cost does not depend on interruptions.
    """
    stored: tuple[Value, int] | None = parts.get(name)
    if stored is not None:
        value, steps = stored
        for _ in range(steps):
            progress()
        return value
    steps = 0

    def step() -> None:
        nonlocal steps
        steps += 1
        progress()

    value = compute(step)
    parts.put({name: (value, steps)})
    return value


@dataclass(frozen=True)
class GivenAnswers:
    """What was answered so far, question by question."""

    questions: tuple[str, ...] = ()
    """Hash of each question."""
    answers: tuple[str, ...] = ()
    """Of each the lines of its answer."""


class AnswerLog:
    """Answers in the order of their questions, stored now and then under a name.

    Work whose questions follow from the answers before them is done again as it was: up to where it
    was interrupted, the answers come from here.
    """

    def __init__(self, parts: StoredParts, name: str) -> None:
        given: GivenAnswers = parts.get(name) or GivenAnswers()
        self._parts, self._name = parts, name
        self._given = list(zip(given.questions, given.answers, strict=False))
        self._asked = 0
        self._stored = time.monotonic()

    def answer(self, question: bytes, lines: int, ask: Callable[[], Sequence[str]]) -> list[str]:
        """What ``ask`` answers to the next question: so many lines of text. It is called where the
        answer is not known, or is one to another question."""
        digest, number = sha256(question), self._asked
        self._asked += 1
        if number < len(self._given):
            asked, text = self._given[number]
            answer = text.split("\n") if lines else []
            if asked == digest and len(answer) == lines:
                return answer
            del self._given[number:]
        answer = list(ask())
        self._given.append((digest, "\n".join(answer)))
        if time.monotonic() - self._stored >= EVERY:
            questions, answers = zip(*self._given, strict=True)
            self._parts.put({self._name: GivenAnswers(questions, answers)})
            self._stored = time.monotonic()
        return answer

    def forget(self) -> None:
        """Store that nothing is known: the work is done."""
        self._parts.put({self._name: GivenAnswers()})
