"""Whether the answer of a study has the noise of its Sobol indices."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from designer.answers.study_answer import StudyKeys


def lacks_noise(answer: StudyKeys) -> bool:
    """Whether an earlier version made the indices, and stored no noise with them."""
    attributions = [response.get("blame") for response in answer["responses"]]
    indices = [index for blame in attributions if blame for index in blame["indices"]]
    return any(i.get("total_error") is None for i in indices if i["total"] is not None)
