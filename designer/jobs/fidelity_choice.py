"""Which fidelity decides: by what ``designer trade`` measured of this design, else the usual one.

A study decides on the exact circuit and asks ngspice about some boards of each response, `LEAST` at
least (``auto``). Where a trade has shown that the exact circuit's yield is further from ngspice's
than its bound, every board goes to ngspice. What a user asks for with ``--rung`` stands.

A trade goes with the design it was made of. A search that replaces a design keeps the word of its
trade, if that was of the same model file, until there is a trade of the design that was found.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from designer.base import progress
from designer.base.defaults import STUDY_ENGINES, StudyEngine
from designer.base.design_folder import Folder
from designer.base.guarded_reading import reading
from designer.base.si_unit import drive_text
from designer.fidelity.fidelity_answers import CIRCUIT
from designer.fidelity.fidelity_errors import BOARD
from designer.fidelity.trade_study import SHARE
from designer.jobs.options import Options

TRADE = "trade.json"
"""What the verb ``trade`` writes."""
SEARCH = "search.json"
"""What the verb ``search`` writes."""
EARLIER = " (of the design that stood here before the search)"
LEAST = 40
"""Boards of each response that ngspice is asked about, whatever a trade says."""


@dataclass(frozen=True)
class FidelityChoice:
    """The fidelity that a study takes, and why."""

    rung: StudyEngine
    """Which engine decides a study."""
    reason: str
    """Why, in one line for people; "" where nothing was measured."""


def choose(folder: Folder) -> FidelityChoice:
    """The fidelity by the folder's ``trade.json``, if its stage is complete, else by what its
    search has kept of an earlier one; else ``auto``.

    Raises
    ------
    InputError : the file is not what ``trade``, or ``search``, wrote.
    """
    stages = folder.manifest.stages if folder.manifest else {}
    if "trade" in stages and stages["trade"].complete:
        return _read(folder, TRADE, "cheapest", _of_trade)
    if "search" in stages and stages["search"].complete and "design" in stages:
        return _read(
            folder, SEARCH, "trade", partial(_of_search, stages["design"].inputs.get("model"))
        )
    return FidelityChoice("auto", "")


def before_search(folder: Folder, model: str) -> FidelityChoice | None:
    """The choice by a trade in the folder, if that is of the model file with this hash; None
    without one.

    To be asked before a search touches the folder.
    """
    stages = folder.manifest.stages if folder.manifest else {}
    of = [stages[name].inputs.get("model") for name in ("design", "search") if name in stages]
    if "search" in stages and not stages["search"].complete:
        return None  # whose the design is cannot be told
    choice = choose(folder) if model in of else FidelityChoice("auto", "")
    return choice if choice.reason else None


def for_search(folder: Folder, options: Options) -> StudyEngine:
    """The fidelity of the study at the end of a search, and a note of why. ``exact`` stands for "as
    usual": the search's confirmation asks ngspice about `LEAST` boards of each response."""
    if options.rung != "auto":
        return options.rung
    choice = choose(folder)
    progress.note(
        choice.reason
        or "rung: no trade of this design, so the exact circuit decides the final study, and "
        f"ngspice's word on {LEAST} boards of each response decides whether it is confirmed"
    )
    return "ngspice" if choice.rung == "ngspice" else "exact"


def with_fidelity(folder: Folder, options: Options) -> Options:
    """The options with a fidelity in place of "auto", and a note of why; a stated fidelity
    stays."""
    if options.rung != "auto":
        return options
    choice = choose(folder)
    if choice.reason:
        progress.note(choice.reason)
    return replace(options, rung=choice.rung)


def _read(
    folder: Folder, name: str, key: str, choice: Callable[[Mapping[str, Any]], FidelityChoice]
) -> FidelityChoice:
    document = folder.json(name)
    with reading(folder / name, f"what {name.removesuffix('.json')} wrote", key):
        return choice(document)


def _of_search(model: object, search: Mapping[str, Any]) -> FidelityChoice:
    """model : hash of the design's model file, which is another where somebody replaced it."""
    trade = search.get("trade")
    if trade is None or trade["model"] != model:
        return FidelityChoice("auto", "")
    if trade["rung"] not in STUDY_ENGINES:
        raise ValueError(trade["rung"])
    reason = str(trade["reason"]).removesuffix(EARLIER)
    return FidelityChoice(trade["rung"], f"{reason}{EARLIER}")


def _of_trade(trade: Mapping[str, Any]) -> FidelityChoice:
    shares = [c for c in trade["cheapest"] if c["question"] == SHARE]
    if not shares:
        reasons = dict.fromkeys(f"{_response(r)}: {r['reason']}" for r in trade["left_out"])
        why = f" ({'; '.join(reasons)})" if reasons else ""
        reason = f"rung by trade.json: it asked no boards{why}, so as usual"
        return FidelityChoice("auto", reason + _warning(trade, CIRCUIT))
    overall = shares[-1]  # of all responses, or of the only one
    if overall["rung"] == CIRCUIT:
        note = f"; {overall['note']}" if overall.get("note") else ""
        error = f"within {100.0 * overall['measured']:.2g} % of ngspice's yield (95 %{note})"
        return FidelityChoice(
            "auto",
            f"rung by trade.json: the exact circuit decides, {error}; ngspice is asked about "
            f"{LEAST} boards of each response at least{_warning(trade, CIRCUIT)}",
        )
    return FidelityChoice(
        "ngspice",
        "rung by trade.json: every board in ngspice, for the exact circuit's yield is off by more "
        f"than {100.0 * overall['bound']:g} %{_warning(trade, 'ideal')}",
    )


def _warning(trade: Mapping[str, Any], decides: str) -> str:
    """Where the fidelity that decides is not shown to have the nominal board's n-p-q."""
    wrong = []
    for truth in trade["truths"]:
        right = any(
            row["right"][BOARD] and row["gate"] is not False
            for row in trade["rungs"]
            if row["number"] == truth["number"] and row["rung"] == decides
        )
        if not (truth["sure"] and right):
            wrong.append(_response(truth))
    if not wrong:
        return ""
    name = "the exact circuit" if decides == CIRCUIT else "ngspice with ideal op-amps"
    return f"; at {'; '.join(wrong)} {name} is not shown to have the nominal board's n-p-q"


def _response(row: Mapping[str, Any]) -> str:
    b = f", b = {row['b']:g}" if "b" in row else ""  # earlier trades have no b
    return f"{drive_text(row['omega'], row.get('frequency_hz'))}{b}"
