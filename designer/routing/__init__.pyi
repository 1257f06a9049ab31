from .routed_board import (
    RoutedBoard as RoutedBoard,
    route_board as route_board,
)
