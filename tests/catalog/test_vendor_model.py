"""A user's SPICE model: works where it should, and cannot do anything but compute."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.catalog.netlist_guard import check_netlist
from designer.catalog.parts_catalog import load_catalog
from designer.catalog.vendor_model import MOST_BYTES, PINS, read_vendor_model
from designer.spice.opamp_check import OpAmpBench

SHIPPED = Path(__file__).resolve().parents[2] / "catalogs" / "opamps.toml"

# Two stages and a helper; a limiter of its own name, as our deck has one; a comment in Latin-1.
MODEL = """* Prüfmodell: offset ± 0
.param half=0.5 ; outside
.func twice(x) {x*2}
.model limiter d(is=1e-15 n=0.05)
.subckt part 1 2 3 4 5 params: gain=1e5
Gm 0 x VALUE = {twice(half)*1e-3*V(1,2)}
Rx x 0 {gain*1k}
Cx x 0 {1e-3/6.283185307/2meg}
Xbuf x 5
+ buffer
Dup x up limiter
Vup up 3 -1
Ddn dn x limiter
Vdn dn 4 1
Iq 3 4 2m
.ends part

.subckt BUFFER in out
Eout y 0 in 0 1
Rout y out 50
.ends
"""


def save(folder: Path, text: str = MODEL, name: str = "part.lib") -> Path:
    (folder / name).write_bytes(text.encode("latin-1"))
    return folder


def entry(spice: str) -> str:
    """The shipped TL074C with a vendor's model."""
    table = SHIPPED.read_text(encoding="utf-8").split("[[opamp]]")[1]
    return f"format = 1\n\n[[opamp]]{table.rstrip()}\nspice = {spice}\n"


GOOD = '{ file = "part.lib", subckt = "PART", pins = ["inp", "inn", "vcc", "vee", "out"] }'
ORDER = ("inp", "inn", "vcc", "vee", "out")


def test_a_vendor_model_takes_the_place_of_ours_on_the_finest_fidelity(tmp_path: Path) -> None:
    """Its gain, bandwidth, limits and supply current are measured, not the catalogue's."""
    save(tmp_path)
    (tmp_path / "own.toml").write_text(entry(GOOD), encoding="utf-8")
    opamp = load_catalog(tmp_path).opamp("TL074C")
    bench = OpAmpBench.of(opamp, "full")
    assert bench.open_loop_gain() == pytest.approx(1e5, rel=1e-3)
    frequency, margin = bench.unity_gain()
    assert frequency == pytest.approx(2e6, rel=1e-2)
    assert margin == pytest.approx(90.0, abs=0.5)
    assert bench.swing(1e6)[1] == pytest.approx(14.1, abs=0.1)
    assert bench.supply_current() == pytest.approx((2e-3, 2e-3), rel=1e-2)
    assert bench.offset() == pytest.approx(opamp.offset.nominal, rel=1e-3)
    assert OpAmpBench.of(opamp, "dynamic").open_loop_gain() == pytest.approx(200e3, rel=1e-3)


def test_the_hash_of_the_catalogue_follows_the_model(tmp_path: Path) -> None:
    save(tmp_path)
    (tmp_path / "own.toml").write_text(entry(GOOD), encoding="utf-8")
    before = load_catalog(tmp_path).hash
    save(tmp_path, MODEL.replace("1e5", "2e5"))
    assert load_catalog(tmp_path).hash != before


def test_names_cannot_collide(tmp_path: Path) -> None:
    """A subcircuit called as ours, parameters and models outside of any."""
    text = MODEL.replace("BUFFER", "opamp").replace("buffer", "OpAmp")
    model = read_vendor_model("part.lib", "part", ORDER, save(tmp_path, text))
    lines = model.wrapped()
    check_netlist("\n".join(["* t", *lines, ".end"]))
    heads = [line.split()[1] for line in lines if line.startswith(".subckt")]
    assert sorted(heads) == ["opamp", "vendor_opamp", "vendor_part"]
    assert "Xbuf x 5 vendor_opamp" in lines
    depth = 0
    for line in lines:
        depth += line.startswith(".subckt") - line.startswith(".ends")
        assert depth == 1 or line.startswith(".ends"), f"outside: {line}"


def test_names_stay_apart(tmp_path: Path) -> None:
    """Two names that differ in punctuation alone."""
    text = MODEL.replace("BUFFER", "a-b").replace("buffer", "a-b")
    text += ".subckt a.b in out\nR1 in out 1\n.ends\n"
    model = read_vendor_model("part.lib", "part", ORDER, save(tmp_path, text))
    heads = [line.split()[1] for line in model.lines if line.startswith(".subckt")]
    assert heads == ["vendor_part", "vendor_a-b", "vendor_a.b"]
    assert "Xbuf x 5 vendor_a-b" in model.lines


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("Iq 3 4 2m", ".include /etc/passwd", r"card \.include"),
        ("Iq 3 4 2m", ".lib other.lib", r"card \.lib"),
        ("Iq 3 4 2m", ".control", r"card \.control"),
        ("Iq 3 4 2m", ".csparam a=1", r"card \.csparam"),
        ("Iq 3 4 2m", ".options reltol=1", r"card \.options"),
        ("Iq 3 4 2m", ".global 3", r"card \.global"),
        ("Iq 3 4 2m", ".end", r"card \.end"),
        ("Iq 3 4 2m", "A1 x y reader", "element of kind A"),
        ("Iq 3 4 2m", "N1 x y osdi", "element of kind N"),
        ("Iq 3 4 2m", "U1 x y digital", "element of kind U"),
        ("Iq 3 4 2m", "1x 3 4 2m", "element of kind 1"),
        ("Iq 3 4 2m", 'V9 q 0 pwl file="a.csv"', "a file"),
        ("Iq 3 4 2m", "V9 q 0 PWL (FILE = a)", "a file"),
        ("Iq 3 4 2m", "V9 q 0 PWLFILE a", "a file"),
        ("Iq 3 4 2m", ".model r2 filesource(file=secret)", "a file"),
        ("Iq 3 4 2m", ".model r2 d_process(process_file=sh)", "a file|type"),
        ("Iq 3 4 2m", ".model r2 d_cosim(simulation=x)", "type"),
        ("Iq 3 4 2m", ".model r2 table2d(offset=0)", "type"),
        ("Iq 3 4 2m", "B9 q 0 V=`id`", "character"),
        ("Iq 3 4 2m", "B9 q 0 V=$HOME", "character"),
        ("Iq 3 4 2m", "R9 q 0 1\\\\", "character"),
        ("Iq 3 4 2m", "R9 q 0 1\x07", "control character"),
        ("Iq 3 4 2m", "R9 q 0 1\rquit", "control character"),
        ("Iq 3 4 2m", "R\xe9 q 0 1", "outside ASCII"),
        ("Iq 3 4 2m", "X9 x q opamp", "not in this file"),
        ("Eout y 0 in 0 1", "X9 in out BUFFER", "calls itself"),
        ("Eout y 0 in 0 1", "X9 a b c d e part", "calls itself"),
        ("{x*2}", "{twice(x)*2}", "function that calls itself"),
        (".ends part", "", "inside another"),
        (".subckt BUFFER in out", "", "outside a subcircuit|without a beginning"),
        (".subckt BUFFER in out", ".subckt BUFFER in {out}", "plain name"),
        (".subckt BUFFER in out", ".subckt part in out", "name that is taken"),
        ("* Prüfmodell", "+ 1", "continuation of nothing"),
    ],
)  # fmt: skip
def test_hostile_and_broken_models(tmp_path: Path, old: str, new: str, why: str) -> None:
    """Refused with the file and the line, before ngspice sees any of it."""
    assert old in MODEL
    save(tmp_path, MODEL.replace(old, new))
    with pytest.raises(InputError, match=why) as refused:
        read_vendor_model("part.lib", "part", ORDER, tmp_path)
    assert refused.value.file == str((tmp_path / "part.lib").resolve())
    assert re.fullmatch(r"line \d+", refused.value.field)


@pytest.mark.parametrize("comment", ["*#shell touch planted", "* ng_script", "*# quit"])
def test_comments_that_ngspice_would_execute_are_dropped(tmp_path: Path, comment: str) -> None:
    save(tmp_path, MODEL.replace("Iq 3 4 2m", f"{comment}\nIq 3 4 2m ; {comment}"))
    model = read_vendor_model("part.lib", "part", ORDER, tmp_path)
    assert not any("*#" in line or "ng_" in line for line in model.lines)


def test_a_model_outside_its_folder(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    save(tmp_path)
    save(inside, name="real.lib")
    (inside / "link.lib").symlink_to(inside / "real.lib")
    (inside / "out").symlink_to(tmp_path)
    (inside / "folder.lib").mkdir()
    names = ["../part.lib", str(tmp_path / "part.lib"), "link.lib", "out/part.lib", "none.lib",
             "folder.lib", ".", ""]  # fmt: skip
    for name in names:
        with pytest.raises(InputError, match=r"^file: ") as refused:
            read_vendor_model(name, "part", ORDER, inside)
        missing = ", which does not exist" if name == "none.lib" else ""
        assert refused.value.found == name + missing


@pytest.mark.parametrize(
    ("spice", "field"),
    [
        (GOOD.replace('"PART"', '"other"'), "subckt"),
        (GOOD.replace('"out"]', '"out", "out"]'), "pins"),
        (GOOD.replace('"out"', '"output"'), "pins"),
        (GOOD.replace('"PART"', '"BUFFER"'), "line"),
        (GOOD.replace("part.lib", "../part.lib"), r"opamp\[1\].spice.file"),
        (GOOD.replace("file =", "path ="), "spice.path"),
        ('"part.lib"', "spice"),
    ],
)
def test_wrong_entries(tmp_path: Path, spice: str, field: str) -> None:
    save(tmp_path)
    (tmp_path / "own.toml").write_text(entry(spice), encoding="utf-8")
    with pytest.raises(InputError, match=field):
        load_catalog(tmp_path)


def test_a_model_that_is_too_large(tmp_path: Path) -> None:
    save(tmp_path, "* x\n" * (MOST_BYTES // 4 + 1))
    with pytest.raises(InputError, match="bytes"):
        read_vendor_model("part.lib", "part", ORDER, tmp_path)
    save(tmp_path, "R1 a 0 1\n" * 6000)
    with pytest.raises(InputError, match="statements"):
        read_vendor_model("part.lib", "part", ORDER, tmp_path)


def doubling(kind: str, levels: int) -> str:
    """A model whose size doubles with each of its levels."""
    if kind == "calls":
        blocks = "".join(
            f".subckt b{k + 1} a b\nX1 a c b{k}\nX2 c b b{k}\n.ends\n" for k in range(levels)
        )
        inner = ".subckt b0 a b\nR1 a b 1\n.ends\n"
        return f"{MODEL.replace('Xbuf x 5', f'X9 x 0 b{levels}{chr(10)}Xbuf x 5')}{inner}{blocks}"
    if kind == "functions":
        heads = "".join(f".func f{k + 1}(x) {{f{k}(x)+f{k}(x)}}\n" for k in range(levels))
        return f".func f0(x) {{x*1}}\n{heads}" + MODEL.replace("1e-3*V", f"f{levels}(1)*V")
    nested = "twice(" * levels + "half" + ")" * levels
    return MODEL.replace("{x*2}", "{x+x}").replace("twice(half)", nested)


@pytest.mark.parametrize("kind", ["calls", "functions", "arguments"])
def test_models_that_grow(tmp_path: Path, kind: str) -> None:
    """Few lines that stand for more than any machine holds; a few levels are no harm."""
    read_vendor_model("part.lib", "part", ORDER, save(tmp_path, doubling(kind, 8)))
    for levels in (24, 200):
        save(tmp_path, doubling(kind, levels))
        with pytest.raises(InputError, match="written out"):
            read_vendor_model("part.lib", "part", ORDER, tmp_path)


def test_pins_are_those_of_our_subcircuit() -> None:
    from designer.spice import opamp_model

    assert opamp_model.PINS.split() == list(PINS)
