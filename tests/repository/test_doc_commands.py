"""Every command line in the README and the docs runs, and every option named there exists.

The pages' commands run in order in a scratch folder that holds ``examples/``, whose paper.toml is
a small model here, and ``out/paper``, as ``make demo`` leaves it. What takes long is made smaller
by the tables below, each replacement by itself.
"""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from designer.cli import command_line, entry
from tests.shared.doc_commands import PAGES, ROOT, Command, Snippet, commands, snippets
from tests.shared.model_text import SMALL

pytestmark = pytest.mark.docs

DEMO = ["run", "examples/paper.toml", "--samples", "4", "--out", "out/paper"]
"""What ``make demo`` runs, of 4 boards instead of 50."""

SMALLER = {
    # in a command: instead
    "--out out/paper200": "--out out/paper200 --samples 2 --no-blame",
    # the README's study tells what is to blame for losses; what it tells is asked in
    # tests/yields/test_loss_attribution.py
    "--rung exact --samples 2000": "--rung exact --samples 20 --no-blame",
    "--rung exact --samples 1000": "--rung exact --samples 20",
    "--from 0.5 --to 0.95 --steps 121 --and b 0.15 0.35 --region": (
        "--from 0.84 --to 0.86 --steps 3 --and b 0.24 0.26 --region"
    ),
    "--steps 121": "--steps 7",
    "--steps 101": "--steps 5",
    "--steps 1801": "--steps 5 --no-points",
    "--steps 251": "--steps 5",
    "--steps 301 --starts 16": "--steps 3 --starts 2",
    "--steps 200 --map b 0.05 0.5 200": "--steps 4 --map b 0.05 0.5 4",
    "--omega 1.505": "--omega 1.505 --steps 4 --map x2 -1 1 4",
    """--steps 300 --map 'x2'"'"'' -1 1 300""": """--steps 4 --map 'x2'"'"'' -1 1 4""",
    "--steps 241": "--steps 5",
    "--steps 111": "--steps 5",
    "--samples 100 --out out/rig": "--samples 4 --out out/rig --no-blame",
    "tolerance out/rig --tuned": "tolerance out/rig --tuned --no-blame",
    "--shares 200": "--shares 20",
    # how many starts lead where is asked in tests/check/test_coexistence.py
    **{
        f"simulate {what}": f"simulate {what} --starts 2"
        for what in (
            "gap.toml",
            "examples/paper.toml --omega 1.55 --omega 0.85",
            "examples/rig.toml",
        )
    },
    # the boards of pages that are routed and asked in ngspice are the paper's and the rig's
    "run examples/two-shakers.toml": "synthesise examples/two-shakers.toml",
    # the parts of these two are chosen in tests/yields/test_without_period.py and
    # tests/synthesis/test_combinations.py
    "run examples/two-wells-chaos.toml --out out/chaos": (
        "simulate examples/two-wells-chaos.toml --starts 2"
    ),
    "run examples/gears.toml --out out/gears": "simulate examples/gears.toml --starts 2",
}
FILLED = {
    # what a page leaves open, by the command: what a reader would write
    "bifurcation sweep DIR --circuit": "bifurcation sweep out/paper --circuit",
    "synthesise examples/paper.toml --compare --out DIR": (
        "synthesise examples/paper.toml --compare --out out/compared"
    ),
    "synthesise DIR --compare": "synthesise out/paper --compare",
}
IN_PYTHON = {
    "samples=50": "samples=2",
    "made)  # of synthesise()": "_made)",
}
NOT_RUN = {
    # the beginning of a command: why no test runs it here
    "make": "targets of the Makefile: the whole environment, or all the tests",
    "pip": "installs a package",
    "dask": "several machines; tests/jobs/test_dask_runner.py has two processes",
    "python -m reports.makers.robust_design": "hours; it is `make reports`",
    "python -m reports.makers.example_report": "minutes; tests/reports has one",
    "explore": "serves a page until Ctrl-C; tests/explorer has it in a browser",
    "reproduce": "hours; tests/paper has smaller ones",
    "search examples/robust.toml": "minutes; tests/jobs/test_search_job.py has a smaller one",
    "search out/paper --yield": "minutes; tests/jobs/test_repair_whole.py has a smaller one",
    "trade out/paper": "minutes in ngspice; tests/fidelity/test_trade_study.py has a smaller one",
    "tolerance out/paper --samples 100000": "a cluster; tests/jobs/test_dask_runner.py",
    "bench out/": "a record of an oscilloscope: tests/jobs/test_bench_job.py",
    "export out/paper --fab": "KiCad and a routed board: tests/jobs/test_order_export.py",
    "export out/rig --fab": "the same",
    "rules out/paper --board": "KiCad and a board: tests/design_rules/test_rules_board.py",
}
LONG = (
    "README.md",
    "docs/paper-case.md",
    "docs/bifurcations.md",
    "docs/compare.md",
    "docs/examples.md",
    "docs/tolerance.md",
    "docs/tutorial.md",
)


def smaller(command: Command) -> str:
    """The command as it is run here."""
    text = command.text
    for old, new in (*FILLED.items(), *SMALLER.items()):
        text = text.replace(old, new)
    return text


def not_run(command: Command) -> str:
    """Why a command is not run; "" where it is."""
    return next((why for start, why in NOT_RUN.items() if command.text.startswith(start)), "")


def is_run(command: Command) -> bool:
    if not_run(command):
        return False
    return command.text != smaller(command) or not command.is_pattern


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("reader")
    shutil.copytree(ROOT / "examples", path / "examples")
    (path / "examples" / "paper.toml").write_text(SMALL, encoding="utf-8")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (path / "gap.toml").write_text(readme.split("```toml\n")[1].split("```")[0], encoding="utf-8")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(path)
        assert entry.status([*DEMO, "-q"]) == 0
    return path


def verbs() -> dict[str, set[str]]:
    """Options of every verb, by the command line itself."""
    return {
        name: {o for p in verb.params for o in (*p.opts, *p.secondary_opts)} | {"-h", "--help"}
        for name, verb in command_line.application().commands.items()
    }


@pytest.mark.parametrize("page", PAGES)
def test_every_verb_and_option_of_a_page_exists(page: str) -> None:
    known = verbs()
    for command in commands(page):
        if command.program != "designer":
            continue
        verb = command.text.split()[0].strip("`")
        assert verb in known, f"{page}:{command.line}: no verb {verb}"
        missing = set(command.options) - known[verb]
        assert not missing, f"{page}:{command.line}: {verb} has no option {missing}"


@pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")
@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=pytest.mark.slow) if p in LONG else p for p in PAGES]
)
def test_the_commands_of_a_page_run(
    page: str,
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    met = [c for c in commands(page) if c.program == "designer" and is_run(c)]
    codes = snippets(page)
    if not met and not codes:
        return
    scratch: Path = request.getfixturevalue("scratch")
    monkeypatch.chdir(scratch)
    steps: list[Command | Snippet] = [*met, *codes]
    for step in sorted(steps, key=lambda s: s.line):
        capfd.readouterr()
        if isinstance(step, Snippet):
            _run_python(step, scratch)
            continue
        status = entry.status(shlex.split(smaller(step)))
        said = capfd.readouterr().err
        assert status == 0, f"{page}:{step.line}: designer {smaller(step)}: {status}\n{said}"


def _run_python(snippet: Snippet, scratch: Path) -> None:
    text = snippet.text
    for old, new in IN_PYTHON.items():
        text = text.replace(old, new)
    if "_made" in text:  # the page speaks of the result of synthesise()
        text = (
            "from pathlib import Path\nfrom designer.folders.design_source import read_design\n"
            f'_made = read_design(Path("out/paper"))\n{text}'
        )
    script = scratch / "snippet.py"
    script.write_text(text, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, str(script)], cwd=scratch, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{snippet.page}:{snippet.line}: {done.stderr}"


def test_no_table_has_an_entry_that_no_page_needs() -> None:
    every = [command for page in PAGES for command in commands(page)]
    texts = [command.text for command in every]
    code = "\n".join(s.text for page in PAGES for s in snippets(page))
    for fragment in (*SMALLER, *FILLED):
        assert any(fragment in text for text in texts), fragment
    for start in NOT_RUN:
        assert any(text.startswith(start) for text in texts), start
    assert all(fragment in code for fragment in IN_PYTHON)


def test_every_command_is_run_or_named_or_stands_for_many() -> None:
    every = [command for page in PAGES for command in commands(page)]
    assert sum(is_run(c) for c in every) >= 15
    assert sum(bool(not_run(c)) for c in every) >= len(NOT_RUN)
    for command in every:
        assert is_run(command) or not_run(command) or command.is_pattern, command


def test_a_page_is_read_as_a_reader_reads_it() -> None:
    page = commands("docs/paper-case.md")
    texts = [c.text for c in page]
    assert "tolerance out/paper --tuned --reached --map omega" in texts
    assert "simulate examples/paper.toml --omega 1.55 --omega 0.85" in texts
    assert "new mine.toml" in texts
    study = next(c for c in commands("docs/tolerance.md") if "--until" in c.text)
    assert study.is_pattern
    assert "--resume" in study.options  # on a further line of the pattern
    assert len(snippets("docs/paper-case.md")) == 1
