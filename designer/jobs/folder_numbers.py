"""The numbers that the work in a design folder was made with, for a user who gives none.

A verb on a folder goes on with the folder's own seed, samples and limits. What the user gives
stands, and where that differs from what is there, ``Folder.decide`` refuses it as it always does.
In these functions ``given`` is what the user says, by the names of ``Options``: None where nothing
is said, and without a name that the verb does not have.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from designer.base.design_folder import Folder, is_design_folder
from designer.base.errors import InputError
from designer.base.manifest import MANIFEST, StageName
from designer.base.schema import literal
from designer.jobs.options import Options
from designer.jobs.study_layers import attributed, attribution_budget
from designer.model.model_file import ModelFile

FIDELITY = "rung"
"""Input of a study's stage: "bandwidth", or not there."""


_WHOLE = (int, "a whole number")
_NUMBER = (int | float, "a number")
_WORDS = (list, "a list of words")
KINDS: Mapping[str, tuple[Any, str]] = {
    "samples": _WHOLE,
    "boards": _WHOLE,
    "seed": _WHOLE,
    "until": _NUMBER,
    "yield": _NUMBER,
    "budget": _NUMBER,
    "layers": _WORDS,
    "without": _WORDS,
    "truth": (str, "a word"),
    FIDELITY: (str, "a word"),
}
"""The kind of each of these inputs, and the kind in words."""


def fidelity_input(options: Options) -> dict[str, str]:
    """The fidelity among a study's inputs. Which engine is asked about the same boards beside the
    exact circuit is a layer; op-amps that lag make another study."""
    return {FIDELITY: options.rung} if options.rung == "bandwidth" else {}


def stage_numbers(
    folder: Folder, stage: StageName, names: Collection[str], limits: Collection[str] = ()
) -> dict[str, Any]:
    """The inputs of these names that a stage of the folder was made with.

    names : numbers that the stage always has. limits : inputs that may be None or empty, which
    means that there is no limit; one without a limit is left out. Empty where there is no such
    stage.

    Raises
    ------
    InputError : an input is not of the kind that the tool writes.
    """
    stages = {} if folder.manifest is None else folder.manifest.stages
    inputs = stages[stage].inputs if stage in stages else {}
    numbers = {name: inputs[name] for name in names if name in inputs}
    numbers |= {name: inputs[name] for name in limits if inputs.get(name) not in (None, [])}
    for name, value in numbers.items():
        kind, expected = KINDS[name]
        words = value if isinstance(value, list) else []
        if (
            not isinstance(value, kind)
            or isinstance(value, bool)
            or not all(isinstance(word, str) for word in words)
        ):
            field = f"stages.{stage}.inputs.{name}"
            raise InputError(folder / MANIFEST, field, literal(value), expected)
    return numbers


def goes_on(model: Path | ModelFile, out: Path, resume: bool) -> bool:
    """Whether a verb goes on with what the folder ``out`` has: it is the verb's argument, or its
    work is to be resumed."""
    argument = isinstance(model, Path) and model.is_dir() and model.resolve() == out.resolve()
    return resume or argument


def of_study(
    model: Path | ModelFile,
    out: Path,
    modelfile: ModelFile,
    options: Options,
    words: Mapping[str, Any],
) -> Options:
    """The options with the numbers of the folder's own study.

    A study that is new has as many samples as the model file lists measured boards, if it does.
    model : the verb's argument; out : the folder. With ``overwrite`` a width in ``until`` is not
    taken over, for nothing else could take it away.
    """
    options = of_list(modelfile, options, words)
    if not goes_on(model, out, options.resume):
        return options
    limits = () if options.overwrite else ("until",)
    names = ("samples", "seed", "layers", FIDELITY)
    return _with(options, stage_numbers(Folder(out), "study", names, limits), words)


def of_list(modelfile: ModelFile, options: Options, words: Mapping[str, Any]) -> Options:
    """The options with as many samples as the model file lists measured boards, if it does."""
    listed = modelfile.measured
    if listed is not None and listed.labels and words["samples"] is None:
        return replace(options, samples=len(listed.labels))
    return options


def of_measured(path: Path, options: Options, words: Mapping[str, Any]) -> Options:
    """The options with the numbers of the study of built boards in a design folder."""
    if not is_design_folder(path):
        return options
    return _with(
        options, stage_numbers(Folder(path), "measured", ("seed", "layers", FIDELITY)), words
    )


def of_search(out: Path, options: Options, words: Mapping[str, Any]) -> Options:
    """The options with the numbers of the search that is resumed in the folder ``out``."""
    if not options.resume:
        return options
    folder = Folder(out)
    return _with(
        options,
        stage_numbers(folder, "search", ("seed",)) | stage_numbers(folder, "study", ("samples",)),
        words,
    )


def _with(options: Options, numbers: dict[str, Any], words: Mapping[str, Any]) -> Options:
    """The options with these numbers of the folder, where ``words`` states none."""
    layers = numbers.pop("layers", None)
    if layers is not None:
        numbers |= {"blame": attributed(layers), "blame_budget": attribution_budget(layers)}
        if "ngspice" not in layers and FIDELITY not in numbers:
            numbers["rung"] = "exact"
    options = replace(options, **{k: v for k, v in numbers.items() if words.get(k, k) is None})
    return options if options.blame else replace(options, blame_budget=None)
