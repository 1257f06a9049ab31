from . import (
    cross_check as cross_check,
    exact_rung as exact_rung,
    ngspice_runs as ngspice_runs,
)
from .cross_check import (
    BOUNDARY_SAMPLES as BOUNDARY_SAMPLES,
    NOMINAL_SAMPLES as NOMINAL_SAMPLES,
    OWN_SAMPLES as OWN_SAMPLES,
    SLOW as SLOW,
    UNDECIDED as UNDECIDED,
    Ask as Ask,
    CrossCheck as CrossCheck,
    NgspiceVerdict as NgspiceVerdict,
    StartKind as StartKind,
    Why as Why,
    margin_share as margin_share,
    survives as survives,
)
from .exact_rung import (
    Case as Case,
    images as images,
    settled as settled,
    waveform_error as waveform_error,
)
from .ngspice_runs import (
    Query as Query,
    cross_checks as cross_checks,
    run_queries as run_queries,
    way_to_rung as way_to_rung,
)
from .rung_gate import gated as gated
from .verdict import (
    BLOCK as BLOCK,
    Answer as Answer,
    BoardRow as BoardRow,
    Question as Question,
    StudyPlan as StudyPlan,
    Verdict as Verdict,
    judge as judge,
    rounded as rounded,
)
