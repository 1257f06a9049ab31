from . import (
    compare_plots as compare_plots,
    compare_table as compare_table,
    comparison as comparison,
    measured_table as measured_table,
    words as words,
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
from .design_tables import (
    spring_of as spring_of,
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
