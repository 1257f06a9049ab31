"""How a verb is declared: one function, whose signature says what the command line asks.

A parameter with an ``option`` or an ``argument`` is a word of the command line; another is for
Python alone. The command line, its help, its completion and the pages of the reference are derived
from the signature (``cli.app``). ``help()`` shows types, and below the docstring what each word is.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import os
import shlex
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
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
    option(
        "--blame/--no-blame",
        None,
        "Attribute losses to parts: say which is to blame [yes, or as the folder has].",
    ),
]
BlameBudget = Annotated[
    int | None, option("--blame-budget", "STEPS", "Most steps of the attribution [20000].")
]
Rare = Annotated[
    bool, option("--rare", None, "Also how many of a million are lost, drawn where they are.")
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
class Kind:
    """One of the things that a verb does, with a help page of its own: a word after the verb's."""

    name: str
    """The word, such as "map"."""
    help: str
    """What it does, in a sentence."""
    words: str
    """The parameters that it has besides those of every kind; those with a "!" it must be given."""
    example: str
    """A command line, which the help shows."""
    given: Mapping[str, Any] = field(default_factory=dict)
    """Parameters that the word itself decides."""
    texts: Mapping[str, str] = field(default_factory=dict)
    """Help of parameters that mean less here than of the verb as a whole."""

    def required(self, parameter: str) -> bool | None:
        """Whether this kind must be given a parameter; None of one that it does not have."""
        words = self.words.split()
        return True if f"{parameter}!" in words else False if parameter in words else None


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
    satisfied: Callable[[Any], bool] = lambda result: getattr(result, "satisfied", True)
    """Whether what the function returns is a yes: exit status 0. By default what it says of
    itself."""
    parts: Show | None = None
    """How the design is shown as soon as its parts stand; the function is given what does that as
    ``shown``."""
    early: tuple[Show, Show] | None = None
    """How a study's answer is shown while the work goes on, the first time and then, likewise."""
    computes: bool = True
    """Whether it may need the exact engine, whose compilation is then announced."""
    beside: Callable[..., AbstractContextManager[object]] = lambda **_: nullcontext()
    """Given the words of the command line, starts a process before anything is imported here."""
    kinds: tuple[Kind, ...] = ()
    """What it does, each by its name, where it does several things."""
    declared: inspect.Signature = field(init=False)
    """The function's signature with its words; the function itself shows types alone."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "declared", inspect.signature(self.function))
        names = self._names
        plain = [
            parameter.replace(annotation=_type(parameter.annotation, names))
            for parameter in self.declared.parameters.values()
        ]
        self.function.__signature__ = self.declared.replace(parameters=plain)  # type: ignore[attr-defined]
        before, raises, after = (inspect.getdoc(self.function) or "").partition("\n\nRaises\n")
        self.function.__doc__ = f"{before}\n\n{self._described(plain)}{raises}{after}"

    def _described(self, plain: Iterable[inspect.Parameter]) -> str:
        """The section of a docstring that says what each word is."""
        types, lines = {each.name: each.annotation for each in plain}, ["Parameters", "-" * 10]
        for parameter, word, _ in self.words():
            spelled = " ".join([*word.names[-1:], *([word.metavar] if word.metavar else [])])
            lines.append(f"{parameter.name} : {types[parameter.name]}")
            lines.append(f"    {word.help}" + (f" (``{spelled}``)" if word.names else ""))
        return "\n".join(lines)

    @property
    def _names(self) -> _Names:
        return _Names(vars(inspect.getmodule(self.function)))

    def words(self, kind: Kind | None = None) -> Iterator[tuple[inspect.Parameter, Word, Any]]:
        """The parameters that are words of the command line, with the type that it reads.

        kind : only those that it has; what it must be given has no usual value.
        """
        names = self._names
        for parameter in self.declared.parameters.values():
            annotation = eval(parameter.annotation, {}, names)  # our own source text
            if get_origin(annotation) is not Annotated:
                continue
            own, word = get_args(annotation)
            required = False if kind is None else kind.required(parameter.name)
            if required is None:
                continue
            if required:
                parameter = parameter.replace(default=inspect.Parameter.empty)
            if kind is not None and parameter.name in kind.texts:
                word = replace(word, help=kind.texts[parameter.name])
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


def _type(annotation: str, names: Mapping[str, Any]) -> str:
    """The type in a parameter's annotation, without how the command line spells it."""
    expression = ast.parse(annotation, mode="eval").body
    if isinstance(expression, ast.Subscript) and isinstance(expression.slice, ast.Tuple):
        outer, own = ast.unparse(expression.value), expression.slice.elts[0]
        return ast.unparse(own) if outer == "Annotated" else annotation
    kind = names.get(annotation)
    if get_origin(kind) is not Annotated:
        return annotation
    own_type = get_args(kind)[0]
    text = getattr(own_type, "__forward_arg__", None) or inspect.formatannotation(own_type)
    return str(text).replace("pathlib.", "")


def _stated(word: Word, value: Any) -> list[str]:
    """A word with its value, as a shell reads it."""
    if isinstance(value, bool):
        yes, _, no = word.names[-1].partition("/")
        return [yes if value else no]
    if isinstance(value, tuple):
        return [text for each in value for text in _stated(word, each)]
    if isinstance(value, Path):
        value = _last_name(value)
    return [*word.names[-1:], _number(value) if isinstance(value, float) else str(value)]


def _number(value: float) -> str:
    """A number as short as it is read again."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)


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
