"""What the docs say of options, defaults and files is what the code has, and is said once."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from designer.base import defaults, design_folder
from designer.bifurcations import parameter_map
from designer.board.bom_layouts import file_of
from designer.cli import command_line
from designer.dynamics.steady_state import TransientSettings
from designer.folders import board_files
from designer.folders.study_cache import CACHE
from designer.jobs import trade_job
from designer.model.board_table import BoardSpec

DOCS = Path(__file__).resolve().parents[2] / "docs"
CONTRACT = (DOCS / "contract.md").read_text("utf-8")
ROOT = command_line.application()
VERBS = {name: verb for name, verb in ROOT.commands.items() if not verb.hidden}


def options(verb: str) -> dict[str, object]:
    """Every spelling of a verb's options, with the default."""
    found: dict[str, object] = {}
    for option in VERBS[verb].params:
        if option.param_type_name == "option":
            names = [*option.opts, *option.secondary_opts]
            found |= dict.fromkeys(names, option.default)
    return found


def section(title: str) -> str:
    return CONTRACT.split(f"\n## {title}\n", 1)[1].split("\n## ", 1)[0]


def test_the_contract_lists_the_verbs_that_there_are() -> None:
    rows = re.findall(r"^\| `designer ([a-z]+)", section("Verbs"), re.MULTILINE)
    assert set(rows) == VERBS.keys()


SEEDED = sorted(verb for verb in VERBS if "--seed" in options(verb) and verb != "reproduce")


@pytest.mark.parametrize(
    ("verb", "option", "default"),
    [
        ("run", "--samples", defaults.SAMPLES),
        ("tolerance", "--samples", defaults.SAMPLES),
        ("trade", "--boards", defaults.TRADE_BOARDS),
        *((verb, "--seed", defaults.SEED) for verb in SEEDED),
    ],
)
def test_a_default_is_one_constant(verb: str, option: str, default: int) -> None:
    """The option's own, or where it may be the folder's, the number that its help begins with."""
    own = options(verb)[option]
    (said,) = (getattr(p, "help", "") for p in VERBS[verb].params if option in p.opts)
    assert own == default or (own is None and re.search(rf"\[{default}[],]", said))


def test_the_defaults_of_the_library_are_those_of_the_commands() -> None:
    from designer.jobs.options import Options
    from designer.jobs.trade_job import TradeExtent

    assert TradeExtent().boards == defaults.TRADE_BOARDS
    assert (Options().samples, Options().seed) == (defaults.SAMPLES, defaults.SEED)


@pytest.mark.parametrize(
    ("option", "usual", "maps"),
    [
        ("--periods", TransientSettings().settle, parameter_map.COURSE.settle),
        ("--keep", TransientSettings().keep, parameter_map.COURSE.keep),
    ],
)
def test_the_help_of_bifurcation_has_its_defaults(option: str, usual: int, maps: int) -> None:
    (found,) = [p for p in VERBS["bifurcation"].params if option in p.opts]
    assert f"[{usual}; maps {maps}]" in str(getattr(found, "help", ""))


def paragraphs(page: Path) -> list[str]:
    """Texts of a page between blank lines; each item of a list, and each row of a table, by itself.
    Blocks of code are left out."""
    text = re.sub(r"^```.*?^```$|^ {4}[^\n]*$", "", page.read_text("utf-8"), flags=re.M | re.S)
    return re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) |\|)", text)


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda page: page.name)
def test_no_paragraph_is_longer_than_a_hundred_words(page: Path) -> None:
    longest = max(paragraphs(page), key=lambda text: len(text.split()))
    assert len(longest.split()) <= 100, longest


def test_the_docs_can_be_read_in_a_day() -> None:
    """Words with a letter or a digit, of the pages that are written by hand."""
    words = " ".join(page.read_text("utf-8") for page in DOCS.glob("*.md")).split()
    assert sum(any(map(str.isalnum, word)) for word in words) <= 35_000


def test_the_readme_is_one_screen() -> None:
    assert len((DOCS.parent / "README.md").read_text("utf-8").split()) <= 900


def files_of_the_contract() -> list[str]:
    table = section("Design folder").split("\n\n")
    (rows,) = [t for t in table if t.startswith("| File |")]
    first = [row.split(" | ")[0] for row in rows.splitlines()[2:]]
    return [name for cell in first for name in re.findall(r"`([^`]+)`", cell)]


def test_no_file_is_listed_twice() -> None:
    said = files_of_the_contract()
    assert sorted(said) == sorted(set(said))


def test_the_files_that_are_written_are_listed() -> None:
    written = {
        *design_folder.DESIGN_FILES,
        *design_folder.REPORTS,
        design_folder.TOLERANCE,
        design_folder.COMPARISON,
        *design_folder.COMPARISON_PICTURES,
        board_files.BILL,
        board_files.NOTES,
        board_files.DRAWING,
        board_files.PICTURE,
        CACHE,
        file_of("NAME"),
        *trade_job.NAMES,
    }
    assert written <= set(files_of_the_contract())


def test_the_layouts_of_the_bill_are_called_alike_everywhere() -> None:
    for page in DOCS.glob("*.md"):
        names = set(re.findall(r"\bbom-([\w]+)\.csv", page.read_text("utf-8")))
        assert names <= {"NAME", *BoardSpec().bom}, page
