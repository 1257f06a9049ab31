"""What later verbs answered, shown in the report of the study of the same folder."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from designer.base.design_folder import DESIGN, REPORTS, Folder
from designer.base.errors import InputError
from designer.base.manifest import StageName, file_hash, read_json
from designer.base.page import PageSection
from designer.base.progress import note

SHOWN: Mapping[StageName, Sequence[str]] = {
    "cure": ("cure.json", "cure-front.csv", "cure-front.svg"),
    "rules": ("rules.json",),
    "trade": ("trade.md", "trade.json", "trade.svg", "trade-numerics.svg"),
}
"""Stages that the report shows, in its order, each with the files that it names."""
BENCHED = "bench.json"
"""What ``bench`` answers of a board, in a directory of its own."""


def later_sections(folder: Folder) -> tuple[PageSection, ...]:
    """A section for each stage in ``SHOWN`` that is finished and as it was written; then one for
    the boards on the bench."""
    return (*_sections(folder), *_bench(folder))


def design_hash(folder: Path) -> str:
    """The hash of the design in a folder; "" where there is none."""
    path = folder / DESIGN
    return file_hash(DESIGN, path.read_bytes()) if path.is_file() else ""


def _bench(folder: Folder) -> Iterator[PageSection]:
    """The boards whose answers lie in directories of the folder, but those of another design."""
    own = design_hash(folder.path)
    answers = dict[str, Any]()
    for path in sorted(folder.path.rglob(BENCHED)):
        with contextlib.suppress(InputError):
            answer = read_json(path)
            if answer.get("design_sha256") == own:
                answers[path.parent.relative_to(folder.path).as_posix()] = answer
    if not answers:
        return
    from designer.report.verb_sections import bench_section, is_whole  # they need matplotlib

    if whole := {place: one for place, one in answers.items() if is_whole("bench", one)}:
        yield bench_section(whole)


def _sections(folder: Folder) -> Iterator[PageSection]:
    stages = {} if folder.manifest is None else folder.manifest.stages
    shown = [name for name in SHOWN if name in stages and stages[name].complete]
    if not shown:
        return
    # They need matplotlib.
    from designer.report.verb_sections import SECTIONS, is_whole, older_section

    for name in shown:
        if folder.changed(name) is None:
            answer = folder.json(f"{name}.json")
            if is_whole(name, answer):
                yield SECTIONS[name](answer, SHOWN[name])
            else:
                yield older_section(name, SHOWN[name])


def renew_report(folder: Folder) -> None:
    """Show in the report of a folder's study what stands in the folder now; nothing is computed.

    A folder without a finished study stays as it is, and so does a report that somebody changed,
    which is said.
    """
    study = None if folder.manifest is None else folder.manifest.stages.get("study")
    if study is None or not study.complete:
        return
    assert folder.manifest is not None
    from designer.report.inserted import inserted_html, inserted_markdown

    sections = later_sections(folder)
    for name, insert in zip(REPORTS, (inserted_html, inserted_markdown), strict=True):
        if name not in folder.manifest.files or not (folder / name).is_file():
            continue
        _, digest = folder.manifest.files[name]
        content = (folder / name).read_bytes()
        # No digest: the tool was about to write it anew and was killed.
        if digest in (None, file_hash(name, content)):
            folder.rewrite(name, insert(content.decode("utf-8"), sections))
        else:
            note(f"{name} was changed since it was written: it stays as it is")
