"""What a search has asked boards already, kept in a file so that an interrupted one goes on.

Lines of JSON: the first says which search, every further one a key and the boards that showed the
response, by stretch. A last line that was cut short is left out.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from designer.base.errors import InputError

FORMAT = 1


class Memory:
    """Answers by key. path : where they are kept; in memory alone if None. whose : names the
    search; what another one left is not read.

    Raises
    ------
    InputError : the file cannot be read or written.
    """

    def __init__(self, path: Path | None = None, whose: str = "") -> None:
        self._path, self._whose = path, whose
        self._known: dict[str, tuple[int, ...]] = {}
        self.asked = 0
        """How many answers were wanted, known or not."""
        if path is not None:
            self._read(path)

    def get_all(
        self, said: list[Any], make: Callable[[list[int]], list[tuple[int, ...]]]
    ) -> list[tuple[int, ...]]:
        """The answers to many. make : those of the questions with these numbers."""
        keys = [_key(one) for one in said]
        new = [k for k, key in enumerate(keys) if key not in self._known]
        self.asked += len(keys)
        if new:
            made = dict(zip((keys[k] for k in new), make(new), strict=True))
            self._known |= made
            self._write(made)
        return [self._known[key] for key in keys]

    def _read(self, path: Path) -> None:
        try:
            lines = path.read_text(encoding="ascii").splitlines() if path.exists() else []
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(path, "the file", str(error), "candidates of a search") from None
        head = self._head()
        if not lines or lines[0] != head:
            self._put(f"{head}\n", new=True)
            return
        whole = []
        for line in lines[1:]:
            try:
                key, ok = json.loads(line)
                self._known[str(key)] = tuple(int(v) for v in ok)
            except (ValueError, TypeError):
                break
            whole.append(line)
        if len(whole) < len(lines) - 1:
            self._put("\n".join([head, *whole]) + "\n", new=True)

    def _head(self) -> str:
        return json.dumps({"format": FORMAT, "search": self._whose})

    def _write(self, made: dict[str, tuple[int, ...]]) -> None:
        if self._path is not None:
            lines = [json.dumps([key, list(ok)]) for key, ok in made.items()]
            self._put("\n".join(lines) + "\n", new=False)

    def _put(self, text: str, *, new: bool) -> None:
        assert self._path is not None
        try:
            with self._path.open("w" if new else "a", encoding="ascii") as stream:
                stream.write(text)
        except OSError as error:
            raise InputError(
                self._path, "the file", error.strerror or str(error), "a file that can be written"
            ) from None


def _key(said: Any) -> str:
    text = json.dumps(said, sort_keys=True)
    return hashlib.sha256(text.encode("ascii")).hexdigest()[:24]
