"""The layers of a study, each a set of rows in blocks: who computes them, and what is on disk.

``samples`` (the exact rung's answers), ``ngspice``, ``tuned``, ``trimmed``, ``reached``: each
stands on the first alone, so a study can get another one later and keep what is there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any, Protocol

from designer.base.threads import parallel
from designer.model.tuning_bands import Bands
from designer.spice.pool import SpicePool
from designer.yields import exact_rung, ngspice_runs
from designer.yields.ngspice_sampling import Ask, Hearing
from designer.yields.power_up_yield import PowerUpAnswer, reached_block
from designer.yields.row_store import BlockStore, Row
from designer.yields.start_recipe import Recipe
from designer.yields.trimmed_yield import DcTrim, Trimmed, trimmed_block
from designer.yields.tuned_yield import Tuned, tuned_block
from designer.yields.verdict import Answer, StudyPlan

CHUNK = 10
"""Samples of a block of ngspice's runs: they take seconds each."""
SEARCH = 25
"""Samples of a block of the tuned and the reached layer: each takes many settings or a long way."""
Task = Callable[[int, Callable[[], None]], Sequence[Any]]
"""Makes the rows of a block: (jobs, progress) → rows. It pickles."""
Step = Callable[[], None]


class Runner(Protocol):
    """Somebody who runs tasks: this process, or a cluster."""

    def run(self, tasks: Iterable[Task], step: Step) -> Iterator[tuple[int, Sequence[Any]]]:
        """(index, rows) as tasks finish; ``step`` is called once a row."""


class Here:
    """This process, with ``jobs`` threads a task. The next task begins before one is done: a block
    ends with its slowest boards, on fewer threads than there are."""

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs

    def run(self, tasks: Iterable[Task], step: Step) -> Iterator[tuple[int, Sequence[Any]]]:
        yield from enumerate(parallel(lambda task: task(self.jobs, step), tasks, min(self.jobs, 2)))


class Samples:
    """Task of the exact rung: the answers of a block."""

    def __init__(self, plan: StudyPlan, indices: range) -> None:
        self.plan, self.indices = plan, indices

    def __call__(self, jobs: int, progress: Step) -> list[Answer]:
        return exact_rung.block(self.plan, self.indices, jobs, progress)


class Tunings:
    """Task of the tuned layer. answers : all of the study's, by sample and question."""

    def __init__(
        self, plan: StudyPlan, answers: Sequence[Answer], bands: Bands, indices: range
    ) -> None:
        count = len(plan.questions)
        self.plan, self.bands, self.indices = plan, bands, indices
        self.answers = tuple(answers[indices.start * count : indices.stop * count])

    def __call__(self, jobs: int, progress: Step) -> list[Tuned]:
        return tuned_block(self.plan, self.indices, self.answers, self.bands, jobs, progress)


class Trimmings:
    """Task of the trimmed layer."""

    def __init__(self, plan: StudyPlan, trim: DcTrim, indices: range) -> None:
        self.plan, self.trim, self.indices = plan, trim, indices

    def __call__(self, jobs: int, progress: Step) -> list[Trimmed]:
        return trimmed_block(self.trim, self.plan, self.indices, jobs, progress)


class PowerUps:
    """Task of the reached layer."""

    def __init__(self, plan: StudyPlan, recipes: Sequence[Recipe], indices: range) -> None:
        self.plan, self.recipes, self.indices = plan, tuple(recipes), indices

    def __call__(self, jobs: int, progress: Step) -> list[PowerUpAnswer]:
        return reached_block(self.plan, self.indices, self.recipes, jobs, progress)


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

    What ``store`` holds is not computed again; what is, goes there at once. task : makes the rows
    of a range of samples. first : a block's edge, where to begin.
    """
    rows: dict[int, list[Row]] = {}
    todo: list[tuple[range, list[Row]]] = []
    for block in plan.blocks(size):
        if block.start < first:
            continue
        known = [] if store is None else store.read(block)
        whole, rest = divmod(len(known), len(plan.questions))
        if rest or (known and known[-1].sample != block.start + whole - 1):
            known, whole = [], 0
        for _ in known:
            step()
        if whole < len(block):
            todo.append((block, known))
            continue
        rows[block.start] = known
        _put(store, block, known)
    if store is not None:
        store.say_ignored()
    missing = [range(b.start + len(known) // len(plan.questions), b.stop) for b, known in todo]
    for index, made in runner.run((task(indices) for indices in missing), step):
        block, known = todo[index]
        rows[block.start] = [*known, *made]
        _put(store, block, rows[block.start])
    return [row for start in sorted(rows) for row in rows[start]]


def _put(store: BlockStore[Row] | None, block: range, rows: Sequence[Row]) -> None:
    if store is not None:
        store.put(block, rows)
        store.forget()


def listen(
    plan: StudyPlan,
    asks: Iterable[Ask],
    store: BlockStore[Hearing] | None,
    pool: SpicePool,
    jobs: int,
    step: Step,
    *,
    known: Iterable[Hearing] = (),
    last: bool = True,
) -> list[Hearing]:
    """ngspice's word on everything that is asked, by sample; as `fill`, in blocks of `CHUNK`.

    known : what need not be asked again. last : nothing further will be asked, so that what
    ``store`` holds beyond it may go.
    """
    wanted: dict[int, list[Ask]] = {}
    for ask in sorted(asks, key=_order):
        wanted.setdefault(ask.sample // CHUNK, []).append(ask)
    before: dict[int, list[Hearing]] = {}
    for h in known:
        before.setdefault(h.sample // CHUNK, []).append(h)
    held: dict[int, dict[tuple[int, int, str], Hearing]] = {}
    missing: dict[int, list[Ask]] = {}
    for number, here in wanted.items():
        block = range(number * CHUNK, (number + 1) * CHUNK)
        rows = [*(store.read(block) if store is not None else ()), *before.get(number, ())]
        held[number] = {_order(row): row for row in rows}
        missing[number] = [ask for ask in here if _order(ask) not in held[number]]
        for _ in range(len(here) - len(missing[number])):
            step()

    def finish(number: int) -> None:
        mine = held[number]
        for ask in wanted[number]:
            if _order(ask) in mine:
                mine[_order(ask)] = replace(mine[_order(ask)], why=ask.why)
        if last:
            mine = {_order(ask): mine[_order(ask)] for ask in wanted[number] if _order(ask) in mine}
        block = range(number * CHUNK, (number + 1) * CHUNK)
        _put(store, block, [mine[key] for key in sorted(mine)])

    todo = [ask for asks in missing.values() for ask in asks]
    left = {number: len(asks) for number, asks in missing.items()}
    for number in [n for n, count in left.items() if not count]:
        finish(number)
    for k, row in ngspice_runs.answered(plan, missing.values(), pool, jobs):
        number = todo[k].sample // CHUNK
        if row is not None:
            held[number][_order(row)] = row
            step()
        left[number] -= 1
        if not left[number]:
            finish(number)
    if store is not None:
        store.say_ignored()
    return [
        held[n][_order(ask)] for n, here in wanted.items() for ask in here if _order(ask) in held[n]
    ]


def held(
    asks: Iterable[Ask], store: BlockStore[Hearing] | None, known: Iterable[Hearing] = ()
) -> int:
    """How many of these `listen` would not have to ask again."""
    wanted = {_order(ask) for ask in asks}
    found = {_order(h) for h in known}
    if store is not None:
        for number in {sample // CHUNK for sample, _, _ in wanted}:
            block = range(number * CHUNK, (number + 1) * CHUNK)
            found |= {_order(h) for h in store.read(block)}
            store.forget()
    return len(wanted & found)


def _order(row: Ask | Hearing) -> tuple[int, int, str]:
    return row.sample, row.question, str(row.kind)
