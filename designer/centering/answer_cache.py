"""The answers that a search has computed, in a file, so that an interrupted search goes on.

Lines of JSON, each with its seal (``base.keyed_store``): the first says which search, every
further one a key and the boards that showed the response, by stretch. A last line that was cut
short is left out, and so is a line that was damaged, which is said.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from designer.base.atomic_write import write
from designer.base.errors import InputError
from designer.base.guarded_reading import read_bytes
from designer.base.keyed_store import DAMAGED, UNSEALED, Note, read_line, sealed_line
from designer.base.progress import quiet
from designer.base.seal import json_hash

FORMAT = 2


class AnswerCache:
    """The answers of a search by key, in a file.

    path : the file that holds them; None: memory alone. search : names the search; the file of
    another search is not read. note : called with a message where lines are damaged.

    Raises
    ------
    InputError : the file cannot be read or written.
    """

    def __init__(self, path: Path | None = None, search: str = "", note: Note = quiet) -> None:
        self._path, self._search, self._note = path, search, note
        self._known: dict[str, tuple[int, ...]] = {}
        self.wanted = 0
        """How many answers were wanted, from the file or new."""
        if path is not None:
            self._read(path)

    def get_all(
        self,
        queries: list[Any],
        make: Callable[[list[int]], list[tuple[int, ...]]],
        most: Sequence[int],
    ) -> list[tuple[int, ...]]:
        """The answer to each query, in their order.

        queries : plain data that decides an answer. make : computes the answers to the queries with
        these numbers, which no earlier call or run has answered. most : greatest value of each
        number of an answer; a stored one that is none, or has others, is computed again.
        """
        keys = [_key(self._search, one) for one in queries]
        new = [k for k, key in enumerate(keys) if not _may_be(self._known.get(key), most)]
        self.wanted += len(keys)
        if new:
            answers = dict(zip((keys[k] for k in new), make(new), strict=True))
            self._known |= answers
            self._write(answers)
        return [self._known[key] for key in keys]

    def _read(self, path: Path) -> None:
        expected = "candidates of a search"
        content = read_bytes(path, expected) if path.exists() else b""
        first, *rest = content.split(b"\n")
        head = read_line(first)
        before = first.startswith(b'{"format": 1, ')
        if before:
            self._note(f"{path}: {UNSEALED}")
        if before or not rest or (head is not None and head != self._head()):
            write(path, self._text([]))
            return
        unfinished = rest.pop()  # empty where the last line ends as it ought to
        answers = [_answer(line) for line in rest]
        self._known |= dict(filter(None, answers))
        damaged = sum(each is None for each in (head, *answers))
        if damaged:
            count = "1 line is" if damaged == 1 else f"{damaged} lines are"
            self._note(f"{path}: {count} {DAMAGED}")
        if damaged or unfinished:
            write(path, self._text(list(self._known.items())))

    def _head(self) -> list[Any]:
        return [{"format": FORMAT, "search": self._search}]

    def _text(self, answers: Iterable[tuple[str, tuple[int, ...]]]) -> str:
        lines = [self._head(), *([key, list(ok)] for key, ok in answers)]
        return "".join(f"{sealed_line(line)}\n" for line in lines)

    def _write(self, answers: dict[str, tuple[int, ...]]) -> None:
        if self._path is None:
            return
        lines = [sealed_line([key, list(ok)]) for key, ok in answers.items()]
        try:
            with self._path.open("a", encoding="ascii") as stream:
                stream.write("\n".join(lines) + "\n")
        except OSError as error:
            raise InputError(
                self._path, "the file", error.strerror or str(error), "a file that can be written"
            ) from None


def _may_be(answer: tuple[int, ...] | None, most: Sequence[int]) -> bool:
    """Whether there is an answer, of as many boards as there are at most."""
    if answer is None or len(answer) != len(most):
        return False
    return all(0 <= value <= limit for value, limit in zip(answer, most, strict=True))


def _answer(line: bytes) -> tuple[str, tuple[int, ...]] | None:
    """Key and answer of a line; None where it is damaged."""
    match read_line(line):
        case [str(key), [*ok]] if all(type(v) is int for v in ok):
            return key, tuple(ok)
    return None


def _key(search: str, query: Any) -> str:
    return json_hash([search, query])[:24]
