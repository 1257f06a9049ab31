from . import (
    output_loads as output_loads,
)
from . import (
    parts_choice as parts_choice,
)
from . import (
    side_conditions as side_conditions,
)
from .attempt import (
    zone_of_spec as zone_of_spec,
)
from .limits import (
    NO_AIMS as NO_AIMS,
)
from .limits import (
    Aims as Aims,
)
from .limits import (
    bandwidth_limit as bandwidth_limit,
)
from .limits import (
    guaranteed as guaranteed,
)
from .output_loads import (
    REST as REST,
)
from .output_loads import (
    Load as Load,
)
from .output_loads import (
    Loads as Loads,
)
from .output_loads import (
    Run as Run,
)
from .output_loads import (
    Sampled as Sampled,
)
from .part_names import (
    parts_of as parts_of,
)
from .parts_choice import (
    check_choices as check_choices,
)
from .parts_choice import (
    synthesise as synthesise,
)
from .side_conditions import (
    saturating as saturating,
)
from .tie_break import (
    SOLVER as SOLVER,
)
