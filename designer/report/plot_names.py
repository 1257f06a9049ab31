"""Names of the plots of a page, the same beside their static pictures."""

from __future__ import annotations


def portrait_name(response: int, clearance: int) -> str:
    """Of one response in one clearance, by their numbers."""
    return f"portrait {response} {clearance}"


def stop_name(clearance: int) -> str:
    """Of the dead zone of a clearance."""
    return f"stop {clearance}"
