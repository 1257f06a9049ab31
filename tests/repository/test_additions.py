"""What somebody who carries this on would add, each really added: Python takes the changed modules
in the place of the package's own. The files that have to be touched are those that
docs/architecture.md names.

An addition is a text that is put before or behind a line of a file that there is.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from designer.catalog.parts_catalog import load_catalog
from designer.spice.opamp_check import checks
from tests.shared.system_text import clearance, system_text, table

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text("utf-8")
Texts = Sequence[tuple[str, str]]
"""Lines of a file, each with the same lines and what is new."""


SITE = """
import sys
from importlib.util import spec_from_file_location
from pathlib import Path

class Grown:
    def find_spec(self, name, path=None, target=None):
        file = Path(__file__).parent.joinpath("changed", *name.split(".")).with_suffix(".py")
        return spec_from_file_location(name, file) if file.is_file() else None

sys.meta_path.insert(0, Grown())
"""
"""What Python runs first: a changed module stands in the place of its own."""


def grown(place: Path, additions: Mapping[str, Texts]) -> Path:
    """A folder from which Python takes the package with more in these files than here."""
    for name, texts in additions.items():
        assert f"`{name}`" in PAGE or f"`{Path(name).parent}`" in PAGE, name
        text = (ROOT / "designer" / name).read_text(encoding="utf-8")
        for old, new in texts:
            assert text.count(old) == 1, f"{name}: {old}"
            text = text.replace(old, new)
        file = place / "changed" / "designer" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    (place / "sitecustomize.py").write_text(SITE, encoding="utf-8")
    return place


def run(place: Path, *words: str | Path) -> str:
    """What Python prints with the package of that folder."""
    done = subprocess.run(
        [sys.executable, "-P", *map(str, words)],
        cwd=place,
        env={**os.environ, "PYTHONPATH": f"{place}{os.pathsep}{ROOT}"},
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


@pytest.mark.slow
def test_a_design_rule_touches_two_files(tmp_path: Path) -> None:
    """Its line in the list and the function that looks; the page's table is made from the list."""
    place = grown(tmp_path, RULE)
    assert json.loads(run(place, "-c", LOOK)) == [[40, "pass"], [41, "fail"]]


LAW: Mapping[str, Texts] = {
    "laws/law_elements.py": [
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_format_of_records_touches_one_file(tmp_path: Path) -> None:
    run(grown(tmp_path / "copy", SCOPE), "-c", RECORD, tmp_path / "record.mat")


STAGE: Mapping[str, Texts] = {
    "model/circuit_table.py": [
        (
            'DeadZone = Literal["saturation", "rectifier"]\n',
            'DeadZone = Literal["saturation", "rectifier", "apart"]\n',
        )
    ],
    "circuit/dead_zone_parts.py": [
        (
            "            if zone.damping or part_of(index, FEEDBACK) in parts\n",
            '            if (kind == "apart" and not zone.limits)\n'
            "            or zone.damping\n"
            "            or part_of(index, FEEDBACK) in parts\n",
        )
    ],
}
APART = system_text(
    {"m": 1.0},
    {GROUNDED: 1.0},
    {GROUNDED: 0.1},
    table("force", on="m", amplitude=1.0),
    clearance("A", *GROUNDED, upper=0.5, lower=0.5, stiffness=9.0),
    table("response", omega=1.3),
    '[circuit]\ndead_zone = "apart"\n',
)
MADE = """
import json, sys
from designer.check.synthesis_result import synthesise
from designer.circuit.nominal import nominal_reduction, on_circuit
from designer.model.model_file import read_model_file
made = synthesise(read_model_file(sys.argv[1]))
design, (wanted,) = made.design, made.model_responses
orbit = on_circuit(nominal_reduction(design).system(), design, wanted)
shown = design.in_model_units(orbit, design.volts(wanted.b))
print(json.dumps({
    "driven": sorted(net for d in design.circuit.diodes for net in d.nets if net.startswith("f")),
    "responses": [wanted.orbit.response, shown.response],
    "ranges": [each.extremes[0].tolist() for each in (wanted.orbit, shown)],
}))
"""


@pytest.mark.slow
def test_a_variant_of_the_rectifier_touches_two_files(tmp_path: Path) -> None:
    """Its name, and what is built: here a stage each half of which has an output of its own,
    whether its halves are equal or not. It is chosen, and shows what the model does."""
    place = grown(tmp_path, STAGE)
    model = tmp_path / "model.toml"
    model.write_text(APART, encoding="utf-8")
    told = json.loads(run(place, "-c", MADE, model))
    assert told["driven"] == ["fl", "fu"]
    assert told["responses"] == ["1-1-1", "1-1-1"]
    assert told["ranges"][1] == pytest.approx(told["ranges"][0], rel=0.01)


FIDELITY: Mapping[str, Texts] = {
    "base/defaults.py": [
        (
            'Fidelity = Literal["ideal", "dynamic", "full"]\n',
            'Fidelity = Literal["ideal", "dynamic", "full", "pole"]\n',
        )
    ],
    "spice/opamp_model.py": [
        (
            "MODELS: Mapping[Fidelity, OpAmpModel] = {\n",
            '''def _one_pole(opamp: OpAmp, gain: float) -> list[str]:
    """A pole that may be charged at any rate, then the output limit."""
    figures = f"gain={literal(gain)} gbw={literal(opamp.gbw.nominal)}"
    return [
        f".subckt opamp {PINS} {_EACH} start=0 {figures}",
        *_INPUT,
        f".param gm={{gbw*{literal(2.0 * math.pi * _POLE)}}}",
        "Gpole 0 x inside inn {gm}",
        "Rpole x 0 {gain/gm}",
        f"Cpole x 0 {literal(_POLE)} IC={{start}}",
        "Ez z 0 x 0 1",
        "Ey out 0 y 0 1",
        *_output_limit("{low}", "{high}"),
        ".ends opamp",
    ]


MODELS: Mapping[Fidelity, OpAmpModel] = {
    "pole": OpAmpModel("one pole alone", _one_pole, frozenset({"start", "gbw"})),
''',
        )
    ],
}
CHECKED = """
import json, sys
from designer.catalog.parts_catalog import load_catalog
from designer.fidelity.trade_files import TITLES
from designer.spice.opamp_check import checks
found = checks(load_catalog().opamp("TL074C"), "pole")
print(json.dumps([[c.figure, c.agrees] for c in found]))
assert TITLES["pole"] == "ngspice, one pole alone"
"""


def test_a_fidelity_of_the_op_amps_touches_two_files(tmp_path: Path) -> None:
    """Its name, and its model. ngspice measures those figures of the data sheet that it has."""
    place = grown(tmp_path, FIDELITY)
    assert "pole" in run(place, "-m", "designer", "simulate", "--help")
    told = json.loads(run(place, "-c", CHECKED))
    names = [name for name, _ in told]
    assert {"gain", "offset", "gain-bandwidth", "swing into 10 kΩ, high"} <= set(names)
    assert not any("slew" in name for name in names)
    assert all(agrees for _, agrees in told), told


SIMULATOR: Mapping[str, Texts] = {
    "base/defaults.py": [
        (
            'Dialect = Literal["ltspice", "portable"]\n',
            'Dialect = Literal["ltspice", "portable", "xyce"]\n',
        )
    ],
    "spice/simulator_decks.py": [
        (
            "SIMULATORS: Mapping[Dialect, SimulatorDeck] = {\n",
            "SIMULATORS: Mapping[Dialect, SimulatorDeck] = {\n"
            '    "xyce": SimulatorDeck("For Xyce", _elements, ".print tran format=csv"),\n',
        )
    ],
}
RUN = """
import json
import numpy as np
from designer.base.manifest import DeckStage, of_design
from designer.circuit.reduction import Reduction
from designer.dynamics.flow import Flow
from designer.spice import simulator_decks
from designer.spice.deck import SolverSettings
from designer.spice.simulator_decks import ResponseRun
from designer.spice.worker import open_simulator
from tests.shared.paper_cases import subject
known = subject(2)
circuit, excitation, start = known.circuit, known.excitation, known.orbit.start
stop = 2.0 / excitation.frequency
settings = SolverSettings("trap", stop / 3000, 1e-5)
asked = ResponseRun(0.85, "1-2-2", excitation, settings, stop, start)
text = simulator_decks.write("xyce", circuit, [asked], title="chain")
assert "* designer deck for xyce" in text
assert of_design(DeckStage.of("xyce"))
nets = circuit.state_nets
decked = text.replace(".print tran format=csv ", ".save ")
found = open_simulator("batch").run(decked, nets, stop)
flow = Flow(Reduction(circuit, known.board).system(), excitation.drive)
points = flow.run(start, 2, points=64).strobes
grid = np.arange(1, 2 * 64) / (64 * excitation.frequency)
off = [
    np.abs(np.interp(grid, found.axis, found.signals[net]) - points[1:-1, k]).max()
    for k, net in enumerate(nets)
]
print(json.dumps([off, np.abs(points).max(axis=0).tolist()]))
"""


@pytest.mark.slow
def test_a_simulator_touches_two_files(tmp_path: Path) -> None:
    """Its name, and what differs in its deck: here how voltages are kept. ngspice reads the rest:
    two periods with impacts are those of the exact circuit."""
    place = grown(tmp_path, SIMULATOR)
    assert "xyce" in run(place, "-m", "designer", "export", "--help")
    off, peaks = json.loads(run(place, "-c", RUN))
    assert min(peaks) > 5e-3
    assert max(np.divide(off, peaks)) < 1e-3


def test_an_op_amp_touches_a_file_of_ones_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A table as in the catalogue's own file, in a folder of one's own: its model in ngspice has
    the figures that were written."""
    shipped = (ROOT / "catalogs" / "opamps.toml").read_text("utf-8")
    (entry,) = re.findall(r'(?ms)^\[\[opamp\]\]\nname = "TL074C"$.*?(?=^\[\[opamp)', shipped)
    mine = re.sub(r"(?m)^gbw = .*$", 'gbw = { typ = "8 MHz", source = "mine" }', entry)
    mine = mine.replace('name = "TL074C"', 'name = "Mine"')
    (tmp_path / "mine.toml").write_text(f"format = 1\n\n{mine}", encoding="utf-8")
    monkeypatch.setenv("DESIGNER_CATALOGS", str(tmp_path))
    found = {check.figure: check for check in checks(load_catalog().opamp("Mine"), "dynamic")}
    assert found["gain-bandwidth"].measured == pytest.approx(8e6, rel=0.02)
    assert all(check.agrees for check in found.values())
