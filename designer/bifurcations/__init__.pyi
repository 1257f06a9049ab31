from . import (
    basin_shares as basin_shares,
    basins as basins,
    border_curves as border_curves,
    parameter_map as parameter_map,
    response_region as response_region,
    sweep as sweep,
    window_ends as window_ends,
)
from .attractor_list import (
    SAME as SAME,
)
from .basin_shares import (
    AttractorShare as AttractorShare,
    BasinShares as BasinShares,
    SharePlan as SharePlan,
    Step as Step,
)
from .basins import (
    BasinPlan as BasinPlan,
    Basins as Basins,
)
from .block_store import (
    KeptBlocks as KeptBlocks,
)
from .border_curve import (
    BorderCurve as BorderCurve,
    CurveMeeting as CurveMeeting,
    CurveOrigin as CurveOrigin,
    read_curve as read_curve,
)
from .border_curves import (
    BLOCKS as BLOCKS,
    CurvePlan as CurvePlan,
)
from .branch_survey import (
    Survey as Survey,
    survey as survey,
)
from .continuation import (
    Branch as Branch,
    End as End,
)
from .curve_switch import (
    OtherCurve as OtherCurve,
)
from .doubling_cascade import (
    Cascade as Cascade,
    cascade as cascade,
)
from .flow_family import (
    Family as Family,
    FlowPlane as FlowPlane,
)
from .grazing_contact import (
    GrazingContact as GrazingContact,
)
from .parameter_map import (
    MapCell as MapCell,
    MapPlan as MapPlan,
    ParameterMap as ParameterMap,
)
from .plane_curves import (
    PlaneWindow as PlaneWindow,
)
from .points import (
    SIDES as SIDES,
    Bifurcation as Bifurcation,
    Birth as Birth,
    PointKind as PointKind,
)
from .response_region import (
    EDGE as EDGE,
    ResponseRegion as ResponseRegion,
    SpreadBox as SpreadBox,
)
from .subject import (
    ShownStop as ShownStop,
    Subject as Subject,
)
from .sweep import (
    BLOCK as BLOCK,
    DOWN as DOWN,
    UP as UP,
    Sweep as Sweep,
    SweepPlan as SweepPlan,
    Window as Window,
    next_start as next_start,
)
from .window_ends import (
    LEAST_STEPS as LEAST_STEPS,
    NOT_SOUGHT as NOT_SOUGHT,
    SweptEnd as SweptEnd,
    WindowEnds as WindowEnds,
)
from .windows import (
    NOT_LOCATED as NOT_LOCATED,
    BranchWindow as BranchWindow,
    WindowEnd as WindowEnd,
    all_windows as all_windows,
    outside as outside,
    window as window,
)
