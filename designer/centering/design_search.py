"""The design that real parts cannot spoil: parts and places with the highest predicted yield.

Over all wanted responses, in this order: the smallest of their distances from being lost
(``centering.distance``), hence the smallest predicted yield; where two designs agree in it,
as far as the boards of a search can tell, the product of the predicted yields. One lever after the
other is moved, from the match design on: op-amp and dead zone first, then the places of the
responses, the other op-amps and dead zones at those, then what the synthesis aims at. A lever stays
where it is unless something is gained. At the end ngspice is asked whether it bears the design out;
where it does not, slower ones are made, and the one is taken of whose worst response ngspice keeps
the most boards.

Nothing of the chain (model, match, circuit, predictions) imports a module of the search.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from scipy.stats import norm

from designer.base.errors import InputError, Unreachable
from designer.base.progress import Progress
from designer.board.board_check import check_board
from designer.catalog.catalog import Catalog
from designer.centering.answer_cache import AnswerCache
from designer.centering.candidate import Candidate, Contribution, Listened, Searched, Step, better
from designer.centering.distance import Stretched
from designer.centering.levers import (
    LEVERS,
    PLACES,
    TOPOLOGY,
    DesignChoice,
    slower,
    topologies,
    variants,
)
from designer.centering.ngspice_check import LISTENED, RUNG, Agreement, Listen
from designer.centering.operating_points import MANY, best_points, room_of, score
from designer.centering.windows import OperatingPoint, Stretch, open_in, stretches
from designer.check.synthesis_result import Synthesis
from designer.circuit.design import Design
from designer.model import find_responses
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile, naming, need_responses
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
    listen: Listen | None = None,
    progress: Progress | None = None,
) -> Searched:
    """Seek the design and the places of the highest predicted yield.

    seed : of the boards of the search, which no study draws. memory : of an earlier, interrupted
    search of the same. windows : of ``look``, if they are known. listen : asks ngspice whether it
    bears a design out (``ngspice_check.Listener``); the exact circuit alone decides if None.

    Raises
    ------
    InputError : something is open that no search can find (``windows.check``), or the model
        does not show a response.
    Unreachable : no design keeps its conditions and the match error.
    """
    said = Progress() if progress is None else progress
    catalog = modelfile.choices(catalog)
    with naming(modelfile):
        seen = look(modelfile, catalog, jobs, said) if windows is None else tuple(windows)
        hunt = _Hunt(
            modelfile,
            catalog,
            seen,
            seed,
            jobs,
            AnswerCache() if memory is None else memory,
            listen,
            said,
        )
        return hunt.run()


def look(
    modelfile: ModelFile, catalog: Catalog, jobs: int, progress: Progress
) -> tuple[tuple[Stretch, ...], ...]:
    """Everything that may be refused, refused; and where the model shows each response."""
    need_responses(modelfile)
    catalog = modelfile.choices(catalog)
    with naming(modelfile):
        _check_topologies(modelfile, catalog.mounted(modelfile.board.mounting))
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
        if choice == DesignChoice.of(modelfile.circuit):
            circuit = unit_circuit(modelfile.model, spec, catalog)
            check_names(modelfile, circuit, catalog)
    if len(short) == len(wanted):
        raise short[0]


class _Hunt:
    """One search. ``steps`` and the counters grow while it runs."""

    def __init__(
        self,
        modelfile: ModelFile,
        catalog: Catalog,
        seen: tuple[tuple[Stretch, ...], ...],
        seed: int,
        jobs: int,
        memory: AnswerCache,
        listen: Listen | None,
        said: Progress,
    ) -> None:
        self.modelfile, self.catalog, self.seen = modelfile, catalog, seen
        self.seed, self.jobs, self.memory, self.said = seed, jobs, memory, said
        self.listen, self.heard = listen, list[Listened]()
        self.steps: list[Step] = []
        self.candidates = self.places = 0
        self.short: Unreachable | None = None

    def run(self) -> Searched:
        middle = tuple(
            self._there(spec, [s.at((0.5,))[0] for s in found])
            for spec, found in zip(self.modelfile.responses, self.seen, strict=True)
        )
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
                best = self._try(lever, _shown(choice.get(lever)), choice, best)
        best = self._borne_out(best)
        contributions = self._contributions(start, best)
        return Searched(
            self._made(best),
            start,
            best,
            tuple(self.steps),
            contributions,
            tuple(self.heard),
            self.seen,
            self.candidates,
            self.places,
            self.seed,
        )

    def _topology(self, middle: tuple[ModelResponse, ...]) -> tuple[Candidate | None, Candidate]:
        """The match design, if there is one, and the best of all op-amps and dead zones."""
        own = DesignChoice.of(self.modelfile.circuit)
        start: Candidate | None = None
        best: Candidate | None = None
        for choice in topologies(self.modelfile, self.catalog):
            setting = f"{choice.opamp}, {choice.dead_zone}"
            made = self._candidate(choice, middle, setting)
            if made is None:
                self._note(TOPOLOGY, setting, None, False)
                continue
            gained = best is None or better(made.rank, best.rank)
            self._note(TOPOLOGY, setting, made, gained)
            if choice == own:
                start = made
            if gained:
                best = made
        if best is None:
            assert self.short is not None
            raise self.short
        if own not in topologies(self.modelfile, self.catalog):  # what the levers are worth
            start = self._candidate(own, middle, "the match design")
        return start, best

    def _placed(self, best: Candidate) -> Candidate:
        """The same choice with every open response at its best place."""
        spread = spread_of(self.modelfile, best.design.circuit, self.catalog)
        bench = Stretched(best.design, spread, self.seed, MANY, jobs=self.jobs, memory=self.memory)
        chosen = []
        for number, spec in enumerate(self.modelfile.responses):
            if not open_in(spec):
                chosen.append(best.found[number])
                continue
            step = self.said.stage(f"place of response {number + 1}, {spec.expect}")
            room = room_of(
                spec, self.modelfile.model.b, self.modelfile.search.band(self.modelfile.model)
            )
            ranked, tried = best_points(bench, spec, self.seen[number], room, progress=step)
            self.places += tried
            if not ranked:
                raise self._nowhere(number, spec)
            chosen.append(self._there(spec, [s.place for s in ranked]))
        setting = "; ".join(f"{r.expected}: ω = {r.omega:.5g}, b = {r.b:.4g}" for r in chosen)
        made = self._candidate(best.choice, tuple(chosen), PLACES)
        gained = made is not None and better(made.rank, best.rank)
        self._note(PLACES, setting, made, gained)
        return made if made is not None and gained else best

    def _try(self, lever: str, setting: str, choice: DesignChoice, best: Candidate) -> Candidate:
        made = self._candidate(choice, best.found, f"{lever} {setting}")
        gained = made is not None and better(made.rank, best.rank)
        self._note(lever, setting, made, gained)
        return made if made is not None and gained else best

    def _borne_out(self, best: Candidate) -> Candidate:
        """The design, or the same with a slower time scale where ngspice loses boards of it."""
        if self.listen is None:
            return best
        tried: list[tuple[Candidate, float, tuple[Agreement, ...]]] = []
        unit = self.modelfile.model.second_order().own_frequency
        frequency = best.design.errors.scales.frequency(unit)
        low, _ = self.modelfile.circuit.frequency
        for choice in (best.choice, *slower(best.choice, frequency, low)):
            made: Candidate | None = best
            if choice != best.choice:
                made = self._candidate(choice, best.found, f"time scale {_shown(choice.frequency)}")
            if made is None:
                self._note("time scale", _shown(choice.frequency), None, False)
                continue
            at = made.design.errors.scales.frequency(unit)
            step = self.said.stage(f"ngspice, rung {RUNG}, {at:.4g} Hz at ω = 1", len(made.found))
            bench = self._bench(made.choice, made.found, made.design, LISTENED)
            heard = self.listen(bench, [s.stand for s in made.scored], step)
            tried.append((made, at, heard))
            if not any(h.borne_out is False for h in heard):
                break
        told = [r for r, h in enumerate(tried[0][2]) if h.borne_out is not None]
        kept = max(tried, key=lambda t: min((t[2][r].ngspice for r in told), default=0))[0]
        for made, at, heard in tried:
            self.heard.append(Listened(at, heard, made is kept))
            said = ", ".join(str(h) for h in heard)
            self.said.note(f"  {at:.4g} Hz: boards that ngspice keeps, by response: {said}")
            if made is not best:
                self._note("time scale", _shown(made.choice.frequency), made, made is kept)
        return kept

    def _bench(
        self, choice: DesignChoice, found: Sequence[ModelResponse], design: Design, boards: int
    ) -> Stretched:
        spread = spread_of(self._resolved(choice, found), design.circuit, self.catalog)
        return Stretched(design, spread, self.seed, boards, jobs=self.jobs, memory=self.memory)

    def _candidate(
        self, choice: DesignChoice, found: tuple[ModelResponse, ...], what: str
    ) -> Candidate | None:
        """A design made so; None where there is none, and then ``short`` says why."""
        step = self.said.stage(f"candidate {self.candidates + 1}: {what}")
        self.candidates += 1
        model, spec = self.modelfile.model, choice.spec(self.modelfile.circuit)
        try:
            held = find_responses.peaks(model, found)
            design = parts_choice.synthesise(
                model, spec, self.catalog, held, found, aims=choice.aims, binding=False
            )
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
        bench = self._bench(choice, found, design, BOARDS)
        scored = tuple(
            score(
                bench, r.spec, [OperatingPoint(r.omega, r.b, r.orbit.start)], BOARDS, progress=step
            )[0]
            for r in found
        )
        self.places += len(scored)
        return Candidate(choice, design, found, scored)

    def _contributions(self, start: Candidate | None, final: Candidate) -> tuple[Contribution, ...]:
        """One lever at a time: moved from the match design, and moved back from the final one."""
        if start is None:
            return ()
        out = []
        if final.shown_at != start.shown_at:
            out.append(
                Contribution(
                    PLACES,
                    "middle of the widest window",
                    "chosen",
                    self._rank(start.choice, final.found),
                    self._rank(final.choice, start.found),
                )
            )
        slowed = bool(self.heard) and not self.heard[0].kept
        for lever in LEVERS:
            before, after = start.choice.get(lever), final.choice.get(lever)
            if before != after:
                out.append(
                    Contribution(
                        lever,
                        _shown(before),
                        _shown(after),
                        self._rank(start.choice.with_lever(lever, after), start.found),
                        self._rank(final.choice.with_lever(lever, before), final.found),
                        "ngspice" if slowed and lever == "time scale" else "exact",
                    )
                )
        return tuple(out)

    def _rank(
        self, choice: DesignChoice, found: tuple[ModelResponse, ...]
    ) -> tuple[float, float] | None:
        made = self._candidate(choice, found, "what a lever is worth")
        return None if made is None else made.rank

    def _there(self, spec: Response, ranked: Sequence[OperatingPoint]) -> ModelResponse:
        """The first of these places at which ``find_responses.find`` meets the response too."""
        model = self.modelfile.model
        for place in ranked:
            asked = replace(spec, omega=place.omega, b=place.b)
            if spec.b is None and place.b == model.b:
                asked = replace(asked, b=None)
            found = find_responses.find(model, [asked])[0]
            if found.found:
                return found
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

    def _resolved(self, choice: DesignChoice, found: Sequence[ModelResponse]) -> ModelFile:
        wanted = tuple(r.spec for r in found)
        return replace(
            self.modelfile, circuit=choice.spec(self.modelfile.circuit), responses=wanted
        )

    def _made(self, best: Candidate) -> Synthesis:
        """The final design with its certificate whole: what each condition costs included."""
        self.said.stage("the design that was found, what its conditions cost")
        model, spec = self.modelfile.model, best.choice.spec(self.modelfile.circuit)
        held = find_responses.peaks(model, best.found)
        design = parts_choice.synthesise(
            model, spec, self.catalog, held, best.found, aims=best.choice.aims
        )
        return Synthesis(self._resolved(best.choice, best.found), self.catalog, best.found, design)

    def _note(self, lever: str, setting: str, made: Candidate | None, kept: bool) -> None:
        rank = None if made is None else made.rank
        reason = str(self.short) if made is None else ""
        self.steps.append(Step(lever, setting, rank, kept, reason))
        if made is not None:
            worst = float(norm.cdf(made.rank[0]))
            self.said.note(
                f"  {lever}: {setting}: smallest distance {made.rank[0]:.2f} σ "
                f"(predicted yield {worst:.4f}){', kept' if kept else ''}"
            )


def _shown(value: object) -> str:
    if isinstance(value, tuple):
        return " to ".join(f"{v:.4g}" for v in value) + " Hz"
    return f"{value:g}" if isinstance(value, float) else str(value)
