"""Text for terminals and logs: what comes from files and names moves no cursor there.

Whatever the tool prints for people passes ``printable``: lines by ``tell``, tables by
``verbs.console``, progress by ``base.progress``, the log by its formatter, messages of errors as
they are made.
"""

from __future__ import annotations

import re
import sys

_CONTROLS = re.compile(
    "[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f"  # controls but tab and line feed
    "\\u061c\\u200e\\u200f\\u202a-\\u202e\\u2066-\\u2069"  # turn the direction of writing
    "\\u2028\\u2029\\ud800-\\udfff]"  # other line ends; halves of characters
)


def printable(text: str) -> str:
    """The text with "?" for each character that would steer a terminal; lines stay lines."""
    return _CONTROLS.sub("?", text)


def one_line(text: str) -> str:
    """The same on one line."""
    return printable(text.replace("\n", "?").replace("\t", " "))


def tell(text: str) -> None:
    """A line, or lines, on standard error."""
    print(printable(text), file=sys.stderr, flush=True)
