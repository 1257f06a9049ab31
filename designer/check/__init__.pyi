from . import (
    checked_design as checked_design,
)
from . import (
    simulation as simulation,
)
from . import (
    synthesis_result as synthesis_result,
)
from .checked_design import (
    Checked as Checked,
)
from .checked_design import (
    traces as traces,
)
from .deck_notes import (
    circuit_notes as circuit_notes,
)
from .deck_notes import (
    simulator_notes as simulator_notes,
)
from .first_responses import (
    FirstRun as FirstRun,
)
from .first_responses import (
    first_run as first_run,
)
from .response_runs import (
    response_runs as response_runs,
)
from .simulation import (
    Simulated as Simulated,
)
from .simulation import (
    simulate as simulate,
)
from .synthesis_result import (
    Synthesis as Synthesis,
)
from .synthesis_result import (
    synthesise as synthesise,
)
from .trust import (
    WORDS as WORDS,
)
from .trust import (
    Trust as Trust,
)
