"""Text of a model file in everything that a design folder holds: it stays text, whatever it says.

Titles, reasons of rules and names of boards are hostile. Each kind of file is read by a parser of
its own, and has the elements, statements and control words of the folder with harmless text.
"""

from __future__ import annotations

import csv
import io
import re
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

import designer
from designer.base.toml_writer import toml_text
from designer.board.sexpr import read
from designer.cli import entry
from designer.model.model_file import ModelFile, parse_model_file
from tests.shared.model_text import SMALL
from tests.shared.quick_folders import quick_folder

pytestmark = [
    pytest.mark.slow,
    pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once"),
]

PIECES = (
    "<script>alert(1)</script>", "<img src=x onerror=y>", "</title>", "</script>", "]]>", "-->",
    "<!--", "{{7*7}}", "{% raw %}", "${HOME}", "$(id)", "`id`", "; rm x", "|", "&&", "&amp;",
    '"', "'", "\\", "\\n", "%s", "%0a", "(", ")", "[", "]", "[x](javascript:y)", "# x", "* x",
    "> x", "=1+1", "+1", "-1", "@SUM(A1)", ".include /etc/passwd", ".end", ".control", "*", "R1",
    "+ R1 0 0 1", "../../x", "/etc/x", "C:\\x", "~", "CON", "\u202e", "\u00a0", "µΩ", "𝛀", "x",
)  # fmt: skip
hostile_text = (
    st.lists(st.sampled_from(PIECES), min_size=1, max_size=8)
    .map(" ".join)
    .filter(lambda text: bool(text.strip()) and text.isprintable() and len(text) <= 200)
)


def file(title: str) -> ModelFile:
    data = parse_model_file(SMALL).data
    data["rules"] = {"offset-force": {"limit": 0.5, "reason": title}}
    return parse_model_file(toml_text({"format": data.pop("format"), "title": title, **data}))


def folder(title: str, out: Path) -> Path:
    """With a design, a study of listed boards of these names, rules, a report and a project."""
    made = quick_folder(file(title).text, out / "design")
    listed = out / "boards.csv"
    with listed.open("w", encoding="utf-8", newline="") as stream:
        rows = csv.writer(stream)
        rows.writerow(["part", "value", "board"])
        rows.writerows(["R1", "22.1k", name] for name in (title[:40], "second"))
    designer.tolerance(made, measured=listed, rung="exact", blame=False, jobs=1)
    designer.rules(made)
    designer.export(made)
    designer.export(made, deck=["ltspice", "portable"])
    return made


class _Tags(HTMLParser):
    """Elements with the names of their attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.met = Counter[str]()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.met[" ".join([tag, *sorted(name for name, _ in attrs)])] += 1
        for name, value in attrs:
            assert not name.startswith("on"), (tag, name)
            assert name not in ("href", "src") or "javascript:" not in (value or "").lower()


def of_html(text: str) -> Counter[str]:
    """Elements with their attributes, how often aside: a longer text is cut into more lines. Of
    scripts the number counts."""
    met = _Tags(text).met
    return Counter(set(met)) + Counter({"script": sum(n for k, n in met.items() if "script" in k)})


def of_svg(text: str) -> Counter[str]:
    """Elements, but those that a longer line of text is made of."""
    met = Counter(element.tag for element in ElementTree.fromstring(text).iter())
    return Counter(set(met))


def of_deck(text: str) -> Counter[str]:
    """First words of statements. A line that goes on begins with +."""
    return Counter(
        line.split()[0].lower() for line in text.splitlines() if line[:1] not in ("*", "")
    )


def of_project(text: str) -> Counter[str]:
    """Heads of the lists of an S-expression, but of the lines of text that a title is cut into."""
    met, open_lists = Counter[str](), [read(text)]
    while open_lists:
        each = open_lists.pop()
        if each.name not in ("gr_text", "text"):
            met[each.name] += 1
            open_lists += each.children
    return met


def of_table(text: str) -> Counter[str]:
    """Columns; no cell is a formula."""
    rows = list(csv.reader(io.StringIO(text)))
    for cell in (cell for row in rows for cell in row):
        assert not re.match(r"[=+@\t\r]|-(?![\d.])", cell), cell
    return Counter(rows[0] if rows else [])


def of_markdown(text: str) -> Counter[str]:
    """Raw elements and links outside of blocks of code."""
    shown = "\n".join(line for line in text.splitlines() if not line.startswith("    "))
    raw = re.findall(r"(?<!\\)<[a-zA-Z/!]", shown)
    return Counter(raw + re.findall(r"(?<!\\)\]\(([a-z]+:)", shown))


READ: dict[str, Callable[[str], Counter[str]]] = {
    ".html": of_html,
    ".svg": of_svg,
    ".cir": of_deck,
    ".net": of_deck,
    ".kicad_sch": of_project,
    ".kicad_pcb": of_project,
    ".csv": of_table,
    ".md": of_markdown,
}


def shape(made: Path) -> dict[str, Counter[str]]:
    """What each file of a folder is made of, by its place; names that come from the title aside."""
    out = dict[str, Counter[str]]()
    for path in sorted(made.rglob("*")):
        if path.name == "measured.csv":  # the user's own list, kept as it is
            assert path.read_bytes() == (made.parent / "boards.csv").read_bytes()
        elif path.is_file() and path.suffix in READ:
            place = path.relative_to(made)
            name = place.name if len(place.parts) == 1 else f"{place.parent}/*{path.suffix}"
            out[name] = out.get(name, Counter()) + READ[path.suffix](path.read_text("utf-8"))
    return out


@pytest.fixture(scope="module")
def harmless(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Counter[str]]:
    return shape(folder("harmless", tmp_path_factory.mktemp("harmless")))


def check(title: str, harmless: dict[str, Counter[str]], place: Path) -> None:
    made = folder(title, place)
    found = shape(made)
    assert found.keys() == harmless.keys()
    for name, met in found.items():
        assert met == harmless[name], (name, met - harmless[name], harmless[name] - met)
    assert {path.name for path in place.iterdir()} == {"design", "boards.csv"}


@pytest.mark.parametrize(
    "title",
    [
        '=1+1 "x" <script>alert(1)</script> ]]> --> </title> [x](javascript:y)',
        "../../x ) ( \\ .include /etc/passwd .end {{7*7}} {% raw %} ${HOME} $(id) `id`",
    ],
)
def test_hostile_text_is_text_in_every_file(
    title: str, harmless: dict[str, Counter[str]], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    check(title, harmless, tmp_path)
    assert entry.status(["tolerance", str(tmp_path / "design")]) == 0
    said = "".join(capfd.readouterr())
    assert all(character.isprintable() or character == "\n" for character in said)


def test_any_hostile_text_is_text_in_every_file(
    harmless: dict[str, Counter[str]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    @settings(max_examples=3, suppress_health_check=list(HealthCheck))
    @given(hostile_text)
    def each(title: str) -> None:
        check(title, harmless, tmp_path_factory.mktemp("hostile"))

    each()
