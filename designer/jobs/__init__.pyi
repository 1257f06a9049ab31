from . import (
    bench_job as bench_job,
    bifurcation_job as bifurcation_job,
    cure_job as cure_job,
    export_job as export_job,
    rules_job as rules_job,
    search_job as search_job,
    simulate_job as simulate_job,
    study_job as study_job,
    synthesise_job as synthesise_job,
    trade_job as trade_job,
)
from .export_job import (
    export as export,
)
from .job_outcome import (
    JobOutcome as JobOutcome,
)
from .options import (
    Options as Options,
)
from .rules_job import (
    rules as rules,
)
from .search_job import (
    search_into as search_into,
)
from .study_job import (
    run as run,
)
