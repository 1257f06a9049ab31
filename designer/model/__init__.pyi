from . import (
    equations as equations,
)
from . import (
    find_responses as find_responses,
)
from . import (
    swept_model as swept_model,
)
from .board_table import (
    BoardChoice as BoardChoice,
)
from .board_table import (
    PartArray as PartArray,
)
from .circuit_table import (
    SIDE_CONDITIONS as SIDE_CONDITIONS,
)
from .circuit_table import (
    CircuitSpec as CircuitSpec,
)
from .circuit_table import (
    DeadZone as DeadZone,
)
from .distributions import (
    Binned as Binned,
)
from .distributions import (
    Law as Law,
)
from .distributions import (
    Normal as Normal,
)
from .distributions import (
    Split as Split,
)
from .distributions import (
    Uniform as Uniform,
)
from .find_responses import (
    FASTEST as FASTEST,
)
from .find_responses import (
    SLOWEST as SLOWEST,
)
from .find_responses import (
    STARTS as STARTS,
)
from .find_responses import (
    ModelResponse as ModelResponse,
)
from .find_responses import (
    Peaks as Peaks,
)
from .find_responses import (
    check_omega as check_omega,
)
from .find_responses import (
    find as find,
)
from .find_responses import (
    matches as matches,
)
from .find_responses import (
    peaks as peaks,
)
from .find_responses import (
    scale_of as scale_of,
)
from .measured_values import (
    MEASURED as MEASURED,
)
from .measured_values import (
    Measured as Measured,
)
from .measured_values import (
    read_measured as read_measured,
)
from .mechanics import (
    SecondOrderSystem as SecondOrderSystem,
)
from .model import (
    STATES as STATES,
)
from .model import (
    Dimensionless as Dimensionless,
)
from .model import (
    Mechanical as Mechanical,
)
from .model_file import (
    ModelFile as ModelFile,
)
from .model_file import (
    naming as naming,
)
from .model_file import (
    need_responses as need_responses,
)
from .model_file import (
    parse_model_file as parse_model_file,
)
from .model_file import (
    read_model_file as read_model_file,
)
from .response_table import (
    Response as Response,
)
from .search_table import (
    SearchSpec as SearchSpec,
)
from .sketch import (
    sketch as sketch,
)
from .spread_table import (
    DataSheet as DataSheet,
)
from .spread_table import (
    PartRule as PartRule,
)
from .spread_table import (
    Shape as Shape,
)
from .spread_table import (
    check_binned as check_binned,
)
from .swept_model import (
    GREATEST as GREATEST,
)
from .swept_model import (
    SMALLEST as SMALLEST,
)
from .swept_model import (
    ModelSubject as ModelSubject,
)
from .template import (
    TEXT as TEXT,
)
from .tuning_bands import (
    Bands as Bands,
)
