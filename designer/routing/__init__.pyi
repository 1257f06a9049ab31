from .board_layers import (
    INNER as INNER,
    layer_count as layer_count,
    with_layers as with_layers,
)
from .routed_board import (
    RoutedBoard as RoutedBoard,
    route_board as route_board,
)
from .specctra import (
    design_text as design_text,
    with_session as with_session,
)
