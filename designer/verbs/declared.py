"""How a verb is declared: one function, whose signature says what the command line asks.

A parameter with an ``option`` or an ``argument`` is a word of the command line; another is for
Python alone. The command line, its help, its completion and the pages of the reference are derived
from the signature (``cli.app``).
"""

from __future__ import annotations

import builtins
import inspect
import os
import shlex
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin

if TYPE_CHECKING:
    from designer.base.progress import Show
    from designer.model.model_file import ModelFile

GROUPS = ("Design", "Study", "Explore", "Make")
"""The headings of the verbs in the help, in their order."""


@dataclass(frozen=True)
class Word:
    """How the command line spells a parameter."""

    names: tuple[str, ...]
    """Such as ("-q", "--quiet"); none of an argument, which stands by its place."""
    metavar: str | None
    """What stands for its value in the help; None for the usual."""
    help: str
    """A sentence for the help."""
    reads: Any = None
    """The type that the command line reads, where Python takes more; None for the parameter's."""
    decides: bool = True
    """Whether results depend on it: a recorded command line states it then."""


def option(
    names: str, metavar: str | None = None, text: str = "", reads: Any = None, decides: bool = True
) -> Word:
    """An option by its spellings, such as "-q --quiet". text : its help. The rest : of ``Word``."""
    return Word(tuple(names.split()), metavar, text, reads, decides)


def argument(metavar: str, text: str, reads: Any = None) -> Word:
    """A word that stands by its place. text : its help. reads : as of ``Word``."""
    return Word((), metavar, text, reads)


Source = Annotated[
    "Path | str | ModelFile",
    argument("MODEL|DIR", "A model file (TOML) or a design folder.", reads=Path),
]
"""A model file that was read, the path of one, or a design folder."""
DesignDir = Annotated[Path | str, argument("DIR", "A design folder.", reads=Path)]
Out = Annotated[Path | str | None, option("--out", "DIR", "The design folder to write.", Path)]
Samples = Annotated[
    int | None,
    option("--samples", "N", "Boards in the study [200, all of a list, or the folder's own]."),
]
Blame = Annotated[
    bool | None,
    option("--blame/--no-blame", None, "Say which part is to blame [yes, or as the folder has]."),
]
BlameBudget = Annotated[
    int | None, option("--blame-budget", "STEPS", "Most steps of the work on the blame [20000].")
]
Seed = Annotated[int, option("--seed", "N", "Seed of the random numbers.")]
OwnSeed = Annotated[
    int | None, option("--seed", "N", "Seed of the random numbers [1, or the folder's own].")
]
Jobs = Annotated[
    int | None,
    option("--jobs", "N", "Workers at a time [default: all cores].", decides=False),
]
Overwrite = Annotated[
    bool,
    option(
        "--overwrite", None, "Replace files that the folder's manifest.json lists.", decides=False
    ),
]
Resume = Annotated[
    bool, option("--resume", None, "Go on with work that was interrupted.", decides=False)
]


def answer_of(result: Any) -> Mapping[str, Any]:
    """The JSON object of what most verbs return."""
    answer: Mapping[str, Any] = result.answer
    return answer


@dataclass(frozen=True)
class Verb:
    """A function, and what the command line has to know of it beside its signature."""

    function: Callable[..., Any]
    """What the verb does. Its docstring begins with the sentence of the help."""
    group: str
    """One of ``GROUPS``."""
    example: str
    """A command line, which the help shows."""
    show: Callable[[Any], None] = lambda _: None
    """Prints what the function returns for people."""
    json: Callable[[Any], Mapping[str, Any]] | None = answer_of
    """The object for ``--json``; None of a verb that has none."""
    satisfied: Callable[[Any], bool] = lambda _: True
    """Whether what the function returns is a yes: exit status 0."""
    parts: Show | None = None
    """How the design is shown as soon as its parts stand; the function is given what does that as
    ``shown``."""
    early: tuple[Show, Show] | None = None
    """How a study's answer is shown while the work goes on, the first time and then, likewise."""
    computes: bool = True
    """Whether it may need the exact engine, whose compilation is then announced."""

    def words(self) -> Iterator[tuple[inspect.Parameter, Word, Any]]:
        """The parameters that are words of the command line, with the type that it reads."""
        names = _Names(vars(inspect.getmodule(self.function)))
        for parameter in inspect.signature(self.function).parameters.values():
            kind = eval(parameter.annotation, {}, names)  # our own source text
            if get_origin(kind) is Annotated:
                own, word = get_args(kind)
                yield parameter, word, own if word.reads is None else word.reads

    def command(
        self, options: Any, model: Path, out: Path | None, without: Collection[str] = ()
    ) -> str:
        """The command line that makes the same results again.

        Files stand by their last names, so that no path of this machine is in it. Numbers are
        stated, other options where they differ from the usual ones.

        options : a record whose fields have the names of parameters, and the usual values where
        nothing is said. without : names of those that are not stated.
        """
        usual = vars(type(options)())
        values = {**vars(options), "model": model, "out": out}
        line = ["designer", self.function.__name__]
        for parameter, word, _ in self.words():
            name, value = parameter.name, values.get(parameter.name)
            number = isinstance(value, int) and not isinstance(value, bool)
            if not word.decides or name in without or value in (None, ()):
                continue
            if number or value != usual.get(name):
                line += _stated(word, value)
        return shlex.join(line)


def _stated(word: Word, value: Any) -> list[str]:
    """A word with its value, as a shell reads it."""
    if isinstance(value, bool):
        yes, _, no = word.names[-1].partition("/")
        return [yes if value else no]
    if isinstance(value, tuple):
        return [text for each in value for text in _stated(word, each)]
    if isinstance(value, Path):
        value = _last_name(value)
    return [*word.names[-1:], f"{value:g}" if isinstance(value, float) else str(value)]


def _last_name(path: Path) -> str:
    """The last name of a path, never an option; ``.`` and ``..`` by the names they stand for."""
    name = os.path.basename(os.path.abspath(path)) or "."
    name = name.encode("utf-8", "replace").decode("utf-8")  # a name that is no text
    return f"./{name}" if name.startswith("-") else name


class _Names(dict[str, Any]):
    """A module's names; one that only a type checker imports is anything."""

    def __missing__(self, name: str) -> Any:
        if hasattr(builtins, name):
            raise KeyError(name)
        return Any
