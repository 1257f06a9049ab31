from . import (
    bifurcation_plots as bifurcation_plots,
    blame_plots as blame_plots,
    captions as captions,
    curve_plots as curve_plots,
    map_plots as map_plots,
    model_drawing as model_drawing,
    orbit_plots as orbit_plots,
    point_captions as point_captions,
    simulate_plots as simulate_plots,
    study_plots as study_plots,
    system_drawing as system_drawing,
    titles as titles,
)
from .map_plots import (
    map_files as map_files,
)
from .point_captions import (
    caption as caption,
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
from .study_plots import (
    VERDICTS as VERDICTS,
    stop_curve as stop_curve,
)
from .titles import (
    NAMES as NAMES,
    curves_title as curves_title,
    title as title,
)
