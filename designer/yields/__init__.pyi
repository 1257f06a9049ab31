from . import (
    margins as margins,
    study_identity as study_identity,
)
from .adjustment import (
    AS_BUILT as AS_BUILT,
    Adjustment as Adjustment,
    centring_offset as centring_offset,
    widths as widths,
)
from .blame_analysis import (
    Blame as Blame,
    BlameStage as BlameStage,
    BlameStatus as BlameStatus,
    NearLimit as NearLimit,
    ResponseBlame as ResponseBlame,
    blame as blame,
)
from .blame_replay import (
    BUDGET as BUDGET,
    BlamedPart as BlamedPart,
)
from .layers import (
    LAYERS as LAYERS,
    LayerName as LayerName,
    LocalRunner as LocalRunner,
    Runner as Runner,
    Step as Step,
    Task as Task,
)
from .margins import (
    DRAWN as DRAWN,
    Crossing as Crossing,
    Limit as Limit,
    Margin as Margin,
    Prediction as Prediction,
)
from .power_up import (
    PowerUp as PowerUp,
    power_up_block as power_up_block,
)
from .row_store import (
    BlockStore as BlockStore,
)
from .setting_search import (
    MOST_TRIES as MOST_TRIES,
    BoardCase as BoardCase,
    seek as seek,
)
from .start_recipe import (
    Recipe as Recipe,
    hertz as hertz,
    volts as volts,
)
from .start_recipe_search import (
    find_recipes as find_recipes,
)
from .stored_parts import (
    StoredParts as StoredParts,
)
from .study import (
    RunResult as RunResult,
    Study as Study,
    plan_study as plan_study,
    trust_of_yield as trust_of_yield,
)
from .study_identity import (
    RULES as RULES,
    blame_hash as blame_hash,
    checks_hash as checks_hash,
    nine_digits as nine_digits,
    study_hash as study_hash,
)
from .tolerance_study import (
    Stores as Stores,
    check as check,
    tolerance as tolerance,
)
from .trimmed_yield import (
    HIGH as HIGH,
    LOW as LOW,
    DcTrim as DcTrim,
    Trimmed as Trimmed,
    dc_trim as dc_trim,
    trimmed_answers as trimmed_answers,
    trimmed_boards as trimmed_boards,
)
from .tuned_yield import (
    Tuned as Tuned,
    benched_block as benched_block,
    tuned_block as tuned_block,
)
from .two_engine_yield import (
    Combined as Combined,
)
from .window_path import (
    find_window as find_window,
)
from .worst_corner import (
    Corner as Corner,
    Index as Index,
)
from .yield_count import (
    Yield as Yield,
    all_on_one as all_on_one,
    count as count,
    count_verdicts as count_verdicts,
    reasons as reasons,
    worst as worst,
)
from .yield_maps import (
    Axis as Axis,
    YieldMap as YieldMap,
    settle_open as settle_open,
    yield_map as yield_map,
)
