"""What all figures share: colours, style, an empty figure, SVG and PNG without a date.

Every function that draws returns a ``Figure`` of its own and touches no global state that outlives
the call: no pyplot, whatever a user's matplotlibrc says. Equal data give equal bytes (``to_svg``).
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import Any, ParamSpec

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from designer.base.arrays import Array

# After Okabe and Ito: told apart with every common form of colour blindness, and in grey by their
# line styles.
INK, MUTED, GRID, CONTACT = "#1a1a1a", "#5c5c5c", "#e3e3e3", "#f1ece0"

MODEL_COLOUR, CIRCUIT_COLOUR, NGSPICE_COLOUR, IMPACT_COLOUR = (
    "#7cc4ee",
    "#1a1a1a",
    "#d55e00",
    "#007a5a",
)

ON_DARK, ON_LIGHT = "#fefefe", "#1b1b1b"
"""Ink on areas that are filled with a colour: the same on a page of any colour."""

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same everywhere
    "font.size": 8.5,
    "axes.titlesize": 9.5,
    "axes.labelsize": 8.5,
    "axes.edgecolor": "#8a8a8a",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "figure.constrained_layout.w_pad": 0.07,
    "figure.constrained_layout.h_pad": 0.06,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "designer",
    "path.simplify": True,
    "text.parse_math": False,
}

_LONG = re.compile(r' (?:d|x|y)="[^"]*"')

_DIGITS = re.compile(r"-?\d+\.\d{3,}")

_HASHED = re.compile(r'((?: id="|href="#|url\(#)(?:p|m|h|image))([0-9a-f]{10})(?=["\)])')
"""A name that Matplotlib made of a hash: of a clip, a marker, a hatch or an image."""

P = ParamSpec("P")


@contextmanager
def style() -> Iterator[None]:
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    @wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with style():
            return draw(*args, **kwargs)

    return inside


def to_svg(figure: Figure) -> str:
    """The figure as an SVG document with text as paths: nothing is loaded, no date, no version.

    Equal data give equal bytes. Matplotlib names clips and markers by a hash of every digit of
    their place, and the layout's last digits differ from process to process: here they are
    numbered.
    """
    buffer = io.StringIO()
    nothing = {"Date": None, "Creator": None, "Format": None, "Type": None}
    with style():
        figure.savefig(buffer, format="svg", metadata=nothing)
    text = buffer.getvalue()
    return _numbered(_LONG.sub(_short, text[text.index("<svg") :]))


def to_png(figure: Figure, dpi: float = 160.0) -> bytes:
    """The figure as PNG."""
    stream = io.BytesIO()
    with style():
        figure.savefig(stream, format="png", dpi=dpi, metadata={"Software": None})
    return stream.getvalue()


def picture(figure: Figure, file_format: str, dpi: float = 160.0) -> bytes:
    """The figure as a file of the form "svg" or "png"."""
    return to_svg(figure).encode() if file_format == "svg" else to_png(figure, dpi)


def _short(attribute: re.Match[str]) -> str:
    """Coordinates to a hundredth of a point: the file is a third smaller, the picture the same."""
    return _DIGITS.sub(lambda m: f"{float(m[0]):.2f}", attribute[0])


def _numbered(document: str) -> str:
    """The same document with hashed names replaced by numbers, in order of appearance."""
    numbers: dict[str, int] = {}
    return _HASHED.sub(lambda m: f"{m[1]}{numbers.setdefault(m[2], len(numbers) + 1)}", document)


def new_figure(width: float, height: float) -> Figure:
    """Size in inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def say(axes: Axes, text: str) -> None:
    axes.set_axis_off()
    axes.text(0.5, 0.5, text, ha="center", va="center", color=MUTED, transform=axes.transAxes)


def axis_limits(values: Array, gaps: Sequence[float]) -> tuple[float, float]:
    """Axis limits that show all values and all stops with a margin."""
    low, high = min(float(values.min()), *gaps, 0.0), max(float(values.max()), *gaps, 0.0)
    margin = 0.08 * (high - low) or 1.0
    return low - margin, high + margin


def shade_stops(
    axes: Axes,
    stops: Sequence[tuple[int, float]],
    limits: tuple[float, float],
    *,
    across: bool = False,
) -> None:
    """Shade what lies beyond each stop, up to the axis limits.

    stops : (side, where it stands), 1 for an upper and -1 for a lower one. They and the limits are
    of x, or of y if ``across``.
    """
    span, line = (axes.axhspan, axes.axhline) if across else (axes.axvspan, axes.axvline)
    for side, gap in stops:
        span(gap, limits[1] if side > 0 else limits[0], color=CONTACT, lw=0, zorder=0)
        line(gap, color=MUTED, lw=0.8, zorder=1)


def state_plane(
    axes: Axes, curves: Iterable[Array], stops: Sequence[tuple[int, float]]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """The limits of x and of y that show all curves (points, 2) and all stops, and are set; shaded
    is what lies beyond a stop. stops : as ``shade_stops`` has them."""
    every = np.concatenate([np.zeros((1, 2)), *curves])
    xlim, ylim = axis_limits(every[:, 0], [gap for _, gap in stops]), axis_limits(every[:, 1], ())
    shade_stops(axes, stops, xlim)
    axes.set_xlim(*xlim)
    axes.set_ylim(*ylim)
    return xlim, ylim


def plain_numbers(*axis: Axis) -> None:
    """Numbers without exponents at the decades of a logarithmic axis, and none between."""
    for each in axis:
        each.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.10g}"))
        each.set_minor_formatter(NullFormatter())


def number_cells(axes: Axes, values: Array, *, least: float = 0.0, size: float = 7) -> None:
    """Write whole per cents into the cells of an image in ``cividis``, those from ``least`` on."""
    for i, j in np.argwhere(np.isfinite(values) & (values >= least)):
        ink = ON_DARK if values[i, j] < 55.0 else ON_LIGHT
        text = f"{values[i, j]:.0f}"
        axes.text(j, i, text, ha="center", va="center", color=ink, size=size)


def name_rows(axes: Axes, names: Sequence[str], *, rules: bool = False) -> None:
    """A row for each name, the first at the top; rules : lines between them."""
    axes.set_yticks(range(len(names)), list(names), color=INK)
    axes.set_ylim(max(len(names), 1) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", color=GRID, lw=0.7)
    for i in range(1, len(names) if rules else 0):
        axes.axhline(i - 0.5, color=GRID, lw=0.7)
