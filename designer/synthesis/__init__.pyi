from . import (
    output_loads as output_loads,
    parts_choice as parts_choice,
    side_conditions as side_conditions,
)
from .limits import (
    NO_AIMS as NO_AIMS,
    Aims as Aims,
    bandwidth_limit as bandwidth_limit,
    guaranteed as guaranteed,
)
from .operating_point import (
    Operating as Operating,
    Peak as Peak,
    operating as operating,
    stuck as stuck,
)
from .output_loads import (
    REST as REST,
    Load as Load,
    Loads as Loads,
    Run as Run,
    Sampled as Sampled,
)
from .part_checks import (
    buyable as buyable,
    check_choices as check_choices,
    diode_of as diode_of,
    opamp_of as opamp_of,
    stage_refusal as stage_refusal,
    unit_circuit as unit_circuit,
)
from .parts_choice import (
    synthesise as synthesise,
    ways_to_less_error as ways_to_less_error,
)
from .side_conditions import (
    guaranteed_swing as guaranteed_swing,
    saturating as saturating,
)
from .static_shifts import (
    Shifts as Shifts,
    Statics as Statics,
    forces as forces,
    largest_offset as largest_offset,
    least_drive as least_drive,
    leftovers as leftovers,
    offset_forces as offset_forces,
    thermal as thermal,
)
