"""The answer of ``search MODEL``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NotRequired

from designer.answers.cure_answer import CureAnswer
from designer.answers.study_answer import RunAnswer


class SearchKeys(RunAnswer):
    search: Mapping[str, Any]
    confirmation: Mapping[str, Any]


class SearchAnswer(SearchKeys):
    """What ``search MODEL`` prints."""

    cure: NotRequired[CureAnswer]
    """Where one was asked for."""
