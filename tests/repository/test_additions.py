"""What somebody who carries this on would add, each really added, to a copy of the package: the
files that have to be touched are those that docs/architecture.md names.

An addition is a text that is put before or behind a line of a file that there is.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from tests.shared.system_text import system_text, table

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text("utf-8")
Texts = Sequence[tuple[str, str]]
"""Lines of a file, each with the same lines and what is new."""


def grown(place: Path, additions: Mapping[str, Texts]) -> Path:
    """A folder with the package in which these files have more than here."""
    package = place / "designer"
    for folder, folders, names in os.walk(ROOT / "designer"):
        there = package / Path(folder).relative_to(ROOT / "designer")
        there.mkdir(parents=True)
        for name in names:
            (there / name).symlink_to(Path(folder) / name)
        if "__pycache__" in folders:
            folders.remove("__pycache__")
    (place / "catalogs").symlink_to(ROOT / "catalogs")
    for name, texts in additions.items():
        assert f"`{name}`" in PAGE or f"`{Path(name).parent}`" in PAGE, name
        file = package / name
        text = file.read_text(encoding="utf-8")
        for old, new in texts:
            assert text.count(old) == 1, f"{name}: {old}"
            text = text.replace(old, new)
        file.unlink()
        file.write_text(text, encoding="utf-8")
    return place


def run(place: Path, *words: str | Path) -> str:
    """What Python prints with the package of that folder."""
    done = subprocess.run(
        [sys.executable, "-P", *map(str, words)],
        cwd=place,
        env={**os.environ, "PYTHONPATH": str(place)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


RULE: Mapping[str, Texts] = {
    "catalog/design_rules.py": [
        (
            "RULES: tuple[DesignRule, ...] = (\n",
            "RULES: tuple[DesignRule, ...] = (\n"
            '    _rule("many-parts", "Resistors of the circuit", 40, "", OWN, "take fewer"),\n',
        )
    ],
    "design_rules/on_nets.py": [
        (
            "LOOKS: Mapping[str, Look] = {\n",
            "def many_parts(s: RuleSubject) -> Iterator[Finding]:\n"
            "    yield Finding(len(s.circuit.resistors), 'the circuit')\n\n\n"
            'LOOKS: Mapping[str, Look] = {\n    "many-parts": many_parts,\n',
        )
    ],
}
LOOK = """
import json
from types import SimpleNamespace
from designer.design_rules import rule_reports, run_rules
found = [
    run_rules.look("many-parts", SimpleNamespace(circuit=SimpleNamespace(resistors=range(n))))
    for n in (40, 41)
]
print(json.dumps([[each.value, each.status] for each in found]))
assert next(iter(run_rules.LOOKS)) == "many-parts"
assert "| `many-parts` | Resistors of the circuit | at most 40 |" in rule_reports.table("circuit")
"""


def test_a_design_rule_touches_two_files(tmp_path: Path) -> None:
    """Its line in the list and the function that looks; the page's table is made from the list."""
    place = grown(tmp_path, RULE)
    assert json.loads(run(place, "-c", LOOK)) == [[40, "pass"], [41, "fail"]]


LAW: Mapping[str, Texts] = {
    "model/law_elements.py": [
        (
            "KINDS: tuple[type[NonlinearElement], ...] = (Law, CubicSpring, Friction)\n",
            '''@dataclass(frozen=True)
class Drag(NonlinearElement):
    """A force with the square of the velocity, by straight pieces."""

    TABLE, LIST, WORDS = "drag", "drags", "drag"
    PARAMETERS: ClassVar[Mapping[str, LawNumber]] = {
        "factor": LawNumber(0.0, "", "drag over the square of the velocity"),
        "speed": LawNumber(SMALLEST, "m/s", "up to which its pieces are laid"),
    }

    between: Annotated[tuple[str, str], two_bodies()]
    factor: Annotated[float, signed("", "a number")]
    speed: Annotated[float, physical("m/s")]

    @property
    def quantity(self) -> Quantity:
        return "velocity"

    @property
    def corners(self) -> Points:
        places = [self.speed * k / 16 for k in range(-16, 17)]
        return tuple((v, self.factor * abs(v) * v) for v in places)

    def check(self) -> None:
        check_size(f"drag {self.bodies}.factor", self.factor)


KINDS: tuple[type[NonlinearElement], ...] = (Law, CubicSpring, Friction, Drag)
''',
        )
    ],
    "model/lumped_elements.py": [
        ("import KINDS, CubicSpring, Friction,", "import KINDS, CubicSpring, Drag, Friction,"),
        (
            '    """Dry friction."""\n',
            '    """Dry friction."""\n    drags: tuple[Drag, ...] = ()\n',
        ),
    ],
    "model/model_file.py": [
        ("import KINDS, CubicSpring, Friction,", "import KINDS, CubicSpring, Drag, Friction,"),
        (
            '    """Dry friction."""\n',
            '    """Dry friction."""\n    drag: tuple[Drag, ...] = ()\n    """Drag."""\n',
        ),
    ],
}
GROUNDED = ("m", "ground")
MODEL = system_text(
    {"m": 1.0},
    {GROUNDED: 1.0},
    {GROUNDED: 0.02},
    table("drag", between=GROUNDED, factor=0.5, speed=2.0),
    table("force", on="m", amplitude=0.8),
    table("response", omega=1.0),
)
SHOWN = """
import json, sys
from designer.model.ascii_sketch import system_sketch
from designer.model.model_file import read_model_file
from designer.plots.system_drawing import system_drawing
from designer.plots.system_equations import element_rows, equations_of
model = read_model_file(sys.argv[1]).model
assert "drag: m to ground" in system_sketch(model)
assert "F₁(x₁′)" in equations_of(model)[0]
assert any("drag over the square" in row[2] for row in element_rows(model, si=False))
assert {"m-ground.factor", "m-ground.speed"} <= set(model.parameters)
assert model.changed({"m-ground.factor": 0.6}).drags[0].factor == 0.6
system_drawing(model, si=False)
(law,) = model.second_order().laws
print(json.dumps([law.quantity, law.row, law.points]))
"""


def test_a_law_of_force_touches_three_files(tmp_path: Path) -> None:
    """Its class, a field of the elements and a table of the model file. What the flow gets is that
    force; checks, tables, sketch and drawing have it too."""
    place = grown(tmp_path, LAW)
    model = tmp_path / "model.toml"
    model.write_text(MODEL, encoding="utf-8")
    quantity, row, points = json.loads(run(place, "-c", SHOWN, model))
    assert (quantity, row) == ("velocity", [1.0])
    velocities = np.linspace(-2.0, 2.0, 1001)
    pieces = np.interp(velocities, *np.transpose(points))
    # A chord of length h is off by h² f″/8 at most, f″ = 2 · 0.5.
    assert pieces == pytest.approx(0.5 * np.abs(velocities) * velocities, abs=0.125**2 / 8 + 1e-12)


SCOPE: Mapping[str, Texts] = {
    "workbench/record_formats.py": [
        (
            "ARRAYS: Mapping[str, tuple[str, Callable[[Path], Mapping[str, Array]]]] = {\n",
            "def _matlab(path: Path) -> Mapping[str, Array]:\n"
            "    from scipy.io import loadmat\n\n"
            "    stored = loadmat(path)\n"
            "    return {n: a.ravel() for n, a in stored.items() if not n.startswith('_')}\n\n\n"
            "ARRAYS: Mapping[str, tuple[str, Callable[[Path], Mapping[str, Array]]]] = {\n"
            '    ".mat": ("MATLAB", _matlab),\n',
        )
    ]
}
RECORD = """
import sys
import numpy as np
from scipy.io import savemat
from designer.workbench.record_formats import read_record
volts = np.sin(np.arange(500) / 10)
savemat(sys.argv[1], {"Tstart": 0.0, "Tinterval": 1e-4, "A": volts})
record = read_record(sys.argv[1])
assert record.kind == "MATLAB"
assert np.allclose(record.signals["A"], volts)
assert np.isclose(record.time[-1], 499e-4)
"""


def test_a_format_of_records_touches_one_file(tmp_path: Path) -> None:
    run(grown(tmp_path / "copy", SCOPE), "-c", RECORD, tmp_path / "record.mat")
