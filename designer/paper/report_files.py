"""The files of a report: its data, its page and its pictures."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from designer.base.atomic_write import write
from designer.base.figure_style import picture
from designer.base.page import Page, markdown
from designer.base.plain_json import plain

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
