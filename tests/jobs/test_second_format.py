"""``designer new --from``: a file of format 1 rewritten in format 2."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from designer.base.errors import InputError
from designer.cli import entry
from designer.jobs.template import SECOND, TEXT, second_format
from designer.model.driven import model_flow
from designer.model.lumped_system import LumpedSystem
from designer.model.model import Mechanical
from designer.model.model_file import parse_model_file, read_model_file
from designer.verbs.new import new
from tests.shared.model_text import PAPER_TABLE, dimensionless

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

SHARES = st.floats(0.01, 0.99)


@given(
    m=SHARES,
    k=SHARES,
    k0=st.sampled_from([0.0, 0.5, 0.99]),
    c=st.sampled_from([0.0, 0.3]),
    zeta=st.floats(1e-3, 2.0),
    f20=st.sampled_from([0.0, 0.25, 1.0]),
    b=st.floats(0.01, 10.0),
    sides=st.sampled_from(["both", "upper", "lower"]),
    omega=st.floats(0.2, 2.0),
    given=st.sampled_from(["model", "mechanical"]),
)
def test_the_equations_stay(
    m: float, k: float, k0: float, c: float, zeta: float, f20: float, b: float, sides: str,
    omega: float, given: str,
) -> None:  # fmt: skip
    values = {"m": m, "k": k, "k0": k0, "c": c, "zeta": zeta, "f20": f20, "b": b}
    table = "".join(f"{name} = {value!r}\n" for name, value in values.items())
    table = f'[model]\n{table}sides = "{sides}"\n'
    if given == "mechanical":
        model = dimensionless(parse_model_file("format = 1\n" + table).model)
        system = Mechanical.from_dimensionless(model, M1=0.3, K1=7e4, force=55.0)
        rows = (f"{n} = {v!r}" for n, v in system.__dict__.items() if n != "sides")
        table = "[mechanical]\n" + "\n".join(rows) + f'\nsides = "{sides}"\n'
    text = f"format = 1\n{table}[[response]]\nomega = {omega!r}\nb = {2.0 * b!r}\n"
    old = parse_model_file(text)
    other = parse_model_file(second_format(old))
    ours = (old.mechanical or old.model).second_order()
    theirs = other.model.second_order()
    for name in ("mass", "damping", "stiffness", "force"):
        want = getattr(ours, name)
        assert getattr(theirs, name) == pytest.approx(want, rel=1e-12, abs=1e-15 * want.max())
    assert [stop.sides for stop in ours.clearances] == [stop.sides for stop in theirs.clearances]
    time = 1.0 if old.si is None else old.si.time_scale
    assert old.responses[0].omega == pytest.approx(omega)
    assert other.responses[0].omega == pytest.approx(omega / time, rel=1e-14)
    assert other.responses[0].b == pytest.approx(2.0, rel=1e-12)


def test_an_orbit_stays_and_so_do_comments_and_other_tables() -> None:
    text = f"""\
format = 1  # the paper's
title = "Mine"
{PAPER_TABLE}
# What is wanted.
[[response]]
omega = 0.85  # ω
expect = "1-2-2"
[circuit]
resistors = "E24"  # cheap
"""
    old = parse_model_file(text)
    written = second_format(old)
    assert written.startswith('format = 2  # the paper\'s\ntitle = "Mine"\n[[mass]]\n')
    kept = '\n# What is wanted.\n[[response]]\nomega = 0.85  # ω\nexpect = "1-2-2"\n'
    assert kept in written
    assert written.endswith('[circuit]\nresistors = "E24"  # cheap\n')
    new_file = parse_model_file(written)
    assert new_file.circuit == old.circuit
    x = np.array([0.1, -0.2, 0.3, 0.05])
    a, b = (model_flow(file.model, 0.85).run(x, 3) for file in (old, new_file))
    assert a.strobes == pytest.approx(b.strobes, abs=1e-12)
    assert a.counts.tolist() == b.counts.tolist()


def test_si_values_keep_their_texts() -> None:
    old = read_model_file(EXAMPLES / "drill.toml")
    written = second_format(old)
    other = parse_model_file(written)
    assert old.mechanical is not None
    assert other.si is not None
    assert other.model.second_order().mass.tolist() == [old.mechanical.M1, old.mechanical.M2]
    assert 'stiffness = "60 kN/m"' in written
    assert second_format(other) == written


def test_what_the_template_offers_is_accepted() -> None:
    """Its tables of laws, and the shapes of its force, with the marks of comments taken away."""
    lines, taken = [], False
    for line in SECOND.splitlines():
        stripped = line.removeprefix("# ")
        taken = stripped != line and (taken or stripped.startswith(("[[", "phase")))
        lines.append(stripped if taken else line)
    found = parse_model_file("\n".join(lines)).model
    assert isinstance(found, LumpedSystem)
    assert list(found.nonlinear) == ["bumper", "casing-ground.cubic", "casing-ground.friction"]
    (force,) = found.forces
    assert (force.waveform, force.terms, len(force.harmonics or ())) == ("square", 5, 1)
    assert force.phase == pytest.approx(np.pi / 2)


def test_from_the_command_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for words, text in (
        (["--format", "2"], SECOND),
        ([], TEXT),
        (["--from", str(EXAMPLES / "drill.toml")], None),
    ):
        path = tmp_path / f"{len(words)}{text is None}.toml"
        assert entry.status(["new", str(path), *words]) == 0
        assert text is None or path.read_text("utf-8") == text
    assert "[[mass]]" in path.read_text("utf-8")
    capfd.readouterr()
    assert entry.status(["new", str(tmp_path / "no.toml"), "--format", "3"]) == 2
    assert "1 or 2" in capfd.readouterr().err


@pytest.mark.parametrize(
    "model",
    ["model = {m = 0.5, k = 0.5, k0 = 0.95, c = 0.5, zeta = 0.1, f20 = 0.0, b = 0.25}\n"],
)
def test_a_file_written_in_another_way_is_refused(model: str, tmp_path: Path) -> None:
    path = tmp_path / "old.toml"
    path.write_text("format = 1\n" + model, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        new(tmp_path / "new.toml", path)
    assert caught.value.file == str(path)
    assert "a header line for each table" in caught.value.expected
    assert not (tmp_path / "new.toml").exists()
    with pytest.raises(InputError):
        new(tmp_path / "new.toml", path, format=2)
