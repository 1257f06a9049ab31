from . import (
    exact_rung as exact_rung,
    margins as margins,
    ngspice_runs as ngspice_runs,
    study_identity as study_identity,
    study_plan as study_plan,
)
from .blame_analysis import (
    Blame as Blame,
    ResponseBlame as ResponseBlame,
    blame as blame,
)
from .blame_extent import (
    BUDGET as BUDGET,
)
from .blame_pieces import (
    StoredParts as StoredParts,
)
from .blame_replay import (
    BlamedPart as BlamedPart,
)
from .blame_status import (
    BlameStage as BlameStage,
    BlameStatus as BlameStatus,
)
from .corners import (
    Corner as Corner,
)
from .dask_runner import (
    Cluster as Cluster,
)
from .exact_rung import (
    images as images,
    waveform_error as waveform_error,
)
from .joint_yield import (
    all_on_one as all_on_one,
    worst as worst,
)
from .layers import (
    CHUNK as CHUNK,
    SEARCH as SEARCH,
    Here as Here,
    Runner as Runner,
)
from .limiting_parts import (
    limiting as limiting,
    limitings as limitings,
    together as together,
)
from .margins import (
    Margin as Margin,
)
from .ngspice_runs import (
    Query as Query,
    confirm as confirm,
    hear as hear,
    way_to_rung as way_to_rung,
)
from .ngspice_sampling import (
    NOMINAL_SAMPLES as NOMINAL_SAMPLES,
    OWN_SAMPLES as OWN_SAMPLES,
    Ask as Ask,
    Hearing as Hearing,
    NgspiceVerdict as NgspiceVerdict,
    StartKind as StartKind,
    Why as Why,
    survives as survives,
)
from .power_up_yield import (
    PowerUpAnswer as PowerUpAnswer,
    reached_block as reached_block,
)
from .row_store import (
    BlockStore as BlockStore,
)
from .run_result import (
    RunResult as RunResult,
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
from .study import (
    Study as Study,
)
from .study_cache import (
    KEPT as KEPT,
    Kept as Kept,
)
from .study_identity import (
    RULES as RULES,
    blame_hash as blame_hash,
    checks_hash as checks_hash,
    nine_digits as nine_digits,
    study_hash as study_hash,
)
from .study_layers import (
    RUNGS as RUNGS,
    RungName as RungName,
    Stores as Stores,
)
from .study_plan import (
    of_yield as of_yield,
)
from .tolerance_study import (
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
    Question as Question,
    StudyPlan as StudyPlan,
    Verdict as Verdict,
    Yield as Yield,
    count as count,
    judge as judge,
    kept as kept,
)
from .yield_maps import (
    OVERS as OVERS,
    Over as Over,
    YieldMap as YieldMap,
    settle_open as settle_open,
    yield_map as yield_map,
)
