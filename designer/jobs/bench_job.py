"""What records of an oscilloscope show of a board."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from designer.base import progress
from designer.base.atomic_write import appearing
from designer.base.design_folder import is_design_folder
from designer.base.errors import MISSING, EnvironmentMissing, InputError
from designer.base.plain_json import dumps, plain
from designer.base.printed import one_line
from designer.circuit.design import GeneratorSetting
from designer.dynamics.counts import read_counts
from designer.folders.report_sections import BENCHED as NAME
from designer.model.model import SiScales
from designer.model.si_units import mechanism_json
from designer.spice.pool import SpicePool, require_ngspice
from designer.spice.simulator import SimulationFailed
from designer.workbench.advice import Advice
from designer.workbench.fitted_board import FittedBoard, board_behind
from designer.workbench.free_decay import FreeDecay, recorded_decay
from designer.workbench.naming import NamedMotion
from designer.workbench.overlay import Overlay
from designer.workbench.prediction import BoardPrediction
from designer.workbench.record import RecordedMotion
from designer.workbench.record_formats import read_record

if TYPE_CHECKING:
    from designer.answers.bench_answer import BenchJson, CutRow, RecordRow, StopEnd, StopRow
    from designer.workbench.dead_zone_curve import DeadZoneCurve

PAGE, LIST = "bench.html", "boards.csv"
LISTED = 20
"""Boards in the list for each fitted one, as probable as its records leave it."""
PLACE = "a directory that can be written"
NEAR = 0.06
"""Of a setting's frequency: how far from it a record may be taken for one of its response."""


@dataclass(frozen=True)
class BenchedRecord:
    """A record, and what it shows."""

    path: Path
    named: NamedMotion
    """What it shows."""
    overlay: Overlay | None
    """The record over the nominal board's orbit; None where there is none."""
    setting: GeneratorSetting | None
    """As of ``near_setting``."""
    board: FittedBoard | None = None
    """The board that it is of, fitted to all of its records; None where none was asked for."""

    @property
    def advice(self) -> Advice | None:
        """What to turn for what is wanted at the nearest setting."""
        if self.setting is None or self.board is None:
            return None
        hertz = self.setting.frequency_hz
        at = (a for a in self.board.advice if a.question.excitation.frequency == hertz)
        return next(at, None)

    @property
    def as_wanted(self) -> bool | None:
        """Whether it surely shows what is wanted at the nearest setting, or its mirror twin; None
        where nothing is wanted there, and where a motion without a period is, which no record of
        one proves."""
        if self.setting is None or self.setting.expect is None:
            return None
        counts = self.named.counts
        if read_counts(self.setting.expect) is None:
            return False if self.named.sure and counts is not None else None
        if not self.named.sure or counts is None:
            return False
        return self.setting.expect in (str(counts), str(counts.mirrored))


def with_ngspice(
    benched: Sequence[BenchedRecord], prediction: BoardPrediction, jobs: int
) -> list[BenchedRecord]:
    """The records with ngspice's motion of the fitted board, or of the nominal one, over each."""
    out, runs, which = list(benched), [], []
    for i, each in enumerate(benched):
        if each.overlay is not None:
            fit = None if each.board is None or not _fits(each) else each.board.fit
            number = sum(1 for b in benched[:i] if b.board is each.board and _fits(b))
            runs.append(each.overlay.ngspice_job(prediction, fit, number))
            which.append((i, fit is not None))
    try:
        with SpicePool(min(jobs, len(runs))) as pool:
            require_ngspice(pool)
            for number, motion in pool.map(runs):
                i, fitted = which[number]
                overlay = benched[i].overlay
                if overlay is None or isinstance(motion, SimulationFailed):
                    progress.note(f"{benched[i].path.name}: no answer of ngspice")
                    continue
                laid = overlay.with_ngspice(motion, prediction, fitted=fitted)
                out[i] = replace(benched[i], overlay=laid)
    except EnvironmentMissing as error:
        progress.note(f"{error}; the pictures are without it")
    return out


def _fits(record: BenchedRecord) -> bool:
    """Whether a record has a say in a fit: it has a period."""
    return record.named.counts is not None


def check_fits(
    prediction: BoardPrediction, *, fit: bool, boards: bool, decays: Sequence[Path]
) -> None:
    """InputError where the generator does not give one sine, and where boards with laws, or with
    dampers in their stops, are to be fitted: the fit knows contacts alone, and rates that are
    continuous there."""
    prediction.check_drive()
    laws = ", ".join(dict.fromkeys(bend.bend_of for bend in prediction.circuit.bends))
    asked = {"--fit": fit, "--boards": boards, "--decay": bool(decays)}
    for option, wanted in asked.items():
        if wanted and laws:
            expected = "a board whose forces are those of clearances; records alone are named"
            raise InputError(None, option, f"a board with bends of {laws}", expected)
        if wanted and prediction.circuit.dependent_capacitors:
            expected = "a board whose stops have no dampers; records alone are named"
            raise InputError(None, option, "a board with dampers in its stops", expected)


def check_decays(files: Sequence[Path], decays: Sequence[Path], several: bool) -> None:
    """InputError for a record with the generator off of a board that has no other."""
    known = {board_name(file, several) for file in files}
    for path in decays:
        name = board_name(path, several)
        if name not in known:
            raise InputError(path, "--decay", f"board {name} alone", "another --record of it")


def free_decays(
    decays: Sequence[Path],
    files: Sequence[Path],
    motions: Sequence[RecordedMotion],
    prediction: BoardPrediction,
    several: bool,
) -> dict[str, list[tuple[str, FreeDecay]]]:
    """The records with the generator off by board, each with its file's name, on the channels of
    its board's first record."""
    free: dict[str, list[tuple[str, FreeDecay]]] = {}
    for path in decays:
        name = board_name(path, several)
        same = next(
            m for f, m in zip(files, motions, strict=True) if board_name(f, several) == name
        )
        decay = recorded_decay(read_record(path), same.channels, prediction)
        free.setdefault(name, []).append((path.name, decay))
    return free


def fitted_boards(
    benched: Sequence[BenchedRecord],
    free: Mapping[str, Sequence[tuple[str, FreeDecay]]],
    prediction: BoardPrediction,
    *,
    several: bool,
) -> dict[str, FittedBoard]:
    """The boards behind the records by name, each fitted to all of its own.

    free : of each board its records with the generator off.
    """
    own: dict[str, list[tuple[str, NamedMotion]]] = {}
    for each in benched:
        name = board_name(each.path, several)
        own.setdefault(name, []).append((each.path.name, each.named))
    out = {}
    for name, records in own.items():
        shows = ", ".join(named.response for _, named in records)
        progress.stage(f"board {name} behind {shows}" if name else f"board behind {shows}")
        out[name] = board_behind(name, records, prediction, decays=free.get(name, ()))
    return out


def board_name(record: Path, several: bool) -> str:
    """The name of a record's board: among several that of its folder, "" where there is one."""
    return one_line(record.resolve().parent.name) if several else ""


def check_places(
    folder: Path, files: Sequence[Path], place: Path | None, names: Sequence[str], overwrite: bool
) -> None:
    """InputError where there is no design or no record, or files are in the way."""
    if not is_design_folder(folder):
        expected = "a design folder, as synthesise and run make it"
        raise InputError(folder, "DIR", "no manifest.json", expected)
    if not files:
        raise InputError(None, "--record", MISSING, "a file that an oscilloscope wrote")
    if place is None:
        return
    if place.exists() and not place.is_dir():
        raise InputError(place, "--out", "a file", PLACE)
    if is_design_folder(place):
        raise InputError(place, "--out", "a design folder", "a directory of its own for a board")
    for name in (NAME, PAGE, *names):
        if (place / name).exists() and not overwrite:
            raise InputError(place / name, "--out", "a file", "a name that is free, or --overwrite")


def picture_names(files: Sequence[Path]) -> list[str]:
    """Of the picture of each record."""
    stems = [file.stem for file in files]
    return [
        f"{stem}.png" if stems.count(stem) == 1 else f"{stem}-{k + 1}.png"
        for k, stem in enumerate(stems)
    ]


def near_setting(frequency: float, prediction: BoardPrediction) -> GeneratorSetting | None:
    """The setting whose frequency is nearest, if it is near."""
    gaps = [(abs(frequency / s.frequency_hz - 1.0), s) for s in prediction.settings]
    gap, setting = min(gaps, key=lambda pair: pair[0], default=(math.inf, None))
    return setting if gap < NEAR else None


def record_json(benched: BenchedRecord, seconds: float, si: SiScales | None) -> RecordRow:
    """seconds : of the circuit for a unit of the model's time."""
    name, motion = benched.named, benched.named.motion
    record, overlay, setting = motion.record, benched.overlay, benched.setting
    wave = None if overlay is None else overlay.ngspice
    omega = 2.0 * math.pi * motion.frequency * seconds
    return {
        "file": one_line(benched.path.name),
        "kind": record.kind,
        "samples": len(record.time),
        "periods": motion.periods,
        "channels": dict(motion.channels),
        "omega": omega,
        **mechanism_json(omega, si),
        "frequency": motion.frequency,
        "frequency_hz": motion.frequency,
        "frequency_error_hz": motion.frequency_error,
        "amplitude_v_peak": motion.amplitude,
        "response": name.response,
        "sure": name.sure,
        "by_board": name.by_board,
        "others": list(name.others),
        "reason": name.reason,
        "would_tell": name.would_tell,
        "clipped": [
            _cut_json(net, motion.channels[net], low, high)
            for net, (low, high) in name.clipped.items()
        ],
        "symmetric": name.symmetric,
        "asymmetry": name.asymmetry,
        "asymmetry_error": name.asymmetry_error,
        "wanted": None if setting is None else setting.expect,
        "as_wanted": benched.as_wanted,
        "stops": [_stops(clearance, zone) for clearance, zone in name.dead_zones.items()],
        "exact_circuit": None
        if overlay is None
        else {"response": overlay.orbit.response, "difference": dict(overlay.errors)},
        "ngspice": None
        if wave is None
        else {
            "response": wave.response,
            "fitted": wave.fitted,
            "difference": dict(wave.errors),
        },
        "fitted": None if benched.board is None else plain(benched.board.figures),
        "advice": None if benched.advice is None else benched.advice.as_dict(si),
    }


def _stops(clearance: str, zone: DeadZoneCurve) -> StopRow:
    row: StopRow = {"clearance": clearance}
    if 1 in zone.ends:
        row["upper"] = _stop_end(zone, 1)
    if -1 in zone.ends:
        row["lower"] = _stop_end(zone, -1)
    return row


def _stop_end(zone: DeadZoneCurve, side: int) -> StopEnd:
    error = zone.end_errors[side]
    return {"volts": zone.ends[side], "error": error if math.isfinite(error) else None}


def _cut_json(net: str, channel: str, low: float | None, high: float | None) -> CutRow:
    """A channel that is cut off below or above a voltage [V]."""
    ends = [
        f"{side} {end:.3g} V" for side, end in (("below", low), ("above", high)) if end is not None
    ]
    words = (
        f"{channel} ({net}) is cut off {' and '.join(ends)}: what is beyond is not seen. "
        "Record it with a larger range."
    )
    return {"net": net, "channel": channel, "low": low, "high": high, "words": words}


def write_answer(
    place: Path,
    names: Sequence[str],
    answer: BenchJson,
    records: Sequence[BenchedRecord],
) -> None:
    """The answer, its page and the picture of each record."""
    from designer.base.figure_style import to_png  # matplotlib is not needed but for them
    from designer.plots.record_plots import record_figure
    from designer.report.record_page import record_page_html

    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(place, "--out", error.strerror or str(error), PLACE) from None
    figures = [record_figure(each.named, each.overlay) for each in records]
    contents: dict[str, bytes] = {NAME: dumps(answer).encode("utf-8")}
    contents |= {n: to_png(f) for n, f in zip(names, figures, strict=True)}
    contents[PAGE] = record_page_html(answer, figures).encode("utf-8")
    for name, content in contents.items():
        put(place / name, content)


def put(path: Path, content: bytes) -> None:
    with appearing(path, "--out", PLACE) as partial:
        partial.write_bytes(content)
