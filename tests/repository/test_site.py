"""The documentation site builds without a warning, and holds what only the code knows."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from designer.cli.app import VERBS
from tests.shared.doc_commands import ROOT

pytestmark = pytest.mark.docs


STORED = {
    str(page.relative_to(ROOT)): page.read_text("utf-8") for page in (ROOT / "docs").rglob("*.md")
}
"""The pages that the build writes, or whose numbers it writes, as they were before it."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "docs", str(out)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return out


def test_every_page_is_on_the_site(site: Path) -> None:
    pages = {page.stem for page in (ROOT / "docs").glob("*.md")}
    assert pages <= {page.stem for page in site.glob("*.html")}
    begin = (site / "index.html").read_text("utf-8")
    missing = {page for page in pages - {"index"} if f'href="{page}.html"' not in begin}
    assert missing == set(), "no way leads from the first page to these"
    assert "Search.setIndex" in (site / "searchindex.js").read_text("utf-8")
    assert 'id="search-results"' in (site / "search.html").read_text("utf-8")


@pytest.mark.parametrize(
    "word",
    "excit restitut beam neimark acceler backlash graz corner derat yield hysteresi shaker "
    "continu floquet poincar".split(),
)
def test_the_search_knows_the_field_s_words(word: str, site: Path) -> None:
    """By the stems that the site's search looks for."""
    index = (site / "searchindex.js").read_text("utf-8")
    assert re.search(rf'[{{,]"?{word}[^":,]*"?:', index), word


def test_options_keys_and_functions_stand_on_it(site: Path) -> None:
    verbs = (site / "reference" / "command-line.html").read_text("utf-8")
    assert [verb for verb in VERBS if f"designer {verb}" not in verbs] == []
    keys = (site / "reference" / "model-file-keys.html").read_text("utf-8")
    for spelt in ("[[response]]", "[circuit]", "[[clearance]]", "[base]", "upper_stiffness"):
        assert spelt in keys
    functions = (site / "reference" / "python-api.html").read_text("utf-8")
    for name in ("run", "synthesise", "tolerance", "simulate", "bifurcation", "Study.yields_table"):
        assert f'id="designer.{name}"' in functions


def test_no_page_of_the_site_asks_another_host(site: Path) -> None:
    for page in site.rglob("*.html"):
        text = page.read_text("utf-8")
        assert 'src="http' not in text, page
        assert '<link rel="stylesheet" type="text/css" href="http' not in text, page


@pytest.mark.parametrize("name", STORED)
def test_what_the_code_writes_is_stored_as_it_is_now(name: str, site: Path) -> None:
    """A clone holds the pages that the build writes, so that links lead somewhere, and the numbers
    that it takes from code and reports."""
    assert (ROOT / name).read_text("utf-8") == STORED[name]
