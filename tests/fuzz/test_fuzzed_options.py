"""Every verb with words that nobody means: answered, or refused by name; never an accident.

The words go in where a user's go in. Work stops where it would begin, so that what is asked is
what the verbs read, check and say before it.
"""

from __future__ import annotations

import asyncio
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from functools import cache
from importlib import import_module
from pathlib import Path
from random import Random
from typing import Any, Literal, get_args, get_origin

import pytest

from designer.base.printed import printable
from designer.centering import stage_choice
from designer.cli import entry
from designer.cli.app import VERBS
from designer.explorer import saved_page, server
from designer.jobs import board_routing, dask_runner, export_job, search_stage, stage_runner
from designer.paper import reproduce_circuit, reproduce_dynamics, reproduce_tolerance
from designer.spice import opamp_check
from designer.spice.pool import SpicePool
from designer.verbs.declared import Verb, Word
from tests.shared.exploring import EXPLORING, quick
from tests.shared.model_text import SMALL
from tests.shared.quick_folders import quick_folder
from tests.shared.stopped_work import work_stopped

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

SWEEP = "model.toml --from 1 --to 0.9 --steps 3".split()
EACH = 25
"""Command lines of one run."""
FEW, MANY = 4, 400 if EXPLORING else 40
"""Runs of the quick test, and of the slow one."""
HOSTILE = (
    "", " ", "-", "--", "-1", "nan", "inf", "-inf", "1e308", "1e999", "-1e-308", "9" * 400,
    "9" * 5000, "0", "00", "0x10", "1_0", "²", "١", "½", "1 mm", "10 Hz", "0 Hz", "-3 V", "1:2",
    "=", "a=b", "x1=", "=1", "x1=1:", "x1=2:1", "x1=nan:1", "v1=CH1,v1=CH2", "v1=", ",", ";", "a b",
    "omega", "b", "zeta", "x1", "x1'", "frequency", "exact", "auto", "ideal", "grade", "1-2-2",
    "x" * 100_000, "[" * 5000, "a\nb", "a\tb", "\x1b[31mred", "\x9b2J", "\u202egpj", "\u2028",
    "\ufeff", "é", "\U0001f600", "\udcff", "$(id)", "`id`", "; rm x", "{name}", "%s%n", "{0}",
    "<script>alert(1)</script>", "=cmd|' /C calc'!A0", "tcp://127.0.0.1:1", "tcp://", "http://x",
    "x" * 70, "a..b", "::1", "256.1.1.1", "con",
)  # fmt: skip
PATHS = (
    "model.toml", "design", "nothing", "nothing/below", "../here/model.toml", "full", "folder",
    "folder/", "model.toml/below", "fifo", "loop", "x" * 300, "x/" * 1000, "-x", "--help", ".",
    "..", "", " ", "a\nb", "\x1b[2J.toml", "\udcff.toml", "design/bom.csv", "design/manifest.json",
    "design/kicad", "design/kept.npz", "é.toml", "con", "link",
)  # fmt: skip
"""Places in the folder of a test: files, folders, and names of neither."""
HOSTS = ("127.0.0.1", "::1", "", "a..b", "x" * 70, "\udcff", "a\nb", "127.0.0.1:80", "[::1]")
"""Of the rest a name server would be asked."""
LOGS = ("log.txt", "full", "design", "nothing/below", "loop", "x" * 300)
NUMBERS = ("1", "2", "3", "7", "0.5", "0.85", "1.2", "100", "1000000", "100000000000", "-7")

SOUND = {
    ("new", "path"): ("new.toml",),
    ("reproduce", "what"): ("dynamics", "circuit", "tolerance"),
}
"""What a verb's argument may be where it is no model and no folder."""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a design folder in it."""
    place = tmp_path_factory.mktemp("options")
    quick_folder(SMALL, place / "design")
    return place


@pytest.fixture
def here(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder of a user, two below what nothing may be written into."""
    place = tmp_path / "above" / "here"
    shutil.copytree(made, place)
    (place / "folder").mkdir()
    (place / "model.toml").write_text(SMALL, encoding="utf-8")
    (place / "full").symlink_to("/dev/full")
    (place / "loop").symlink_to("loop")
    (place / "link").symlink_to("design")
    os.mkfifo(place / "fifo")
    monkeypatch.chdir(place)
    return place


@pytest.fixture
def work_begins(made: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What comes after the words were read stops at once, as by Ctrl-C."""

    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    for place, name in (
        (stage_choice, "synthesise"),
        (SpicePool, "map"),
        (board_routing, "route_board"),
        (export_job, "checked"),
        (opamp_check, "checks"),
        (reproduce_circuit, "reproduce"),
        (reproduce_dynamics, "reproduce"),
        (reproduce_tolerance, "reproduce"),
        (saved_page, "record"),
        (search_stage, "look"),
    ):
        monkeypatch.setattr(place, name, stop)
    monkeypatch.setattr(stage_runner, "compiling_ahead", lambda *_: nullcontext(lambda: None))
    monkeypatch.setattr(dask_runner, "PATIENCE", 0.2)
    monkeypatch.setattr(server, "_serve", lambda _explorer, listening, _started: listening.close())
    monkeypatch.setattr(asyncio, "run", lambda _: None)
    with work_stopped(made / "design"):
        yield


@cache
def declared(name: str) -> Verb:
    spelled = {"synthesize": "synthesise"}.get(name, name)
    verb: Verb = import_module(f"designer.verbs.{spelled}").VERB
    return verb


def values(reads: Any) -> Iterator[Any]:
    """The types of the values that an option takes."""
    inner = [each for each in get_args(reads) if each is not type(None)]
    if get_origin(reads) is Literal:
        yield str
    elif get_origin(reads) is tuple:
        for each in inner:
            yield from values(each)
    elif inner:
        yield from values(inner[0])
    else:
        yield reads


def one_value(kind: Any, word: Word, dice: Random) -> str:
    if word.names == ("--host",):
        return dice.choice(HOSTS)
    if kind is Path or (word.metavar or "") in ("FILE", "DIR", "PATH", "MODEL|DIR"):
        return dice.choice(PATHS)
    return dice.choice(NUMBERS) if dice.random() < 0.3 else dice.choice(HOSTILE)


def command_line(name: str, dice: Random) -> list[str]:
    """A verb with its argument, mostly a sound one, and one to three of its options."""
    words = list(declared(name).words())
    line = [name]
    for parameter, word, reads in words:
        if not word.names:
            (kind,) = values(reads)
            sound = SOUND.get((name, parameter.name), ("model.toml", "design"))
            line.append(dice.choice(sound) if dice.random() < 0.8 else one_value(kind, word, dice))
    options = [each for each in words if each[1].names]
    for _, word, reads in dice.sample(options, min(len(options), dice.choice((1, 1, 2, 3)))):
        if reads is bool or bool in get_args(reads):
            line.append(dice.choice(word.names[-1].split("/")))
        else:
            line += [word.names[-1], *(one_value(kind, word, dice) for kind in values(reads))]
    if dice.random() < 0.2:
        line += dice.choice((["--json"], ["-v"], ["-q"], ["--log", dice.choice(LOGS)]))
    return line


def outside(here: Path) -> set[Path]:
    return {path for path in here.parents[1].rglob("*") if here not in (path, *path.parents)}


def run(line: Sequence[str], capfd: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Exit status, and what a terminal shows."""
    capfd.readouterr()
    status = entry.status(list(line))
    return status, "".join(capfd.readouterr())


@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "number",
    quick(range(FEW + MANY), FEW),
)
@pytest.mark.usefixtures("work_begins")
def test_words_that_nobody_means_are_answered_or_refused(
    number: int, here: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    before = outside(here)
    for seed in range(number * EACH, (number + 1) * EACH):
        dice = Random(seed)
        line = command_line(dice.choice(VERBS), dice)
        status, said = run(line, capfd)
        told = f"{seed}: {[word[:80] for word in line]}: {said[-3000:]}"
        assert status in (0, 1, 2, 3, 130), told
        assert "internal error" not in said, told
        assert "Traceback" not in said, told
        assert "Logging error" not in said, told
        assert said == printable(said), told
        assert len(said) < 100_000, told
        assert outside(here) == before, told


@pytest.mark.usefixtures("work_begins")
@pytest.mark.parametrize(
    ("line", "field"),
    [
        (["explore", "model.toml", "--host", "a..b", "--no-browser"], "--host"),
        (["explore", "model.toml", "--host", "é" * 70, "--no-browser"], "--host"),
        (["explore", "model.toml", "--token", "a&b", "--no-browser"], "--token"),
        (["explore", "model.toml", "--token", "a\nb", "--no-browser"], "--token"),
        (["explore", "model.toml", "--token", "", "--no-browser"], "--token"),
        (["search", "x" * 300], "MODEL|DIR"),
        (["bifurcation", *SWEEP, "--shares", "2", "--seed", "-1"], "--seed"),
        (["tolerance", "design", "--seed", "9" * 400], "--seed"),
        (["trade", "design", "--boards", "9" * 400], "--boards"),
        (["simulate", "loop"], "MODEL|DIR"),
        (["rules", "design", "--junit", "x" * 300], "--junit"),
        (["bench", "design", "--record", "model.toml", "--record", "loop"], "--record"),
    ],
)
def test_it_is_refused_by_its_name(
    line: list[str], field: str, here: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    status, said = run(line, capfd)
    assert (status, field in said) == (2, True), said


def test_a_log_that_can_no_longer_be_written_stops_nothing(
    here: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The disk is full: that is said once, and the verb answers."""
    status, said = run(["new", "it.toml", "--log", "/dev/full"], capfd)
    assert status == 0, said
    assert (here / "it.toml").is_file()
    assert said.count("the log ends here: No space left on device") == 1
    assert "Traceback" not in said
