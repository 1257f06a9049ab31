"""An option is declared once, in its verb's signature; the rest is derived from there."""

from __future__ import annotations

import ast
import inspect
import shlex
from collections import Counter
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from designer.cli.app import VERBS
from designer.cli.command_line import OTHER_SPELLINGS, application
from designer.jobs.options import Options
from designer.verbs.declared import Verb
from tests.shared.house import trees

DECLARED: dict[str, Verb] = {
    name: import_module(f"designer.verbs.{name}").VERB
    for name in VERBS
    if name not in OTHER_SPELLINGS
}


def test_an_option_is_declared_once() -> None:
    """No spelling with the same help stands twice, and none outside the verbs."""
    found: Counter[str] = Counter()
    for module, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "option":
                assert module.startswith("verbs."), module
                found[" ".join(ast.unparse(each) for each in node.args[::2])] += 1
    assert len(found) > 60
    assert [text for text, count in found.items() if count > 1] == []


@pytest.mark.parametrize("name", DECLARED)
def test_the_command_line_reads_what_the_signature_says(name: str) -> None:
    """Every parameter with a word is an option of the verb with the same default, and no other."""
    verb = DECLARED[name]
    there = {p.name: p for p in application().commands[name].params}
    declared = {parameter.name: parameter for parameter, _, _ in verb.words()}
    every = {"verbose", "quiet", "log", "help"} | ({"json"} if verb.json else set())
    assert there.keys() - every == declared.keys()
    for key, parameter in declared.items():
        usual = None if parameter.default in ((), inspect.Parameter.empty) else parameter.default
        assert (there[key].default or None) == (usual or None), key
    others = inspect.signature(verb.function).parameters.keys() - declared.keys()
    assert others <= {"progress", "shown", "catalog", "ready"}


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("run", Options(), "run m.toml --out o --samples 200 --seed 1"),
        (
            "run",
            Options(7, 3, 40, overwrite=True, resume=True, blame=False, rung="exact", tuned=True),
            "run m.toml --out o --samples 40 --no-blame --seed 7",
        ),
        (
            "tolerance",
            Options(until=0.05, rung="exact", tuned=True, map_=("b", "omega-grade"), cluster="x"),
            "tolerance m.toml --out o --samples 200 --until 0.05 --rung exact --tuned --map b "
            "--map omega-grade --seed 1",
        ),
        (
            "tolerance",
            Options(measured=Path("/far/away/a list.csv"), reached=True, blame_budget=9),
            "tolerance m.toml --out o --samples 200 --reached --measured 'a list.csv' "
            "--blame-budget 9 --seed 1",
        ),
        (
            "search",
            Options(rung="ngspice"),
            "search m.toml --out o --samples 200 --rung ngspice --seed 1",
        ),
    ],
)  # fmt: skip
def test_a_recorded_command_is_read_as_it_was_meant(
    name: str, options: Options, said: str, tmp_path: Path
) -> None:
    """What it states comes back from the parser; what changes no result is not stated."""
    verb = DECLARED[name]
    line = verb.command(options, tmp_path / "m.toml", tmp_path / "o")
    assert line == f"designer {said}"
    context: Any = application().commands[name].make_context(name, shlex.split(line)[2:])
    read = context.params
    assert (read["samples"], read["seed"]) == (options.samples, options.seed)
    if name == "tolerance":
        assert tuple(each.value for each in read["map_"] or ()) == options.map_
        assert (read["until"], read["tuned"], read["reached"]) == (
            options.until,
            options.tuned,
            options.reached,
        )


@pytest.mark.parametrize("name", ["run", "tolerance", "search"])
def test_what_decides_a_result_can_be_recorded(name: str) -> None:
    """Every such option is a field of ``Options``."""
    decides = {parameter.name for parameter, word, _ in DECLARED[name].words() if word.decides}
    assert decides - {"model", "out"} <= set(vars(Options()))


def test_no_path_of_this_machine_is_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "bench"
    here.mkdir()
    monkeypatch.chdir(here)
    rest = "--samples 200 --seed 1"
    for out, last in (
        (tmp_path / "out", "out"),
        (Path("out/"), "out"),
        (Path("."), "bench"),
        (Path("../-x"), "./-x"),
        (Path("/"), "."),
        (Path("\udcff"), "'?'"),
    ):
        line = DECLARED["run"].command(Options(), tmp_path / "my model.toml", out)
        assert line == f"designer run 'my model.toml' --out {last} {rest}"
    line = DECLARED["tolerance"].command(Options(), here, None, without=("samples",))
    assert line == "designer tolerance bench --seed 1"
