from .fab import (
    Fab as Fab,
    fabs as fabs,
)
from .order import (
    BoardOrder as BoardOrder,
    order_files as order_files,
)
from .order_refusal import (
    not_checked as not_checked,
    refusals as refusals,
)
