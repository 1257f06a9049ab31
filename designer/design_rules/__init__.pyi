from . import (
    junit as junit,
)
from . import (
    on_board as on_board,
)
from . import (
    run_rules as run_rules,
)
from .kicad_drc import (
    kicad_version as kicad_version,
)
from .subject import (
    Subject as Subject,
)
