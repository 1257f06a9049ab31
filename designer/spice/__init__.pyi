from . import (
    convergence_aids as convergence_aids,
)
from . import (
    deck as deck,
)
from . import (
    equation_check as equation_check,
)
from . import (
    numerics_gate as numerics_gate,
)
from . import (
    opamp_model as opamp_model,
)
from . import (
    read_orbit as read_orbit,
)
from . import (
    simulator_decks as simulator_decks,
)
from .backends import (
    ngspice_version as ngspice_version,
)
from .batch_backend import (
    program_version as program_version,
)
from .deck import (
    SolverSettings as SolverSettings,
)
from .equation_check import (
    EquationCheck as EquationCheck,
)
from .equation_check import (
    Finding as Finding,
)
from .job import (
    SpiceJob as SpiceJob,
)
from .numerics_gate import (
    GateResult as GateResult,
)
from .numerics_gate import (
    Subject as Subject,
)
from .numerics_gate import (
    shortest_contact as shortest_contact,
)
from .opamp_check import (
    Check as Check,
)
from .opamp_check import (
    checks as checks,
)
from .opamp_model import (
    RUNGS as RUNGS,
)
from .opamp_model import (
    Rung as Rung,
)
from .pool import (
    SpicePool as SpicePool,
)
from .pool import (
    require_ngspice as require_ngspice,
)
from .read_orbit import (
    STROBE_TOLERANCE as STROBE_TOLERANCE,
)
from .read_orbit import (
    Read as Read,
)
from .read_orbit import (
    Reading as Reading,
)
from .read_orbit import (
    read as read,
)
from .simulator import (
    SimulationFailed as SimulationFailed,
)
from .simulator import (
    Sweep as Sweep,
)
from .simulator import (
    Waveforms as Waveforms,
)
from .simulator_decks import (
    Dialect as Dialect,
)
from .simulator_decks import (
    ResponseRun as ResponseRun,
)
from .simulator_decks import (
    file_name as file_name,
)
