from . import (
    on_board as on_board,
    rule_reports as rule_reports,
    run_rules as run_rules,
)
from .kicad_drc import (
    kicad_version as kicad_version,
)
from .subject import (
    RuleSubject as RuleSubject,
)
