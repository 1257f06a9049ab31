"""Names of the plots of a page, the same beside their static pictures."""

from __future__ import annotations


def portrait_name(response: int, motion: int) -> str:
    """Name of the portrait of a response, by the numbers of the response and of its motion."""
    return f"portrait {response} {motion}"


def stop_name(clearance: int) -> str:
    """Name of the plot of the dead zone of a clearance."""
    return f"stop {clearance}"
