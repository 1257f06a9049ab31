from . import (
    paper_reports as paper_reports,
    reproduce_circuit as reproduce_circuit,
    reproduce_dynamics as reproduce_dynamics,
    reproduce_tolerance as reproduce_tolerance,
)
from .paper_reports import (
    PaperPart as PaperPart,
    reproduce as reproduce,
)
