from . import (
    export as export,
    rules as rules,
    run as run,
)
from .declared import (
    GROUPS as GROUPS,
    Show as Show,
    Verb as Verb,
    Word as Word,
)
