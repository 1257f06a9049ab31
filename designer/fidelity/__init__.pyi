from . import (
    pieces as pieces,
    runge_kutta as runge_kutta,
    rungs as rungs,
    trade_files as trade_files,
    yields as yields,
)
from .cpu_clock import (
    Entrant as Entrant,
    SpiceClock as SpiceClock,
    here as here,
    rounds as rounds,
)
from .label import (
    ResponseLabel as ResponseLabel,
)
from .pieces import (
    CHUNK as CHUNK,
    PIECES as PIECES,
    TradePieces as TradePieces,
    read_pieces as read_pieces,
)
from .rung_errors import (
    BOARD as BOARD,
    compare as compare,
)
from .runge_kutta import (
    PAPERS_STEP as PAPERS_STEP,
)
from .rungs import (
    CIRCUIT as CIRCUIT,
    LEVELS as LEVELS,
    ROUNDS as ROUNDS,
    TOP as TOP,
    VENDOR as VENDOR,
    Truths as Truths,
)
from .trade_files import (
    sheet as sheet,
    trade_json as trade_json,
)
from .trade_study import (
    SHARE as SHARE,
    Trade as Trade,
    TradedResponse as TradedResponse,
    trade as trade,
)
from .yields import (
    BoardTrade as BoardTrade,
    LeftOut as LeftOut,
    Tally as Tally,
)
