from . import (
    on_board as on_board,
    rule_reports as rule_reports,
    run_rules as run_rules,
)
from .kicad_drc import (
    OPEN as OPEN,
    SHORT as SHORT,
)
from .kicad_program import (
    KicadFailed as KicadFailed,
    call as call,
    kicad_version as kicad_version,
    last_words as last_words,
    needed_version as needed_version,
)
from .subject import (
    RuleSubject as RuleSubject,
)
