from . import (
    diode_curve as diode_curve,
)
from .catalog import (
    Catalog as Catalog,
    load_catalog as load_catalog,
)
from .design_rule import (
    FAIL as FAIL,
    NOT_RUN as NOT_RUN,
    PASS as PASS,
    Found as Found,
    NotRun as NotRun,
    Outcome as Outcome,
    Override as Override,
    Rule as Rule,
    Scope as Scope,
    judged as judged,
    not_run as not_run,
    shown as shown,
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
    PRICE_CLASSES as PRICE_CLASSES,
    Diode as Diode,
    Figure as Figure,
    Kind as Kind,
    Mounting as Mounting,
    OpAmp as OpAmp,
    PartChoice as PartChoice,
    PartFamily as PartFamily,
    Rating as Rating,
    Reference as Reference,
    Use as Use,
)
from .folders import (
    LAYOUTS as LAYOUTS,
)
from .vendor_model import (
    VendorModel as VendorModel,
)
