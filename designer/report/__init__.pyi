from . import (
    bifurcation_plots as bifurcation_plots,
)
from . import (
    compare_plots as compare_plots,
)
from . import (
    compare_table as compare_table,
)
from . import (
    comparison as comparison,
)
from . import (
    measured_table as measured_table,
)
from . import (
    simulate_plots as simulate_plots,
)
from .bifurcation_plots import (
    BLACK as BLACK,
)
from .bifurcation_plots import (
    MARKS as MARKS,
)
from .bifurcation_plots import (
    RED as RED,
)
from .compare_json import (
    comparison_json as comparison_json,
)
from .compare_json import (
    file_json as file_json,
)
from .compare_json import (
    in_answer as in_answer,
)
from .compare_table import (
    EXACT as EXACT,
)
from .comparison import (
    compare as compare,
)
from .data import (
    ReportData as ReportData,
)
from .map_writer import (
    files as files,
)
from .write import (
    write_report as write_report,
)
