from . import (
    equations as equations,
    find_responses as find_responses,
    swept_model as swept_model,
)
from .absolute_motion import (
    absolute_extremes as absolute_extremes,
)
from .ascii_sketch import (
    sketch as sketch,
    system_sketch as system_sketch,
)
from .board_table import (
    BoardChoice as BoardChoice,
    BoardSpec as BoardSpec,
    PartArray as PartArray,
)
from .circuit_table import (
    SIDE_CONDITIONS as SIDE_CONDITIONS,
    CircuitSpec as CircuitSpec,
    DeadZone as DeadZone,
)
from .distributions import (
    Binned as Binned,
    Distribution as Distribution,
    Normal as Normal,
    Split as Split,
    Uniform as Uniform,
)
from .driven import (
    model_flow as model_flow,
)
from .find_responses import (
    STARTS as STARTS,
    ModelResponse as ModelResponse,
    Peaks as Peaks,
    Reach as Reach,
    find as find,
    matches as matches,
    need_found as need_found,
    peaks as peaks,
    scale_of as scale_of,
)
from .lumped_elements import (
    GROUND as GROUND,
    Damper as Damper,
    Gap as Gap,
    Spring as Spring,
)
from .lumped_system import (
    LumpedSystem as LumpedSystem,
)
from .measured_values import (
    MEASURED as MEASURED,
    MeasuredBoards as MeasuredBoards,
    read_measured as read_measured,
)
from .mechanics import (
    POSITIONS as POSITIONS,
    Clearance as Clearance,
    MechanicalModel as MechanicalModel,
    SecondOrderSystem as SecondOrderSystem,
    Side as Side,
    Sides as Sides,
    check_omega as check_omega,
    frequency_range as frequency_range,
    state_names as state_names,
)
from .model import (
    GREATEST as GREATEST,
    SMALLEST as SMALLEST,
    Dimensionless as Dimensionless,
    Mechanical as Mechanical,
    SiScales as SiScales,
)
from .model_file import (
    MAX_BYTES as MAX_BYTES,
    ModelFile as ModelFile,
    naming as naming,
    need_responses as need_responses,
    parse_model_file as parse_model_file,
    read_model_file as read_model_file,
)
from .relative_motion import (
    RelativeMotion as RelativeMotion,
    companion_motions as companion_motions,
    different_motions as different_motions,
    ground_of as ground_of,
    mass_motion as mass_motion,
    relative_motions as relative_motions,
    shown_stops as shown_stops,
    state_labels as state_labels,
    subscripted as subscripted,
)
from .response_table import (
    Response as Response,
    placed as placed,
)
from .search_table import (
    SearchSpec as SearchSpec,
)
from .si_units import (
    MECHANICAL_UNITS as MECHANICAL_UNITS,
    NO_UNITS as NO_UNITS,
    Reader as Reader,
    angular_frequency as angular_frequency,
    hertz_json as hertz_json,
    in_si as in_si,
    mechanism_json as mechanism_json,
    units_of as units_of,
)
from .spread_table import (
    DataSheet as DataSheet,
    PartRule as PartRule,
    SpreadShape as SpreadShape,
    check_binned as check_binned,
)
from .swept_model import (
    ModelSubject as ModelSubject,
    of_model as of_model,
)
from .system_equations import (
    element_rows as element_rows,
    equations_of as equations_of,
    hertz_notes as hertz_notes,
    number_of as number_of,
)
from .template import (
    SCHEMA as SCHEMA,
    SECOND as SECOND,
    TEXT as TEXT,
    write_model_file as write_model_file,
)
from .tuning_bands import (
    Bands as Bands,
)
