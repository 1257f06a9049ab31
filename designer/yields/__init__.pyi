from . import (
    exact_rung as exact_rung,
    margins as margins,
    ngspice_runs as ngspice_runs,
    study_identity as study_identity,
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
from .cross_check import (
    NOMINAL_SAMPLES as NOMINAL_SAMPLES,
    OWN_SAMPLES as OWN_SAMPLES,
    Ask as Ask,
    CrossCheck as CrossCheck,
    NgspiceVerdict as NgspiceVerdict,
    StartKind as StartKind,
    Why as Why,
    survives as survives,
)
from .exact_rung import (
    images as images,
    waveform_error as waveform_error,
)
from .layers import (
    LAYERS as LAYERS,
    Here as Here,
    LayerName as LayerName,
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
from .ngspice_runs import (
    Query as Query,
    cross_checks as cross_checks,
    run_queries as run_queries,
    way_to_rung as way_to_rung,
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
    STUDY_ENGINES as STUDY_ENGINES,
    Stores as Stores,
    StudyEngine as StudyEngine,
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
from .verdict import (
    BLOCK as BLOCK,
    Answer as Answer,
    BoardRow as BoardRow,
    Question as Question,
    StudyPlan as StudyPlan,
    Verdict as Verdict,
    Yield as Yield,
    all_on_one as all_on_one,
    count as count,
    count_verdicts as count_verdicts,
    judge as judge,
    reasons as reasons,
    rounded as rounded,
    worst as worst,
)
from .worst_corner import (
    Corner as Corner,
    Index as Index,
)
from .yield_maps import (
    OVERS as OVERS,
    Axis as Axis,
    Over as Over,
    YieldMap as YieldMap,
    settle_open as settle_open,
    yield_map as yield_map,
)
