"""What the page shows of a place, against ``simulate`` and ``settle``."""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np
import pytest

from designer import InputError, read_model_file, simulate
from designer.dynamics.attractors import settle
from designer.explorer import omega_strip
from designer.explorer.place import first_place, read_place
from designer.explorer.response_view import facts, multipliers_text, respond, shown_motions
from designer.explorer.wire import column, text_of
from designer.model.driven import model_flow

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PAPER = read_model_file(EXAMPLES / "paper.toml")
RIG = read_model_file(EXAMPLES / "rig.toml")
THREE = read_model_file(EXAMPLES / "three-masses.toml")


def floats(packed: dict[str, str]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(packed["f4"]), dtype="<f4")


@pytest.mark.parametrize(("modelfile", "omega"), [(PAPER, 0.54), (THREE, 0.8)])
def test_the_response_is_that_of_simulate(modelfile, omega) -> None:  # type: ignore[no-untyped-def]
    view = respond(read_place(modelfile, {"omega": omega}))
    (expected,) = simulate(modelfile, [omega], starts=1)
    assert view.orbit.response == expected.orbit.response
    assert dict(view.message()["facts"])["response"] == expected.orbit.response
    drawn = floats(view.message()["data"]["trace"]["x"])
    low, high = expected.orbit.extremes[2 * modelfile.model.second_order().clearances[0].mass]
    assert (drawn.min(), drawn.max()) == pytest.approx((low, high), abs=2e-3 * (high - low))
    assert drawn[0] == pytest.approx(drawn[-1], abs=1e-5)
    assert len(view.strobes) == view.orbit.n
    text_of(view.message())


def test_impacts_lie_on_the_stops_and_on_the_trace() -> None:
    view = respond(read_place(THREE, {"omega": 1.2}))
    gaps = view.motion.motion.gaps
    for time, place, speed in view.impacts:
        assert any(place == pytest.approx(gap) for gap in gaps)
        assert np.interp(time, view.time, view.displacement) == pytest.approx(place, abs=1e-3)
        assert np.interp(time, view.time, view.velocity) == pytest.approx(speed, abs=1e-2)
    assert len(view.impacts) == view.orbit.p + view.orbit.q


def test_impacts_are_told_stop_by_stop_with_the_velocities_of_simulate() -> None:
    place = read_place(THREE, {"omega": 1.2})
    figures = dict(facts(respond(place).orbit, place))
    (expected,) = simulate(THREE, [1.2], starts=1)
    orbit = expected.orbit
    for name, clearance, side, rate in (
        ("upper stop of A", 0, 1, "x₁′"),
        ("lower stop of A", 0, -1, "x₁′"),
        ("upper stop of B", 1, 1, "x₃′"),
    ):
        here = (orbit.impact_clearances == clearance) & (orbit.impact_sides == side)
        (velocity,) = orbit.impact_velocities[here]
        assert figures[name] == f"1 impact, {rate}\u00a0=\u00a0{velocity:.3g}"
    assert "lower stop of B" not in figures


def test_many_impacts_are_told_by_their_range_and_none_as_none() -> None:
    figures = {}
    for omega in (0.24, 0.05):
        place = read_place(PAPER, {"omega": omega, "b": 5.0 if omega == 0.05 else 0.25})
        figures[omega] = dict(facts(respond(place).orbit, place))
    assert figures[0.24]["upper stop"].startswith("7 impacts, x₁′\u00a0=\u00a00.")
    assert " to " in figures[0.24]["upper stop"]
    assert figures[0.05]["upper stop"] == figures[0.05]["lower stop"] == "no impact"


def test_figures_of_a_rig_have_units_and_those_of_one_row_the_same() -> None:
    place = first_place(RIG)
    figures = dict(facts(respond(place).orbit, place))
    assert figures["x₁ (carriage)"] == "-2.613 to 2.613 mm"
    assert figures["λ max"].endswith(" 1/s")
    assert figures["upper stop"].endswith(" mm/s")


def test_a_mass_on_a_moving_base_is_shown_as_it_moves_and_in_its_clearance() -> None:
    modelfile = read_model_file(EXAMPLES / "aberdeen.toml")
    gap, mass = (respond(read_place(modelfile, {"shown": k})) for k in (0, 1))
    base = modelfile.model.second_order().base
    moved = gap.displacement + base * np.sin(2.0 * np.pi * gap.time)
    assert mass.displacement == pytest.approx(moved, abs=1e-9)
    assert [each.label for each in shown_motions(modelfile.model.second_order())] == [
        "x₁ − y (oscillator)",
        "x₁ (oscillator)",
    ]


def test_chaos_is_drawn_without_a_period() -> None:
    view = respond(read_place(PAPER, {"omega": 0.62}))
    message = view.message()
    assert message["response"] == "aperiodic"
    assert len(view.strobes) > 100
    assert len(view.impacts) == 0
    assert float(dict(message["facts"])["λ max"].split()[0]) > 0.0


def test_a_displacement_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match="shown"):
        respond(read_place(PAPER, {"shown": 7}))


def test_the_strip_follows_the_branch_that_is_shown() -> None:
    """Each point is the least displacement of the attractor that ``settle`` reaches there."""
    place = first_place(PAPER)
    view = respond(place)
    pieces = list(omega_strip.strip(place, view.orbit.start))
    data = {
        key: np.concatenate([floats(piece["data"][key]) for piece in pieces])
        for key in ("omega", "x", "period")
    }
    assert data["omega"].min() == pytest.approx(place.omega * (1.0 - omega_strip.WIDTH))
    assert data["omega"].max() == pytest.approx(place.omega * (1.0 + omega_strip.WIDTH))
    for omega in sorted(set(data["omega"].tolist()))[::20]:
        here = data["omega"] == np.float32(omega)
        orbit = settle(model_flow(place.model, float(omega)), view.orbit.start)
        quick = orbit.periods <= omega_strip.COURSE.settle
        assert set(data["period"][here]) <= ({orbit.n} if quick else {orbit.n, omega_strip.OPEN})
        if orbit.n:
            assert data["x"][here].min() == pytest.approx(orbit.extremes[0, 0], abs=1e-4)


def test_multipliers_are_written_once_for_each_pair() -> None:
    assert multipliers_text([0.1 - 0.2j, -0.5, 0.1 + 0.2j]) == "-0.5, 0.1 ± 0.2i"


def test_numbers_survive_the_wire() -> None:
    assert floats(column([1.5, float("nan")])).tolist() == pytest.approx([1.5, np.nan], nan_ok=True)
    with pytest.raises(ValueError, match="JSON"):
        text_of({"kind": "view", "number": float("nan")})
