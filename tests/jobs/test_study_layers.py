"""Which layers a study gets beside those that it has."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from designer.base.design_folder import Folder
from designer.jobs.options import Options
from designer.jobs.study_layers import NOISE, layers_of, merged

INPUTS = {"seed": 1}
OLD = {"first": 0.1, "total": 0.2}
NEW = OLD | {"first_error": 0.01, "total_error": 0.02}


def folder_of(index: dict[str, float], options: Options, complete: bool = True) -> Folder:
    """A folder whose study has an attribution with this index."""
    stage = SimpleNamespace(inputs={**INPUTS, "layers": layers_of(options)}, complete=complete)
    answer: dict[str, Any] = {"responses": [{"blame": {"indices": [index]}}, {"blame": None}]}
    manifest = SimpleNamespace(stages={"study": stage})
    return cast(Folder, SimpleNamespace(manifest=manifest, json=lambda name: answer))


@pytest.mark.parametrize(
    ("index", "asked", "complete", "anew"),
    [
        (OLD, True, True, True),
        (OLD, False, True, False),
        (NEW, True, True, False),
        (OLD, True, False, False),  # what goes on has its attribution before it
    ],
)
def test_noise_is_a_layer_where_it_is_asked_for_and_lacks(
    index: dict[str, float], asked: bool, complete: bool, anew: bool
) -> None:
    folder = folder_of(index, Options(), complete)
    options = merged(folder, INPUTS, Options(attribution_anew=asked))
    assert options.attribution_anew == anew
    assert (NOISE in layers_of(options)) == anew
    other = merged(folder, {"seed": 2}, Options(attribution_anew=asked))
    assert NOISE not in layers_of(other)


def test_a_study_whose_noise_was_made_anew_stays_the_same_study() -> None:
    stored = Options(attribution_anew=True)
    for asked in (Options(), Options(attribution_anew=True)):
        options = merged(folder_of(NEW, stored), INPUTS, asked)
        assert layers_of(options) == layers_of(stored)
