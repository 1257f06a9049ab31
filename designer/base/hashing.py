"""Hashes of content."""

from __future__ import annotations

import hashlib


def sha256(content: bytes) -> str:
    """Hash of some bytes, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()
