from . import (
    paper_reports as paper_reports,
)
