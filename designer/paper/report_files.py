"""The files of a report: its data, its page and its pictures; the command that makes them."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from designer.base.atomic_write import write
from designer.base.errors import DesignerError
from designer.base.figure_style import picture
from designer.base.page import Page, markdown
from designer.base.plain_json import plain
from designer.base.progress import progress_for

README = "README.md"


def write_files(
    out: Path,
    data: tuple[str, Mapping[str, Any]],
    page: Page,
    figures: Mapping[str, Figure],
    forms: Sequence[str] = ("png",),
    dpi: float = 160.0,
) -> None:
    """Write them into the report's folder.

    data : name and content of its JSON file, which is written first. figures : by name, without
    ending. forms : of "png" and "svg". dpi : of the PNG.
    """
    name, document = data
    text = json.dumps(plain(document), indent=1, ensure_ascii=False, allow_nan=False)
    write(out / name, f"{text}\n")
    for title, figure in figures.items():
        for file_format in forms:
            write(out / f"{title}.{file_format}", picture(figure, file_format, dpi))
    write(out / README, markdown(page))


def make_report(
    report: Callable[..., object], parser: ArgumentParser, arguments: Sequence[str] | None
) -> int:
    """Make the report that a command line asks for; the exit status.

    report : takes what the parser reads, by name. arguments : the command line; None for this
    process's.
    """
    asked = parser.parse_args(arguments)
    try:
        with progress_for(False):
            report(**vars(asked))
    except DesignerError as error:
        print(f"{parser.prog.rpartition('.')[2]}: {error}", file=sys.stderr)
        return error.exit_status
    return 0
