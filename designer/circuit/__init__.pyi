from . import (
    build as build,
    nominal as nominal,
    paper_values as paper_values,
)
from .board_arrays import (
    Boards as Boards,
)
from .board_parts_only import (
    Connector as Connector,
    SupplyCapacitor as SupplyCapacitor,
    SupplyDiode as SupplyDiode,
    TestPoint as TestPoint,
    Trimmer as Trimmer,
)
from .board_values import Board as Board, nominal_board as nominal_board
from .build import (
    constant_resistor as constant_resistor,
)
from .coefficients import (
    EXACT as EXACT,
    LARGE_ERROR as LARGE_ERROR,
    CoefficientErrors as CoefficientErrors,
    coefficient_errors as coefficient_errors,
)
from .dead_zone_parts import (
    DeadZoneStage as DeadZoneStage,
    HalfNames as HalfNames,
    Kind as Kind,
    dead_zone_stage as dead_zone_stage,
    half_parts as half_parts,
    idle_limits as idle_limits,
    reference_sign as reference_sign,
    stage_kind as stage_kind,
)
from .dead_zone_place import (
    OUTPUT as OUTPUT,
    DeadZonePlace as DeadZonePlace,
)
from .dead_zone_reading import (
    CutShort as CutShort,
)
from .design import (
    Certificate as Certificate,
    ConditionCheck as ConditionCheck,
    Design as Design,
    GeneratorSetting as GeneratorSetting,
    settings as settings,
)
from .ensemble import (
    Ensemble as Ensemble,
    displacement as displacement,
)
from .feedback_loops import (
    feedback_share as feedback_share,
)
from .netlist import (
    GROUND as GROUND,
    NEGATIVE as NEGATIVE,
    POSITIVE as POSITIVE,
    Capacitor as Capacitor,
    Circuit as Circuit,
    Diode as Diode,
    Excitation as Excitation,
    Fitting as Fitting,
    Generator as Generator,
    Part as Part,
    Reference as Reference,
    Resistor as Resistor,
    Section as Section,
)
from .nodal import (
    Exit as Exit,
    NodalEquations as NodalEquations,
    Solution as Solution,
)
from .nodal_bandwidth import (
    swinging_sections as swinging_sections,
)
from .noise_gains import (
    SectionStage as SectionStage,
    conductance as conductance,
    stages as stages,
)
from .nominal import (
    Trace as Trace,
    circuit_flow as circuit_flow,
    nominal_reduction as nominal_reduction,
    on_circuit as on_circuit,
    record_of as record_of,
    response_flow as response_flow,
    trace_of as trace_of,
    traces_of as traces_of,
)
from .packing import (
    QUAD as QUAD,
)
from .paper_values import (
    MODEL as MODEL,
    ComparedCircuit as ComparedCircuit,
)
from .reduction import (
    FloatingCircuit as FloatingCircuit,
    Reduction as Reduction,
)
from .resistors import (
    Composite as Composite,
    composites_of as composites_of,
    effective as effective,
)
from .scale_fit import (
    least_largest as least_largest,
    minimax as minimax,
)
from .stage_title import (
    DEAD_ZONE as DEAD_ZONE,
    INTERFACE as INTERFACE,
    REFERENCES as REFERENCES,
    SUPPLY as SUPPLY,
    dead_zone_titles as dead_zone_titles,
    section_stages as section_stages,
    stage_names as stage_names,
)
from .stop import (
    Stop as Stop,
)
from .swept_board import (
    BoardSubject as BoardSubject,
)
from .terms import (
    Term as Term,
    drive_resistor as drive_resistor,
    entry_resistor as entry_resistor,
)
from .working_modes import (
    BoardModes as BoardModes,
    ModeRows as ModeRows,
    at_rest as at_rest,
    mode_rows as mode_rows,
)
