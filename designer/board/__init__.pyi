from . import (
    board_notes as board_notes,
    kicad_sim as kicad_sim,
    kicad_symbols as kicad_symbols,
    placement_drawing as placement_drawing,
)
from .board_check import (
    check_board as check_board,
)
from .board_facts import (
    BoardFacts as BoardFacts,
    check_edge as check_edge,
    facts_of as facts_of,
)
from .board_parts import (
    Designed as Designed,
    board_circuit as board_circuit,
    trimmed_clearance as trimmed_clearance,
)
from .bom import (
    Line as Line,
    bill as bill,
    bill_csv as bill_csv,
    bill_of_materials as bill_of_materials,
)
from .bom_layouts import (
    Layout as Layout,
    file_of as file_of,
    layouts as layouts,
)
from .component import (
    Component as Component,
    Numbers as Numbers,
    components as components,
    designator as designator,
    pin_numbers as pin_numbers,
    to_buy as to_buy,
)
from .footprints import (
    FootprintShape as FootprintShape,
    footprint as footprint,
)
from .kicad_board import (
    board as board,
    layers as layers,
    revision as revision,
)
from .kicad_footprint import (
    module as module,
)
from .kicad_items import (
    Entry as Entry,
    Item as Item,
    entries as entries,
    section_units as section_units,
)
from .kicad_names import (
    BOARD_VERSION as BOARD_VERSION,
    HEAD as HEAD,
    LIBRARY as LIBRARY,
    PAPERS as PAPERS,
    POWER as POWER,
    SHEET_VERSION as SHEET_VERSION,
    circuit_net as circuit_net,
    footprint_name as footprint_name,
    identifier as identifier,
    kicad_net as kicad_net,
    project_name as project_name,
    safe_text as safe_text,
    sheet_id as sheet_id,
    symbol_id as symbol_id,
)
from .kicad_netlist import (
    netlist as netlist,
)
from .kicad_placement import (
    place as place,
)
from .kicad_reader import (
    EXCLUDED as EXCLUDED,
    PART_NUMBER as PART_NUMBER,
    TRACKS as TRACKS,
    BoardFile as BoardFile,
    PlacedFootprint as PlacedFootprint,
    PlacedPad as PlacedPad,
    check_belongs as check_belongs,
    pad_corners as pad_corners,
    read_board as read_board,
    turned as turned,
)
from .kicad_rules import (
    CANARY as CANARY,
    CANARY_WIDTH as CANARY_WIDTH,
    CustomRule as CustomRule,
    board_rules as board_rules,
    canary as canary,
    project_rules as project_rules,
    rules_text as rules_text,
)
from .kicad_symbols import (
    GRID as GRID,
    PART_ROW as PART_ROW,
    REACH as REACH,
    TEXT as TEXT,
    ShapePin as ShapePin,
    SymbolShape as SymbolShape,
    effects as effects,
    library as library,
    position as position,
    power as power,
)
from .net_classes import (
    CLASSES as CLASSES,
    DEFAULT as DEFAULT,
    SUMMING as SUMMING,
    SUPPLY as SUPPLY,
    VIA as VIA,
    net_settings as net_settings,
)
from .outline import (
    LAYER as LAYER,
    pen_path as pen_path,
    read_outline as read_outline,
)
from .pins import (
    SUPPLY_UNIT as SUPPLY_UNIT,
    Pin as Pin,
)
from .summing_nodes import (
    shortest_tree as shortest_tree,
)
