from . import (
    reproduce_circuit as reproduce_circuit,
    reproduce_dynamics as reproduce_dynamics,
    reproduce_tolerance as reproduce_tolerance,
)
from .report_files import (
    make_report as make_report,
    write_files as write_files,
)
