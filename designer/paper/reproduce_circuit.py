"""``designer reproduce circuit``: the paper's Section 5 measured.

Fig. 7 and Fig. 8 with the paper's values as printed, corrected, and with this tool's own; what each
misprint and the op-amps' offsets would have cost; and the claim that the circuit takes a third of
the time. ``paper_circuit_cases`` has the pieces; each is on disk as soon as it is done.
"""

from __future__ import annotations

import hashlib
import io
import json
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from designer.base.atomic_write import write
from designer.base.defaults import at_least, cores
from designer.base.progress import Progress
from designer.base.report_pieces import CaseStore
from designer.base.version import __version__
from designer.catalog.catalog import load_catalog
from designer.jobs.origin import provenance
from designer.paper.circuit_cases import CircuitExtent, PaperBench, as_data, pieces
from designer.paper.circuits import model_with
from designer.spice.pool import SpicePool, require_ngspice

FORMAT = 1
COMMAND = "designer reproduce circuit --out reports/paper-circuit"
DATA, README = "circuit.json", "README.md"
PICTURES = ("fig7", "misprints", "offsets", "times")


def names(extent: CircuitExtent) -> tuple[str, ...]:
    """The report's files beside its pieces."""
    pictures = (*PICTURES, *(f"fig8-{name}" for name in extent.circuits))
    return (DATA, README, *(f"{name}.png" for name in pictures))


def reproduce(
    out: Path,
    *,
    jobs: int | None = None,
    progress: Progress | None = None,
    resume: bool = False,
    extent: CircuitExtent | None = None,
) -> dict[str, dict[str, Any]]:
    """Make the report in the folder ``out``; returns its pieces by name.

    resume : go on with the pieces that are there, if they were made with the same settings.
    extent : the report's by default.

    Raises
    ------
    InputError : results, or files that go by their names, are there already; pieces of other
        settings; a number that cannot be.
    EnvironmentMissing : ngspice is missing; nothing is written then.
    """
    said = Progress() if progress is None else progress
    jobs = cores() if jobs is None else jobs
    at_least("--jobs", jobs, 1)
    extent = CircuitExtent() if extent is None else extent
    with SpicePool(1) as pool:
        require_ngspice(pool)
    catalog = load_catalog()
    key = hashlib.sha256(
        json.dumps([FORMAT, __version__, asdict(extent), catalog.hash]).encode("ascii")
    ).hexdigest()
    store = CaseStore(out, names(extent), resume=resume, note=said.note)
    store.expect(key)
    said.stage("responses of the model")
    bench = PaperBench.of(catalog, extent, jobs, said)
    found: dict[str, dict[str, Any]] = {}
    seconds: dict[str, float] = {}
    for name, make in pieces(bench):
        began = time.perf_counter()
        piece = store.piece(
            name,
            lambda make=make, began=began: _timed(as_data(make()), began),  # type: ignore[misc]
        )
        seconds[name] = piece.pop("seconds")
        found[name] = piece
    said.stage("pictures")
    source = provenance(
        model_with("saturation"), catalog.hash, seed=0, settings={"circuit": asdict(extent)}
    )
    for name, content in _files(found, source, seconds).items():
        write(out / name, content)
    return found


def _timed(piece: dict[str, Any], began: float) -> dict[str, Any]:
    return {**piece, "seconds": time.perf_counter() - began}


def _files(
    found: Mapping[str, dict[str, Any]], source: Mapping[str, Any], seconds: Mapping[str, float]
) -> dict[str, bytes]:
    """The report from its pieces: content by file name."""
    from designer.base.figure_style import to_png
    from designer.paper import circuit_pictures as drawn  # Matplotlib takes a while to import
    from designer.paper.circuit_page import readme

    circuits = [p for name, p in found.items() if name.startswith("circuit-")]
    figures = {
        "fig7": drawn.dc_curves(circuits),
        **{f"fig8-{p['circuit']}": drawn.portraits(found["model"], p) for p in circuits},
        "misprints": drawn.misprints(found["misprints"]["misprints"]),
        "offsets": drawn.offsets([p for n, p in found.items() if n.startswith("offsets-")]),
        "times": drawn.times(found["clock"]["responses"]),
    }
    document = {
        "format": FORMAT,
        "command": COMMAND,
        **{name: _without_curves(piece) for name, piece in found.items()},
        "provenance": dict(source),
        "cost": {"seconds": sum(seconds.values()), "pieces": dict(seconds)},
    }
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    files = {DATA: f"{text}\n".encode(), README: readme(found, COMMAND).encode("utf-8")}
    for name, figure in figures.items():
        stream = io.BytesIO()
        to_png(figure, stream)
        files[f"{name}.png"] = stream.getvalue()
    return files


def _without_curves(piece: Mapping[str, Any]) -> dict[str, Any]:
    """Curves stay in the pieces."""
    out = dict(piece)
    if "responses" in out:
        out["responses"] = [
            {k: v for k, v in row.items() if not k.endswith("portrait")} for row in out["responses"]
        ]
    if "dc" in out:
        out["dc"] = {k: v for k, v in out["dc"].items() if not isinstance(v, list)}
    return out
