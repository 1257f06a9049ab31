"""Whether the answer of a study has the noise of its Sobol indices."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def lacks_noise(answer: Mapping[str, Any]) -> bool:
    """Whether an earlier version made the indices, and stored no noise with them.

    answer : as in ``tolerance.json``.
    """
    attributions = [response.get("blame") or {} for response in answer.get("responses", ())]
    indices = [index for attribution in attributions for index in attribution.get("indices", ())]
    return any(i.get("total_error") is None for i in indices if i["total"] is not None)
