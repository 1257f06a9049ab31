"""The layers of a study, each a set of rows in blocks: who computes them, and what is on disk.

``samples`` (the exact circuit's answers), ``ngspice``, ``tuned``, ``trimmed``, ``reached``: each
stands on the first alone, so a study can get another one later and keep what is there.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any, Literal, Protocol

from designer.base.threads import parallel
from designer.spice.pool import SpicePool
from designer.verdicts import exact_circuit, ngspice_runs
from designer.verdicts.cross_check import Ask, CrossCheck, Why
from designer.verdicts.verdict import BLOCK, Answer, BoardRow, StudyPlan
from designer.yields.power_up import PowerUp
from designer.yields.row_store import BlockStore, Row
from designer.yields.trimmed_yield import Trimmed
from designer.yields.tuned_yield import Tuned

CHUNK = 10
"""Samples of a block of ngspice's runs: they take seconds each."""
SEARCH = 25
"""Samples of a block of the tuned and the power-up layer: each takes many settings or a long
way."""
LayerName = Literal["samples", "ngspice", "tuned", "trimmed", "reached"]
LAYERS: dict[LayerName, tuple[type[BoardRow | CrossCheck], int]] = {
    "samples": (Answer, BLOCK),
    "ngspice": (CrossCheck, CHUNK),
    "tuned": (Tuned, SEARCH),
    "trimmed": (Trimmed, BLOCK),
    "reached": (PowerUp, SEARCH),
}
"""The rows of each layer, and the samples of a block."""
Task = Callable[[int, Callable[[], None]], Sequence[Any]]
"""Computes the rows of a block: (jobs, progress) → rows. It pickles."""
Step = Callable[[], None]


class Runner(Protocol):
    """Somebody who runs tasks: this process, or a cluster."""

    def run(self, tasks: Iterable[Task], step: Step) -> Iterator[tuple[int, Sequence[Any]]]:
        """(index, rows) as tasks finish; ``step`` is called once a row."""


class LocalRunner:
    """This process, with ``jobs`` threads a task. The next task begins before one is done: a block
    ends with its slowest boards, on fewer threads than there are."""

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs

    def run(self, tasks: Iterable[Task], step: Step) -> Iterator[tuple[int, Sequence[Any]]]:
        yield from enumerate(parallel(lambda task: task(self.jobs, step), tasks, min(self.jobs, 2)))


def samples_task(plan: StudyPlan, block: range) -> Task:
    """The exact circuit's answers of a block."""
    return partial(exact_circuit.block, plan, block)


def fill(
    plan: StudyPlan,
    store: BlockStore[Row] | None,
    size: int,
    task: Callable[[range], Task],
    runner: Runner,
    step: Step,
    first: int = 0,
) -> list[Row]:
    """Every row of a layer with one row for each sample and question, by sample and question.

    Rows in ``store`` are not computed again; new rows are written there at once. task : computes
    the rows of a range of samples. first : a block's edge, where to begin.
    """
    rows: dict[int, list[Row]] = {}
    missing: list[tuple[range, list[Row]]] = []
    for block in plan.blocks(size):
        if block.start < first:
            continue
        stored = [] if store is None else store.read(block)
        count, rest = divmod(len(stored), len(plan.questions))
        samples = range(block.start, block.start + count)
        wanted = product(samples, range(len(plan.questions)))
        if rest or [(row.sample, row.question) for row in stored] != list(wanted):
            stored, count = [], 0
        for _ in stored:
            step()
        if count < len(block):
            missing.append((block, stored))
            continue
        rows[block.start] = stored
        _put(store, block, stored)
    if store is not None:
        store.say_ignored()
    starts = (range(b.start + len(stored) // len(plan.questions), b.stop) for b, stored in missing)
    for index, new in runner.run(map(task, starts), step):
        block, stored = missing[index]
        rows[block.start] = [*stored, *new]
        _put(store, block, rows[block.start])
    return [row for start in sorted(rows) for row in rows[start]]


def _put(store: BlockStore[Row] | None, block: range, rows: Sequence[Row]) -> None:
    if store is not None:
        store.put(block, rows)
        store.forget()


def fill_cross_checks(
    plan: StudyPlan,
    asks: Iterable[Ask],
    store: BlockStore[CrossCheck] | None,
    pool: SpicePool,
    jobs: int,
    step: Step,
    *,
    earlier: Iterable[CrossCheck] = (),
    last: bool = True,
) -> list[CrossCheck]:
    """ngspice's answers to all asks, by sample; as `fill`, in blocks of `CHUNK`.

    earlier : answers that stand already. last : nothing further will be asked, so that what
    ``store`` holds beyond it may go.
    """
    before, wanted = _by_block(earlier), _by_block(sorted(asks, key=lambda ask: ask.key))
    answers: dict[int, dict[tuple[int, int, str], CrossCheck]] = {}
    missing: dict[int, list[Ask]] = {}
    for number, block in wanted.items():
        stored = [] if store is None else store.read(_chunk(number))
        answers[number] = {c.key: c for c in (*stored, *before[number])}
        missing[number] = [ask for ask in block if ask.key not in answers[number]]
        for _ in range(len(block) - len(missing[number])):
            step()

    def finish(number: int) -> None:
        mine = answers[number]
        for ask in wanted[number]:
            if ask.key in mine:
                mine[ask.key] = replace(mine[ask.key], why=ask.why)
        keys = {ask.key for ask in wanted[number]} if last else mine.keys()
        _put(store, _chunk(number), [mine[key] for key in sorted(mine) if key in keys])

    first, rest = _nearest_first(missing.values())
    blocks = [block for block in (first, *rest) if block]
    todo = [ask for block in blocks for ask in block]
    left = {number: len(some) for number, some in missing.items()}
    for number in [n for n, count in left.items() if not count]:
        finish(number)
    for k, row in ngspice_runs.checks_run(plan, blocks, pool, jobs, fidelity=plan.fidelity):
        number = todo[k].sample // CHUNK
        if row is not None:
            answers[number][row.key] = row
            step()
        left[number] -= 1
        if k < len(first) or not left[number]:  # the dearest answers are stored as they come
            finish(number)
    if store is not None:
        store.say_ignored()
    return [
        answers[n][ask.key] for n, block in wanted.items() for ask in block if ask.key in answers[n]
    ]


def _nearest_first(blocks: Iterable[Sequence[Ask]]) -> tuple[list[Ask], list[list[Ask]]]:
    """The asks about boards next to a boundary, to come before all others, and the others' blocks.

    It is their runs that are made again at finer steps, one after the other: begun last, they
    would keep one worker busy long after the others have nothing left to do.
    """
    asked = [list(block) for block in blocks]
    near = {(a.sample, a.question) for block in asked for a in block if a.why is Why.BOUNDARY}
    first = [a for block in asked for a in block if (a.sample, a.question) in near]
    rest = [[a for a in block if (a.sample, a.question) not in near] for block in asked]
    return first, rest


def count_answered(
    asks: Iterable[Ask], store: BlockStore[CrossCheck] | None, earlier: Iterable[CrossCheck] = ()
) -> int:
    """The number of these asks that the store or ``earlier`` answers."""
    wanted = {ask.key for ask in asks}
    answered = {c.key for c in earlier}
    if store is not None:
        for number in {sample // CHUNK for sample, _, _ in wanted}:
            answered |= {c.key for c in store.read(_chunk(number))}
            store.forget()
    return len(wanted & answered)


def _by_block(rows: Iterable[Any]) -> defaultdict[int, list[Any]]:
    """Rows by the number of their block of ngspice's runs."""
    blocks = defaultdict[int, list[Any]](list)
    for row in rows:
        blocks[row.sample // CHUNK].append(row)
    return blocks


def _chunk(number: int) -> range:
    """The samples of a block of ngspice's runs."""
    return range(number * CHUNK, (number + 1) * CHUNK)
