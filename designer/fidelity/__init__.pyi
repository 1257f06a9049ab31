from . import (
    pieces as pieces,
)
from . import (
    runge_kutta as runge_kutta,
)
from . import (
    rungs as rungs,
)
from . import (
    trade_files as trade_files,
)
from . import (
    yields as yields,
)
from .cpu_clock import (
    Entrant as Entrant,
)
from .cpu_clock import (
    SpiceClock as SpiceClock,
)
from .cpu_clock import (
    here as here,
)
from .cpu_clock import (
    rounds as rounds,
)
from .label import (
    Label as Label,
)
from .pieces import (
    CHUNK as CHUNK,
)
from .pieces import (
    PIECES as PIECES,
)
from .pieces import (
    Pieces as Pieces,
)
from .pieces import (
    read_pieces as read_pieces,
)
from .rung_errors import (
    BOARD as BOARD,
)
from .rung_errors import (
    compare as compare,
)
from .runge_kutta import (
    PAPERS_STEP as PAPERS_STEP,
)
from .rungs import (
    CIRCUIT as CIRCUIT,
)
from .rungs import (
    LEVELS as LEVELS,
)
from .rungs import (
    ROUNDS as ROUNDS,
)
from .trade_files import (
    sheet as sheet,
)
from .trade_files import (
    trade_json as trade_json,
)
from .trade_study import (
    SHARE as SHARE,
)
from .trade_study import (
    Response as Response,
)
from .trade_study import (
    Trade as Trade,
)
from .trade_study import (
    trade as trade,
)
from .yields import (
    BOARDS as BOARDS,
)
from .yields import (
    BoardTrade as BoardTrade,
)
from .yields import (
    LeftOut as LeftOut,
)
from .yields import (
    Tally as Tally,
)
