"""Fourier series of the usual waveforms, each with a peak of 1 and rising through 0 at 0."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count, islice
from typing import Literal

Waveform = Literal["square", "triangle", "sawtooth"]


def series(waveform: Waveform, terms: int) -> Iterator[tuple[int, float]]:
    """(n, amplitude of sin nθ) of the first ``terms`` harmonics that the waveform has."""
    return islice(_terms(waveform), terms)


def _terms(waveform: Waveform) -> Iterator[tuple[int, float]]:
    if waveform == "sawtooth":
        yield from ((n, (-1.0) ** (n + 1) * 2.0 / (math.pi * n)) for n in count(1))
    for n in count(1, 2):
        if waveform == "square":
            yield n, 4.0 / (math.pi * n)
        else:
            yield n, (-1.0) ** (n // 2) * 8.0 / (math.pi * n) ** 2
