from . import (
    reproduce_circuit as reproduce_circuit,
)
from . import (
    reproduce_dynamics as reproduce_dynamics,
)
from . import (
    reproduce_tolerance as reproduce_tolerance,
)
