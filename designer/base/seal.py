"""Hashes, and seals: bytes that carry their own SHA-256, so that damage shows without another file.

Whoever writes puts ``BLANK`` into the content, anywhere that its format allows and after all other
text. ``sealed`` puts the digest of everything, with the blank still in it, in its place.
"""

from __future__ import annotations

import hashlib
import json
from typing import Any

MARK = "designer-sha256:"
DIGITS = 64
BLANK = MARK + "0" * DIGITS


def sha256(content: bytes) -> str:
    """The hash of some bytes, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def json_hash(value: Any) -> str:
    """The hash of JSON data, in whatever order its keys are."""
    return sha256(json.dumps(value, sort_keys=True).encode("ascii"))


def sealed(content: bytes) -> bytes:
    """The content with its last blank filled in.

    Raises
    ------
    ValueError : there is no blank.
    """
    at = content.rindex(BLANK.encode("ascii")) + len(MARK)
    return content[:at] + sha256(content).encode("ascii") + content[at + DIGITS :]


def intact(content: bytes) -> bool | None:
    """Whether the content is as it was sealed, to the last bit; None where it has no seal."""
    at = content.rfind(MARK.encode("ascii"))
    if at < 0:
        return None
    at += len(MARK)
    blank = content[:at] + b"0" * DIGITS + content[at + DIGITS :]
    return content[at : at + DIGITS] == sha256(blank).encode("ascii")
