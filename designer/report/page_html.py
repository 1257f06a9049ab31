"""A page as one file of HTML that loads nothing."""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path

from bokeh.settings import settings as bokeh_settings
from jinja2 import Environment
from markupsafe import Markup, escape

from designer.base.html_templates import page_templates
from designer.base.page import Page, PageSection
from designer.base.script_policy import script_source
from designer.report.design_page import FORMAT
from designer.report.inline_svg import VARIABLES

_NPQ = r"(?:\d+-\d+-\d+|n-p-q|n-q-p)"
_WHOLE = re.compile(rf"(?:ω = [\d.]+|[\d.]+ [mkM]?Hz)(?: \({_NPQ}\))?|(?<![\w-]){_NPQ}(?![\w-])")


def render_page(page: Page, plots: Mapping[str, str] | None = None, boards: str = "") -> str:
    """A page as one file of HTML that loads nothing. plots : the documents that its pictures name
    (``interactive_plots.plots``). boards : those of a study (``board_columns.boards_json``)."""
    names = ["tables.js", *["plots.js"] * bool(plots), *["boards.js"] * bool(boards)]
    scripts = [_script(name) for name in names]
    blocks: dict[str, Markup] = {}
    allowed = [script_source(script) for script in scripts]
    if plots:
        library = (Path(bokeh_settings.bokehjs_path()) / "js" / "bokeh.min.js").read_text("utf-8")
        allowed.append(script_source(library))
        blocks["bokeh"] = _packed(library)
        blocks["plots"] = _packed(json.dumps({"colours": VARIABLES, "items": plots}))
    if boards:
        blocks["board-data"] = _packed(boards)
    return (
        _templates()
        .get_template("page.html.j2")
        .render(page=page, format=FORMAT, scripts=scripts, allowed=allowed, blocks=blocks)
    )


def render_sections(sections: Sequence[PageSection]) -> str:
    """Sections as they stand in such a page."""
    macros = vars(_templates().get_template("blocks.html.j2").module)
    return str(macros["sections"](sections))


@cache
def _templates() -> Environment:
    templates = page_templates("designer.report")
    templates.filters["text"] = _unbroken
    return templates


def _packed(text: str) -> Markup:
    """A text as a page carries it for its scripts: zlib's form in base64. Nothing in it is HTML."""
    return Markup(base64.b64encode(zlib.compress(text.encode("utf-8"), 9)).decode())


def _script(name: str) -> Markup:
    """A script of the package, as it stands in a page."""
    file = resources.files("designer.report") / "templates" / name
    return Markup(file.read_text("utf-8"))


def _unbroken(value: object) -> Markup:
    """Any text in HTML: no line ends inside an n-p-q, or between a frequency and its n-p-q."""
    text = str(escape(str(value)))
    return Markup(_WHOLE.sub(lambda m: f'<span class="whole">{m[0]}</span>', text))
