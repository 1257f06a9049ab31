"""README.md of the report on the paper's dynamics."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from designer.base.page import Block, Page, PageSection, Picture, Table, bullets, table
from designer.bifurcations.branch_survey import Survey
from designer.bifurcations.continuation import End
from designer.bifurcations.doubling_cascade import Cascade
from designer.bifurcations.windows import NOT_LOCATED, BranchWindow
from designer.dynamics.orbit import Orbit
from designer.paper.statements import Statement, main_windows

KINDS = ("S", "AS")
CAPTIONS = {
    "branches": "Followed branches: least x1 of each orbit over ω; solid where stable.",
    "fig3": "Fig. 3: phase portraits of 1-p-p, symmetric and as twins in black and red; shaded: "
    "contact.",
    "fig2a": "Fig. 2(a): ω from 0.1 to 1.8, attractor followed down and up.",
    "fig2b": "Fig. 2(b): the windows at low ω.",
    "fig2c": "Fig. 2(c): around the pitchfork of 1-1-1.",
}


@dataclass(frozen=True)
class Dynamics:
    """Everything that was measured."""

    survey: Survey
    """The branches, with their bifurcation points."""
    windows: tuple[BranchWindow, ...]
    """The windows in which responses are stable."""
    cascades: Mapping[int, Cascade]
    """Period-doubling cascades by p of the main window."""
    after: Mapping[tuple[int, str], str]
    """Response right beyond an end of a main window, by its p and "S low", "S high", "AS low" or
    "AS high"."""
    shared: Mapping[float, tuple[str, ...]]
    """By ω, the coexisting responses."""
    chatter: tuple[tuple[float, Orbit], ...]
    """(ω, orbit) of the response from rest."""
    statements: tuple[Statement, ...]
    """What the paper says, and what is found here."""


def dynamics_page(
    dynamics: Dynamics, pictures: Iterable[str], command: str, *, first: float, starts: int
) -> Page:
    """The page. pictures : their names without endings. first : ω at which the branch of
    symmetric orbits begins. starts : initial states at each ω of ``shared``."""
    head = [
        Markup(f"Made by `{command}`; the data are in `dynamics.json` and `branches.parquet`."),
        "The model is the corrected Eq. (4) with the paper's parameters; ω falls from right to "
        "left. Points and ends of windows are located on the exact flow, to 1e-8 or better; five "
        "digits are shown. S is symmetric, AS stands for the two asymmetric twins.",
    ]
    statements = table(
        ("paper", "found", "verdict", "shown by"),
        [
            (Markup(s.paper), Markup(s.found), Markup(f"**{s.verdict}**"), Markup(f"`{s.command}`"))
            for s in dynamics.statements
        ],
    )
    coexisting = [(f"{w:g}", ", ".join(names)) for w, names in dynamics.shared.items()]
    sections = [
        PageSection("What the paper says, and what is found", [statements]),
        PageSection(
            "Windows of 1-p-p",
            [
                "The widest window of each kind on the branches followed: the symmetric branch "
                f"through 1-1-1 at ω = {first}, and what leaves it. Responses that these do not "
                "lead to are not looked for here; some stand below, under what coexists. What lies "
                "outside is what the last orbit settles to 5e-4 (relative) past the end.",
                _main_windows(dynamics),
            ],
        ),
        PageSection(
            "Cascades",
            [
                "From the main symmetric window of each p, as ω falls:",
                bullets(c.describe() for c in dynamics.cascades.values()),
            ],
        ),
        PageSection(
            "What coexists",
            [
                f"From {starts} starts at each ω (mirror twins count as one, aperiodic motions are "
                "not told apart):",
                table(("ω", "attractors"), coexisting),
            ],
        ),
        PageSection(
            "Narrower windows of 1-p-p and other responses of period 1", [_narrower(dynamics)]
        ),
        PageSection("Pictures", _pictures(dynamics, pictures)),
    ]
    return Page("The paper's Sections 3 and 4, measured", head, sections)


def _main_windows(dynamics: Dynamics) -> Table | None:
    rows = []
    for p in range(1, 9):
        for one, kind in zip(main_windows(dynamics.windows, p), KINDS, strict=True):
            if one is None:
                rows.append((str(p), kind, "none on the branches followed", *[""] * 5))
                continue
            ends = [
                (f"{end.value:.5f}", end.why, dynamics.after[p, f"{kind} {side}"])
                for side, end in (("low", one.low), ("high", one.high))
            ]
            rows.append((str(p), kind, *ends[0], *ends[1]))
    columns = ("p", "kind", "from ω", "ended by", "outside", "to ω", "ended by", "outside")
    return table(columns, rows)


def _narrower(dynamics: Dynamics) -> Table | None:
    main = [w for p in range(1, 9) for w in main_windows(dynamics.windows, p)]
    rows = [
        (
            f"{w.response} {KINDS[0] if w.symmetric else KINDS[1]}",
            f"{w.low.value:.6f}",
            w.low.why,
            f"{w.high.value:.6f}",
            w.high.why,
        )
        for w in dynamics.windows
        if w not in main and w.response.startswith("1-")
    ]
    return table(("response", "from ω", "ended by", "to ω", "ended by"), rows)


def _pictures(dynamics: Dynamics, names: Iterable[str]) -> list[Block]:
    branches = dynamics.survey.branches
    lost = sum(b.ends.count(End.LOST) for b in branches)
    unseen = [w for w in dynamics.windows if NOT_LOCATED in (w.low.why, w.high.why)]
    text = (
        f"{len(branches)} branches were followed, {sum(len(b.points) for b in branches)} orbits "
        f"in all; {lost} of their ends are for want of convergence. {len(unseen)} of the "
        f"{len(dynamics.windows)} windows, those of longer periods included, end where no "
        f"bifurcation was located{_named(unseen)}."
    )
    return [text, *(Picture(CAPTIONS[n], CAPTIONS[n], f"{n}.png") for n in names)]


def _named(windows: Sequence[BranchWindow]) -> str:
    if not windows:
        return ""
    names = [f"{w.response} from ω = {w.low.value:.6f} to {w.high.value:.6f}" for w in windows]
    return f" ({'; '.join(names)})"
