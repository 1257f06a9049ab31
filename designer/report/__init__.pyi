from . import (
    compare_plots as compare_plots,
    compare_table as compare_table,
    comparison as comparison,
    measured_table as measured_table,
)
from .comparison import (
    compare as compare,
    comparison_json as comparison_json,
    file_json as file_json,
    in_answer as in_answer,
)
from .data import (
    ReportData as ReportData,
)
from .inserted import (
    inserted_html as inserted_html,
    inserted_markdown as inserted_markdown,
)
from .record_page import (
    record_page_html as record_page_html,
)
from .verb_sections import (
    SECTIONS as SECTIONS,
    bench_section as bench_section,
    is_whole as is_whole,
    older_section as older_section,
)
from .write import (
    write_report as write_report,
)
