"""The design that real parts cannot spoil: parts and places with the highest predicted yield.

Over all wanted responses, in this order: the smallest of their reliability indices
(``centering.scaled_sigma``), hence the smallest predicted yield; where two designs agree in it,
as far as the boards of a search can tell, the product of the predicted yields. One lever after the
other is moved, from the match design on: op-amp and dead zone first, then the places of the
responses, the other op-amps and dead zones at those, then what the synthesis aims at. A lever stays
where it is unless something is gained. At the end the exact circuit with bandwidth is asked whether
it bears the design out, then ngspice; where one does not, slower ones are made, and of those that
ngspice was asked about the one is taken of whose worst response it keeps the most boards.

Nothing of the chain (model, match, circuit, predictions) imports a module of the search.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from scipy.special import ndtr

from designer.base import progress
from designer.base.errors import InputError, Unreachable
from designer.base.progress import doing, part, seeking
from designer.board.board_check import check_board
from designer.catalog.parts_catalog import Catalog
from designer.centering.answer_cache import AnswerCache
from designer.centering.bandwidth_check import BANDWIDTH, LaggingBoards
from designer.centering.candidate import (
    Candidate,
    Contribution,
    FidelityOutcome,
    SearchResult,
    Step,
    better,
)
from designer.centering.levers import (
    LEVERS,
    PLACES,
    TOPOLOGY,
    DesignChoice,
    slower,
    topologies,
    variants,
)
from designer.centering.ngspice_check import BOARDS_ASKED, FIDELITY, AskAgreement
from designer.centering.operating_points import MANY, best_points, room_of, score
from designer.centering.response_windows import OperatingPoint, Stretch, open_in, stretches
from designer.centering.scaled_sigma import ScaledBoards
from designer.check.synthesis_result import Synthesis
from designer.circuit.design import Design
from designer.model import find_responses
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile, errors_in, need_responses
from designer.model.response_table import Response
from designer.spread.part_rules import check_names, spread_of
from designer.synthesis import parts_choice
from designer.synthesis.part_checks import unit_circuit

BOARDS = 128
"""Boards by which designs are compared, at each stretch of the spread."""


def search(
    modelfile: ModelFile,
    catalog: Catalog,
    *,
    seed: int = 1,
    jobs: int = 1,
    memory: AnswerCache | None = None,
    windows: Sequence[tuple[Stretch, ...]] | None = None,
    ask_agreement: AskAgreement | None = None,
) -> SearchResult:
    """Seek the design and the places of the highest predicted yield.

    seed : of the boards of the search, which no study draws. memory : of an earlier, interrupted
    search of the same. windows : of ``look``, if they are known. ask_agreement : asks ngspice
    whether it bears a design out (``ngspice_check.AgreementCheck``); the exact circuit alone
    decides if None.

    Raises
    ------
    InputError : something is open that no search can find (``windows.check``), or the model
        does not show a response.
    Unreachable : no design keeps its conditions and the match error.
    """
    catalog = modelfile.choices(catalog)
    with errors_in(modelfile):
        all_windows = look(modelfile, catalog, jobs) if windows is None else tuple(windows)
        design_search = _DesignSearch(
            modelfile,
            catalog,
            all_windows,
            seed,
            jobs,
            AnswerCache() if memory is None else memory,
            ask_agreement,
        )
        with seeking("design"):
            return design_search.run()


def look(modelfile: ModelFile, catalog: Catalog, jobs: int) -> tuple[tuple[Stretch, ...], ...]:
    """Refuse everything that may be refused, and say where the model shows each response.

    Raises
    ------
    InputError : as ``search``. ResponseNotFound : no start finds a response at its place.
    """
    need_responses(modelfile)
    catalog = modelfile.choices(catalog)
    with errors_in(modelfile):
        _check_topologies(modelfile, catalog.mounted(modelfile.board.mounting))
        wanted = {n: r for n, r in enumerate(modelfile.responses, start=1) if not open_in(r)}
        found = find_responses.find(modelfile.model, list(wanted.values()))
        there = dict(zip(wanted, found, strict=True))
        find_responses.need_found(there, modelfile.si, modelfile.source)
        step = progress.stage("windows of the responses on the model")
        return stretches(
            modelfile.model, modelfile.responses, modelfile.search, jobs=jobs, progress=step
        )


def _check_topologies(modelfile: ModelFile, catalog: Catalog) -> None:
    """Refuse what no board could be made of. One topology for which the catalogue has no value is
    left to the search as long as there is another."""
    short: list[Unreachable] = []
    wanted = topologies(modelfile, catalog)
    for choice in wanted:
        spec = choice.spec(modelfile.circuit)
        try:
            check_board(modelfile, catalog, spec)
        except Unreachable as error:
            short.append(error)
        if choice == DesignChoice.of(modelfile):
            circuit = unit_circuit(modelfile.model, spec, catalog)
            check_names(modelfile, circuit, catalog)
    if len(short) == len(wanted):
        raise short[0]


class _DesignSearch:
    """One search of a design. ``steps`` and the counters grow while it runs."""

    def __init__(
        self,
        modelfile: ModelFile,
        catalog: Catalog,
        windows: tuple[tuple[Stretch, ...], ...],
        seed: int,
        jobs: int,
        memory: AnswerCache,
        ask_agreement: AskAgreement | None,
    ) -> None:
        self.modelfile, self.catalog, self.windows = modelfile, catalog, windows
        self.seed, self.jobs, self.memory = seed, jobs, memory
        self.ask_agreement, self.checks = ask_agreement, list[FidelityOutcome]()
        self.steps: list[Step] = []
        self.candidates = self.places = 0
        self.short: Unreachable | None = None
        self._step: Callable[[], None] = lambda: None

    @property
    def _most_designs(self) -> int:
        """How many designs are made, at most, before real op-amps are asked."""
        choice = DesignChoice.of(self.modelfile)
        every = topologies(self.modelfile, self.catalog)
        number = len(every) + (choice not in every)
        if any(open_in(spec) for spec in self.modelfile.responses):
            number += len(every)
        return number + sum(len(list(variants(choice, lever))) for lever in LEVERS[2:])

    def run(self) -> SearchResult:
        middle = tuple(
            self._there(spec, [s.at((0.5,))[0] for s in window])
            for spec, window in zip(self.modelfile.responses, self.windows, strict=True)
        )
        self._step = progress.stage("designs", self._most_designs)
        start, best = self._topology(middle)
        if any(open_in(spec) for spec in self.modelfile.responses):
            best = self._placed(best)
            for choice in topologies(self.modelfile, self.catalog):
                other = best.choice.with_lever("opamp", choice.opamp)
                other = other.with_lever("dead zone", choice.dead_zone)
                if other != best.choice:
                    setting = f"{other.opamp}, {other.dead_zone}"
                    best = self._try(TOPOLOGY, setting, other, best)
        for lever in LEVERS[2:]:
            for choice in variants(best.choice, lever):
                best = self._try(lever, _setting_text(choice.get(lever)), choice, best)
        best = self._borne_out(best)
        contributions = self._contributions(start, best)
        return SearchResult(
            self._synthesis(best),
            start,
            best,
            tuple(self.steps),
            contributions,
            tuple(self.checks),
            self.windows,
            self.candidates,
            self.places,
            self.seed,
        )

    def _topology(self, middle: tuple[ModelResponse, ...]) -> tuple[Candidate | None, Candidate]:
        """The match design, if there is one, and the best of all op-amps and dead zones."""
        file_choice = DesignChoice.of(self.modelfile)
        start: Candidate | None = None
        best: Candidate | None = None
        for choice in topologies(self.modelfile, self.catalog):
            setting = f"{choice.opamp}, {choice.dead_zone}"
            candidate = self._candidate(choice, middle, setting)
            if candidate is None:
                self._note(TOPOLOGY, setting, None, False)
                continue
            gained = best is None or better(candidate.rank, best.rank)
            self._note(TOPOLOGY, setting, candidate, gained)
            if choice == file_choice:
                start = candidate
            if gained:
                best = candidate
        if best is None:
            assert self.short is not None
            raise self.short
        if file_choice not in topologies(self.modelfile, self.catalog):  # what the levers are worth
            start = self._candidate(file_choice, middle, "the match design")
        return start, best

    def _placed(self, best: Candidate) -> Candidate:
        """The best candidate with every open response moved to its best place."""
        spread = spread_of(self.modelfile, best.design.circuit, self.catalog)
        bench = ScaledBoards(
            best.design, spread, self.seed, MANY, jobs=self.jobs, memory=self.memory
        )
        responses = []
        for number, spec in enumerate(self.modelfile.responses):
            if not open_in(spec):
                responses.append(best.model_responses[number])
                continue
            band = self.modelfile.search.band(self.modelfile.model)
            room = room_of(spec, self.modelfile.model.b, band)
            with part(f"place of response {number + 1}, {spec.expect}"):
                ranked, trials = best_points(bench, spec, self.windows[number], room)
            self.places += trials
            if not ranked:
                raise self._nowhere(number, spec)
            responses.append(self._there(spec, [s.place for s in ranked]))
        setting = "; ".join(f"{r.expected}: ω = {r.omega:.5g}, b = {r.b:.4g}" for r in responses)
        candidate = self._candidate(best.choice, tuple(responses), PLACES)
        gained = candidate is not None and better(candidate.rank, best.rank)
        self._note(PLACES, setting, candidate, gained)
        return candidate if candidate is not None and gained else best

    def _try(self, lever: str, setting: str, choice: DesignChoice, best: Candidate) -> Candidate:
        candidate = self._candidate(choice, best.model_responses, f"{lever} {setting}")
        gained = candidate is not None and better(candidate.rank, best.rank)
        self._note(lever, setting, candidate, gained)
        return candidate if candidate is not None and gained else best

    def _borne_out(self, best: Candidate) -> Candidate:
        """The design, or the same with a slower time scale where real op-amps lose boards of it.

        ngspice is asked about what the exact circuit with bandwidth bears out, until one design
        stands; where it bears none out, about the one of which it keeps the most boards.
        """
        if self.ask_agreement is None:
            return best
        lagging: list[tuple[Candidate, FidelityOutcome]] = []
        confirmed: list[tuple[Candidate, FidelityOutcome]] = []
        for candidate in self._slower(best):
            lagging.append(self._asked(candidate, BANDWIDTH, LaggingBoards(self.memory)))
            if lagging[-1][1].holds:
                confirmed.append(self._asked(candidate, FIDELITY, self.ask_agreement))
                if confirmed[-1][1].holds:
                    break
        if not confirmed:
            confirmed.append(self._asked(_most_surviving(lagging), FIDELITY, self.ask_agreement))
        final = _most_surviving(confirmed)
        for candidate, outcome in lagging + confirmed:
            self.checks.append(replace(outcome, adopted=candidate is final))
        for candidate, _ in lagging:
            if candidate is not best:
                setting = _setting_text(candidate.choice.frequency)
                self._note("time scale", setting, candidate, candidate is final)
        return final

    def _slower(self, best: Candidate) -> Iterator[Candidate]:
        """The design, and as it is with slower time scales."""
        yield best
        low, _ = self.modelfile.circuit.frequency
        for choice in slower(best.choice, self._frequency(best), low):
            setting = _setting_text(choice.frequency)
            self._step = progress.stage("slower designs")
            candidate = self._candidate(choice, best.model_responses, f"time scale {setting}")
            if candidate is None:
                self._note("time scale", setting, None, False)
            else:
                yield candidate

    def _frequency(self, candidate: Candidate) -> float:
        """The frequency [Hz] of a candidate at ω = 1."""
        unit = self.modelfile.model.second_order().own_frequency
        return candidate.design.errors.scales.frequency(unit)

    def _time_scale(self, frequency: float) -> str:
        """Which frequency of the generator [Hz] stands for the model's own, in words."""
        si = self.modelfile.si
        if si is None:
            return f"{frequency:.4g} Hz at ω = 1"
        own = si.hertz(self.modelfile.model.second_order().own_frequency)
        return f"{frequency:.4g} Hz for {own:.4g} Hz of the mechanism"

    def _asked(
        self, candidate: Candidate, fidelity: str, ask_agreement: AskAgreement
    ) -> tuple[Candidate, FidelityOutcome]:
        frequency = self._frequency(candidate)
        engine = "exact circuit with" if fidelity == BANDWIDTH else "ngspice, rung"
        title = f"{engine} {fidelity}, {self._time_scale(frequency)}"
        step = progress.stage(title, len(candidate.scored))
        responses, design = candidate.model_responses, candidate.design
        bench = self._bench(candidate.choice, responses, design, BOARDS_ASKED)
        agreements = ask_agreement(bench, [s.operating_orbit for s in candidate.scored], step)
        text = ", ".join(map(str, agreements))
        progress.note(f"  {title}: boards that show it as well, by response: {text}")
        return candidate, FidelityOutcome(fidelity, frequency, agreements)

    def _bench(
        self, choice: DesignChoice, responses: Sequence[ModelResponse], design: Design, boards: int
    ) -> ScaledBoards:
        spread = spread_of(self._resolved(choice, responses), design.circuit, self.catalog)
        return ScaledBoards(design, spread, self.seed, boards, jobs=self.jobs, memory=self.memory)

    def _candidate(
        self, choice: DesignChoice, responses: tuple[ModelResponse, ...], title: str
    ) -> Candidate | None:
        """A design made so; None where there is none, and then ``short`` says why."""
        self.candidates += 1
        with part(f"design {self.candidates}, {title}"):
            made = self._made(choice, responses)
        self._step()
        return made

    def _made(self, choice: DesignChoice, responses: tuple[ModelResponse, ...]) -> Candidate | None:
        model, spec = self.modelfile.model, choice.spec(self.modelfile.circuit)
        try:
            model_peaks = find_responses.peaks(model, responses)
            design = parts_choice.synthesise(
                model, spec, self.catalog, model_peaks, responses,
                aims=choice.aims, binding=False, jobs=self.jobs,
            )  # fmt: skip
            most, error = self.modelfile.search.match_error, design.errors.max_error
            if error > most:
                raise Unreachable(
                    None,
                    "search.match_error",
                    most,
                    f"a limit that a design keeps: the least error is {error:.3g}; a wider "
                    "choice (circuit.resistors, circuit.capacitors, circuit.composites) has less",
                )
        except Unreachable as error:
            self.short = error
            return None
        bench = self._bench(choice, responses, design, BOARDS)
        doing("boards")
        scored = tuple(
            score(bench, r.spec, [OperatingPoint(r.omega, r.b, r.orbit.start)], BOARDS)[0]
            for r in responses
        )
        self.places += len(scored)
        return Candidate(choice, design, responses, scored)

    def _contributions(self, start: Candidate | None, final: Candidate) -> tuple[Contribution, ...]:
        """One lever at a time: moved from the match design, and moved back from the final one."""
        if start is None:
            return ()
        moved = [lv for lv in LEVERS if start.choice.get(lv) != final.choice.get(lv)]
        number = 2 * (len(moved) + (final.wanted != start.wanted))
        self._step = progress.stage("what each lever is worth", number)
        out = []
        if final.wanted != start.wanted:
            out.append(
                Contribution(
                    PLACES,
                    "middle of the widest window",
                    "chosen",
                    self._rank(start.choice, final.model_responses),
                    self._rank(final.choice, start.model_responses),
                )
            )
        slowed = bool(self.checks) and not self.checks[0].adopted
        slower_for = "ngspice" if slowed and self.checks[0].holds else BANDWIDTH
        for lever in LEVERS:
            before, after = start.choice.get(lever), final.choice.get(lever)
            if before != after:
                out.append(
                    Contribution(
                        lever,
                        _setting_text(before),
                        _setting_text(after),
                        self._rank(start.choice.with_lever(lever, after), start.model_responses),
                        self._rank(final.choice.with_lever(lever, before), final.model_responses),
                        slower_for if slowed and lever == "time scale" else "exact",
                    )
                )
        return tuple(out)

    def _rank(
        self, choice: DesignChoice, responses: tuple[ModelResponse, ...]
    ) -> tuple[float, float] | None:
        candidate = self._candidate(choice, responses, "what a lever is worth")
        return None if candidate is None else candidate.rank

    def _there(self, spec: Response, ranked: Sequence[OperatingPoint]) -> ModelResponse:
        """The first of these places at which ``find_responses.find`` meets the response too."""
        model = self.modelfile.model
        for place in ranked:
            wanted = replace(spec, omega=place.omega, b=place.b)
            if spec.b is None and place.b == model.b:
                wanted = replace(wanted, b=None)
            response = find_responses.find(model, [wanted])[0]
            if response.found:
                return response
        raise self._nowhere(self.modelfile.responses.index(spec), spec)

    def _nowhere(self, number: int, spec: Response) -> InputError:
        open_ = "omega" if spec.omega is None else "b"
        return InputError(
            None,
            f"response[{number + 1}].{open_}",
            "best" if spec.omega is None else spec.b,
            f"a place that starts reach and the nominal circuit shows; {spec.expect} has none "
            "within this range",
        )

    def _resolved(self, choice: DesignChoice, responses: Sequence[ModelResponse]) -> ModelFile:
        wanted = tuple(r.spec for r in responses)
        return replace(
            self.modelfile, circuit=choice.spec(self.modelfile.circuit), responses=wanted
        )

    def _synthesis(self, best: Candidate) -> Synthesis:
        """The final design with its certificate whole: what each condition costs included."""
        progress.stage("the design that was found, what its conditions cost")
        model, spec = self.modelfile.model, best.choice.spec(self.modelfile.circuit)
        responses = best.model_responses
        model_peaks = find_responses.peaks(model, responses)
        design = parts_choice.synthesise(
            model, spec, self.catalog, model_peaks, responses,
            aims=best.choice.aims, jobs=self.jobs,
        )  # fmt: skip
        modelfile = self._resolved(best.choice, responses)
        return Synthesis(modelfile, self.catalog, responses, design)

    def _note(self, lever: str, setting: str, candidate: Candidate | None, adopted: bool) -> None:
        rank = None if candidate is None else candidate.rank
        reason = str(self.short) if candidate is None else ""
        self.steps.append(Step(lever, setting, rank, adopted, reason))
        if candidate is not None:
            worst = float(ndtr(candidate.rank[0]))
            text = f"smallest distance {candidate.rank[0]:.2f} σ (predicted yield {worst:.4f})"
            progress.note(f"  {lever}: {setting}: {text}{', kept' if adopted else ''}")
            if adopted:
                progress.best_so_far(f"{text}, with {lever} {setting}")


def _most_surviving(asked: Sequence[tuple[Candidate, FidelityOutcome]]) -> Candidate:
    """The design whose worst response most boards keep, of those that the first has answers to."""
    answered = [r for r, a in enumerate(asked[0][1].agreements) if a.borne_out is not None]

    def worst(one: tuple[Candidate, FidelityOutcome]) -> int:
        return min((one[1].agreements[r].survivors for r in answered), default=0)

    return max(asked, key=worst)[0]


def _setting_text(value: object) -> str:
    if isinstance(value, tuple):
        return " to ".join(f"{v:.4g}" for v in value) + " Hz"
    return f"{value:g}" if isinstance(value, float) else str(value)
