from . import (
    bifurcation_job as bifurcation_job,
    cure_job as cure_job,
    export_job as export_job,
    folder_numbers as folder_numbers,
    origin as origin,
    rules_job as rules_job,
    search_job as search_job,
    study_job as study_job,
    synthesise_job as synthesise_job,
    trade_job as trade_job,
)
from .bifurcation_job import (
    BifurcationResult as BifurcationResult,
    bifurcation as bifurcation,
)
from .bifurcation_request import (
    Request as Request,
)
from .cure_job import (
    CureResult as CureResult,
    cure as cure,
    cure_into as cure_into,
)
from .deck_job import (
    export_decks as export_decks,
)
from .design_files import (
    load as load,
)
from .export_job import (
    ExportResult as ExportResult,
    export as export,
    export_into as export_into,
)
from .measured_job import (
    measured_into as measured_into,
)
from .options import (
    Options as Options,
)
from .origin import (
    provenance as provenance,
)
from .rules_job import (
    RulesResult as RulesResult,
    rules as rules,
)
from .search_job import (
    search as search,
    search_into as search_into,
)
from .study_folder import (
    FolderStores as FolderStores,
)
from .study_job import (
    run as run,
)
from .synthesise_job import (
    JobOutcome as JobOutcome,
    read_design as read_design,
)
from .trade_job import (
    TradeResult as TradeResult,
    trade as trade,
)
