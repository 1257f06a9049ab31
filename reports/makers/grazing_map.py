"""The map over one drive period near a grazing orbit: what a first, shallow contact does to it.

A mass m on a spring and a damper d grazes a stop with the acceleration -α. A start that would pass
it by δ is turned back, and leaves the contact with its velocity changed by Δv and its displacement
by Δx. To leading order, with the stop's stiffness k, damper c and preload P (the force with which
it pushes as soon as it is touched),

    relaxed (P = 0)     Δv = -(k - cd/m) S/m,   Δx = -c S/m,   S = (4√2/3) δ^1.5/√α
    pre-stressed        Δv = -2 P/(P + mα) √(2αδ)

where S is the displacement past the stop, integrated over the contact. The contact lasts
τ = 2√(2δ/α), or 2√(2αδ)/(α + P/m); its damper makes the determinant of the map's Jacobian
exp(-cτ/m) times as large. The trace changes by N₁₂ dΔv/dδ + N₁₁ dΔx/dδ, where N is the map of the
open system and N₁₂ = exp(-ζω₀T) sin(ω_d T)/ω_d. Those are the singularities that Kundu, Banerjee,
Ing, Pavlovskaia and Wiercigroch describe (Physica D 241, 553, 2012).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure
from scipy.linalg import expm

from designer.base.arrays import Array
from designer.base.figure_style import GRID, INK, MUTED, new_figure, styled
from designer.base.page import table
from designer.dynamics.flow import Flow
from designer.model.driven import model_flow
from designer.model.lumped_system import LumpedSystem
from designer.model.model_file import ModelFile
from reports.makers.evidence import (
    Comparison,
    Evidence,
    Example,
    comparison_table,
    figure_block,
)
from reports.makers.first_grazing import first_grazings, linear_state

DEPTHS = np.geomspace(1e-8, 1e-3, 11)
"""δ over the gap."""
FITTED = slice(0, 5)
"""Of ``DEPTHS``: where the powers are taken; the leading order holds the better the shallower."""


@dataclass(frozen=True)
class StopKind:
    """One of the four stops that are looked at."""

    name: str
    """In words."""
    preload: float
    """Its preload over the stiffness times the gap."""
    damping: float
    """Of contact, over the critical one of the open oscillator."""


STOPS = (
    StopKind("relaxed", 0.0, 0.0),
    StopKind("pre-stressed", 1.0, 0.0),
    StopKind("relaxed, with a damper", 0.0, 1.0),
    StopKind("pre-stressed, with a damper", 1.0, 1.0),
)


@dataclass(frozen=True)
class GrazingMap:
    """What is measured of one stop, with the closed forms beside it."""

    stop: StopKind
    kicks: Array
    """(DEPTHS,) change Δv of the velocity at the contact."""
    traces: Array
    """(DEPTHS,) change of the trace of the Jacobian."""
    determinants: Array
    """(DEPTHS,) determinant of the Jacobian over that of the open system."""
    expected: Array
    """(DEPTHS, 3) closed forms of these three, to leading order."""

    @property
    def kick_power(self) -> float:
        """Power of δ in the map."""
        return _power(self.kicks)

    @property
    def trace_power(self) -> float:
        """Power of δ in the trace."""
        return _power(self.traces)


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about the two singularities, for the file's first response."""
    assert isinstance(file.model, LumpedSystem)
    omega = file.responses[0].omega
    assert omega is not None
    maps = [grazing_map(file.model, omega, stop) for stop in STOPS]
    compared = tuple(c for each in maps for c in _compared(each))
    text = (
        "The upper stop alone is looked at, at the gap at which it is first touched. Starts near "
        "the grazing orbit that would pass the stop by δ are followed over one drive period. The "
        "map differs from that of the open system by a change of velocity at the contact. Its "
        "power of δ is 3/2 at a relaxed stop and 1/2 at a pre-stressed one, so that the trace of "
        "the Jacobian changes with the powers 1/2 and −1/2. The determinant is continuous: "
        "without a damper in the contact it does not change, with one it falls exponentially with "
        "the time in contact. That is what Kundu and others (2012) derive."
    )
    rows = [
        (m.stop.name, f"{m.kick_power:.4f}", f"{m.trace_power:.4f}", f"{m.determinants[-1]:.6f}")
        for m in maps
    ]
    deepest = f"determinant at δ = {DEPTHS[-1]:.0e} of the gap, over the open one's"
    name = "near-grazing"
    blocks = [
        text,
        table(("stop", "power of δ in the map", "in the trace", deepest), rows, (1, 2, 3)),
        f"At δ = {DEPTHS[0]:.0e} of the gap, against the closed forms to leading order:",
        comparison_table(compared, 6),
        figure_block(
            name, "Change of the map, of the trace and of the determinant; lines: closed forms."
        ),
    ]
    return [Evidence("Two singularities", blocks, {name: _figure(maps)}, compared)]


def grazing_map(model: LumpedSystem, omega: float, stop: StopKind) -> GrazingMap:
    """Measure the map of one mass and its upper stop alone at the factor b of the first touch."""
    model = replace(model, gaps=(replace(model.gaps[0], lower=None, lower_stiffness=None),))
    grazing = model.changed({"b": first_grazings(model, omega)[0].b})
    name, system = grazing.gaps[0].name, grazing.second_order()
    side = system.clearances[0].first
    critical = 2.0 * float(system.mass[0]) * system.own_frequency
    preload = stop.preload * side.stiffness * side.gap
    changes = {f"{name}.preload": preload / grazing.b, f"{name}.damping": stop.damping * critical}
    flow = model_flow(grazing.changed(changes), omega)
    start, depths = linear_state(grazing, omega), DEPTHS * side.gap
    moment = _time_of_grazing(flow, start)
    A = flow.system.mode(flow.system.start).A
    before, after = expm(A * moment), expm(A * (flow.drive.period - moment))
    kicks, traces, determinants = [], [], []
    for depth in depths:
        offset = np.linalg.solve(before, [depth, 0.0])
        run = flow.run(start + offset, 1, tangent=np.eye(2))
        assert run.tangent is not None
        off = run.strobes[-1] - start - after @ before @ offset
        kicks.append(np.linalg.solve(after, off)[1])
        traces.append(np.trace(run.tangent) - np.trace(after @ before))
        determinants.append(np.linalg.det(run.tangent) / np.linalg.det(after @ before))
    mass, alpha = float(system.mass[0]), omega**2 * side.gap
    contact = _Contact(
        mass,
        alpha,
        side.stiffness,
        preload,
        stop.damping * critical,
        float(system.damping[0, 0]),
    )
    expected = _leading(depths, contact, after @ before)
    return GrazingMap(stop, np.array(kicks), np.array(traces), np.array(determinants), expected)


@dataclass(frozen=True)
class _Contact:
    """The symbols of the module's text, in its order."""

    m: float
    alpha: float
    k: float
    P: float
    c: float
    d: float


def _leading(depths: Array, contact: _Contact, N: Array) -> Array:
    """(depths, 3) the closed forms of the module's text."""
    m, alpha, P, c = contact.m, contact.alpha, contact.P, contact.c
    root = np.sqrt(2.0 * alpha * depths)
    if P:
        kick, shift, power = -2.0 * P / (P + m * alpha) * root, 0.0 * depths, 0.5
    else:
        S = (4.0 * math.sqrt(2.0) / 3.0) * depths**1.5 / math.sqrt(alpha)
        kick, shift, power = -(contact.k - c * contact.d / m) * S / m, -c * S / m, 1.5
    lasting = 2.0 * root / (alpha + P / m)
    trace = power * (N[0, 1] * kick + N[0, 0] * shift) / depths
    return np.column_stack([kick, trace, np.exp(-c * lasting / m)])


def _time_of_grazing(flow: Flow, start: Array) -> float:
    """Time at which the linear response is farthest out, in the first drive period.

    The displacement is (x - c) = R sin(ωt + φ), with R cos φ = v/ω and R sin φ = x - c at t = 0;
    c = 0 as nothing is constant.
    """
    omega = flow.drive.omega
    phase = math.atan2(start[0], start[1] / omega)
    return float((0.5 * math.pi - phase) % (2.0 * math.pi)) / omega


def _power(values: Array) -> float:
    """Slope of ln |values| over ln δ."""
    depths, some = np.log(DEPTHS[FITTED]), np.log(np.abs(values[FITTED]))
    return float(np.polyfit(depths, some, 1)[0])


def _compared(measured: GrazingMap) -> list[Comparison]:
    """At the shallowest contact."""
    kick, trace, determinant = (float(v) for v in measured.expected[0])
    name = measured.stop.name
    return [
        Comparison(f"{name}: change of velocity", kick, float(measured.kicks[0])),
        Comparison(f"{name}: change of the trace", trace, float(measured.traces[0])),
        Comparison(f"{name}: determinant", determinant, float(measured.determinants[0])),
    ]


@styled
def _figure(maps: Sequence[GrazingMap]) -> Figure:
    figure = new_figure(9.4, 3.4)
    kick, trace, fall = figure.subplots(1, 3)
    for number, each in enumerate(maps):
        ink = {"color": ("#0072b2", "#d55e00", "#56b4e9", "#e69f00")[number], "ls": ""}
        look = {**ink, "marker": "oosd"[number], "ms": 6.5 - 1.5 * (number > 1), "mfc": "none"}
        kick.loglog(DEPTHS, -each.kicks, label=each.stop.name, **look)
        trace.loglog(DEPTHS, np.abs(each.traces), **look)
        fall.semilogx(DEPTHS, each.determinants, **look)
        for axes, column in zip((kick, trace, fall), each.expected.T, strict=True):
            axes.plot(DEPTHS, np.abs(column), color=MUTED, lw=0.8, zorder=0)
    titles = ("−Δv at the contact", "|change of the trace|", "determinant, over the open one's")
    for axes, text in zip((kick, trace, fall), titles, strict=True):
        axes.set_title(text, color=INK)
        axes.set_xlabel("δ over the gap")
        axes.grid(True, color=GRID, lw=0.5)
        axes.set_xticks([1e-8, 1e-6, 1e-4], ["1e-8", "1e-6", "1e-4"])
        axes.minorticks_off()
    for axes in (kick, trace):
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:.0e}")
    figure.legend(loc="outside lower center", ncols=4)
    return figure


EXAMPLE = Example(
    evidence,
    see="A relaxed stop begins to push from zero, a pre-stressed one with a finite force. Near "
    "grazing the first changes the trace of the Jacobian by a square root, the second by an "
    "inverse square root, which has no bound: this is what makes a pre-stressed stop lose its "
    "orbit at the first touch.",
    board="The pre-stressed stop and the damper are for comparison in the model alone; a circuit "
    "has such a stop with a push that rises over a depth (prestressed.toml). The board is of the "
    "file as it stands: a relaxed stop above, and below one that the mass rests against.",
)
