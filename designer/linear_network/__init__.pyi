from . import (
    linear_search as linear_search,
)
from .linear_block import (
    errors_of as errors_of,
)
from .linear_terms import (
    ANY as ANY,
    Bounds as Bounds,
    LinearBlock as LinearBlock,
    LinearQuestion as LinearQuestion,
    Shortfall as Shortfall,
    Targets as Targets,
)
from .milp import (
    NODES as NODES,
    PRICE_WEIGHT as PRICE_WEIGHT,
    SOLVER as SOLVER,
    chosen_row as chosen_row,
    distinct_values as distinct_values,
)
from .solver_check import (
    solver_words as solver_words,
)
