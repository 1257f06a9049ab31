from . import (
    cure_table as cure_table,
)
from .cure_branch import (
    KINDS as KINDS,
)
from .cure_branch import (
    cured as cured,
)
from .cure_branch import (
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
)
from .cure_result_json import (
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
)
from .design_search import (
    search as search,
)
from .memory import (
    Memory as Memory,
)
from .ngspice_check import (
    LEVELS as LEVELS,
)
from .ngspice_check import (
    RUNG as RUNG,
)
from .ngspice_check import (
    Listener as Listener,
)
from .resolved_file import (
    resolved as resolved,
)
from .result_json import (
    confirmation_json as confirmation_json,
)
from .result_json import (
    search_json as search_json,
)
