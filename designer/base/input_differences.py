"""In what a folder's work differs from what is asked for now, in words: no hashes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from designer.base.schema import literal

OPTIONS = {
    "seed": "--seed",
    "samples": "--samples",
    "until": "--until",
    "rung": "--rung",
    "yield": "--yield",
    "budget": "--budget",
    "without": "--without",
    "boards": "--boards",
    "truth": "--truth",
    "fabs": "--fab",
    "accepted": "--accept",
    "parameter": "--over",
    "from": "--from",
    "to": "--to",
    "steps": "--steps",
    "region": "--region",
}
"""Inputs that an option gives, by their names."""
THINGS = {
    "model": "model file",
    "catalogue": "catalogue",
    "version": "version of designer",
    "list": "list of measured boards",
    "measured": "list of measured values",
    "board": "board file",
    "parts": "list of parts",
    "work": "sweep",
    "kicad": "KiCad",
    "rules": "rules",
}
"""Inputs that are no option, in words."""
MOST = 4
"""Differences that a message has words for; the rest is counted."""
_HASH = re.compile(r"[0-9a-f]{64}")
_LONGEST = 40


def differences(
    made: Mapping[str, Any], asked: Mapping[str, Any], behind: Mapping[str, tuple[Any, Any]]
) -> str:
    """ "made with --steps 226, asked for 227": every input that differs.

    made, asked : inputs of a stage. behind : what a hash among them is of, as it was made and as it
    is asked for, where both are known.
    """
    parts = []
    for key in sorted({*made, *asked}):
        before, now = made.get(key), asked.get(key)
        if before == now:
            continue
        known = behind.get(key)
        inner = [] if known is None else list(_leaves("", *known))
        if inner:
            parts += inner
        elif known is not None:
            apart = "in its comments alone" if key == "model" else "by the rules of another version"
            parts.append(f"made with another {_name(key)}, {apart}")
        elif _is_hash(before) or _is_hash(now):
            parts.append(_of_hash(key, before, now))
        else:
            parts += _leaves(key, before, now)
    more = len(parts) - MOST
    shown = [*parts[:MOST], *([f"{more} more"] if more > 0 else [])]
    return "; ".join(shown)


def _leaves(place: str, made: Any, asked: Any) -> Iterator[str]:
    """Each value in which two records differ."""
    if made == asked:
        return
    if isinstance(made, Mapping) and isinstance(asked, Mapping):
        for key in dict.fromkeys([*made, *asked]):
            inner = f"{place}.{key}" if place else str(key)
            yield from _leaves(inner, made.get(key), asked.get(key))
    elif _are_tables(made) and _are_tables(asked):
        for index in range(max(len(made), len(asked))):
            pair = [rows[index] if index < len(rows) else None for rows in (made, asked)]
            yield from _leaves(f"{place}[{index + 1}]", *pair)
    elif made is None:
        yield f"made without {_name(place)}, asked for {_text(asked)}"
    elif asked is None:
        yield f"made with {_name(place)} {_text(made)}, asked for without"
    else:
        yield f"made with {_name(place)} {_text(made)}, asked for {_text(asked)}"


def _of_hash(key: str, made: Any, asked: Any) -> str:
    if made is None or asked is None:
        return f"made {'with' if asked is None else 'without'} a {_name(key)}"
    return f"made with another {_name(key)}"


def _name(key: str) -> str:
    return OPTIONS.get(key) or THINGS.get(key) or key


def _is_hash(value: Any) -> bool:
    return isinstance(value, str) and _HASH.fullmatch(value) is not None


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, Mapping) for v in value)


def _text(value: Any) -> str:
    """A value in few words."""
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list | tuple):
        listed = ", ".join(map(_text, value))
        return listed if len(listed) <= _LONGEST else f"{len(value)} values"
    text = value if isinstance(value, str) else literal(value)
    text = "".join(ch if ch.isprintable() else "?" for ch in text)
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "…"
