"""Systems that matrices give, and clearances on combinations, against what shares no code."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import OrbitStatus
from designer.fidelity.system_runge_kutta import rates_of
from designer.model.driven import model_flow
from designer.model.model_file import parse_model_file, read_model_file
from designer.plots.system_equations import equations_of, number_of
from tests.shared.system_text import clearance, system_text

Matrix = list[list[float]]


def drawn(seed: int) -> tuple[str, dict[str, Array], Array, float, float, float]:
    """Three nodes with couplings of any sign, gyroscopic damping, and a stop on a combination: the
    file, its matrices, the factors of the combination, its gap, its stiffness, and ω."""
    rng = np.random.default_rng(seed)

    def definite(low: float, high: float) -> Array:
        turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        return np.asarray(np.round(turn @ np.diag(rng.uniform(low, high, 3)) @ turn.T, 6))

    mass, stiffness = definite(0.5, 2.0), definite(0.6, 4.0)
    mass, stiffness = (0.5 * (m + m.T) for m in (mass, stiffness))
    whirl = np.round(0.2 * rng.standard_normal((3, 3)), 6)
    damping = definite(0.15, 0.5) + whirl - whirl.T
    factors = np.round(rng.uniform(-1.0, 1.0, 3), 3)
    gap, stop, omega = 0.1, float(rng.uniform(4.0, 12.0)), float(rng.uniform(0.5, 1.4))
    pairs = ", ".join(f"{name} = {f}" for name, f in zip("abc", factors.tolist(), strict=True))
    text = f"""
format = 2
[matrices]
names = ["a", "b", "c"]
mass = {mass.tolist()}
stiffness = {stiffness.tolist()}
damping = {damping.tolist()}
[[clearance]]
name = "S"
of = {{ {pairs} }}
upper = {gap}
lower = {2 * gap}
stiffness = {stop}
[[force]]
on = "b"
amplitude = 0.8
constant = 0.05
"""
    return text, {"M": mass, "C": damping, "K": stiffness}, factors, gap, stop, omega


def test_entries_of_matrices_are_parameters() -> None:
    """Of a symmetric matrix both that are one; the file of a place has them."""
    text, matrices, *_ = drawn(3)
    file = parse_model_file(text)
    changes = {"mass.b.b": 3.0, "stiffness.a.c": 0.25, "damping.c.a": 0.125}
    M, C, K = (matrices[key].copy() for key in "MCK")
    M[1, 1], C[2, 0], K[0, 2], K[2, 0] = 3.0, 0.125, 0.25, 0.25
    changed, written = file.model.changed(changes), file.with_(changes).model
    assert changed == written
    assert [changed.parameter(name) for name in changes] == list(changes.values())
    inverse, system = np.linalg.inv(M), changed.second_order()
    for ours, whole in ((system.damping, C), (system.stiffness, K)):
        assert system.over_mass(ours) == pytest.approx(inverse @ whole, rel=1e-9, abs=1e-9)
    assert "stiffness.c.a" not in file.model.parameters
    with pytest.raises(InputError, match="positive definite"):
        file.model.changed({"mass.b.b": 1e-9})
    for name in ("mass.b.b", "stiffness.c.c"):
        with pytest.raises(InputError, match="a number > 0"):
            file.model.changed({name: -1.0})
    with pytest.raises(InputError, match="found 1 N/m, expected a dimensionless number"):
        file.with_({"stiffness.a.c": "1 N/m"})


def test_a_mass_matrix_that_a_file_gives_by_its_diagonal_may_get_couplings() -> None:
    text, matrices, *_ = drawn(1)
    diagonal = np.diag(matrices["M"]).tolist()
    file = parse_model_file(text.replace(f"mass = {matrices['M'].tolist()}", f"mass = {diagonal}"))
    assert file.data["matrices"]["mass"] == diagonal
    assert file.with_({"mass.a.b": 0.1}).data["matrices"]["mass"][1][0] == 0.1


def test_only_the_entry_that_changes_is_written() -> None:
    text = """format = 2
[matrices]
names = ["a", "b"]
mass = [1, 2]
stiffness = [[2, -1], [-1, 3]]
damping = [[1, 0], [0, 1]]
[[force]]
on = "a"
amplitude = 1
"""
    file = parse_model_file(text)
    found = file.with_({"stiffness.a.b": -0.5, "mass.b.b": 2.5}).data["matrices"]
    wanted = {
        "names": ["a", "b"],
        "mass": [1, 2.5],
        "stiffness": [[2, -0.5], [-0.5, 3]],
        "damping": [[1, 0], [0, 1]],
    }
    assert repr(found) == repr(wanted)


def test_entries_that_are_alike_across_the_diagonal_are_read_as_their_mean() -> None:
    text, matrices, *_ = drawn(2)
    rows = matrices["K"].tolist()
    entry = rows[0][1]
    rows[0][1] = entry * (1.0 + 1e-10)
    model = parse_model_file(text.replace(f"{matrices['K'].tolist()}", f"{rows}")).model
    assert model.parameter("stiffness.a.b") == pytest.approx(entry * (1.0 + 5e-11), rel=1e-15)
    assert model.parameter("stiffness.a.b") not in (entry, rows[0][1])
    assert model.changed({name: model.parameter(name) for name in model.parameters}) == model


@pytest.mark.parametrize("seed", range(6))
def test_any_matrices_against_another_integrator(seed: int) -> None:
    """M x″ + C x′ + K x + row · force(row · x) = P sin ωt, solved with scipy at tight tolerance
    from the orbit's start on: back at the start after n periods, with the same extremes."""
    text, matrices, row, gap, stop, omega = drawn(seed)
    orbit = settle(model_flow(parse_model_file(text).model, omega), np.zeros(6))
    assert orbit.status is OrbitStatus.PERIODIC
    inverse = np.linalg.inv(matrices["M"])
    drive, constant = np.array([0.0, 0.8, 0.0]), np.array([0.0, 0.05, 0.0])

    def rates(t: float, state: Array) -> Array:
        x, v = state[0::2], state[1::2]
        u = float(row @ x)
        push = stop * (max(u - gap, 0.0) + min(u + 2 * gap, 0.0))
        force = drive * np.sin(omega * t) + constant - push * row
        force -= matrices["C"] @ v + matrices["K"] @ x
        return np.column_stack([v, inverse @ force]).ravel()

    span = orbit.n * 2.0 * np.pi / omega
    times = np.linspace(0.0, span, 4001)
    kept = solve_ivp(rates, (0.0, span), orbit.start, "DOP853", times, rtol=1e-11, atol=1e-13)
    peak = np.abs(orbit.extremes).max()
    assert np.abs(kept.y[:, -1] - orbit.start).max() < 1e-8 * peak
    assert np.abs(kept.y.max(axis=1) - orbit.extremes[:, 1]).max() < 1e-4 * peak
    u = row @ kept.y[0::2]
    met = [int(((u[:-1] <= a) & (u[1:] > a)).sum()) for a in (gap,)]
    met += [int(((u[:-1] >= -2 * gap) & (u[1:] < -2 * gap)).sum())]
    assert [orbit.p, orbit.q] == met


@pytest.mark.parametrize("seed", [0, 3])
def test_the_fixed_step_integrator_has_the_same_equations(seed: int) -> None:
    """At a state in contact its rates are those of the engine's mode there."""
    text, *_, omega = drawn(seed)
    system = parse_model_file(text).model.second_order()
    numbers, flow = rates_of(system, omega), system.piecewise_linear(omega)
    x = np.array([0.4, -0.1, 0.5, 0.2, -0.6, 0.3])
    mode = flow.mode(flow.mode_at(x, np.sin(0.7)))
    wanted = mode.A @ x + mode.B * np.sin(0.7) + mode.d
    depth = np.maximum(numbers.row @ np.append(x, np.sin(0.7)) - numbers.place, 0.0)
    found = numbers.A @ x + numbers.B * np.sin(0.7) + numbers.d - depth @ numbers.push
    assert found == pytest.approx(wanted, rel=1e-12)


def test_springs_written_as_matrices_are_the_same_system() -> None:
    springs = system_text(
        {"a": 1.0, "b": 2.0},
        {("a", "ground"): 3.0, ("a", "b"): 1.5},
        {("a", "ground"): 0.2, ("a", "b"): 0.1},
    )
    matrices = """
format = 2
[matrices]
names = ["a", "b"]
mass = [1.0, 2.0]
stiffness = [[4.5, -1.5], [-1.5, 1.5]]
damping = [[0.3, -0.1], [-0.1, 0.1]]
"""
    base = '[base]\namplitude = 0.3\nstops = "fixed"\n'
    gap = clearance("A", "b", "ground", upper=0.4, stiffness=9.0)
    of = gap.replace('between = ["b", "ground"]', "of = { b = 1.0 }")
    one, two, three = (
        parse_model_file(head + base + end).model
        for head, end in ((springs, gap), (matrices, gap), (matrices, of))
    )
    orbits = [settle(model_flow(model, 0.7), np.zeros(4)) for model in (one, two, three)]
    assert orbits[0].p == 1
    for orbit in orbits[1:]:
        assert orbit.response == orbits[0].response
        assert orbit.start == pytest.approx(orbits[0].start, abs=1e-12)
    (line, *_) = equations_of(two, number_of)  # type: ignore[arg-type]
    assert line == ("x₁″ + 0.3 (x₁′ − y′) − 0.1 (x₂′ − y′) + 4.5 (x₁ − y) − 1.5 (x₂ − y) = 0")


def written(folder: Path, stiffness: str) -> Path:
    path = folder / "model.toml"
    path.write_text(
        f"""format = 2
[matrices]
names = ["a", "b"]
mass = [1.0, 2.0]
stiffness = {stiffness}  # from a file
damping = [[0.3, -0.1], [-0.1, 0.1]]
[[force]]
on = "a"
amplitude = 1.0
""",
        "utf-8",
    )
    return path


def test_a_numpy_file_is_written_out(tmp_path: Path) -> None:
    """The text then says everything, to the last digit, so that a copy needs no other file."""
    K = np.array([[4.0 / 3.0, -1.0 / 7.0], [-1.0 / 7.0, 0.3]])
    np.save(tmp_path / "K.npy", K)
    modelfile = read_model_file(written(tmp_path, '"K.npy"'))
    again = parse_model_file(modelfile.text).model.second_order()
    assert (again.stiffness == K).all()
    assert "# from a file" in modelfile.text


@pytest.mark.parametrize(
    ("stiffness", "field", "found"),
    [
        ('"none.npy"', "stiffness", "does not exist"),
        ('"../K.npy"', "stiffness", "../K.npy"),
        ('"text.npy"', "stiffness", "text.npy"),
        ('"objects.npy"', "stiffness", "objects.npy"),
        ('"large.npy"', "stiffness", "large.npy"),
        ("[[1.0, 2.0], [3.0, 1.0]]", "stiffness", "2 and 3"),
        ("[[1.0]]", "stiffness", "1 rows"),
        ("[[1.0, 0.0], [0.0]]", "stiffness", ""),
        ("[[1.0, 0.0], [0.0, inf]]", "stiffness", ""),
        ("[[1.0, 0.0], [0.0, true]]", "stiffness", ""),
        ("[[1e308, 0.0], [0.0, 1.0]]", "stiffness", "1e+308"),
        ("[[1.0, 2.0], [2.0, 1.0]]", "stiffness", "nothing holds"),
        ("[[1.0, 0.0], [0.0, 0.0]]", "stiffness", "nothing holds"),
    ],
)
def test_what_is_no_matrix_is_refused(
    tmp_path: Path, stiffness: str, field: str, found: str
) -> None:
    (tmp_path / "text.npy").write_text("no array", "utf-8")
    np.save(tmp_path / "objects.npy", np.array([{}], dtype=object), allow_pickle=True)
    np.save(tmp_path / "large.npy", np.zeros((65, 65)))
    with pytest.raises(InputError) as caught:
        read_model_file(written(tmp_path, stiffness))
    assert caught.value.field == f"matrices.{field}"
    assert found in str(caught.value)
    assert "model.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("more", "field"),
    [
        ('[[spring]]\nbetween = ["a", "b"]\nstiffness = 1.0\n', "spring"),
        ('[[mass]]\nname = "c"\nmass = 1.0\n', "mass"),
        ('[[clearance]]\nname = "A"\nupper = 0.1\nstiffness = 1.0\n', "clearance A.between"),
        (
            '[[clearance]]\nname = "A"\nof = { q = 1.0 }\nupper = 0.1\nstiffness = 1.0\n',
            "clearance.of",
        ),
        (
            '[[clearance]]\nname = "A"\nof = { ground = 1.0 }\nupper = 0.1\nstiffness = 1.0\n',
            "clearance A.of",
        ),
    ],
)
def test_what_cannot_stand_beside_matrices(tmp_path: Path, more: str, field: str) -> None:
    path = written(tmp_path, "[[2.0, -1.0], [-1.0, 2.0]]")
    with pytest.raises(InputError) as caught:
        parse_model_file(path.read_text("utf-8") + more)
    assert caught.value.field == field
