from . import (
    random_streams as random_streams,
)
from .board_quantities import (
    Quantity as Quantity,
    between as between,
    column as column,
    exact_in as exact_in,
    quantities as quantities,
    with_column as with_column,
)
from .part_grades import (
    BetterGrade as BetterGrade,
    arrays as arrays,
    better_grades as better_grades,
    better_grades_text as better_grades_text,
    bought as bought,
    once_otherwise as once_otherwise,
)
from .part_rules import (
    check_names as check_names,
    spread_of as spread_of,
)
from .random_streams import (
    uniforms as uniforms,
)
from .spread import (
    BOARD as BOARD,
    NO_BANDWIDTH as NO_BANDWIDTH,
    Spread as Spread,
    draw_many as draw_many,
    part_of as part_of,
)
