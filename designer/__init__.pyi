from .base.errors import (
    DesignerError as DesignerError,
    EnvironmentMissing as EnvironmentMissing,
    InputError as InputError,
    ResponseNotFound as ResponseNotFound,
    Unreachable as Unreachable,
)
from .base.version import (
    __version__ as __version__,
)
from .catalog.parts_catalog import (
    Catalog as Catalog,
    load_catalog as load_catalog,
)
from .check.simulation import (
    Simulated as Simulated,
)
from .check.synthesis_result import (
    Synthesis as Synthesis,
)
from .folders.design_source import (
    read_design as read_design,
)
from .jobs.bifurcation_job import (
    BifurcationResult as BifurcationResult,
)
from .jobs.export_job import (
    ExportResult as ExportResult,
)
from .jobs.job_outcome import (
    JobOutcome as JobOutcome,
)
from .jobs.repair_job import (
    CureResult as CureResult,
    cure as cure,
)
from .model.model import (
    Dimensionless as Dimensionless,
    Mechanical as Mechanical,
)
from .model.model_file import (
    ModelFile as ModelFile,
    parse_model_file as parse_model_file,
    read_model_file as read_model_file,
)
from .model.response_table import (
    Response as Response,
)
from .verbs.bench import (
    BenchAnswer as BenchAnswer,
    bench as bench,
)
from .verbs.bifurcation import (
    bifurcation as bifurcation,
)
from .verbs.explore import (
    explore as explore,
)
from .verbs.export import (
    export as export,
)
from .verbs.new import (
    new as new,
)
from .verbs.reproduce import (
    reproduce as reproduce,
)
from .verbs.rules import (
    RulesResult as RulesResult,
    rules as rules,
)
from .verbs.run import (
    run as run,
)
from .verbs.search import (
    search as search,
)
from .verbs.simulate import (
    SimulationResult as SimulationResult,
    simulate as simulate,
)
from .verbs.synthesise import (
    synthesise as synthesise,
    synthesize as synthesize,
)
from .verbs.tolerance import (
    tolerance as tolerance,
)
from .verbs.trade import (
    TradeResult as TradeResult,
    trade as trade,
)
from .yields.study import (
    RunResult as RunResult,
    Study as Study,
)
