from .advice import (
    Advice as Advice,
    Replacement as Replacement,
    advise as advise,
)
from .board_fit import (
    BoardFit as BoardFit,
    NoSuchBoard as NoSuchBoard,
    fit_board as fit_board,
)
from .board_prior import (
    Prior as Prior,
)
from .channel_roles import (
    recorded_motion as recorded_motion,
)
from .fitted_board import (
    FittedBoard as FittedBoard,
    board_behind as board_behind,
)
from .fitted_quantities import (
    BoardFigure as BoardFigure,
    figures as figures,
    told_figures as told_figures,
)
from .folding import (
    samples_of as samples_of,
)
from .free_decay import (
    FreeDecay as FreeDecay,
    recorded_decay as recorded_decay,
)
from .naming import (
    NamedMotion as NamedMotion,
    named as named,
)
from .observation import (
    Observation as Observation,
    ScopeErrors as ScopeErrors,
    observe as observe,
)
from .overlay import (
    Overlay as Overlay,
    overlaid as overlaid,
)
from .prediction import (
    BoardPrediction as BoardPrediction,
    PredictedStop as PredictedStop,
)
from .record import (
    Record as Record,
    RecordedMotion as RecordedMotion,
)
from .record_formats import (
    read_record as read_record,
)
from .spread_estimate import (
    KindSpread as KindSpread,
    estimated_spread as estimated_spread,
    measured_list as measured_list,
)
