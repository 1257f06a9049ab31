from . import (
    checked_design as checked_design,
    simulation as simulation,
    synthesis_result as synthesis_result,
)
from .checked_design import (
    CheckedResponse as CheckedResponse,
    traces as traces,
)
from .coexistence import (
    beside as beside,
)
from .deck_runs import (
    FirstRun as FirstRun,
    circuit_notes as circuit_notes,
    first_run as first_run,
    response_runs as response_runs,
    simulator_notes as simulator_notes,
)
from .motion_record import (
    PowerSpectrum as PowerSpectrum,
    power_spectrum as power_spectrum,
    section as section,
)
from .simulation import (
    Engine as Engine,
    Simulated as Simulated,
)
from .synthesis_result import (
    Synthesis as Synthesis,
    synthesise as synthesise,
    with_stage as with_stage,
)
from .trust import (
    WORDS as WORDS,
    Trust as Trust,
)
