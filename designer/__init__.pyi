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
from .catalog.catalog import (
    Catalog as Catalog,
    load_catalog as load_catalog,
)
from .check.simulation import (
    Simulated as Simulated,
)
from .check.synthesis_result import (
    Synthesis as Synthesis,
)
from .explorer.server import (
    explore as explore,
)
from .folders.design_source import (
    read_design as read_design,
)
from .jobs.bench_job import (
    BenchAnswer as BenchAnswer,
    bench as bench,
)
from .jobs.bifurcation_job import (
    BifurcationResult as BifurcationResult,
    bifurcation as bifurcation,
)
from .jobs.cure_job import (
    CureResult as CureResult,
    cure as cure,
)
from .jobs.export_job import (
    ExportResult as ExportResult,
    export as export,
)
from .jobs.job_outcome import (
    JobOutcome as JobOutcome,
)
from .jobs.rules_job import (
    RulesResult as RulesResult,
    rules as rules,
)
from .jobs.search_job import (
    search as search,
)
from .jobs.simulate_job import (
    SimulationResult as SimulationResult,
    simulate as simulate,
)
from .jobs.study_job import (
    run as run,
    tolerance as tolerance,
)
from .jobs.synthesise_job import (
    synthesise as synthesise,
    synthesize as synthesize,
)
from .jobs.trade_job import (
    TradeResult as TradeResult,
    trade as trade,
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
from .model.template import (
    new as new,
)
from .paper.paper_reports import (
    reproduce as reproduce,
)
from .yields.study import (
    RunResult as RunResult,
    Study as Study,
)
