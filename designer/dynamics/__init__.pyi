from . import (
    attractors as attractors,
    harmonics as harmonics,
    modal_tables as modal_tables,
    step_budget as step_budget,
    working_modes as working_modes,
)
from .attractors import (
    ENGINE_ERROR as ENGINE_ERROR,
    STROBE_TOLERANCE as STROBE_TOLERANCE,
    describe as describe,
    mirrored_strobes as mirrored_strobes,
    peaks_near as peaks_near,
    same as same,
    settle as settle,
    shoot as shoot,
    starts as starts,
    twin as twin,
    with_exponent as with_exponent,
)
from .coexisting_attractors import (
    coexisting as coexisting,
    outlived as outlived,
    settled as settled,
)
from .continued_orbit import (
    ContinuedOrbit as ContinuedOrbit,
    Function as Function,
    follow as follow,
    functions as functions,
    valleys as valleys,
)
from .counts import (
    MAX_PERIOD as MAX_PERIOD,
    Counts as Counts,
    Pairs as Pairs,
    period_of as period_of,
    read_counts as read_counts,
)
from .drive_shape import (
    SINE as SINE,
    Channel as Channel,
    Shape as Shape,
    channels as channels,
    has_harmonics as has_harmonics,
    wave as wave,
)
from .drive_states import (
    with_drive_states as with_drive_states,
)
from .flow import MAX_EVENTS as MAX_EVENTS, Flow as Flow
from .flow_result import FlowResult as FlowResult, FlowStatus as FlowStatus
from .lyapunov_exponent import (
    batch_error as batch_error,
)
from .modal_tables import (
    WORST_RESONANCE as WORST_RESONANCE,
    Oscillators as Oscillators,
)
from .mode_tables import (
    augmented as augmented,
    augmented_row as augmented_row,
    augmented_state as augmented_state,
    step_length as step_length,
)
from .orbit import (
    ANSWERS as ANSWERS,
    MOST_COUNTED as MOST_COUNTED,
    SETTLED as SETTLED,
    SURE as SURE,
    SYMMETRY_TOLERANCE as SYMMETRY_TOLERANCE,
    WITHOUT_PERIOD as WITHOUT_PERIOD,
    Complex as Complex,
    Motion as Motion,
    Orbit as Orbit,
    OrbitStatus as OrbitStatus,
    failed as failed,
    largest_speeds as largest_speeds,
)
from .piecewise_linear import (
    Drive as Drive,
    ForceCorner as ForceCorner,
    Guard as Guard,
    Mode as Mode,
    ModeKey as ModeKey,
    PiecewiseLinearSystem as PiecewiseLinearSystem,
    SecondDrive as SecondDrive,
    motion_of_states as motion_of_states,
)
from .steady_state import (
    UPPER as UPPER,
    DrivenSystem as DrivenSystem,
    SteadyMotion as SteadyMotion,
    TransientSettings as TransientSettings,
    stopped as stopped,
)
from .step_budget import (
    Budget as Budget,
)
from .turning_points import (
    corner_crossings as corner_crossings,
    heights as heights,
    turning_points_of as turning_points_of,
)
from .working_modes import (
    ANCHORS as ANCHORS,
    MOST_STATES as MOST_STATES,
    GuardTargets as GuardTargets,
    drive_of as drive_of,
    driven as driven,
    empty_modes as empty_modes,
    grown as grown,
)
