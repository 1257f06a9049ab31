from . import (
    build as build,
)
from . import (
    drive_resistors as drive_resistors,
)
from . import (
    nominal as nominal,
)
from . import (
    paper_values as paper_values,
)
from . import (
    terms as terms,
)
from .board_arrays import (
    Boards as Boards,
)
from .board_parts_only import (
    Connector as Connector,
)
from .board_parts_only import (
    SupplyCapacitor as SupplyCapacitor,
)
from .board_parts_only import (
    TestPoint as TestPoint,
)
from .board_parts_only import (
    Trimmer as Trimmer,
)
from .coefficients import (
    EXACT as EXACT,
)
from .coefficients import (
    CoefficientErrors as CoefficientErrors,
)
from .coefficients import (
    CutShort as CutShort,
)
from .coefficients import (
    coefficient_errors as coefficient_errors,
)
from .dead_zone_kind import (
    Zone as Zone,
)
from .dead_zone_kind import (
    zone_of as zone_of,
)
from .dead_zone_parts import (
    OUTPUT as OUTPUT,
)
from .dead_zone_parts import (
    idle_limits as idle_limits,
)
from .design import (
    Certificate as Certificate,
)
from .design import (
    Check as Check,
)
from .design import (
    Design as Design,
)
from .design import (
    settings as settings,
)
from .ensemble import (
    Ensemble as Ensemble,
)
from .ensemble import (
    displacement as displacement,
)
from .netlist import (
    GROUND as GROUND,
)
from .netlist import (
    NEGATIVE as NEGATIVE,
)
from .netlist import (
    POSITIVE as POSITIVE,
)
from .netlist import (
    Board as Board,
)
from .netlist import (
    Capacitor as Capacitor,
)
from .netlist import (
    Circuit as Circuit,
)
from .netlist import (
    Diode as Diode,
)
from .netlist import (
    Excitation as Excitation,
)
from .netlist import (
    Fitting as Fitting,
)
from .netlist import (
    Generator as Generator,
)
from .netlist import (
    Part as Part,
)
from .netlist import (
    Reference as Reference,
)
from .netlist import (
    Resistor as Resistor,
)
from .netlist import (
    Section as Section,
)
from .netlist import (
    nominal_board as nominal_board,
)
from .nodal import (
    NodalEquations as NodalEquations,
)
from .nodal import (
    Solution as Solution,
)
from .noise_gains import (
    Stage as Stage,
)
from .noise_gains import (
    stages as stages,
)
from .nominal import (
    Trace as Trace,
)
from .nominal import (
    circuit_flow as circuit_flow,
)
from .nominal import (
    model_flow as model_flow,
)
from .nominal import (
    nominal_reduction as nominal_reduction,
)
from .nominal import (
    on_circuit as on_circuit,
)
from .nominal import (
    reached as reached,
)
from .nominal import (
    trace_of as trace_of,
)
from .paper_values import (
    MODEL as MODEL,
)
from .paper_values import (
    Candidate as Candidate,
)
from .reduction import (
    FloatingCircuit as FloatingCircuit,
)
from .reduction import (
    Reduction as Reduction,
)
from .resistors import (
    Composite as Composite,
)
from .resistors import (
    composites_of as composites_of,
)
from .resistors import (
    effective as effective,
)
from .rest_point import (
    at_rest as at_rest,
)
from .scale_fit import (
    minimax as minimax,
)
from .stage_title import (
    INTERFACE as INTERFACE,
)
from .stage_title import (
    SUPPLY as SUPPLY,
)
from .stage_title import (
    section_stages as section_stages,
)
from .stage_title import (
    stage_names as stage_names,
)
from .swept_board import (
    BoardSubject as BoardSubject,
)
from .terms import (
    Term as Term,
)
