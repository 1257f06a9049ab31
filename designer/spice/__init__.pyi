from . import (
    convergence_aids as convergence_aids,
    deck as deck,
    equation_check as equation_check,
    numerics_gate as numerics_gate,
    opamp_model as opamp_model,
    read_orbit as read_orbit,
    simulator_decks as simulator_decks,
)
from .batch_backend import (
    program_version as program_version,
)
from .convergence_aids import (
    RunQueue as RunQueue,
    Task as Task,
)
from .deck import (
    SolverSettings as SolverSettings,
    diode_cards as diode_cards,
    diode_names as diode_names,
)
from .equation_check import (
    EquationCheck as EquationCheck,
    EquationFinding as EquationFinding,
)
from .numerics_gate import (
    LEVELS as LEVELS,
    GateResult as GateResult,
    GateSubject as GateSubject,
    shortest_contact as shortest_contact,
)
from .opamp_check import (
    FigureCheck as FigureCheck,
    checks as checks,
)
from .opamp_model import (
    RUNGS as RUNGS,
    Rung as Rung,
    literal as literal,
)
from .pool import (
    SpicePool as SpicePool,
    require_ngspice as require_ngspice,
)
from .read_orbit import (
    STROBE_TOLERANCE as STROBE_TOLERANCE,
    Read as Read,
    Reading as Reading,
    clearance_rows as clearance_rows,
    name_in_ngspice as name_in_ngspice,
    read as read,
)
from .simulator import (
    SimulationFailed as SimulationFailed,
    SpiceJob as SpiceJob,
    Waveforms as Waveforms,
)
from .simulator_decks import (
    Dialect as Dialect,
    ResponseRun as ResponseRun,
    file_name as file_name,
)
