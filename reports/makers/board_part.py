"""What becomes of a model file on a board: the design, its yields, its drawing and its rules."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from designer.base.errors import Unreachable
from designer.base.page import Block, Picture, bullets, table
from designer.board.board_parts import board_circuit
from designer.board.component import components
from designer.board.kicad_placement import place
from designer.check import checked_design
from designer.check.checked_design import traces
from designer.check.synthesis_result import Synthesis
from designer.jobs.job_outcome import JobOutcome
from designer.model.mechanics import SecondOrderSystem
from designer.model.relative_motion import relative_motions
from designer.plots import orbit_plots
from designer.report import comparison
from designer.spice.pool import SpicePool
from designer.verbs.export import export
from designer.verbs.rules import rules
from designer.verbs.run import run
from reports.makers import placement_drawing
from reports.makers.evidence import Evidence, figure_block

FOLDER = "design"
"""Of the report: the whole design folder, which no repository needs."""
COPIED = ("bom.csv", "circuit.cir", "setup.csv", "schematic.svg")
"""Files of the design that stand beside the page."""
TITLE = "On a board"


def board_part(model: Path, out: Path, note: str, samples: int, seed: int, jobs: int) -> Evidence:
    """Take the file to a board in the folder ``design`` of the report; finished work is kept.

    note : what of the example the board shows, and what it cannot.

    Raises
    ------
    InputError, EnvironmentMissing : as the verbs.
    """
    folder = out / FOLDER
    try:
        outcome = run(model, folder, samples=samples, seed=seed, jobs=jobs, resume=True)
    except Unreachable as error:
        return Evidence(TITLE, [note, f"No circuit was found. {error}"])
    export(folder, resume=True)
    checked = rules(folder).answer
    for name in COPIED:
        shutil.copyfile(folder / name, out / name)
    portraits = _portraits(outcome.synthesis)
    links = ", ".join(f"[{name}]({name})" for name in COPIED[:3])
    blocks: list[Block] = [
        note,
        f"{samples} boards with the reference spread, judged on the exact circuit and compared "
        "with ngspice on some of them:",
        _responses(outcome.answer["responses"]),
        bullets([*_facts(outcome), *_rules(checked)]),
        *(figure_block(name, caption) for name, (caption, _) in portraits.items()),
        Picture("schematic", "The circuit, one stage a cell.", COPIED[3]),
        figure_block("board", "The board with its parts placed; KiCad routes it."),
        Markup(f"To build and to measure it: {links}."),
    ]
    figures = {name: figure for name, (_, figure) in portraits.items()}
    figures["board"] = _board(outcome.synthesis)
    return Evidence(TITLE, blocks, figures, numbers=_numbers(outcome.answer))


def _portraits(made: Synthesis) -> dict[str, tuple[str, Figure]]:
    """Of each response in each clearance, with its caption, by the picture's name."""
    with SpicePool(1) as pool:
        checked = checked_design.check(made.design, made.model_responses, pool)
    out = {}
    for number, response in enumerate(checked):
        system = made.design.model.at(response.model.b).second_order()
        drawn = traces(made.design, response)
        for index, motion in enumerate(relative_motions(system)):
            figure = orbit_plots.phase_portrait(response, drawn, motion)
            caption = (
                f"{response.circuit.response} at ω = {response.model.omega:.4g}: {motion.label}"
                f"{_named(system, index)}, the model (broad line), the exact circuit (broken line) "
                "and ngspice (dots)."
            )
            out[f"portrait-{number + 1}-{index + 1}"] = (caption, figure)
    return out


def _named(system: SecondOrderSystem, clearance: int) -> str:
    """Which clearance is seen, where there are several."""
    several = len(system.clearances) > 1
    return f" in {system.clearances[clearance].name}" if several else ""


def _board(made: Synthesis) -> Figure:
    circuit, choice = board_circuit(made)
    placed = place(circuit, components(circuit, made.catalog, choice))
    return placement_drawing.placement_drawing(placed)


def _responses(answers: Sequence[Mapping[str, Any]]) -> Block:
    rows = []
    for each in answers:
        counted, agreement = each["yield"], each["agreement"]
        rows.append(
            (
                f"{each['omega']:.4g}",
                *(str(each[name]) for name in ("expected", "model", "circuit", "ngspice")),
                *(str(counted[name]) for name in ("ok", "lost", "grazing", "failed")),
                f"{each['rate']:.2f} ({counted['low']:.2f} to {counted['high']:.2f})",
                _asked(agreement) if agreement else "not asked",
            )
        )
    verdicts = ("ok", "lost", "grazing", "failed")
    engines = ("wanted", "model", "exact circuit", "ngspice")
    head = ("ω", *engines, *verdicts, "yield (95 %)", "ngspice agrees on")
    return table(head, rows, numeric=(0, 5, 6, 7, 8))


def _asked(agreement: Mapping[str, Any]) -> str:
    """Boards started on their own orbit, and on the nominal design's."""
    nominal = agreement["nominal_start"]
    return (
        f"{agreement['agreed']} of {agreement['asked']} on their own orbit, {nominal['agreed']} of "
        f"{nominal['asked']} from the nominal one"
    )


def _facts(outcome: JobOutcome) -> list[str]:
    answer, made = outcome.answer, outcome.synthesis
    certificate = answer["certificate"]
    bill = comparison.bill_of(made.design.circuit, made.modelfile.circuit, made.catalog)
    bound = certificate["lower_bound"]
    proved = "" if bound is None else f", lower bound {bound:.2g}"
    check = answer["equation_check"]
    within = sum(finding["passed"] for finding in check["findings"])
    others = [
        f" {finding['name']}: {finding['reason'] or 'outside its bound'}."
        for finding in check["findings"]
        if not finding["passed"]
    ]
    return [
        f"Largest error of a coefficient {answer['max_error']:.2g}; certificate: "
        f"{certificate['status']}{proved}.",
        f"{bill.parts} parts, {bill.packages} packages of op-amps, {bill.distinct} distinct "
        f"values, {bill.price:.2f} € a board.",
        f"The netlist in ngspice against the equations: {within} of {len(check['findings'])} "
        f"comparisons within their bounds.{''.join(others)}",
        *_together(answer["all_on_one_board"]["built"]),
    ]


def _together(counted: Mapping[str, Any] | None) -> list[str]:
    """Boards that show every response; nothing where there is only one."""
    if counted is None:
        return []
    return [f"All responses on one board: {counted['ok']} of {counted['samples']}."]


def _rules(answer: Mapping[str, Any]) -> list[str]:
    """How many design rules pass, and what each that fails has found."""
    counts = answer["counts"]
    texts = [
        f"Design rules: {counts['pass']} pass, {counts['fail']} fail, {counts['not run']} not run "
        "(they ask for a routed board)."
    ]
    return texts + [
        f"Fails: {rule['title']}: {rule['found']}, {rule['limit']}."
        for rule in answer["rules"]
        if rule["status"] == "fail"
    ]


def _numbers(answer: Mapping[str, Any]) -> dict[str, Any]:
    """What the report's JSON has of the board."""
    keys = ("max_error", "certificate", "parts", "responses", "all_on_one_board", "equation_check")
    return {key: answer[key] for key in keys}
