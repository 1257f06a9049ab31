from . import (
    output_loads as output_loads,
    parts_choice as parts_choice,
    side_conditions as side_conditions,
)
from .attempt import (
    to_choose_from as to_choose_from,
    zone_of_spec as zone_of_spec,
)
from .limits import (
    NO_AIMS as NO_AIMS,
    Aims as Aims,
    bandwidth_limit as bandwidth_limit,
    guaranteed as guaranteed,
)
from .output_loads import (
    REST as REST,
    Load as Load,
    Loads as Loads,
    Run as Run,
    Sampled as Sampled,
)
from .part_choice import (
    diode_of as diode_of,
    opamp_of as opamp_of,
)
from .part_names import (
    parts_of as parts_of,
)
from .parts_choice import (
    check_choices as check_choices,
    synthesise as synthesise,
)
from .side_conditions import (
    saturating as saturating,
)
from .tie_break import (
    SOLVER as SOLVER,
)
