"""The verb ``bench``: what records of an oscilloscope show of a board."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.atomic_write import appearing
from designer.base.defaults import cores
from designer.base.design_folder import Folder, is_design_folder
from designer.base.errors import MISSING, EnvironmentMissing, InputError
from designer.base.frames import frame, table_html
from designer.base.plain_json import dumps, plain
from designer.base.progress import Progress
from designer.catalog.catalog import load_catalog
from designer.circuit.design import GeneratorSetting
from designer.folders.design_source import read_design
from designer.folders.origin import provenance
from designer.folders.report_sections import BENCHED as NAME, design_hash, renew_report
from designer.model.model import SiScales
from designer.model.si_units import mechanism_json
from designer.spice.pool import SpicePool, require_ngspice
from designer.spice.simulator import SimulationFailed
from designer.workbench.advice import Advice
from designer.workbench.channel_roles import recorded_motion
from designer.workbench.fitted_board import FittedBoard, board_behind
from designer.workbench.free_decay import FreeDecay, recorded_decay
from designer.workbench.naming import NamedMotion, named
from designer.workbench.overlay import Overlay, overlaid
from designer.workbench.prediction import BoardPrediction
from designer.workbench.record import RecordedMotion
from designer.workbench.record_formats import read_record
from designer.workbench.spread_estimate import estimated_spread, measured_list

if TYPE_CHECKING:
    import pandas as pd

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
    """The file."""
    named: NamedMotion
    """What it shows."""
    overlay: Overlay | None
    """The record over the nominal board's orbit; None where there is none."""
    setting: GeneratorSetting | None
    """The nearest setting of ``setup.csv``; None where none is near."""
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
        where nothing is wanted there."""
        if self.setting is None or self.setting.expect is None:
            return None
        counts = self.named.counts
        if not self.named.sure or counts is None:
            return False
        return self.setting.expect in (str(counts), str(counts.mirrored))


@dataclass(frozen=True)
class BenchAnswer:
    """What the verb ``bench`` answers. It is a sequence of the records too."""

    answer: dict[str, Any]
    """The JSON object (docs/contract.md)."""
    records: tuple[BenchedRecord, ...]
    """Each record with what it shows."""
    fitted: tuple[FittedBoard, ...] = ()
    """The boards behind them; none where they were not asked for."""

    @property
    def satisfied(self) -> bool:
        """Whether every record surely shows a response, and the one that is wanted where one is."""
        return all(r.named.sure and r.as_wanted is not False for r in self.records)

    def table(self) -> pd.DataFrame:
        """A row for each record."""
        return frame(_row(record) for record in self.answer["records"])

    def __iter__(self) -> Iterator[BenchedRecord]:
        return iter(self.records)

    def __len__(self) -> int:
        return len(self.records)

    def __getitem__(self, index: int) -> BenchedRecord:
        return self.records[index]

    def _repr_html_(self) -> str:
        return table_html(self.answer["title"], [_row(r) for r in self.answer["records"]], "")


def bench(
    folder: Path | str,
    record: Sequence[Path | str],
    *,
    omega: float | None = None,
    channels: Mapping[str, str] | None = None,
    fit: bool = False,
    boards: bool = False,
    decay: Sequence[Path | str] = (),
    ngspice: bool = True,
    out: Path | str | None = None,
    overwrite: bool = False,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> BenchAnswer:
    """The verb ``bench``: read records of boards of a design and say what they show.

    omega : the drive frequency of all of them in the model's units; found where None. channels :
    channel by net, for all of them; found where None. fit : also look for the board behind the
    records, and for what to turn on it. boards : the records are of several boards, each with a
    folder of its own that has its name; fits them, and says how far they differ. decay : records of
    the same boards that go on when the generator is switched off, with the same channels; for the
    fit. ngspice : also lay ngspice's motion of the board over each record, once the rest is
    written; needs ``out``, and does without where ngspice is missing. jobs : the most ngspice runs
    at a time. out : a directory for ``bench.json``, ``bench.html``, a picture of each record and,
    of several boards, ``boards.csv``; ``overwrite`` replaces files of these names. Where it lies in
    the design folder the folder's report shows these records too.

    Raises
    ------
    InputError : no design folder, a file that is no record, channels that cannot be told apart,
        several boards in one folder, or files in the way; nothing is written then.
    """
    began, path = time.perf_counter(), Path(folder)
    progress = Progress() if progress is None else progress
    files, decays = [Path(name) for name in record], [Path(name) for name in decay]
    place = None if out is None else Path(out)
    names = _names(files)
    lists = [LIST] if boards else []
    _check(path, files, place, (*names, *lists), overwrite)
    if omega is not None and not 0.0 < omega < math.inf:
        raise InputError(None, "--omega", omega, "a frequency above 0")
    if boards and len(files) > 1 and len({_board(file, True) for file in files}) == 1:
        found, expected = "all records in one folder", "a folder for each board, with its name"
        raise InputError(None, "--boards", found, f"{expected}; --fit takes them as of one board")
    catalog = load_catalog()
    synthesis = read_design(path, catalog, progress)
    prediction = BoardPrediction(synthesis)
    scales = synthesis.design.errors.scales
    frequency = None if omega is None else scales.frequency(omega)
    _check_decays(files, decays, boards)
    read = [read_record(file) for file in files]
    motions = [
        recorded_motion(each, prediction, frequency=frequency, told=channels) for each in read
    ]
    free = _free_decays(decays, files, motions, prediction, boards)
    benched = []
    for file, motion in zip(files, motions, strict=True):
        progress.stage(f"record {file.name}")
        name = named(motion, prediction)
        setting = _setting(name.motion.frequency, prediction)
        benched.append(BenchedRecord(file, name, overlaid(name, prediction), setting))
    fitted: dict[str, FittedBoard] = {}
    if fit or boards or decays:
        fitted = _fitted(benched, free, prediction, several=boards, progress=progress)
        benched = [replace(b, board=fitted[_board(b.path, boards)]) for b in benched]
    fits = {name: one.fit for name, one in fitted.items() if one.fit is not None}
    settings = {
        "omega": omega,
        "channels": dict(channels or {}),
        "fit": bool(fit or boards or decays),
        "boards": boards,
    }
    common = {
        "format": 1,
        "title": synthesis.modelfile.title,
        "boards": [board.as_dict(synthesis.modelfile.si) for board in fitted.values()],
        "spread": [k.as_dict() for k in estimated_spread([*fits.values()])]
        if boards and fits
        else [],
        "files": [] if place is None else [NAME, PAGE, *names, *lists],
        "design_sha256": design_hash(path),
        "provenance": provenance(synthesis.modelfile, catalog.hash, settings=settings),
    }

    def result(records: Sequence[BenchedRecord]) -> BenchAnswer:
        answer = {
            **common,
            "records": [
                _record_json(each, scales.seconds, synthesis.modelfile.si) for each in records
            ],
            "cost": {"seconds": time.perf_counter() - began},
        }
        return BenchAnswer(plain(answer), tuple(records), tuple(fitted.values()))

    answered = result(benched)
    if place is None:
        return answered
    progress.stage("pictures")
    _write(place, names, answered)
    if lists:
        _put(place / LIST, measured_list(fits, LISTED).encode("utf-8"))
    if place.resolve().is_relative_to(path.resolve()):
        renew_report(Folder(path), progress.note)
    if ngspice and any(each.overlay is not None for each in benched):
        progress.stage("ngspice")
        answered = result(_with_ngspice(benched, prediction, jobs or cores(), progress))
        _write(place, names, answered)
    return answered


def _with_ngspice(
    benched: Sequence[BenchedRecord], prediction: BoardPrediction, jobs: int, progress: Progress
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


def _check_decays(files: Sequence[Path], decays: Sequence[Path], several: bool) -> None:
    """InputError for a record with the generator off of a board that has no other."""
    known = {_board(file, several) for file in files}
    for path in decays:
        name = _board(path, several)
        if name not in known:
            raise InputError(path, "--decay", f"board {name} alone", "another --record of it")


def _free_decays(
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
        name = _board(path, several)
        same = next(m for f, m in zip(files, motions, strict=True) if _board(f, several) == name)
        decay = recorded_decay(read_record(path), same.channels, prediction)
        free.setdefault(name, []).append((path.name, decay))
    return free


def _fitted(
    benched: Sequence[BenchedRecord],
    free: Mapping[str, Sequence[tuple[str, FreeDecay]]],
    prediction: BoardPrediction,
    *,
    several: bool,
    progress: Progress,
) -> dict[str, FittedBoard]:
    """The boards behind the records by name, each fitted to all of its own.

    free : of each board its records with the generator off.
    """
    own: dict[str, list[tuple[str, NamedMotion]]] = {}
    for each in benched:
        name = _board(each.path, several)
        own.setdefault(name, []).append((each.path.name, each.named))
    out = {}
    for name, records in own.items():
        shows = ", ".join(named.response for _, named in records)
        progress.stage(f"board {name} behind {shows}" if name else f"board behind {shows}")
        out[name] = board_behind(name, records, prediction, decays=free.get(name, ()))
    return out


def _board(record: Path, several: bool) -> str:
    """The name of a record's board: among several that of its folder, "" where there is one."""
    return record.resolve().parent.name if several else ""


def channels_of(text: str) -> dict[str, str]:
    """Channel by net of a text such as "v1=CH1,fv=CH2".

    Raises
    ------
    InputError : it is no list of such pairs, or a net or channel comes twice.
    """
    pairs = [pair.split("=", 1) for pair in text.split(",")]
    if any(len(pair) != 2 or not all(word.strip() for word in pair) for pair in pairs):
        raise InputError(None, "--channels", text, "NET=CHANNEL pairs such as v1=CH1,fv=CH2")
    named_channels = {net.strip(): channel.strip() for net, channel in pairs}
    if len(named_channels) < len(pairs) or len(set(named_channels.values())) < len(pairs):
        raise InputError(None, "--channels", text, "each net and each channel once")
    return named_channels


def _check(
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


def _names(files: Sequence[Path]) -> list[str]:
    """Of the picture of each record."""
    stems = [file.stem for file in files]
    return [
        f"{stem}.png" if stems.count(stem) == 1 else f"{stem}-{k + 1}.png"
        for k, stem in enumerate(stems)
    ]


def _setting(frequency: float, prediction: BoardPrediction) -> GeneratorSetting | None:
    """The setting of ``setup.csv`` whose frequency is nearest, if it is near."""
    gaps = [(abs(frequency / s.frequency_hz - 1.0), s) for s in prediction.settings]
    gap, setting = min(gaps, key=lambda pair: pair[0], default=(math.inf, None))
    return setting if gap < NEAR else None


def _record_json(benched: BenchedRecord, seconds: float, si: SiScales | None) -> dict[str, Any]:
    """seconds : of the circuit for a unit of the model's time."""
    name, motion = benched.named, benched.named.motion
    record, overlay, setting = motion.record, benched.overlay, benched.setting
    wave = None if overlay is None else overlay.ngspice
    omega = 2.0 * math.pi * motion.frequency * seconds
    return {
        "file": benched.path.name,
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
        "stops": [
            {
                "clearance": clearance,
                **{
                    key: {"volts": zone.ends[side], "error": zone.end_errors[side]}
                    for side, key in ((1, "upper"), (-1, "lower"))
                    if side in zone.ends
                },
            }
            for clearance, zone in name.dead_zones.items()
        ],
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
        "fitted": None if benched.board is None else [f.as_dict() for f in benched.board.figures],
        "advice": None if benched.advice is None else benched.advice.as_dict(si),
    }


def _cut_json(net: str, channel: str, low: float | None, high: float | None) -> dict[str, Any]:
    """A channel that is cut off below or above a voltage [V]."""
    ends = [
        f"{side} {end:.3g} V" for side, end in (("below", low), ("above", high)) if end is not None
    ]
    words = (
        f"{channel} ({net}) is cut off {' and '.join(ends)}: what is beyond is not seen. "
        "Record it with a larger range."
    )
    return {"net": net, "channel": channel, "low": low, "high": high, "words": words}


def _row(record: Mapping[str, Any]) -> dict[str, Any]:
    keys = ("file", "omega", "response", "sure", "others", "wanted", "as_wanted")
    return {key: record[key] for key in keys}


def _write(place: Path, names: Sequence[str], result: BenchAnswer) -> None:
    """The answer, its page and the picture of each record."""
    from designer.base.figure_style import to_png  # matplotlib is not needed but for them
    from designer.plots.record_plots import record_figure
    from designer.report.record_page import record_page_html

    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(place, "--out", error.strerror or str(error), PLACE) from None
    figures = [record_figure(each.named, each.overlay) for each in result.records]
    contents: dict[str, bytes] = {NAME: dumps(result.answer).encode("utf-8")}
    contents |= {n: to_png(f) for n, f in zip(names, figures, strict=True)}
    contents[PAGE] = record_page_html(result.answer, figures).encode("utf-8")
    for name, content in contents.items():
        _put(place / name, content)


def _put(path: Path, content: bytes) -> None:
    with appearing(path, "--out", PLACE) as partial:
        partial.write_bytes(content)
