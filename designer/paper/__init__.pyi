from . import (
    paper_reports as paper_reports,
)
from .report_files import (
    write_files as write_files,
)
