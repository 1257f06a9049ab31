"""JSON Schema of the tables of a file, so that editors complete and check what people write.

The schema allows everything that the file's reader accepts, and may allow more: a reader also
looks at what keys say together.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import is_dataclass
from itertools import pairwise
from typing import Any, get_args, get_type_hints

from pydantic import TypeAdapter

Json = Mapping[str, Any]
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def listed(items: Json, least: int = 0, most: int | None = None) -> dict[str, Any]:
    """A list of what ``items`` allows."""
    length = {"minItems": least} | ({} if most is None else {"maxItems": most})
    return {"type": "array", "items": items, **length}


def either(*schemas: Json) -> dict[str, Any]:
    """What one of several allows."""
    return {"anyOf": list(schemas)}


def of_tables(table: type) -> dict[str, Any]:
    """Schema of a record of tables (``schema.FileTable``), the tables in it below ``$defs``.

    Each key has the docstring of its field and, in words, what it accepts.
    """
    schema: dict[str, Any] = TypeAdapter(table).json_schema()
    own = {each.__name__: each for each in set(_tables_in(table))}
    for name, node in [(table.__name__, schema), *schema["$defs"].items()]:
        for key, words in _docstrings(own[name]).items():
            if key in node["properties"]:
                node["properties"][key]["description"] = words
    out: dict[str, Any] = _plain(schema)
    return out


def _tables_in(annotation: Any) -> Iterator[type]:
    """The records of an annotation, and of the fields of these."""
    if isinstance(annotation, type) and is_dataclass(annotation):
        yield annotation
        for hint in get_type_hints(annotation, include_extras=True).values():
            yield from _tables_in(hint)
    for each in get_args(annotation):
        yield from _tables_in(each)


def _docstrings(table: type) -> dict[str, str]:
    """The docstrings of a record's fields; Python itself drops them."""
    out = dict[str, str]()
    for each in filter(is_dataclass, reversed(table.__mro__)):
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(each))).body
        assert isinstance(body, ast.ClassDef)
        for field, words in pairwise(body.body):
            match field, words:
                case (
                    ast.AnnAssign(target=ast.Name(id=name)),
                    ast.Expr(value=ast.Constant(value=str(text))),
                ):
                    out[name] = text
    return out


def _plain(node: Any) -> Any:
    """A part of pydantic's schema: descriptions for people, and nothing of Python in it."""
    if isinstance(node, list):
        return [_plain(each) for each in node if each != {"type": "null"}]
    if not isinstance(node, dict):
        return node
    out = {key: _plain(value) for key, value in node.items() if not _is_title(key, value)}
    if not isinstance(out.get("default", 0), int | float | str | list):  # of Python's own records
        del out["default"]
    if isinstance(out.get("description"), str):
        out["description"] = _words(out["description"], out.pop("x-expected", ""))
    if len(out.get("anyOf", ())) == 1:
        out |= out.pop("anyOf")[0]
    return out


def _words(docstring: str, expected: str) -> str:
    """The first paragraph of a docstring and what is expected, on one line."""
    text = " ".join(docstring.partition("\n\n")[0].split()).replace("``", "")
    return f"{text} Expected: {expected}." if expected else text


def _is_title(key: str, value: object) -> bool:
    """Titles are the names of Python's fields and classes once more."""
    return key == "title" and isinstance(value, str)
