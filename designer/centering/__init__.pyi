from . import (
    cure_table as cure_table,
    stage_choice as stage_choice,
)
from .answer_cache import (
    AnswerCache as AnswerCache,
)
from .cure_branch import (
    KINDS as KINDS,
    cured as cured,
    kind_named as kind_named,
)
from .cure_measure import (
    Book as Book,
)
from .cure_plots import (
    front_chart as front_chart,
)
from .cure_result_json import (
    cure_json as cure_json,
    front_csv as front_csv,
)
from .cure_search import (
    find_cure as find_cure,
)
from .cure_upgrade import (
    Upgrades as Upgrades,
)
from .design_search import (
    look as look,
    search as search,
)
from .limiting_parts import (
    limitings as limitings,
)
from .ngspice_check import (
    LEVELS as LEVELS,
    RUNG as RUNG,
    Listener as Listener,
)
from .resolved_file import (
    resolved as resolved,
)
from .result_json import (
    confirmation_json as confirmation_json,
    search_json as search_json,
)
