"""The report: what was asked, what was found, how many boards will work, what to buy.

``report.html`` is one file that loads nothing; ``report.md`` says the same as text. Both are made
from the same page (``report.design_page``), hold no time and no path, and are equal for equal
results and command lines.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
import zlib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

from bokeh.settings import settings as bokeh_settings
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from designer.base.atomic_write import write
from designer.base.page import Page, markdown
from designer.report.board_columns import boards_json
from designer.report.data import ReportData
from designer.report.design_page import FORMAT, design_page
from designer.report.inline_svg import VARIABLES
from designer.report.interactive_plots import plots
from designer.report.pictures import pictures

_NPQ = r"(?:\d+-\d+-\d+|n-p-q|n-q-p)"
_WHOLE = re.compile(rf"ω = [\d.]+(?: \({_NPQ}\))?|(?<![\w-]){_NPQ}(?![\w-])")


def write_report(data: ReportData, html: Path, text: Path) -> None:
    """Write both reports; each appears whole or not at all.

    Raises
    ------
    InputError : a file cannot be written.
    """
    for path, render in ((text, render_markdown), (html, render_html)):
        write(path, render(data))


def render_html(data: ReportData) -> str:
    """``report.html`` as text."""
    return render_page(design_page(data, pictures(data)), plots(data), boards_json(data))


def render_page(page: Page, plots: Mapping[str, str] | None = None, boards: str = "") -> str:
    """A page as one file of HTML that loads nothing. plots : the documents that its pictures name
    (``interactive_plots.plots``). boards : those of a study (``board_columns.boards_json``)."""
    templates = Environment(
        loader=PackageLoader("designer.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    templates.filters["text"] = _unbroken
    template = templates.get_template("page.html.j2")
    names = ["tables.js", *["plots.js"] * bool(plots), *["boards.js"] * bool(boards)]
    scripts = [_script(name) for name in names]
    blocks: dict[str, Markup] = {}
    allowed = [_digest(script) for script in scripts]
    if plots:
        library = (Path(bokeh_settings.bokehjs_path()) / "js" / "bokeh.min.js").read_text("utf-8")
        allowed.append(_digest(library))
        blocks["bokeh"] = _packed(library)
        blocks["plots"] = _packed(json.dumps({"colours": VARIABLES, "items": plots}))
    if boards:
        blocks["board-data"] = _packed(boards)
    return template.render(
        page=page, format=FORMAT, scripts=scripts, allowed=allowed, blocks=blocks
    )


def _packed(text: str) -> Markup:
    """A text as a page carries it for its scripts: zlib's form in base64. Nothing in it is HTML."""
    return Markup(base64.b64encode(zlib.compress(text.encode("utf-8"), 9)).decode())


def _script(name: str) -> Markup:
    """A script of the package, as it stands in a page."""
    file = resources.files("designer.report") / "templates" / name
    return Markup(file.read_text("utf-8"))


def _digest(script: str) -> str:
    """What a page's policy allows a script by: nothing else runs, whatever a text holds."""
    digest = hashlib.sha256(script.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def render_markdown(data: ReportData) -> str:
    """``report.md`` as text."""
    return markdown(design_page(data, {}))


def _unbroken(value: object) -> Markup:
    """Any text in HTML: no line ends inside an n-p-q, or between a frequency and its n-p-q."""
    text = str(escape(str(value)))
    return Markup(_WHOLE.sub(lambda m: f'<span class="whole">{m[0]}</span>', text))
