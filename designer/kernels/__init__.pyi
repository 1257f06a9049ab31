from . import (
    kernel_boards as kernel_boards,
    kernel_general as kernel_general,
    kernel_modal as kernel_modal,
    kernel_mode_tables as kernel_mode_tables,
    kernel_orbit as kernel_orbit,
    kernel_propagators as kernel_propagators,
    kernel_sweep as kernel_sweep,
)
from .kernel_algebra import (
    exponential_terms as exponential_terms,
    factor as factor,
    motion_terms as motion_terms,
    rows_of_terms as rows_of_terms,
    substitute as substitute,
)
from .kernel_boards import (
    POINTS as POINTS,
    Anchors as Anchors,
)
from .kernel_crossing import (
    BLOCK_STEP as BLOCK_STEP,
    LAST as LAST,
    NODES as NODES,
    PARTS as PARTS,
    TERMS as TERMS,
)
from .kernel_general import (
    Log as Log,
    ModeTables as ModeTables,
)
from .kernel_modal import (
    ModalTables as ModalTables,
    Watch as Watch,
)
from .kernel_orbit import (
    CHAOS as CHAOS,
    CLOSING as CLOSING,
    DONE as DONE,
    FOUND as FOUND,
    LEFT as LEFT,
    NEAR as NEAR,
    STROBE_TOLERANCE as STROBE_TOLERANCE,
    WORTH as WORTH,
)
from .kernel_propagators import (
    RunTrail as RunTrail,
)
from .kernel_sweep import (
    ALIGN as ALIGN,
    SPAN as SPAN,
)
