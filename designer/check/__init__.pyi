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
from .deck_notes import (
    circuit_notes as circuit_notes,
    simulator_notes as simulator_notes,
)
from .deck_runs import (
    response_runs as response_runs,
)
from .first_responses import (
    FirstRun as FirstRun,
    first_run as first_run,
)
from .simulation import (
    Engine as Engine,
    Simulated as Simulated,
)
from .synthesis_result import (
    Synthesis as Synthesis,
    synthesise as synthesise,
)
from .trust import (
    WORDS as WORDS,
    Trust as Trust,
)
