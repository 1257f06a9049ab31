"""The map over two parameters: its points, its colours, its borders, and what is refused."""

from __future__ import annotations

import base64
from itertools import islice
from typing import Any

import numpy as np
import pytest

from designer import InputError, read_model_file
from designer.dynamics.attractors import settle
from designer.explorer import response_map
from designer.explorer.place import read_place
from designer.explorer.response_map import COLUMNS, ROWS, borders, mapped, read_map
from designer.explorer.wire import Message
from designer.model.driven import model_flow
from designer.plots.response_colours import response_palette
from tests.explorer.served import EXAMPLES

PAPER = read_model_file(EXAMPLES / "paper.toml")
PLACE = read_place(PAPER, {"omega": "0.85"})


def asked(**words: str) -> response_map.MapRequest:
    return read_map(PAPER, PLACE, {"x": "omega", "y": "b", **words})


def unpacked(line: Message) -> np.ndarray:
    return np.stack(
        [np.frombuffer(base64.b64decode(line["data"][key]["f4"]), dtype="<f4") for key in "xy"], 1
    )


def test_it_shows_at_its_points_what_rest_settles_on() -> None:
    """The periodic points of the first level against the engine of single motions."""
    pieces = mapped(asked())
    head = next(pieces)
    assert (head["x"]["low"], head["x"]["high"], head["y"]["low"]) == ("0.68", "1.02", "0.2")
    cells = list(islice((cell for piece in pieces for cell in piece["cells"]), 18))
    settled = [cell for cell in cells if cell[2][0].isdigit()]
    assert len(settled) > 5
    for i, j, response in settled[::2]:
        omega = 0.68 + 0.34 * j / (COLUMNS - 1)
        model = PLACE.model.changed({"b": 0.2 + 0.1 * i / (ROWS - 1)})
        assert settle(model_flow(model, omega), np.zeros(4)).response == response


def test_every_point_comes_once_and_coarse_ones_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(response_map, "COLUMNS", 9)
    monkeypatch.setattr(response_map, "ROWS", 17)
    # Within the window of 1-1-1 a point takes some periods and no more.
    words = {"x_low": "1.5", "x_high": "1.6", "y_low": "0.24", "y_high": "0.26"}
    pieces = list(mapped(asked(**words)))[1:]
    places = [(i, j) for piece in pieces for i, j, _ in piece["cells"]]
    assert sorted(places) == [(i, j) for i in range(17) for j in range(9)]
    strides = [piece["stride"] for piece in pieces]
    assert strides == sorted(strides, reverse=True)
    assert all(i % piece["stride"] == 0 for piece in pieces for i, _, _ in piece["cells"])
    assert pieces[-1]["done"] == pieces[-1]["of"] == 153
    assert pieces[-1]["looks"] == response_palette({"1-1-1": 153})
    assert pieces[-1]["legend"] == [[pieces[-1]["looks"]["1-1-1"], "1-1-1: 100.0%"]]


@pytest.mark.slow
def test_an_orbit_changes_at_its_borders() -> None:
    """Inside each border 1-2-2 stands; a little past the fold it is gone, past the pitchfork it is
    not symmetric any more."""
    last = list(borders(asked(x_low="0.78", x_high="0.93", y_low="0.245", y_high="0.255")))[-1]
    assert last["words"] == "Borders of 1-2-2, symmetric"
    kinds = [text for _, text in last["legend"]]
    assert kinds == ["pitchfork", "fold"]
    orbit = settle(model_flow(PLACE.model, 0.85), np.zeros(4))
    for line, side in zip(last["curves"], (-1.0, 1.0), strict=True):
        points = unpacked(line)
        assert np.isfinite(points).all()
        omega, b = points[len(points) // 2].tolist()
        model = PLACE.model.changed({"b": b})

        def followed(by: float, omega: float = omega, model: Any = model) -> tuple[str, Any]:
            x, way = orbit.start, np.linspace(0.85, omega * (1.0 + by), 12)
            for each in way:
                there = settle(model_flow(model, float(each)), x)
                x = there.start
            return there.response, there.symmetric

        assert followed(-side * 2e-3) == ("1-2-2", True)
        assert followed(side * 2e-3) != ("1-2-2", True)


def test_borders_that_are_not_looked_for_have_a_reason() -> None:
    chaos = read_place(PAPER, {"omega": "0.95"})
    (message,) = borders(read_map(PAPER, chaos, {"x": "omega", "y": "b"}))
    assert "the motion here is aperiodic" in message["words"]
    (message,) = borders(asked(x_low="0.9", x_high="1.0"))
    assert "outside the map" in message["words"]


@pytest.mark.parametrize(
    ("words", "field"),
    [
        (None, "map"),
        ({"x": "nothing", "y": "b"}, "map.x"),
        ({"x": "omega", "y": ["b"]}, "map.y"),
        ({"x": "omega", "y": "omega"}, "map.y"),
        ({"x": "omega", "y": "b", "x_low": "1", "x_high": "0.9"}, "map.x"),
        ({"x": "omega", "y": "k0", "y_high": "1.5"}, "map.y"),
        ({"x": "omega", "y": "b", "y_low": "<b>"}, "map.y"),
    ],
)
def test_a_map_that_cannot_be_is_refused_by_its_field(words: object, field: str) -> None:
    with pytest.raises(InputError, match=rf"^{field}\b"):
        read_map(PAPER, PLACE, words)


@pytest.mark.parametrize("name", ["k0", "f20", "c"])
def test_ends_around_a_place_are_values_that_the_model_may_have(name: str) -> None:
    request = read_map(PAPER, PLACE, {"x": name, "y": "omega"})
    low, high = request.x.low, request.x.high
    assert low <= PLACE.model.parameter(name) <= high
    assert low < high
