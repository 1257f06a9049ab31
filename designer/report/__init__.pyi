from . import (
    bifurcation_plots as bifurcation_plots,
    compare_plots as compare_plots,
    compare_table as compare_table,
    comparison as comparison,
    curve_plots as curve_plots,
    measured_table as measured_table,
    orbit_plots as orbit_plots,
    simulate_plots as simulate_plots,
    system_drawing as system_drawing,
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
from .map_plots import (
    map_files as map_files,
)
from .record_page import (
    record_page_html as record_page_html,
)
from .record_plots import (
    record_figure as record_figure,
)
from .response_colours import (
    BLACK as BLACK,
    MARKS as MARKS,
    RED as RED,
    palette_legend as palette_legend,
    response_palette as response_palette,
)
from .verb_sections import (
    SECTIONS as SECTIONS,
    older_section as older_section,
)
from .write import (
    write_report as write_report,
)
