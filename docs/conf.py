"""Settings of the documentation site: ``make site`` builds it into ``out/site``.

Pages are Markdown that reads well in a repository too. What only the code knows is written when
the site is built: the keys of the model file from their JSON Schema, the command line from its
help, the Python functions from their docstrings, and each number that names its source.
Warnings are errors.

A number of a page names its source in a comment right behind it, which no reader sees::

    200<!--=base.defaults.SAMPLES-->               a value of the package ``designer``
    5<!--=yields.tolerance_study.GROWTH:.0%-->     in a format of Python, without its %
    0.20<!--=reports/a/b.json#rows.0.error:.2f-->  a value of a report

The build puts the value of the source in the place of the number.
"""

from __future__ import annotations

import json
import pkgutil
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from click.testing import CliRunner
from sphinx.application import Sphinx

from designer.base.version import __version__
from designer.cli.app import VERBS
from designer.cli.command_line import application
from designer.model.model_file import json_schema

project = "designer"
author = "The designer maintainers"
copyright = author
release = version = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]
myst_heading_anchors = 4
suppress_warnings = ["misc.highlighting_failure"]  # a language without colours is plain text
html_theme = "furo"
html_title = f"designer {release}"
html_copy_source = False
html_show_sphinx = False
autodoc_typehints = "description"
smartquotes_action = "qe"  # an option keeps its two hyphens
autodoc_member_order = "bysource"
napoleon_google_docstring = False

_NUMBER = re.compile(
    r"(?P<stands>-?\d+(?: \d{3})*(?:\.\d+)?(?:e-?\d+)?)"
    r"(?P<comment><!--=(?P<source>[^\s:>]+)(?::(?P<form>[^\s>]+))?-->)"
)
_OUTSIDE = re.compile(r"\[([^\]]+)\]\(\.\./([^)]+)\)")
_REFERENCE = re.compile(r"#/\$defs/(\w+)")
_HELP = {"COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb"}
"""How help is printed: as wide as a page, in plain text."""


def setup(site: Sphinx) -> None:
    site.connect("builder-inited", _write_pages)
    site.connect("builder-inited", _write_numbers)
    site.connect("source-read", _name_files_of_the_repository)


def _name_files_of_the_repository(site: Sphinx, page: str, source: list[str]) -> None:
    """A link out of ``docs/`` leads to a file of the repository, which the site does not hold."""
    source[0] = _OUTSIDE.sub(r"\1 (`\2` in the repository)", source[0])


def _write_pages(site: Sphinx) -> None:
    """The pages that only the code knows, below ``docs/reference``."""
    for name, lines in (("model-file-keys", _keys()), ("command-line", _commands())):
        page, text = Path(site.srcdir, "reference", f"{name}.md"), "\n".join(lines) + "\n"
        if not page.exists() or page.read_text("utf-8") != text:  # else Sphinx reads it again
            page.write_text(text, "utf-8")


def _write_numbers(site: Sphinx) -> None:
    """The numbers whose source a page names, in the pages that are written by hand."""
    for page in Path(site.srcdir).glob("*.md"):
        text = page.read_text("utf-8")
        filled, found = _NUMBER.subn(lambda one: _number(**one.groupdict()) + one["comment"], text)
        if found != text.count("<!--="):
            raise ValueError(f"{page.name}: a source that follows no number")
        if filled != text:
            page.write_text(filled, "utf-8")


def _number(source: str, form: str | None, stands: str, **_: str) -> str:
    """The value of a source as a page writes it, in the place of what stands there.

    Raises:
        ValueError, KeyError: the source is not there, or is no number, or what stands there may be
            two numbers.
    """
    if source.startswith("reports/"):
        file, _, keys = source.partition("#")
        value = json.loads((Path(__file__).parents[1] / file).read_text("utf-8"))
        for key in keys.split("."):
            value = value[int(key) if isinstance(value, list) else key]
    else:
        value = pkgutil.resolve_name(f"designer.{source}")
    if form is None:
        form = "_" if value >= 10_000 else "g"
    written = format(value, form).replace("_", " ").removesuffix("%")
    if " " in stands and " " not in written:
        raise ValueError(f"{source}: {stands} is one number of a page, or two?")
    return re.sub(r"e[+]?(-?)0*", r"e\1", written)


def _commands() -> Iterator[str]:
    """The help of every verb."""
    yield "# Every option of the command line"
    yield ""
    yield (
        "Look up a verb and its options. This page is the help that `designer VERB --help` prints. "
        "[What you may build on](../contract.md) says what each verb writes."
    )
    parser = application()
    for verb in VERBS:
        for name in (verb, *(n for n in parser.commands if n.startswith(f"{verb} "))):
            shown = CliRunner().invoke(parser, [name, "--help"], env=_HELP, prog_name="designer")
            level = "##" if name == verb else "###"
            yield from ("", f"{level} designer {name}", "", "```text", shown.output.strip(), "```")


def _keys() -> Iterator[str]:
    """The model file, from the schema that editors check it by."""
    yield "# Every key of the model file"
    yield ""
    yield (
        "Look up a key, what it means and what it accepts. This page is made from the JSON Schema "
        "that `designer new` writes beside a model file. [The model file](../model-file.md) "
        "explains the tables by example."
    )
    schema = json_schema()
    tables = schema["$defs"]
    for name, place in _places(schema).items():
        table = tables[name]
        yield from ("", f"## {place}", "", "| key | what it is | default |", "|---|---|---|")
        for key, value in table["properties"].items():
            words = " ".join(value.get("description", "").split()).replace("|", "\\|")
            yield f"| `{key}` | {words} | {_default(value, key in table.get('required', ()))} |"


def _places(schema: Mapping[str, Any]) -> dict[str, str]:
    """How a file spells each table, by the name of its schema: ``[[response]]``, ``[circuit]``."""
    out: dict[str, str] = {}
    for whole in schema["anyOf"]:
        for key, value in whole["properties"].items():
            for name in _REFERENCE.findall(repr(value)):
                out.setdefault(name, f"`[[{key}]]`" if "'items'" in repr(value) else f"`[{key}]`")
    for name in list(out):
        for key, value in schema["$defs"][name]["properties"].items():
            for inner in _REFERENCE.findall(repr(value)):
                out.setdefault(inner, f"A table of `{key}` in {out[name]}")
    return out


def _default(value: Mapping[str, Any], required: bool) -> str:
    if required:
        return "required"
    return f"`{value['default']}`" if "default" in value else ""
