from . import (
    bench_job as bench_job,
    bifurcation_job as bifurcation_job,
    cure_job as cure_job,
    export_job as export_job,
    folder_numbers as folder_numbers,
    rules_job as rules_job,
    search_job as search_job,
    search_stage as search_stage,
    study_job as study_job,
    synthesise_job as synthesise_job,
    trade_job as trade_job,
    usual_times as usual_times,
)
from .bench_job import (
    BenchedRecord as BenchedRecord,
)
from .bifurcation_job import (
    BifurcationResult as BifurcationResult,
    requested as requested,
)
from .bifurcation_request import (
    Request as Request,
)
from .cure_job import (
    CureResult as CureResult,
)
from .export_job import (
    ExportResult as ExportResult,
)
from .job_outcome import (
    JobOutcome as JobOutcome,
)
from .options import (
    Options as Options,
    stated_options as stated_options,
)
from .rules_job import (
    checked as checked,
)
from .search_job import (
    search_into as search_into,
)
from .study_job import (
    design_and_study as design_and_study,
    measured_into as measured_into,
)
