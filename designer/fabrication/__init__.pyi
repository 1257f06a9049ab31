from .board_cost import (
    CostEstimate as CostEstimate,
    cost_estimate as cost_estimate,
    cost_markdown as cost_markdown,
    cost_or_none as cost_or_none,
    cost_words as cost_words,
)
from .board_picture import (
    Side as Side,
    board_svg as board_svg,
)
from .interactive_bom import (
    bom_page as bom_page,
)
from .order import (
    BoardOrder as BoardOrder,
    order_files as order_files,
)
from .order_refusal import (
    accepted_failures as accepted_failures,
    check_accepted as check_accepted,
    not_checked as not_checked,
    refusals as refusals,
)
