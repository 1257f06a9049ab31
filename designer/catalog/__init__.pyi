from . import (
    diode_curve as diode_curve,
)
from .catalog import (
    Catalog as Catalog,
)
from .catalog import (
    load_catalog as load_catalog,
)
from .design_rule import (
    FAIL as FAIL,
)
from .design_rule import (
    NOT_RUN as NOT_RUN,
)
from .design_rule import (
    PASS as PASS,
)
from .design_rule import (
    Found as Found,
)
from .design_rule import (
    NotRun as NotRun,
)
from .design_rule import (
    Outcome as Outcome,
)
from .design_rule import (
    Override as Override,
)
from .design_rule import (
    Rule as Rule,
)
from .design_rule import (
    Scope as Scope,
)
from .design_rule import (
    judged as judged,
)
from .design_rule import (
    not_run as not_run,
)
from .design_rule import (
    shown as shown,
)
from .design_rules import (
    BY_ID as BY_ID,
)
from .design_rules import (
    RULES as RULES,
)
from .diode_curve import (
    THERMAL as THERMAL,
)
from .diode_curve import (
    DiodeModel as DiodeModel,
)
from .diode_curve import (
    card as card,
)
from .diode_curve import (
    diode_model as diode_model,
)
from .entries import (
    FORBIDDEN as FORBIDDEN,
)
from .entries import (
    PRICE_CLASSES as PRICE_CLASSES,
)
from .entries import (
    Diode as Diode,
)
from .entries import (
    Figure as Figure,
)
from .entries import (
    Kind as Kind,
)
from .entries import (
    Mounting as Mounting,
)
from .entries import (
    OpAmp as OpAmp,
)
from .entries import (
    PartChoice as PartChoice,
)
from .entries import (
    PartFamily as PartFamily,
)
from .entries import (
    Rating as Rating,
)
from .entries import (
    Reference as Reference,
)
from .entries import (
    Use as Use,
)
from .folders import (
    LAYOUTS as LAYOUTS,
)
from .vendor_model import (
    VendorModel as VendorModel,
)
