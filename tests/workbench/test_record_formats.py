"""Files as oscilloscopes write them, made here cell by cell, and read back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from designer.base.errors import InputError
from designer.workbench.record_formats import read_record

K = 400
START, STEP = -5.0e-3, 2.0e-5
TIME = START + STEP * np.arange(K)
FIRST = np.round(2.0 * np.sin(2.0 * np.pi * 300.0 * TIME), 3)
SECOND = np.round(0.5 * np.cos(2.0 * np.pi * 300.0 * TIME) + 0.1, 3)


def rows(line: Callable[[int], str]) -> str:
    return "".join(line(i) + "\n" for i in range(K))


def comma(value: float, digits: int = 8) -> str:
    return f"{value:.{digits}f}".replace(".", ",")


TDS = ["Record Length,4.000000e+02,", "Sample Interval,2.000000e-05,", "Trigger Point,250.0,"]
TDS += ["Source,CH1,", "Vertical Units,V,", "Yzero,0.000000e+00,", "Firmware Version,FV:v22.01,"]

ONE = {
    "Rigol MSO5000 memory": "CH1(V),t0 = -5.0e-03s, tInc = 2.0e-05s,\n"
    + rows(lambda i: f"{FIRST[i]:.3f},,,"),
    "Tektronix TDS": rows(
        lambda i: f"{TDS[i] if i < len(TDS) else ',,'},{TIME[i]:018.12f},{FIRST[i]:10.5f},"
    ),
    "Siglent, one channel": "Record Length,Analog:400,\nSample Interval,Analog:2.0E-05,\n"
    "Vertical Units,CH1:V,,\nVertical Scale,CH1:1.0E+00,,\nModel Number,SDS1104X-E\n"
    "Source,CH1\nSecond,Value\n" + rows(lambda i: f"{TIME[i]:+.6E},{FIRST[i]:+.6E}"),
}
TWO = {
    "Rigol DS1000Z": "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-5.000000e-03,2.000000e-05\n"
    + rows(lambda i: f"{i},{FIRST[i]:.3e},{SECOND[i]:.3e},"),
    "Rigol MSO5000": "Time(s),CH1(V),CH2(V)\n"
    + rows(lambda i: f"{TIME[i]:.6f},{FIRST[i]:.3f},{SECOND[i]:.3f}"),
    "Siglent": "Record Length,Analog:400\nSample Rate,50000.0\nVertical Scale,CH1: 1.00,CH2: 0.20\n"
    "Vertical Offset,CH1:0.00000,CH2:0.00000\nHorizontal Scale, 0.000500000\nSource,CH1,CH2\n"
    "Second,Volt,Volt\n" + rows(lambda i: f"{TIME[i]:.11f},{FIRST[i]:.5f},{SECOND[i]:.5f}"),
    "Keysight": "x-axis,1,2\nsecond,Volt,Volt\n-5.02000E-03,,\n"
    + rows(lambda i: f"{TIME[i]:.6E},{FIRST[i]:+.6E},{SECOND[i]:+.6E}"),
    "Tektronix MSO": "Model,MSO54\nLabel,,\nWaveform Type,ANALOG,\nHorizontal Units,s,\n"
    "Sample Interval,2E-05,\nRecord Length,400,\n,,\n\nVertical Units,V,V\nLabels,,\n"
    "TIME,CH1,CH2\n" + rows(lambda i: f"{TIME[i]:.6e},{FIRST[i]:.3f},{SECOND[i]:.3f}"),
    "PicoScope": "Time,Channel A,Channel B\n(ms),(V),(mV)\n\n"
    + rows(lambda i: f"{1e3 * TIME[i]:.8f},{FIRST[i]:.8f},{1e3 * SECOND[i]:.6f}"),
    "PicoScope, German": "Zeit;Kanal A;Kanal B\n(µs);(V);(mV)\n\n"
    + rows(lambda i: f"{comma(1e6 * TIME[i], 3)};{comma(FIRST[i])};{comma(1e3 * SECOND[i])}"),
    "PicoScope, tabs": "Time\tChannel A\tChannel B\n(us)\t(V)\t(V)\n\n"
    + rows(lambda i: f"{1e6 * TIME[i]:.3f}\t{FIRST[i]:.6f}\t{SECOND[i]:.6f}"),
    "plain columns": rows(lambda i: f"  {TIME[i]:.6e}   {FIRST[i]:.3f} {SECOND[i]:.3f}"),
    "plain columns, decimal commas": rows(
        lambda i: f"{comma(TIME[i])} {comma(FIRST[i])} {comma(SECOND[i])}"
    ),
    "comment above": "# time v1 v2\n" + rows(lambda i: f"{TIME[i]:.6e} {FIRST[i]} {SECOND[i]}"),
}


@pytest.mark.parametrize("name", [*ONE, *TWO])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_what_scopes_write_is_read(name: str, encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text({**ONE, **TWO}[name], encoding=encoding, newline="\r\n")
    record = read_record(path)
    assert len(record.time) == K
    np.testing.assert_allclose(record.time, TIME, rtol=0.0, atol=1e-6 * STEP + 1e-9)
    assert record.interval == pytest.approx(STEP, rel=1e-6)
    wanted = [FIRST] if name in ONE else [FIRST, SECOND]
    assert len(record.signals) == len(wanted)
    for signal, truth in zip(record.signals.values(), wanted, strict=True):
        np.testing.assert_allclose(signal, truth, rtol=0.0, atol=1e-9)
    maker = name.split(",")[0].split()[0]
    assert maker in record.kind or maker in ("plain", "comment")


@pytest.mark.parametrize(
    ("name", "channels"),
    [
        ("Rigol DS1000Z", ["CH1", "CH2"]),
        ("Siglent", ["CH1", "CH2"]),
        ("Keysight", ["1", "2"]),
        ("Tektronix MSO", ["CH1", "CH2"]),
        ("PicoScope, German", ["Kanal A", "Kanal B"]),
        ("plain columns", ["column 2", "column 3"]),
        ("Tektronix TDS", ["CH1"]),
        ("Rigol MSO5000 memory", ["CH1"]),
        ("Siglent, one channel", ["CH1"]),
    ],
)
def test_channels_have_the_names_of_the_file(
    name: str, channels: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "record.csv"
    path.write_text({**ONE, **TWO}[name], encoding="utf-8")
    assert list(read_record(path).signals) == channels


def test_times_that_were_rounded_are_equal_steps_again(tmp_path: Path) -> None:
    """A scope that writes six digits of -25 s at 2 µs repeats each time over and over."""
    path = tmp_path / "record.csv"
    times = -25.0 + 2e-6 * np.arange(5000)
    lines = [f"{t:.5f},{np.sin(3e3 * t):.3f}" for t in times]
    path.write_text("Time(s),CH1(V)\n" + "\n".join(lines), encoding="utf-8")
    assert read_record(path).interval == pytest.approx(2e-6, rel=1e-3)


def test_arrays_of_numpy(tmp_path: Path) -> None:
    table, named, pico = (tmp_path / name for name in ("a.npy", "b.npz", "c.npz"))
    np.save(table, np.column_stack([TIME, FIRST, SECOND]))
    np.savez(named, v1=FIRST, time=TIME, fv=SECOND)
    np.savez(pico, A=FIRST, B=SECOND, Tstart=START, Tinterval=STEP, Length=K)
    for path, channels in ((table, ["column 2", "column 3"]), (named, ["v1", "fv"])):
        record = read_record(path)
        assert list(record.signals) == channels
        np.testing.assert_array_equal(record.signals[channels[1]], SECOND)
        np.testing.assert_allclose(record.time, TIME, rtol=0.0, atol=1e-12)
    assert read_record(pico).interval == pytest.approx(STEP)


def broken(change: Callable[[list[str]], None]) -> str:
    lines = TWO["Rigol MSO5000"].splitlines()
    change(lines)
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "field", "found"),
    [
        ("", "the file", "nothing"),
        ("no numbers here\nnor here\n" * 60, "a line in the middle", "here"),
        (broken(lambda lines: lines.__setitem__(100, "1,2,nonsense")), "line 101", "nonsense"),
        (broken(lambda lines: lines.__setitem__(100, "1,2")), "line 101", "1,2"),
        (broken(lambda lines: lines.__setitem__(100, "1,2,3,4,5")), "line 101", "1 s"),
        (broken(lambda lines: lines.__setitem__(100, "1,∞,3")), "line 101", "∞"),
        (broken(lambda lines: lines.__setitem__(100, "1,nan,3")), "line 101", "nan"),
        (broken(lambda lines: lines.__delitem__(slice(100, 200))), "line", "s"),
        (broken(lambda lines: lines.__delitem__(slice(50, None))), "its samples", "49"),
        (TWO["Siglent"].replace("Second,Volt,Volt", "Second,Volt,Ampere"), "the unit", "Ampere"),
        ("CH1(V)\n" + rows(lambda i: f"{FIRST[i]}"), "its times", "missing"),
    ],
)
def test_a_file_that_is_no_record_is_refused_with_the_line(
    text: str, field: str, found: str, tmp_path: Path
) -> None:
    path = tmp_path / "record.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_record(path)
    assert str(path) in str(error.value)
    assert field in error.value.field
    assert found in str(error.value)


def test_bytes_and_pickles_are_refused(tmp_path: Path) -> None:
    noise, pickled = tmp_path / "noise.csv", tmp_path / "pickled.npy"
    noise.write_bytes(bytes(range(256)) * 9)
    np.save(pickled, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    for path in (noise, pickled, tmp_path / "nowhere.csv", tmp_path):
        with pytest.raises(InputError):
            read_record(path)


def test_a_long_record_is_no_trouble(tmp_path: Path) -> None:
    """A hundred thousand points are read; how long that takes is reports/bench's to say."""
    path, count = tmp_path / "record.csv", 100_000
    table = np.column_stack([STEP * np.arange(count), np.sin(np.arange(count) * 0.01)])
    path.write_text("Time,Channel A\n(s),(V)\n\n" + "\n".join(f"{a:.8f},{b:.6f}" for a, b in table))
    assert len(read_record(path).time) == count
