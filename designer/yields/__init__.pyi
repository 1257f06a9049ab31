from . import (
    exact_rung as exact_rung,
)
from . import (
    margins as margins,
)
from . import (
    ngspice_runs as ngspice_runs,
)
from . import (
    study_identity as study_identity,
)
from . import (
    study_plan as study_plan,
)
from .blame_analysis import (
    Blame as Blame,
)
from .blame_analysis import (
    ResponseBlame as ResponseBlame,
)
from .blame_analysis import (
    blame as blame,
)
from .blame_extent import (
    BUDGET as BUDGET,
)
from .blame_pieces import (
    Pieces as Pieces,
)
from .blame_replay import (
    Subject as Subject,
)
from .blame_status import (
    BlameStage as BlameStage,
)
from .blame_status import (
    BlameStatus as BlameStatus,
)
from .dask_runner import (
    Cluster as Cluster,
)
from .exact_rung import (
    images as images,
)
from .exact_rung import (
    waveform_error as waveform_error,
)
from .joint_yield import (
    all_on_one as all_on_one,
)
from .joint_yield import (
    worst as worst,
)
from .layers import (
    CHUNK as CHUNK,
)
from .layers import (
    SEARCH as SEARCH,
)
from .layers import (
    Here as Here,
)
from .layers import (
    Runner as Runner,
)
from .limiting_parts import (
    limiting as limiting,
)
from .limiting_parts import (
    limitings as limitings,
)
from .limiting_parts import (
    together as together,
)
from .margins import (
    Margin as Margin,
)
from .ngspice_runs import (
    Query as Query,
)
from .ngspice_runs import (
    confirm as confirm,
)
from .ngspice_runs import (
    hear as hear,
)
from .ngspice_runs import (
    way_to_rung as way_to_rung,
)
from .ngspice_sampling import (
    NOMINAL_SAMPLES as NOMINAL_SAMPLES,
)
from .ngspice_sampling import (
    OWN_SAMPLES as OWN_SAMPLES,
)
from .ngspice_sampling import (
    Ask as Ask,
)
from .ngspice_sampling import (
    Hearing as Hearing,
)
from .ngspice_sampling import (
    Kind as Kind,
)
from .ngspice_sampling import (
    Outcome as Outcome,
)
from .ngspice_sampling import (
    Why as Why,
)
from .ngspice_sampling import (
    survives as survives,
)
from .power_up_yield import (
    Reached as Reached,
)
from .power_up_yield import (
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
)
from .start_recipe import (
    hertz as hertz,
)
from .start_recipe import (
    volts as volts,
)
from .start_recipe_search import (
    find_recipes as find_recipes,
)
from .study import (
    SAMPLES as SAMPLES,
)
from .study import (
    SEED as SEED,
)
from .study import (
    Study as Study,
)
from .study_cache import (
    KEPT as KEPT,
)
from .study_cache import (
    Kept as Kept,
)
from .study_identity import (
    RULES as RULES,
)
from .study_identity import (
    blame_hash as blame_hash,
)
from .study_identity import (
    checks_hash as checks_hash,
)
from .study_identity import (
    nine_digits as nine_digits,
)
from .study_identity import (
    study_hash as study_hash,
)
from .study_layers import (
    RUNGS as RUNGS,
)
from .study_layers import (
    RungName as RungName,
)
from .study_layers import (
    Stores as Stores,
)
from .study_plan import (
    of_yield as of_yield,
)
from .tolerance_study import (
    check as check,
)
from .tolerance_study import (
    tolerance as tolerance,
)
from .trimmed_yield import (
    HIGH as HIGH,
)
from .trimmed_yield import (
    LOW as LOW,
)
from .trimmed_yield import (
    DcTrim as DcTrim,
)
from .trimmed_yield import (
    Trimmed as Trimmed,
)
from .trimmed_yield import (
    dc_trim as dc_trim,
)
from .trimmed_yield import (
    trimmed_answers as trimmed_answers,
)
from .trimmed_yield import (
    trimmed_boards as trimmed_boards,
)
from .tuned_yield import (
    Tuned as Tuned,
)
from .tuned_yield import (
    benched_block as benched_block,
)
from .tuned_yield import (
    tuned_block as tuned_block,
)
from .two_engine_yield import (
    Combined as Combined,
)
from .verdict import (
    BLOCK as BLOCK,
)
from .verdict import (
    Answer as Answer,
)
from .verdict import (
    Question as Question,
)
from .verdict import (
    StudyPlan as StudyPlan,
)
from .verdict import (
    Verdict as Verdict,
)
from .verdict import (
    Yield as Yield,
)
from .verdict import (
    count as count,
)
from .verdict import (
    judge as judge,
)
from .verdict import (
    kept as kept,
)
from .yield_maps import (
    OVERS as OVERS,
)
from .yield_maps import (
    Over as Over,
)
from .yield_maps import (
    YieldMap as YieldMap,
)
from .yield_maps import (
    settle_open as settle_open,
)
from .yield_maps import (
    yield_map as yield_map,
)
