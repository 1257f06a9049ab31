"""``export --fab``: refused until the board is finished, then written once and stated in full."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from designer.board.sexpr import Expression, expression, expression_text, read
from designer.catalog.design_rule import NOT_RUN, PASS, RuleOutcome
from designer.catalog.design_rules import RULES
from designer.jobs import export_job
from designer.jobs.rules_job import RulesAnswer
from tests.jobs.test_kicad_export import MODEL, Done, designer, snapshot

pytestmark = pytest.mark.usefixtures("figures_are_blank")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A design folder with a board that nobody has routed."""
    place = tmp_path_factory.mktemp("order")
    (place / "pair.toml").write_text(MODEL, encoding="utf-8")
    done = designer("export", place / "pair.toml", "--out", place / "design")
    assert done.returncode == 0, done.stderr
    return place / "design"


@pytest.fixture(scope="module")
def routed(made: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with its board routed."""
    folder = tmp_path_factory.mktemp("routed") / "design"
    shutil.copytree(made, folder)
    assert designer("export", folder, "--routed").returncode == 0
    return folder


@pytest.fixture
def own(routed: Path, tmp_path: Path) -> Path:
    """A copy of it that is a test's own."""
    return Path(shutil.copytree(routed, tmp_path / "design"))


@pytest.fixture(scope="module")
def of_both(routed: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The same ordered from two fabs, and what ``export`` said of it."""
    folder = tmp_path_factory.mktemp("ordered") / "design"
    shutil.copytree(routed, folder)
    with pytest.MonkeyPatch.context() as patched:
        finished(patched)
        done = ordered(folder, "--fab", "jlcpcb", "--fab", "generic")
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


@pytest.fixture
def own_orders(of_both: tuple[Path, str], tmp_path: Path) -> Path:
    """A copy of it that is a test's own."""
    return Path(shutil.copytree(of_both[0], tmp_path / "design"))


def finished(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every rule pass, as on a routed board, but for one that nobody can check here."""
    outcomes = tuple(
        RuleOutcome(rule, NOT_RUN if rule.id == "slew" else PASS, "told so") for rule in RULES
    )
    monkeypatch.setattr(export_job, "checked", lambda *_: RulesAnswer(outcomes, "9"))


def ordered(folder: Path, *options: str | Path) -> Done:
    return designer("export", folder, *options, "--json")


@pytest.mark.kicad
def test_an_unrouted_board_is_not_ordered(made: Path) -> None:
    before = snapshot(made)
    done = ordered(made, "--fab", "jlcpcb")
    assert done.returncode == 1, done.stderr
    answer = json.loads(done.stdout)
    assert (answer["files"], answer["fabs"]) == ([], ["jlcpcb"])
    (reason,) = (r for r in answer["refused"] if r.startswith("unconnected"))
    assert "nothing is routed yet" in reason
    assert snapshot(made) == before


@pytest.mark.kicad
def test_orders_are_written_once_each_in_a_stage_of_its_own(
    own: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finished(monkeypatch)
    done = ordered(own, "--fab", "jlcpcb")
    assert done.returncode == 0, done.stderr
    first = json.loads(done.stdout)["files"]
    names = {name.removeprefix("fabrication/jlcpcb/") for name in first}
    assert names >= {"README.md", "SHA256SUMS", "linear-pair-gerbers.zip", "linear-pair-bom.csv",
                     "linear-pair-positions.csv", "gerbers/linear-pair-F_Cu.gtl"}  # fmt: skip
    assert "without an open or a short" in (own / "fabrication/jlcpcb/README.md").read_text()
    before = snapshot(own)
    monkeypatch.setattr(export_job, "checked", None)  # nothing is checked or plotted again
    assert json.loads(ordered(own, "--fab", "jlcpcb").stdout)["files"] == first
    assert snapshot(own) == before
    finished(monkeypatch)
    done = ordered(own, "--fab", "generic")
    assert done.returncode == 0, done.stderr
    assert all(n.startswith("fabrication/generic/") for n in json.loads(done.stdout)["files"])
    manifest = json.loads((own / "manifest.json").read_text())
    stages = {name: f["stage"] for name, f in manifest["files"].items() if "fabrication" in name}
    assert stages == {
        str(p.relative_to(own)): f"fabrication/{p.relative_to(own).parts[1]}"
        for p in (own / "fabrication").rglob("*")
        if p.is_file()
    }
    assert {n: c for n, c in snapshot(own).items() if "jlcpcb/" in n} == {
        n: c for n, c in before.items() if "jlcpcb/" in n
    }


@pytest.mark.kicad
def test_another_board_is_ordered_with_overwrite_alone_and_other_orders_stay(
    own_orders: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finished(monkeypatch)
    own = own_orders
    kept = {n: c for n, c in snapshot(own).items() if "jlcpcb/" in n}
    assert kept
    moved = tmp_path / "mine.kicad_pcb"
    moved.write_bytes((own / "kicad" / "linear-pair.kicad_pcb").read_bytes() + b"\n")
    done = ordered(own, "--fab", "generic", "--board", moved)
    assert done.returncode == 2
    assert "--overwrite" in done.stderr
    done = ordered(own, "--fab", "generic", "--board", moved, "--overwrite")
    assert done.returncode == 0, done.stderr
    assert {n: c for n, c in snapshot(own).items() if "jlcpcb/" in n} == kept
    assert (own / "fabrication" / "generic" / "README.md").is_file()


@pytest.mark.kicad
def test_orders_in_the_one_stage_of_earlier_versions_are_read_as_one_each(
    of_both: tuple[Path, str], own_orders: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Version 1 of the folder had one stage for all orders, with the names of the fabs."""
    own, first = own_orders, json.loads(of_both[1])
    file = own / "manifest.json"
    manifest = json.loads(file.read_text())
    entries = [manifest["stages"].pop(f"fabrication/{name}") for name in ("generic", "jlcpcb")]
    assert entries[0]["inputs"] == entries[1]["inputs"]
    inputs = {**entries[0]["inputs"], "fabs": ["generic", "jlcpcb"]}
    manifest["stages"]["fabrication"] = {"inputs": inputs, "complete": True}
    for each in manifest["files"].values():
        each["stage"] = each["stage"].partition("/")[0]
    file.write_text(json.dumps(manifest))
    monkeypatch.setattr(export_job, "checked", None)
    again = ordered(own, "--fab", "jlcpcb", "--fab", "generic")
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout) == first


def test_without_kicad_nothing_begins(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = snapshot(made)
    monkeypatch.setenv("PATH", str(tmp_path))
    done = ordered(made, "--fab", "jlcpcb")
    assert done.returncode == 3
    assert "kicad-cli is not installed" in done.stderr
    assert snapshot(made) == before


@pytest.mark.kicad
@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--fab", "jlpcb"], 'did you mean "jlcpcb"?'),
        (["--fab", "jlcpcb", "--deck", "ltspice"], "--deck"),
        (["--board", "some.kicad_pcb"], "--fab NAME"),
        (["--accept", "slew"], "--fab NAME"),
        (["--fab", "generic", "--accept", "slow"], 'did you mean "slew"?'),
        (["--fab", "generic", "--accept", "unconnected"], "--accept"),
        (["--fab", "generic", "--board", "some.kicad_pcb"], "some.kicad_pcb"),
    ],
)
def test_wrong_options_are_named(made: Path, options: list[str], told: str) -> None:
    before = snapshot(made)
    done = ordered(made, *options)
    assert done.returncode == 2, done.stderr
    assert told in done.stderr
    assert snapshot(made) == before


@pytest.mark.kicad
@pytest.mark.slow
def test_a_routed_board_is_ordered_under_its_own_rules(own: Path) -> None:
    """Offsets disturb this system more than its rule allows: refused until that is accepted."""
    folder = own
    refused = ordered(folder, "--fab", "jlcpcb")
    assert refused.returncode == 1, refused.stderr
    (reason,) = json.loads(refused.stdout)["refused"]
    assert reason.startswith("offset-force: ")
    done = ordered(folder, "--fab", "jlcpcb", "--accept", "offset-force")
    assert done.returncode == 0, done.stderr
    place = folder / "fabrication" / "jlcpcb"
    assert "Accepted, though the rule fails: offset-force" in (place / "README.md").read_text()
    copper = (place / "gerbers" / "linear-pair-B_Cu.gbl").read_text()
    assert "D01*" in copper, "tracks are drawn"
    assert "G36*" in copper, "the ground pour is drawn"


@pytest.mark.kicad
@pytest.mark.parametrize("edge", ["no edge", "an edge that is not closed"])
def test_a_board_without_an_edge_is_refused(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, edge: str
) -> None:
    """Nobody can mill it, whatever the rules are told to accept; nothing is written."""
    finished(monkeypatch)
    (path,) = (own / "kicad").glob("*.kicad_pcb")
    board = read(path.read_text("utf-8"))
    inner = [each for each in board.items if not (isinstance(each, Expression) and on_edge(each))]
    if edge != "no edge":
        inner.append(expression("gr_line", start=(0, 0), end=(9, 9), layer="Edge.Cuts"))
    bare = tmp_path / "bare.kicad_pcb"
    bare.write_text(expression_text(Expression(tuple(inner))), encoding="utf-8")
    before = snapshot(own)
    words = ("--fab", "generic", "--board", bare, "--overwrite", "--accept", "board-outline")
    done = ordered(own, *words)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "bare.kicad_pcb: Edge.Cuts" in done.stderr
    assert edge in done.stderr
    assert snapshot(own) == before


def on_edge(item: Expression) -> bool:
    return any(layer.text() == "Edge.Cuts" for layer in item.all("layer"))
