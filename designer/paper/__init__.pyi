from . import (
    reproduce_circuit as reproduce_circuit,
    reproduce_dynamics as reproduce_dynamics,
    reproduce_tolerance as reproduce_tolerance,
)
