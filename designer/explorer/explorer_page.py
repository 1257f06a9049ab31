"""The page of a model: its controls, its plots, and the state that it begins with."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from functools import cache

from bokeh.resources import Resources
from jinja2 import Environment
from markupsafe import Markup

from designer.base.html_templates import page_templates
from designer.base.script_policy import script_source
from designer.explorer import plots
from designer.explorer.controls import Control, controls, length_unit, units_note
from designer.explorer.folder_losses import FolderLosses
from designer.explorer.omega_strip import PERIODS
from designer.explorer.place import OMEGA, first_place
from designer.explorer.response_view import IN_SIGHT, shown_motions
from designer.explorer.wire import Message
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
    return page_templates("designer.explorer")


def page(
    modelfile: ModelFile, losses: FolderLosses | None = None, asked: Collection[str] = ()
) -> str:
    """The page that ``server`` gives out; it loads ``ASSETS`` from beside itself. losses : of the
    model's folder. asked : words of its address."""
    css, *scripts = ("explore.css", "bokeh.js", "explore.js")
    return _render(
        modelfile,
        styles=Markup(f'<link rel="stylesheet" href="{css}">'),
        scripts=Markup("".join(f'<script src="{name}"></script>' for name in scripts)),
        shown=controls(modelfile, asked),
        losses=losses,
    )


def recorded_page(
    modelfile: ModelFile, recording: Message, losses: FolderLosses | None = None
) -> str:
    """The page as one file: it carries ``ASSETS``, and the answers that it shows.

    recording : what ``saved_page.message_of`` makes. Only the slider of ω is there. losses : of
    the model's folder.
    """
    scripts = [asset("bokeh.js"), asset("explore.js")]
    loads = "".join(f"<script>{script}</script>" for script in scripts)
    return _render(
        modelfile,
        styles=Markup(f"<style>{asset('explore.css')}</style>"),
        scripts=Markup(loads),
        shown=tuple(each for each in controls(modelfile) if each.name == OMEGA),
        recording=recording,
        losses=losses,
        allowed=[script_source(script) for script in scripts],
    )


def _render(
    modelfile: ModelFile,
    *,
    styles: Markup,
    scripts: Markup,
    shown: tuple[Control, ...],
    recording: Message | None = None,
    losses: FolderLosses | None = None,
    allowed: Sequence[str] = (),
) -> str:
    each = controls(modelfile, [control.name for control in shown])
    (omega,) = (control for control in each if control.name == OMEGA)
    motions = shown_motions(first_place(modelfile).model.second_order())
    if recording is not None:
        motions = motions[: len(recording["views"][0]["motions"])]
    unit, scale = length_unit(modelfile)
    items = plots.items(omega, unit, motions[0].motion.symbol)
    if recording is None:
        items |= plots.map_item()
    data = _script_text(
        {
            "plots": items,
            "recording": recording,
            "losses": None if losses is None else losses.message(),
            "settled_within": PERIODS,
            "in_sight": IN_SIGHT,
            "length": {"unit": unit, "scale": scale},
        }
    )
    return (
        _templates()
        .get_template("explore.html.j2")
        .render(
            title=modelfile.title,
            motions=[motion.label for motion in motions],
            stem=stem_for(modelfile),
            plots=plots.TITLES,
            units=units_note(modelfile),
            groups=_groups(shown),
            axes=each,
            upward=next(control.name for control in each if control.name != OMEGA),
            fixed=[control for control in each if control not in shown],
            recorded=recording is not None,
            losses=losses,
            allowed=allowed,
            styles=styles,
            data=Markup(data),
            scripts=scripts,
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
