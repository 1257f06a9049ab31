from . import (
    basins as basins,
)
from . import (
    captions as captions,
)
from . import (
    parameter_map as parameter_map,
)
from . import (
    sweep as sweep,
)
from . import (
    window_ends as window_ends,
)
from .basins import (
    SAME as SAME,
)
from .basins import (
    BasinPlan as BasinPlan,
)
from .basins import (
    Basins as Basins,
)
from .branch_survey import (
    Survey as Survey,
)
from .branch_survey import (
    survey as survey,
)
from .continuation import (
    Branch as Branch,
)
from .continuation import (
    End as End,
)
from .doubling_cascade import (
    Cascade as Cascade,
)
from .doubling_cascade import (
    cascade as cascade,
)
from .flow_family import (
    Family as Family,
)
from .parameter_map import (
    Cell as Cell,
)
from .parameter_map import (
    MapPlan as MapPlan,
)
from .parameter_map import (
    ParameterMap as ParameterMap,
)
from .points import (
    Bifurcation as Bifurcation,
)
from .points import (
    Kind as Kind,
)
from .store import (
    GridStore as GridStore,
)
from .store import (
    SweepStore as SweepStore,
)
from .store import (
    work_hash as work_hash,
)
from .store import (
    write_sweep as write_sweep,
)
from .subject import (
    Subject as Subject,
)
from .sweep import (
    DOWN as DOWN,
)
from .sweep import (
    UP as UP,
)
from .sweep import (
    Sweep as Sweep,
)
from .sweep import (
    SweepPlan as SweepPlan,
)
from .sweep import (
    Window as Window,
)
from .titles import (
    NAMES as NAMES,
)
from .titles import (
    title as title,
)
from .windows import (
    NOT_LOCATED as NOT_LOCATED,
)
from .windows import (
    BranchWindow as BranchWindow,
)
from .windows import (
    all_windows as all_windows,
)
from .windows import (
    outside as outside,
)
