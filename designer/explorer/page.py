"""The page of a model: its controls, its plots, and the state that it begins with."""

from __future__ import annotations

import json
from functools import cache

from bokeh.resources import Resources
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from designer.explorer import plots
from designer.explorer.controls import Control, controls
from designer.explorer.place import first_place
from designer.explorer.response_view import shown_motions
from designer.model.model_file import ModelFile

ASSETS = ("explore.css", "explore.js", "bokeh.js")
"""Names of the files that a served page loads."""


@cache
def asset(name: str) -> str:
    """The text of one of ``ASSETS``; Bokeh's own script comes with Bokeh."""
    if name == "bokeh.js":
        return "\n".join(Resources(mode="inline", components=["bokeh"]).js_raw)
    return _templates().get_template(name).render()


@cache
def _templates() -> Environment:
    loader = PackageLoader("designer.explorer", "templates")
    return Environment(
        loader=loader,
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def page(modelfile: ModelFile) -> str:
    """The page that ``server`` gives out; it loads ``ASSETS`` from beside itself."""
    css, *scripts = ("explore.css", "bokeh.js", "explore.js")
    styles = f'<link rel="stylesheet" href="{css}">'
    loads = "".join(f'<script src="{name}"></script>' for name in scripts)
    return _render(modelfile, styles, loads, {})


def _render(modelfile: ModelFile, styles: str, loads: str, more: dict[str, object]) -> str:
    each = controls(modelfile)
    (omega,) = (control for control in each if control.name == "omega")
    data = _script_text({"plots": plots.items(omega), **more})
    return (
        _templates()
        .get_template("explore.html.j2")
        .render(
            title=modelfile.title,
            motions=[
                each.label for each in shown_motions(first_place(modelfile).model.second_order())
            ],
            stem=stem_for(modelfile),
            plots=plots.TITLES.items(),
            groups=_groups(each),
            styles=Markup(styles),
            scripts=Markup(f'<script type="application/json" id="page">{data}</script>{loads}'),
        )
    )


def stem_for(modelfile: ModelFile) -> str:
    """The name under which a place is saved unless another is typed."""
    source = modelfile.source
    return f"{'model' if source is None else source.stem}-explored"


def _groups(each: tuple[Control, ...]) -> list[tuple[str, list[Control]]]:
    drive = [control for control in each if control.drive]
    return [("Drive", drive), ("Model", [c for c in each if not c.drive])]


def _script_text(data: object) -> str:
    """JSON that may stand inside a script of a page, whatever texts it has."""
    return json.dumps(data, allow_nan=False).replace("<", "\\u003c")
