from .board_quantities import (
    Quantity as Quantity,
)
from .board_quantities import (
    between as between,
)
from .board_quantities import (
    column as column,
)
from .board_quantities import (
    exact_in as exact_in,
)
from .board_quantities import (
    quantities as quantities,
)
from .board_quantities import (
    with_column as with_column,
)
from .part_grades import (
    BetterGrade as BetterGrade,
)
from .part_grades import (
    arrays as arrays,
)
from .part_grades import (
    better_grades as better_grades,
)
from .part_grades import (
    better_grades_text as better_grades_text,
)
from .part_grades import (
    bought as bought,
)
from .part_grades import (
    once_otherwise as once_otherwise,
)
from .part_rules import (
    check_names as check_names,
)
from .part_rules import (
    spread_of as spread_of,
)
from .random_streams import (
    uniforms as uniforms,
)
from .spread import (
    BOARD as BOARD,
)
from .spread import (
    NO_BANDWIDTH as NO_BANDWIDTH,
)
from .spread import (
    Spread as Spread,
)
from .spread import (
    draw_many as draw_many,
)
from .spread import (
    part_of as part_of,
)
