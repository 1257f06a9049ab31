from . import (
    atomic_write as atomic_write,
)
from . import (
    figure_style as figure_style,
)
from .arrays import (
    Array as Array,
)
from .arrays import (
    Index as Index,
)
from .arrays import (
    Mask as Mask,
)
from .atomic_write import (
    appearing as appearing,
)
from .atomic_write import (
    write as write,
)
from .checks import (
    at_least as at_least,
)
from .checks import (
    cores as cores,
)
from .csv_tables import (
    csv_text as csv_text,
)
from .design_folder import (
    COMPARISON as COMPARISON,
)
from .design_folder import (
    COMPARISON_PICTURES as COMPARISON_PICTURES,
)
from .design_folder import (
    DESIGN as DESIGN,
)
from .design_folder import (
    DESIGN_FILES as DESIGN_FILES,
)
from .design_folder import (
    MODEL as MODEL,
)
from .design_folder import (
    REPORTS as REPORTS,
)
from .design_folder import (
    TOLERANCE as TOLERANCE,
)
from .design_folder import (
    Folder as Folder,
)
from .design_folder import (
    is_design_folder as is_design_folder,
)
from .doubt import (
    Doubt as Doubt,
)
from .environment import (
    changed_environment as changed_environment,
)
from .environment import (
    clean_environment as clean_environment,
)
from .environment import (
    set_environment as set_environment,
)
from .errors import (
    MISSING as MISSING,
)
from .errors import (
    DesignerError as DesignerError,
)
from .errors import (
    EnvironmentMissing as EnvironmentMissing,
)
from .errors import (
    InputError as InputError,
)
from .errors import (
    InputErrors as InputErrors,
)
from .errors import (
    Unreachable as Unreachable,
)
from .errors import (
    problems_in as problems_in,
)
from .eseries import (
    SERIES as SERIES,
)
from .eseries import (
    series_values as series_values,
)
from .figure_style import (
    CIRCUIT_COLOUR as CIRCUIT_COLOUR,
)
from .figure_style import (
    CONTACT as CONTACT,
)
from .figure_style import (
    EXACT as EXACT,
)
from .figure_style import (
    GRID as GRID,
)
from .figure_style import (
    IMPACT_COLOUR as IMPACT_COLOUR,
)
from .figure_style import (
    INK as INK,
)
from .figure_style import (
    MODEL_COLOUR as MODEL_COLOUR,
)
from .figure_style import (
    MUTED as MUTED,
)
from .figure_style import (
    NGSPICE_COLOUR as NGSPICE_COLOUR,
)
from .figure_style import (
    ON_DARK as ON_DARK,
)
from .figure_style import (
    ON_LIGHT as ON_LIGHT,
)
from .figure_style import (
    axis_limits as axis_limits,
)
from .figure_style import (
    new_figure as new_figure,
)
from .figure_style import (
    say as say,
)
from .figure_style import (
    style as style,
)
from .figure_style import (
    styled as styled,
)
from .figure_style import (
    to_png as to_png,
)
from .figure_style import (
    to_svg as to_svg,
)
from .hashing import (
    sha256 as sha256,
)
from .inside_folder import (
    inside as inside,
)
from .interruption import (
    heed as heed,
)
from .interruption import (
    interrupt as interrupt,
)
from .jit import (
    compiled as compiled,
)
from .jit_notice import (
    announced as announced,
)
from .manifest import (
    StageName as StageName,
)
from .manifest import (
    file_hash as file_hash,
)
from .manifest import (
    read_json as read_json,
)
from .natural_sort import (
    natural as natural,
)
from .netlist_guard import (
    check_netlist as check_netlist,
)
from .plain_json import (
    FORMAT as FORMAT,
)
from .plain_json import (
    dumps as dumps,
)
from .plain_json import (
    plain as plain,
)
from .progress import (
    Progress as Progress,
)
from .progress import (
    progress_for as progress_for,
)
from .proportion import (
    wilson as wilson,
)
from .report_guard import (
    check_ours as check_ours,
)
from .report_pieces import (
    CaseStore as CaseStore,
)
from .schema import (
    STRICT as STRICT,
)
from .schema import (
    Accepts as Accepts,
)
from .schema import (
    FieldProblems as FieldProblems,
)
from .schema import (
    Problem as Problem,
)
from .schema import (
    checked as checked,
)
from .schema import (
    choice as choice,
)
from .schema import (
    did_you_mean as did_you_mean,
)
from .schema import (
    exactly as exactly,
)
from .schema import (
    flag as flag,
)
from .schema import (
    line as line,
)
from .schema import (
    lines as lines,
)
from .schema import (
    number as number,
)
from .schema import (
    one_of as one_of,
)
from .schema import (
    parse_toml as parse_toml,
)
from .schema import (
    physical as physical,
)
from .schema import (
    physical_span as physical_span,
)
from .schema import (
    shown as shown,
)
from .schema import (
    span as span,
)
from .schema import (
    validated as validated,
)
from .sexpr import (
    Atom as Atom,
)
from .sexpr import (
    Expression as Expression,
)
from .sexpr import (
    expression as expression,
)
from .sexpr import (
    expression_text as expression_text,
)
from .sexpr import (
    number_text as number_text,
)
from .sexpr import (
    read as read,
)
from .sexpr import (
    word as word,
)
from .sexpr import (
    write_all as write_all,
)
from .threads import (
    parallel as parallel,
)
from .toml_writer import (
    toml_text as toml_text,
)
from .units import (
    VALUE_CODES as VALUE_CODES,
)
from .units import (
    decode_value as decode_value,
)
from .units import (
    encode_value as encode_value,
)
from .units import (
    format_quantity as format_quantity,
)
from .units import (
    parse_quantity as parse_quantity,
)
from .version import (
    __version__ as __version__,
)
from .views import (
    View as View,
)
