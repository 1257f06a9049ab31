"""The verb ``bench``."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from designer.base.defaults import cores
from designer.base.errors import InputError
from designer.base.frames import frame, table_html
from designer.base.progress import Progress, reported, stage, watched
from designer.verbs.console import answering, say, table
from designer.verbs.declared import DesignDir, Jobs, Overwrite, Verb, option
from designer.verbs.tables import YES_NO, drive_cells, files as written

if TYPE_CHECKING:
    import pandas as pd

    from designer.answers.bench_answer import BenchJson, BenchKeys, BoardRecord, RecordRow
    from designer.jobs.bench_job import BenchedRecord
    from designer.workbench.fitted_board import FittedBoard


@dataclass(frozen=True)
class BenchAnswer:
    """What the verb ``bench`` answers. It is a sequence of the records too."""

    answer: BenchJson
    """The JSON object (docs/contract.md)."""
    records: tuple[BenchedRecord, ...]
    """Each record with what it shows."""
    fitted: tuple[FittedBoard, ...] = ()
    """The boards behind them; none where they were not asked for."""
    place: Path | None = None
    """The directory that it is in, if any."""

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


@reported
def bench(
    folder: DesignDir,
    record: Annotated[
        Sequence[Path | str],
        option(
            "--record",
            "FILE",
            "What an oscilloscope wrote of one board; may be repeated.",
            reads=list[Path],
        ),
    ] = (),
    *,
    omega: Annotated[
        float | None,
        option("--omega", "W", "Drive frequency in the model's own units [found in the record]."),
    ] = None,
    channels: Annotated[
        str | Mapping[str, str] | None,
        option(
            "--channels",
            "NET=CHANNEL,…",
            "What each channel shows [found by the shapes].",
            reads=str | None,
        ),
    ] = None,
    fit: Annotated[
        bool, option("--fit", None, "Also look for the board behind them, and what to turn on it.")
    ] = False,
    boards: Annotated[
        bool,
        option("--boards", None, "Records of several boards, each in a folder with its name."),
    ] = False,
    decay: Annotated[
        Sequence[Path | str],
        option(
            "--decay",
            "FILE",
            "A record that goes on when the generator is off; for --fit.",
            reads=list[Path],
        ),
    ] = (),
    out: Annotated[
        Path | str | None,
        option("--out", "DIR", "Write the answer, its page and pictures there.", Path),
    ] = None,
    ngspice: Annotated[
        bool,
        option("--ngspice/--no-ngspice", None, "Lay ngspice's motion over each record [yes]."),
    ] = True,
    jobs: Jobs = None,
    overwrite: Overwrite = False,
    progress: Progress | None = None,
) -> BenchAnswer:
    """Say what records of a board show, and how sure that is; exit status 1 where it is not sure or
    not what is wanted there.

    channels : channel by net, for all of the records, or a text such as "v1=CH1,fv=CH2". boards :
    fits them, and says how far they differ. decay : with the same channels. ngspice : once the rest
    is written; needs ``out``, and does without where ngspice is missing. out : for ``bench.json``,
    ``bench.html``, a picture of each record and, of several boards, ``boards.csv``; where it lies
    in the design folder the folder's report shows these records too.

    Raises
    ------
    InputError : no design folder, a file that is no record, channels that cannot be told apart,
        several boards in one folder, or files in the way; nothing is written then.
    """
    from designer.base.design_folder import Folder
    from designer.base.plain_json import plain
    from designer.catalog.parts_catalog import load_catalog
    from designer.folders.design_source import read_design
    from designer.folders.origin import provenance
    from designer.folders.report_sections import BENCHED as NAME, design_hash, renew_report
    from designer.jobs import bench_job
    from designer.workbench.channel_roles import recorded_motion
    from designer.workbench.naming import identify_response
    from designer.workbench.overlay import overlaid
    from designer.workbench.prediction import BoardPrediction
    from designer.workbench.record_formats import read_record
    from designer.workbench.spread_estimate import estimated_spread, measured_list

    roles = channels_of(channels) if isinstance(channels, str) else channels
    began, path = time.perf_counter(), Path(folder)
    files, decays = [Path(name) for name in record], [Path(name) for name in decay]
    place = None if out is None else Path(out)
    names = bench_job.picture_names(files)
    lists = [bench_job.LIST] if boards else []
    bench_job.check_places(path, files, place, (*names, *lists), overwrite)
    if omega is not None and not 0.0 < omega < math.inf:
        raise InputError(None, "--omega", omega, "a frequency above 0")
    if boards and len(files) > 1 and len({bench_job.board_name(file, True) for file in files}) == 1:
        found, expected = "all records in one folder", "a folder for each board, with its name"
        raise InputError(None, "--boards", found, f"{expected}; --fit takes them as of one board")
    catalog = load_catalog()
    synthesis = read_design(path, catalog, watched())
    prediction = BoardPrediction(synthesis)
    bench_job.check_fits(prediction, fit=fit, boards=boards, decays=decays)
    scales = synthesis.design.errors.scales
    frequency = None if omega is None else scales.frequency(omega)
    bench_job.check_decays(files, decays, boards)
    read = [read_record(file) for file in files]
    motions = [
        recorded_motion(each, prediction, frequency=frequency, stated=roles) for each in read
    ]
    free = bench_job.free_decays(decays, files, motions, prediction, boards)
    benched = []
    for file, motion in zip(files, motions, strict=True):
        stage(f"record {file.name}")
        name = identify_response(motion, prediction)
        setting = bench_job.near_setting(name.motion.frequency, prediction)
        benched.append(bench_job.BenchedRecord(file, name, overlaid(name, prediction), setting))
    fitted: dict[str, FittedBoard] = {}
    if fit or boards or decays:
        fitted = bench_job.fitted_boards(benched, free, prediction, several=boards)
        benched = [replace(b, board=fitted[bench_job.board_name(b.path, boards)]) for b in benched]
    fits = {name: one.fit for name, one in fitted.items() if one.fit is not None}
    settings = {
        "omega": omega,
        "channels": dict(roles or {}),
        "fit": bool(fit or boards or decays),
        "boards": boards,
    }
    common: BenchKeys = {
        "format": 1,
        "title": synthesis.modelfile.title,
        "boards": [board.as_dict(synthesis.modelfile.si) for board in fitted.values()],
        "spread": plain(estimated_spread([*fits.values()]) if boards and fits else ()),
        "files": [] if place is None else [NAME, bench_job.PAGE, *names, *lists],
        "design_sha256": design_hash(path),
        "provenance": provenance(synthesis.modelfile, catalog.hash, settings=settings),
    }

    def result(records: Sequence[BenchedRecord]) -> BenchAnswer:
        answer: BenchJson = {
            **common,
            "records": [
                bench_job.record_json(each, scales.seconds, synthesis.modelfile.si)
                for each in records
            ],
            "cost": {"seconds": time.perf_counter() - began},
        }
        return BenchAnswer(plain(answer), tuple(records), tuple(fitted.values()), place)

    answered = result(benched)
    if place is None:
        return answered
    stage("pictures")
    bench_job.write_answer(place, names, answered.answer, answered.records)
    if lists:
        bench_job.put(place / bench_job.LIST, measured_list(fits, bench_job.LISTED).encode("utf-8"))
    if place.resolve().is_relative_to(path.resolve()):
        renew_report(Folder(path))
    if ngspice and any(each.overlay is not None for each in benched):
        stage("ngspice")
        answered = result(bench_job.with_ngspice(benched, prediction, jobs or cores()))
        bench_job.write_answer(place, names, answered.answer, answered.records)
    return answered


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


def _row(record: RecordRow) -> dict[str, object]:
    keys = ("file", "omega", "response", "sure", "others", "wanted", "as_wanted")
    return {key: record.get(key) for key in keys}


def show(result: BenchAnswer) -> None:
    """The tables, which are the answer, and where the files are."""
    with answering():
        tables(result.answer)
    if result.place is not None:
        written(result.place, False)


def tables(answer: BenchJson) -> None:
    """What each record shows; then what is not sure, and what would tell."""
    rows = answer["records"]
    table(
        "Records",
        (
            {
                "record": r["file"],
                **drive_cells(r, rows),
                "generator": f"{r['frequency_hz']:.5g} Hz",
                "shows": r["response"],
                "sure": YES_NO[r["sure"]],
                "wanted there": r["wanted"] or "-",
                "exact circuit": "-" if (e := r["exact_circuit"]) is None else e["response"],
            }
            for r in rows
        ),
    )
    for r in rows:
        for cut in r["clipped"]:
            say(f"{r['file']}: {cut['words']}")
        if r["others"]:
            say(f"{r['file']}: {r['response']}, or {' or '.join(r['others'])}")
        if r["reason"]:
            say(f"{r['file']}: not sure, for {r['reason']}. What would tell: {r['would_tell']}.")
    for board in answer["boards"]:
        _fitted(board)
    for kind in answer["spread"]:
        say(
            f"{kind['kind']} differ by {kind['factor']:.2g} times what [spread] says "
            f"({kind['low']:.2g} to {kind['high']:.2g})"
        )


def _fitted(board: BoardRecord) -> None:
    """What the records tell of a board, and what to turn on it."""
    of = f" {board['board']}" if board["board"] else ""
    if board["reason"]:
        say(f"The board{of} was not found: {board['reason']}")
        return
    rows = (
        {
            "figure": f["name"],
            "unit": f["unit"],
            "this board": f"{f['value']:.5g}",
            "95 %": f"{f['low']:.5g} to {f['high']:.5g}",
            "nominal": f"{f['nominal']:.5g}",
        }
        for f in board["figures"]
    )
    table(f"The board{of}, as its records tell it", rows)
    advised = (
        {
            "wanted": a["expected"],
            **drive_cells(a, board["advice"]),
            "shows as set": next(iter(a["shown"])),
            "advice": a["words"],
            "then, % of boards": f"{100 * a['share']:.0f}",
        }
        for a in board["advice"]
    )
    table("What to turn", advised)
    if board["doubtful"]:
        say(
            f"The records differ from the board that was found by {board['misfit']:.1f} times what "
            "noise explains: it may not be one of this spread, or the generator was set otherwise."
        )


VERB = Verb(
    bench,
    "Make",
    "designer bench out/model --record scope.csv --out out/board-1",
    show=show,
)
