"""Names of the plots of a page, the same beside their static pictures."""

from __future__ import annotations


def portrait_name(response: int, motion: int) -> str:
    """Of one response by one of its motions, by their numbers."""
    return f"portrait {response} {motion}"


def stop_name(clearance: int) -> str:
    """Of the dead zone of a clearance."""
    return f"stop {clearance}"
