from . import (
    diode_curve as diode_curve,
)
from .build_cost import (
    BuildCost as BuildCost,
)
from .catalog import (
    Catalog as Catalog,
    load_catalog as load_catalog,
)
from .coaxial_jack import (
    CoaxialJack as CoaxialJack,
)
from .design_rule import (
    FAIL as FAIL,
    NOT_RUN as NOT_RUN,
    PASS as PASS,
    ROUNDING as ROUNDING,
    DesignRule as DesignRule,
    Finding as Finding,
    NotRun as NotRun,
    Override as Override,
    RuleOutcome as RuleOutcome,
    Scope as Scope,
    judged as judged,
    not_run as not_run,
    value_text as value_text,
)
from .design_rules import (
    BY_ID as BY_ID,
    RULES as RULES,
)
from .diode_curve import (
    THERMAL as THERMAL,
    DiodeModel as DiodeModel,
    card as card,
    diode_model as diode_model,
)
from .entries import (
    FORBIDDEN as FORBIDDEN,
    DiodeEntry as DiodeEntry,
    Kind as Kind,
    Mounting as Mounting,
    OpAmp as OpAmp,
    PartChoice as PartChoice,
    PartFamily as PartFamily,
    Rating as Rating,
    ReferenceEntry as ReferenceEntry,
    Use as Use,
)
from .fab import (
    Fab as Fab,
    FabLimits as FabLimits,
    Measure as Measure,
    PositionField as PositionField,
    fab_limits as fab_limits,
    fabs as fabs,
)
from .fields import (
    PRICE_CLASSES as PRICE_CLASSES,
    Figure as Figure,
)
from .output_stage import (
    HEAVY_LOAD as HEAVY_LOAD,
    RATED_LOAD as RATED_LOAD,
    OutputStage as OutputStage,
    output_at as output_at,
    saturation_resistance as saturation_resistance,
)
from .read import (
    FABS as FABS,
    LAYOUTS as LAYOUTS,
)
from .stock_list import (
    StockRow as StockRow,
    order_number as order_number,
    stock_rows as stock_rows,
)
from .supply_diode import (
    SupplyDiodeEntry as SupplyDiodeEntry,
)
from .vendor_model import (
    VendorModel as VendorModel,
)
