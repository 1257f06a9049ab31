"""The files of a report on the paper: its data, its page and its pictures."""

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
) -> None:
    """Write them into the report's folder.

    data : name and content of its JSON file, which is written first. figures : by name, without
    ending. forms : of "png" and "svg".
    """
    name, document = data
    text = json.dumps(plain(document), indent=1, ensure_ascii=False, allow_nan=False)
    write(out / name, f"{text}\n")
    for title, figure in figures.items():
        for form in forms:
            write(out / f"{title}.{form}", picture(figure, form))
    write(out / README, markdown(page))
