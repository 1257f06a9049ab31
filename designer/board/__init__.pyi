from . import (
    board_notes as board_notes,
)
from . import (
    schematic_drawing as schematic_drawing,
)
from .board_parts import (
    board_circuit as board_circuit,
)
from .bom import (
    bill as bill,
)
from .bom import (
    bill_csv as bill_csv,
)
from .bom_layouts import (
    file_of as file_of,
)
from .bom_layouts import (
    layouts as layouts,
)
from .component import (
    Component as Component,
)
from .component import (
    Numbers as Numbers,
)
from .component import (
    components as components,
)
from .component import (
    pin_numbers as pin_numbers,
)
from .component import (
    to_buy as to_buy,
)
from .kicad_footprint import (
    FILE_VERSION as FILE_VERSION,
)
from .kicad_names import (
    LIBRARY as LIBRARY,
)
from .kicad_names import (
    POWER as POWER,
)
from .kicad_names import (
    circuit_net as circuit_net,
)
from .kicad_names import (
    footprint_name as footprint_name,
)
from .kicad_names import (
    identifier as identifier,
)
from .kicad_project import (
    Project as Project,
)
from .kicad_project import (
    files as files,
)
from .kicad_reader import (
    PART_NUMBER as PART_NUMBER,
)
from .kicad_reader import (
    BoardFile as BoardFile,
)
from .kicad_reader import (
    Footprint as Footprint,
)
from .kicad_reader import (
    check_belongs as check_belongs,
)
from .kicad_reader import (
    read_board as read_board,
)
from .kicad_rules import (
    CANARY as CANARY,
)
from .kicad_rules import (
    CANARY_WIDTH as CANARY_WIDTH,
)
from .kicad_rules import (
    CustomRule as CustomRule,
)
from .kicad_rules import (
    board_rules as board_rules,
)
from .kicad_rules import (
    canary as canary,
)
from .kicad_rules import (
    rules_text as rules_text,
)
from .outline import (
    LAYER as LAYER,
)
from .pins import (
    Pin as Pin,
)
