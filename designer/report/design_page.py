"""The page of a design: what was asked for, what was found, how many boards work, what to buy.

Its equations of motion are (1), (2) and (4) of Shi and He, "Global bifurcation and circuit
simulation of a soft-impacting system", as corrected in docs/errata.md. Subscripts and primes are
Unicode, so that the same line stands in a page, in Markdown and in a picture.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from dataclasses import replace

from markupsafe import Markup

from designer.answers.rare_words import boards_at
from designer.base.page import (
    Block,
    Columns,
    Gallery,
    Items,
    Page,
    PageSection,
    Picture,
    SmallPrint,
    Verbatim,
    Widget,
    bullets,
    table,
    titled,
)
from designer.circuit.coefficients import EXACT
from designer.circuit.design import Design
from designer.circuit.netlist import Circuit
from designer.fabrication.bench_sheet import NOTE, BenchSheet
from designer.fabrication.board_cost import CostEstimate, cost_words
from designer.model.ascii_sketch import sketch, system_sketch
from designer.model.clearance import Sides
from designer.model.lumped_system import LumpedSystem
from designer.model.model import Dimensionless, Mechanical
from designer.plots.system_equations import approximation_notes, equations_of, number_of
from designer.report import design_tables, four_answers, response_tables, tolerance_tables, words
from designer.report.data import ReportData
from designer.report.spread_words import words_of
from designer.spread.part_grades import better_grades_text
from designer.yields.loss_attribution import Attribution

FORMAT = 1
MADE = "What was it made with?"
"""Title of the section that what later verbs answered stands before (``inserted``)."""
WORDS = "What do the words mean?"

Pictures = Mapping[str, Picture | Gallery]

GLOSSARY = (
    (
        "n-p-q",
        "a response that repeats after n periods of the drive, with p impacts on the upper stop "
        "and q on the lower one in that time; n-q-p is its mirror twin",
    ),
    ("ω", "frequency of the drive; ω = 1 is one radian per unit of model time"),
    ("model", "the mechanical model, solved exactly piece by piece"),
    (
        "exact circuit",
        "the circuit's own equations (nodal analysis, finite op-amp gain, limits), solved likewise",
    ),
    (
        "ngspice",
        "the SPICE deck, at solver settings that passed a gate first: two step sizes and two "
        "integration methods have to agree",
    ),
    ("ok", "started on the nominal design's orbit, the board settles on the wanted response"),
    ("lost", "the board settles on something else, or on nothing periodic, or an op-amp clips"),
    ("grazing", "too close to call: a contact too shallow or a miss too near to count"),
    ("failed", "no answer; such boards are not part of the yield"),
    (
        "tuned",
        "a setting of the generator within the stated bands was found that works. Where none was "
        "found among the settings tried the board counts as lost, though there may be one: the "
        "yield is a lower bound. On the bench: what the bench procedure finds works",
    ),
    (
        "trimmed",
        "the trimmer on the board is set once, by the bench procedure, and every response is "
        "judged at that setting with the generator as in setup.csv",
    ),
    ("reached", "switched on by the recipe, from discharged capacitors, the board ends on it"),
    (
        "both engines together",
        "the yield of the exact circuit, corrected by the boards that ngspice was asked about",
    ),
)


def design_page(data: ReportData, pictures: Pictures) -> Page:
    """The page of a run: the answers, then a folded section for each question. pictures : those of
    ``pictures.pictures``; none for Markdown."""
    head: list[Block] = [_purpose(data)]
    sections = [
        _not_good_enough(data),
        four_answers.answers(data, pictures.get("small portraits")),
        _question(
            "Which response does each engine show?",
            four_answers.shown_line(data),
            "engines",
            PageSection("Phase portraits", [pictures.get("portraits")], "portraits"),
            _responses(data),
        ),
        _question(
            "How many boards work, and why are the others lost?",
            four_answers.working_line(data),
            "working",
            _yields(data, pictures),
            _boards(data, pictures),
            _rare(data, pictures),
            *_maps(data, pictures),
        ),
        _attribution(data, pictures),
        _question(
            "What was chosen, and how good is it?",
            four_answers.chosen_line(data),
            "choice",
            _model(data, pictures.get("model")),
            _errors(data, pictures.get("errors")),
            _dead_zones(data, pictures),
            _values(data),
            _scales(data),
        ),
        _question(
            "How to build and start it?",
            four_answers.built_line(data),
            "build",
            PageSection("Schematic", [pictures.get("schematic")], "schematic"),
            PageSection("The board", [pictures.get("board")], "board"),
            _parts(data),
            *_starts(data),
        ),
        _question(MADE, four_answers.MADE_LINE, "made", _provenance(data)),
        PageSection(WORDS, [Items(GLOSSARY, "terms")], "words", "", four_answers.WORDS_LINE),
    ]
    if not pictures:
        head.append(Markup("The pictures stand in `report.html`."))
    return Page(data.result.modelfile.title, head, [s for s in sections if any(s.blocks)])


def _question(title: str, line: str, anchor: str, *sections: PageSection) -> PageSection:
    """A question with what answers it. line : the answer in short."""
    return PageSection(title, [s for s in sections if any(s.blocks)], anchor, "", line)


def _maps(data: ReportData, pictures: Pictures) -> tuple[PageSection, PageSection]:
    """Yields over settings, and over temperature."""
    warm = [name for name in pictures if name.startswith("map ") and name.endswith(" temperature")]
    others = [p for name, p in pictures.items() if name[:4] == "map " and name not in warm]
    return (
        PageSection("Where to sit", [tolerance_tables.maps(data), *others], "maps"),
        PageSection(
            "Warm and cold boards",
            [
                tolerance_tables.what_temperature_moves(data),
                tolerance_tables.over_temperature(data),
                *(pictures[name] for name in warm),
            ],
            "temperature",
        ),
    )


def _purpose(data: ReportData) -> str:
    number = len(data.checked)
    title = data.result.modelfile.title
    purpose = f"Asked for: an op-amp circuit that behaves like the model “{title}”"
    if not number:
        return f"{purpose}; no response is named."
    return f"{purpose} and shows {words.plural(number, 'response')} of it."


def _not_good_enough(data: ReportData) -> PageSection:
    """What stands before everything else, where there is something."""
    heads = ("rule", "found", "limit", "what to do")
    rows = ([r["id"], r["found"], r["limit"], r["do"]] for r in data.failed_rules)
    failing = table(heads, rows)
    names = ", ".join(rule["id"] for rule in data.failed_rules)
    rules = PageSection("Design rules that fail", [failing], "", "", f"{names}.")
    blocks: list[Block] = [
        bullets(data.warnings) if data.warnings else None,
        None if failing is None else rules,
    ]
    return PageSection("What is not good enough", blocks, "warnings")


def _model(data: ReportData, drawing: Picture | Gallery | None) -> PageSection:
    model, mechanical = data.design.model, data.mechanical
    assert not isinstance(drawing, Gallery)
    if isinstance(model, LumpedSystem):
        return _system(model, drawing or Picture(), si=data.si is not None)
    assert isinstance(model, Dimensionless)
    picture = replace(
        drawing or Picture(), sketch=tuple(sketch(model).splitlines()), caption=_drawing_note(data)
    )
    equations: list[Block] = []
    if mechanical is not None:
        lines = tuple(mechanical_equations(mechanical))
        equations += [SmallPrint("As given, in SI units:"), Verbatim(lines, equations=True)]
    for title, lines in (
        ("Dimensionless:", tuple(dimensionless_equations(model))),
        ("With the numbers of this model:", tuple(equations_with_numbers(model))),
    ):
        equations += [SmallPrint(title), Verbatim(lines, equations=True)]
    tables = [PageSection("Dimensionless", [design_tables.model_table(model)])]
    if mechanical is not None:
        tables.append(PageSection("As given", [design_tables.mechanical_table(mechanical)]))
    blocks: list[Block] = [
        picture,
        PageSection("Equations of motion", equations),
        Columns(tuple(tables)),
    ]
    return PageSection("The model", blocks, "model")


def _system(model: LumpedSystem, drawing: Picture, *, si: bool) -> PageSection:
    """The model of a file of format 2."""
    sketch = tuple(system_sketch(model).splitlines())
    caption = "Values as the model file gives them. Displacements count to the right."
    if any(gap.preload and gap.preload_over is None for gap in model.gaps):
        caption += " A comparison in the equations is 1 where it holds, else 0."
    equations: list[Block] = []
    for title, lines in (
        (
            "With symbols; u is the displacement in a clearance, or what a law depends on:"
            if model.second_order().laws
            else "With symbols; u is the displacement in a clearance:",
            equations_of(model),
        ),
        ("With the numbers of this model:", equations_of(model, number_of)),
    ):
        equations += [SmallPrint(title), Verbatim(lines, equations=True)]
    blocks: list[Block] = [
        replace(drawing, sketch=sketch, caption=caption),
        PageSection("Equations of motion", equations),
        *(SmallPrint(note) for note in approximation_notes(model, si=si)),
        design_tables.elements_table(model, si=si),
    ]
    return PageSection("The model", blocks, "model")


def _drawing_note(data: ReportData) -> str:
    """The units of the drawing's values, and the words that the equations use."""
    text = "Values as the model file gives them. "
    if data.mechanical is None:
        text = (
            "Values in units of M₁ and K₁, lengths in units of (P₁ + P₂)/K₁, dampers in units of "
            "√(K₁ M₁), forces in units of P₁ + P₂. "
        )
    stops = data.design.model.second_order().clearances
    if stops and stops[0].which == "both":
        text += "clip(x, −b, b) is x, but no less than −b and no more than b. "
    return text + "t = T √(K₁/M₁), x = X K₁/(P₁ + P₂), ω = Ω √(M₁/K₁)."


def _responses(data: ReportData) -> PageSection:
    blocks: list[Block] = ["None was asked for."]
    if data.checked:
        settings = [SmallPrint(_settings_note(data)), response_tables.settings_table(data)]
        blocks = [
            response_tables.response_table(data),
            PageSection("Generator and solver settings", settings),
        ]
    return PageSection("Responses", blocks, "responses")


def _settings_note(data: ReportData) -> str:
    text = (
        "Amplitudes into a high impedance; a generator set for 50 Ω shows half. No DC. Shortest "
        "contact and nearest grazing (the smaller of shallowest contact and nearest miss) are "
        "those of the nominal circuit."
    )
    drive = data.checked[0].excitation
    if drive.second is not None:
        text += " The second amplitude is that of the generator's second channel"
        ahead = drive.second_phase_deg
        text += f", {ahead:.4g}° ahead of the first." if ahead else "."
    if drive.is_waveform:
        text += " The generator gives the waveform of waveform.csv"
        text += "." if drive.second is None else ", its second channel that of waveform2.csv."
    if any(c.gate is not None for c in data.checked):
        text += (
            " The largest difference is between ngspice's runs at the strobes, in per cent of "
            "the peak."
        )
    return text


def _dead_zones(data: ReportData, pictures: Pictures) -> PageSection:
    """The stops as the circuit has them."""
    note = (
        "Output of the stage that makes the stops over the displacement, on the nominal board by "
        "nodal analysis: a slow ramp at the input draws the same on a scope set to XY."
    )
    drawn = [p for name, p in pictures.items() if name.startswith("stop ")]
    blocks: list[Block] = []
    if data.zones:
        blocks = [SmallPrint(note), *drawn, design_tables.stop_table(data.zones)]
    blocks += [p for name, p in pictures.items() if name.startswith("law ")]
    return PageSection("DC curve of the dead zone", blocks, "dc", "DC curve")


def _yields(data: ReportData, pictures: Pictures) -> PageSection:
    blocks: list[Block] = [_study_note(data)]
    if data.checked:
        ngspice = response_tables.ngspice_table(data)
        note = SmallPrint(
            "From its own orbit ngspice starts on the attractor that the exact circuit reached; "
            "from the nominal orbit it has to find the way, over at least 5/(1 − ρ) periods (ρ: "
            "largest multiplier)."
        )
        confirmation: list[Block] = [note, ngspice]
        if ngspice is None:
            confirmation = ["ngspice was not asked about any board."]
        blocks += [
            response_tables.yield_table(data),
            pictures.get("yields"),
            titled("Board by board", tolerance_tables.boards(data)),
            PageSection("Does ngspice confirm?", confirmation),
            titled("How near the boards are to the edge", pictures.get("margins")),
        ]
    kinds = tolerance_tables.kinds(data)
    if kinds is not None:
        *others, last = kinds.columns[1:]
        title = f"{', '.join(others)} and {last}"
        within = "of all the boards" if data.plan.census else "with their 95 % intervals"
        blocks.append(
            PageSection(f"{title[0].upper()}{title[1:]}", [SmallPrint(f"Yields {within}."), kinds])
        )
    blocks.append(titled("Where the engines differ", tolerance_tables.differences(data)))
    return PageSection("Yields", blocks, "yields")


def _rare(data: ReportData, pictures: Pictures) -> PageSection:
    if not data.study.rare:
        return PageSection("", [])
    note = SmallPrint(
        "Boards are drawn where they are lost, and each counts by how likely it is (importance "
        "sampling). The laws of the parts are bounded, so no board outlies its tolerances. What no "
        "search met is not counted; the plain boards that were lost elsewhere, if any, bound it. "
        f"Boards differ as in the study above, {boards_at(data.plan.spread.temperature)}."
    )
    wider = SmallPrint(
        "Where one part alone is moved, all others are as they should be. Below 1 it is lost "
        "within its tolerance."
    )
    return PageSection(
        "Boards of a million",
        [
            note,
            pictures.get("rare"),
            tolerance_tables.rare(data),
            titled("Where boards are lost", tolerance_tables.loss_regions(data)),
            PageSection(
                "How far tolerances may widen", [wider, tolerance_tables.tolerance_margins(data)]
            ),
        ],
        "rare",
    )


def _boards(data: ReportData, pictures: Pictures) -> PageSection:
    """Where HTML calls up each board of the study."""
    if not pictures or not data.study.answers:
        return PageSection("", [])
    number = words.plural(data.plan.samples, "board")
    note = (
        f"What became of each of the {number}, what was drawn for it, and, of those that stand for "
        "a way of losing a response, how it moves. A dot in the picture of the edges above calls "
        "its board up too."
    )
    without = "This needs a browser that runs scripts; samples.parquet has the verdicts."
    return PageSection("Each board", [SmallPrint(note), Widget("boards", without)], "boards")


def _study_note(data: ReportData) -> str:
    limits = "Intervals are Wilson's, at 95 %."
    if data.plan.census:
        limits = "These are all the boards there are, so their shares have no interval."
    varies = words_of(data.plan.spread, data.design.circuit, bandwidth=data.plan.bandwidth)
    attribution = data.study.blame_status.sentence
    engine = "the exact circuit"
    if data.plan.bandwidth:
        engine += " with op-amps that lag by their gain-bandwidth, as ngspice's do here"
    return (
        f"{words.plural(data.plan.samples, 'board')}, seed {data.plan.seed}: {varies}. "
        "Boards run as built: the generator stays at the settings above. Verdicts are those of "
        f"{engine}. {limits}" + (f" {attribution}" if attribution else "")
    )


def _attribution(data: ReportData, pictures: Pictures) -> PageSection:
    limits, attribution = tolerance_tables.limits(data), data.study.blame
    indices = tolerance_tables.indices(data)
    if limits is None or attribution is None:
        return PageSection("", [])
    lost = any(b.lost for b in attribution.responses)
    avoided = tolerance_tables.avoided(data)
    blocks: list[Block] = [SmallPrint(_attribution_note(data, attribution, lost=lost)), limits]
    if avoided is not None:
        blocks.append(PageSection("Losses avoided", [avoided, pictures.get("avoided")]))
    if indices is not None:
        moved: list[Block] = [*_indices_note(data, attribution), indices, pictures.get("indices")]
        blocks.append(PageSection("Whose spread moves the margin", moved))
    blocks.append(titled("Worst corners", tolerance_tables.corners(data)))
    title = "Which part is to blame?" if lost else "What comes nearest to a loss?"
    return PageSection(title, blocks, "blame", "", four_answers.attributed_line(data))


INDICES_NOTE = (
    "Sobol indices of the margin, the largest of each response: the share of its variance that a "
    "coordinate explains alone (first-order) and with all others (total)"
)
NOISE_NOTE = ", with the 95 % noise of the estimate, by the bootstrap over base samples."


def _indices_note(data: ReportData, attribution: Attribution) -> list[Block]:
    """What the indices are; where their noise was not stored, how to get it."""
    if attribution.noise_known:
        return [SmallPrint(INDICES_NOTE + NOISE_NOTE)]
    folder = shlex.quote(data.folder) if data.folder else "DIR"
    measured = " --measured FILE" if data.plan.census else ""
    return [
        SmallPrint(
            f"{INDICES_NOTE}. An earlier version made them and stored no noise; this works it out:"
        ),
        Verbatim((f"designer tolerance {folder}{measured} --blame --resume",)),
    ]


def _attribution_note(data: ReportData, attribution: Attribution, *, lost: bool) -> str:
    replays = "No board was lost, so none was asked again. "
    if lost:
        replays = (
            "Lost boards were asked again with one part or one group exact and all else as drawn; "
            "shares do not add up, since a board can be lost by several parts together. "
        )
    temperature = data.plan.spread.temperature
    warm = ""
    if temperature is not None:
        warm = f"Boards are {boards_at(temperature)}, the nominal one {boards_at(None)}. "
    return replays + (
        "The margin is the distance to the loss, linear in the parts; its indices tell whose "
        "spread moves it, and are worth as much as the verdicts that it foretells. "
        f"{warm}Cost: "
        f"{words.plural(attribution.attractors, 'attractor')} and "
        f"{words.plural(attribution.orbits, 'step')} of following orbits."
    )


def _parts(data: ReportData) -> PageSection:
    blocks: list[Block] = [
        _parts_note(data),
        PageSection("To buy", [design_tables.bom_table(data.bom)]),
        *_cost(data.board_cost),
        *_bench(data.bench),
    ]
    return PageSection("Parts", blocks, "parts")


def _values(data: ReportData) -> PageSection:
    """What each part is there for."""
    columns = Columns(
        (
            PageSection("Values by role", [design_tables.part_table(data.design.circuit)]),
            PageSection("Op-amp sections", [design_tables.opamp_table(data.design.circuit)]),
        )
    )
    return PageSection("What each part does", [columns], "roles")


def _starts(data: ReportData) -> Iterator[PageSection]:
    """How to reach each response, where that is known."""
    if (recipes := tolerance_tables.recipes(data)) is not None:
        yield PageSection("How to reach a response", [recipes], "starts")


def _bench(sheet: BenchSheet | None) -> list[PageSection]:
    """What to expect of a new board at its test points; nothing where that is not known."""
    if sheet is None:
        return []
    rows = table(sheet.head, sheet.rows, ())
    return [PageSection("At the bench", [sheet.before, rows, SmallPrint(NOTE)])]


def _cost(estimate: CostEstimate | None) -> list[PageSection]:
    """What the boards cost; nothing where that is not known."""
    if estimate is None:
        return []
    blocks: list[Block] = [SmallPrint(cost_words(estimate)), design_tables.cost_table(estimate)]
    return [PageSection("Cost, estimated", blocks)]


def _into(circuit: Circuit) -> str:
    """The load that the limits belong to, and what U3C or its like reaches in its own; of a limit
    that the model file states nothing, for it is that of every pin."""
    stage = circuit.output_stage
    if stage.load is None:
        return ""
    limits = circuit.output_limits()
    meant = [contact.switch for stop in circuit.dead_zones for _, contact in stop.contacts]
    own = {f"{name} {limits[name]:.4g} V" for name in meant if name in limits}
    return f" into {stage.load / 1e3:g} kΩ ({', '.join([stage.source, *sorted(own)])})"


def _parts_note(data: ReportData) -> str:
    c = data.design.circuit
    better = better_grades_text(data.better_grades)
    return (
        f"Supply ± {c.supply:g} V, op-amp output limits ± {c.saturation:g} V nominal{_into(c)}. "
        f"{words.plural(len(c.sections), 'section')} of {c.opamp} in "
        f"{words.plural(len(c.packages), 'package')}; {len(c.resistors)} resistors, "
        f"{len(c.capacitors)} capacitors, {data.design.distinct_values} different values."
        + (f" {better}" if better else "")
    )


def _errors(data: ReportData, picture: Picture | Gallery | None) -> PageSection:
    worst, check = data.design.errors.max_error, data.result.equations
    largest = "All are exact." if worst <= EXACT else f"Largest: {words.error(worst)}."
    blocks: list[Block] = [
        "Of the finished circuit, reduced by nodal analysis with ideal op-amps, at the time and "
        f"voltage scales that suit it best. {largest} The clearance and the force are set at the "
        "generator and do not count.",
        _certificate(data.design),
        picture,
        design_tables.error_table(data.design),
    ]
    if check is not None:
        low, high = (words.quantity(f, "Hz", 3) for f in (check.low, check.high))
        note = SmallPrint(
            f"ngspice on the deck itself, by .ac from {low} to {high} from the generator to v1, "
            "the clearance held open and closed by a constant force, and by .dc through the dead "
            "zone and into contact; against the model at the scales below. The bounds follow from "
            "the coefficient errors."
        )
        table = response_tables.equation_table(check)
        blocks.append(PageSection("Does the netlist compute this equation?", [note, table]))
    return PageSection("Coefficient errors", blocks, "errors")


def _certificate(design: Design) -> str:
    c, largest = design.certificate, words.error(design.errors.max_error)
    text = f"Status {c.status}; lower bound {words.error(c.lower_bound)}."
    if c.status == "bound" and c.lower_bound <= EXACT:
        text = (
            f"Not proved optimal: this design reaches {largest}. Whether a better choice from this "
            "catalogue exists is open."
        )
    elif c.status == "bound":
        text = (
            f"Not proved optimal: this design reaches {largest}; what is proved is that no choice "
            f"from this catalogue stays below {words.error(c.lower_bound)}. Whether a choice in "
            "between exists is open."
        )
    elif c.status == "optimal" and design.errors.max_error <= EXACT:
        text = "Proved optimal: an exact match cannot be improved on."
    elif c.status == "optimal":
        text = (
            "Proved optimal: under the conditions kept, no choice of parts from this catalogue "
            f"has a largest error below {largest}."
        )
    return f"{text} Basis: {c.proof}."


def _scales(data: ReportData) -> PageSection:
    model, conditions = data.design.model, design_tables.condition_table(data.design)
    note = f"For the model's own clearance b = {words.number(model.b)}."
    if any(c.model.b != model.b for c in data.checked):
        note += (
            " A response wanted at another b is driven with the amplitude times b(model)/b, and "
            "its volts stand for other lengths by the same factor; the threshold stays."
        )
    scales = design_tables.scale_table(data.design, data.si)
    columns = Columns(
        (
            PageSection("What a volt and a second stand for", [scales]),
            PageSection("Conditions kept", [conditions or "None."]),
        )
    )
    return PageSection("Scales and conditions", [SmallPrint(note), columns], "scales")


def _provenance(data: ReportData) -> PageSection:
    blocks: list[Block] = []
    if data.command:
        again = "To make these results again, with the same versions:"
        blocks += [again, Verbatim((data.command,))]
    blocks += [response_tables.provenance_table(data), f"Format of this file: {FORMAT}."]
    return PageSection("Provenance", blocks, "provenance")


SYMBOLS = (
    "x₁″ + 2ζ (x₁′ − x₂′) + (x₁ − x₂) + f(x₁) = (1 − f₂₀) sin ωt",
    "m/(1 − m) x₂″ + 2ζ (x₂′/(1 − c) − x₁′) + (x₂/(1 − k) − x₁) = f₂₀ sin ωt",
)
"""Eq. (4) as corrected, dimensionless; ``stop_force`` has f."""

MECHANICAL = (
    "M₁ X₁″ + C₁ (X₁′ − X₂′) + K₁ (X₁ − X₂) + F(X₁) = P₁ sin ΩT",
    "M₂ X₂″ + C₁ (X₂′ − X₁′) + C₂ X₂′ + K₁ (X₂ − X₁) + K₂ X₂ = P₂ sin ΩT",
)
"""Eq. (1) and (2), in SI units; ``stop_force`` has F."""


def dimensionless_equations(model: Dimensionless) -> tuple[str, ...]:
    """Eq. (4) with symbols; the force of the stops only where there are some."""
    return _lines(
        SYMBOLS, " + f(x₁)", stop_force("f(x)", "k₀/(1 − k₀)", "x", "b", model.sides, model.k0)
    )


def mechanical_equations(model: Mechanical) -> tuple[str, ...]:
    """Eq. (1) and (2) with symbols; the force of the stops only where there are some."""
    return _lines(MECHANICAL, " + F(X₁)", stop_force("F(X)", "K₀", "X", "B", model.sides, model.K0))


def equations_with_numbers(model: Dimensionless) -> tuple[str, ...]:
    """Eq. (4) with the values of a model, four digits each."""
    damping = _number(2.0 * model.zeta)
    second = f"{_times(model.m / (1.0 - model.m))}x₂″"
    return _lines(
        (
            f"x₁″ + {damping} (x₁′ − x₂′) + (x₁ − x₂) + f(x₁) = {_wave(1.0 - model.f20)}",
            f"{second} + {damping} ({_times(1.0 / (1.0 - model.c))}x₂′ − x₁′)"
            f" + ({_times(1.0 / (1.0 - model.k))}x₂ − x₁) = {_wave(model.f20)}",
        ),
        " + f(x₁)",
        stop_force("f(x)", _number(model.mu), "x", _number(model.b), model.sides, model.k0),
    )


def stop_force(
    name: str, stiffness: str, x: str, gap: str, sides: Sides, there: float
) -> tuple[str, ...]:
    """The law of the stops, of which there is none where ``there`` is 0."""
    if not there:
        return ()
    inside = {
        "both": f"{x} − clip({x}, −{gap}, {gap})",
        "upper": f"max({x} − {gap}, 0)",
        "lower": f"min({x} + {gap}, 0)",
    }[sides]
    law = f"({inside})" if sides == "both" else inside
    return (f"{name} = {stiffness} {law}",)


def _lines(equations: tuple[str, ...], stops: str, law: tuple[str, ...]) -> tuple[str, ...]:
    if law:
        return (*equations, *law)
    return tuple(line.replace(stops, "") for line in equations)


def _number(value: float) -> str:
    return f"{value:.4g}"


def _times(value: float) -> str:
    text = _number(value)
    return "" if text == "1" else f"{text} "


def _wave(amplitude: float) -> str:
    return f"{_times(amplitude)}sin ωt" if amplitude else "0"
