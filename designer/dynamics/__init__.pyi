from . import (
    attractors as attractors,
)
from . import (
    harmonics as harmonics,
)
from . import (
    kernel_four_state as kernel_four_state,
)
from . import (
    kernel_modal as kernel_modal,
)
from . import (
    modal_tables as modal_tables,
)
from . import (
    working_modes as working_modes,
)
from .attractors import (
    STROBE_TOLERANCE as STROBE_TOLERANCE,
)
from .attractors import (
    coexisting as coexisting,
)
from .attractors import (
    describe as describe,
)
from .attractors import (
    mirrored_strobes as mirrored_strobes,
)
from .attractors import (
    peaks_near as peaks_near,
)
from .attractors import (
    settle as settle,
)
from .attractors import (
    starts as starts,
)
from .attractors import (
    twin as twin,
)
from .continued_orbit import (
    Followed as Followed,
)
from .continued_orbit import (
    Function as Function,
)
from .continued_orbit import (
    follow as follow,
)
from .continued_orbit import (
    functions as functions,
)
from .continued_orbit import (
    valleys as valleys,
)
from .flow import (
    MAX_EVENTS as MAX_EVENTS,
)
from .flow import (
    Flow as Flow,
)
from .flow import (
    FlowResult as FlowResult,
)
from .flow import (
    FlowStatus as FlowStatus,
)
from .kernel_four_state import (
    POINTS as POINTS,
)
from .kernel_modal import (
    LAST as LAST,
)
from .kernel_modal import (
    NODES as NODES,
)
from .kernel_modal import (
    PARTS as PARTS,
)
from .kernel_modal import (
    TERMS as TERMS,
)
from .kernel_modal import (
    ModalTables as ModalTables,
)
from .modal_tables import (
    STEP as STEP,
)
from .modal_tables import (
    WORST_RESONANCE as WORST_RESONANCE,
)
from .modal_tables import (
    Oscillators as Oscillators,
)
from .orbit import (
    ANSWERS as ANSWERS,
)
from .orbit import (
    MAX_PERIOD as MAX_PERIOD,
)
from .orbit import (
    SYMMETRY_TOLERANCE as SYMMETRY_TOLERANCE,
)
from .orbit import (
    Complex as Complex,
)
from .orbit import (
    Orbit as Orbit,
)
from .orbit import (
    OrbitStatus as OrbitStatus,
)
from .orbit import (
    failed as failed,
)
from .piecewise_linear import (
    Drive as Drive,
)
from .piecewise_linear import (
    Guard as Guard,
)
from .piecewise_linear import (
    Mode as Mode,
)
from .piecewise_linear import (
    ModeKey as ModeKey,
)
from .piecewise_linear import (
    PiecewiseLinearSystem as PiecewiseLinearSystem,
)
from .steady_state import (
    Course as Course,
)
from .steady_state import (
    Setting as Setting,
)
from .steady_state import (
    Steady as Steady,
)
from .turning_points import (
    heights as heights,
)
from .working_modes import (
    STATES as STATES,
)
from .working_modes import (
    empty_modes as empty_modes,
)
