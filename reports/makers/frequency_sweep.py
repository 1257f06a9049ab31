"""What a model shows over the drive frequency, the attractor followed down and up."""

from __future__ import annotations

import numpy as np

from designer.base.page import Table, table
from designer.base.si_unit import Unit
from designer.bifurcations import sweep
from designer.bifurcations.sweep import DOWN, UP, SweepPlan, Window
from designer.dynamics.steady_state import TransientSettings
from designer.model.model_file import ModelFile
from designer.model.swept_model import ModelSubject
from designer.plots import bifurcation_plots
from reports.makers.evidence import Evidence, figure_block

STEPS = 240
COURSE = TransientSettings(settle=240, keep=16)
"""Less than a diagram on the screen asks for: the windows named here are wide."""
NAMED = 12
"""Windows in the table, the widest."""


def frequency_sweep(file: ModelFile, jobs: int) -> Evidence:
    """The part of a report about what is reached at each frequency."""
    low, high = _range(file)
    plan = SweepPlan(
        ModelSubject(file.model, scales=file.si),
        "omega",
        np.linspace(low, high, STEPS),
        course=COURSE,
        **sweep.follow(DOWN, UP),
    )
    result = sweep.run(plan, jobs)
    widest = sorted(result.windows, key=lambda w: w.low - w.high)[:NAMED]
    # A diagram of a model in SI units is over hertz.
    si = plan.subject.si["omega"] if plan.subject.units else Unit("", 1.0)
    text = (
        f"{STEPS} frequencies from {si.scale * low:.4g} to {si.scale * high:.4g}"
        f"{si.name and f' {si.name}'}, the attractor followed down and up. "
        f"The table has the {NAMED} widest windows."
    )
    name = "frequency-sweep"
    blocks = [text, _table(widest, si), figure_block(name, "Over the drive frequency.")]
    figure = bifurcation_plots.diagram(result, name=file.title)
    return Evidence("Over the drive frequency", blocks, {name: figure})


def _range(file: ModelFile) -> tuple[float, float]:
    """From well below the first mode to above the last one, with the stops half the time met, and
    above every response that is wanted."""
    system = file.model.second_order()
    wanted = [1.1 * response.omega for response in file.responses if response.omega is not None]
    off, on = system.natural_frequencies(), system.natural_frequencies(closed=True)
    highest = 1.4 * float((2.0 * off * on / (off + on))[-1])
    return 0.4 * float(off[0]), max([highest, *wanted])


def _table(windows: list[Window], unit: Unit) -> Table | None:
    rows = [
        (
            w.response,
            _symmetry(w),
            f"{unit.scale * w.low:.4g}",
            f"{unit.scale * w.high:.4g}",
            w.track,
        )
        for w in sorted(windows, key=lambda w: (w.track, w.low))
    ]
    from_, to = (
        ("from ω", "to ω") if not unit.name else (f"from [{unit.name}]", f"to [{unit.name}]")
    )
    head = ("response", "kind", from_, to, "followed")
    return table(head, rows, numeric=(2, 3))


def _symmetry(window: Window) -> str:
    return {True: "symmetric", False: "not symmetric", None: ""}[window.symmetric]
