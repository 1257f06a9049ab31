from . import (
    paper_reports as paper_reports,
)
from .report_files import (
    make_report as make_report,
    write_files as write_files,
)
