from . import (
    atomic_write as atomic_write,
    figure_style as figure_style,
    jit as jit,
)
from .arrays import (
    Array as Array,
    Index as Index,
    Mask as Mask,
    distinct_indices as distinct_indices,
)
from .atomic_write import (
    NotWritten as NotWritten,
    appearing as appearing,
    write as write,
)
from .csv_tables import (
    csv_text as csv_text,
)
from .defaults import (
    CURVE_DEPTH as CURVE_DEPTH,
    DRAWN_STARTS as DRAWN_STARTS,
    OVERS as OVERS,
    SAMPLES as SAMPLES,
    SEARCH_SAMPLES as SEARCH_SAMPLES,
    SEED as SEED,
    STUDY_ENGINES as STUDY_ENGINES,
    TRADE_BOARDS as TRADE_BOARDS,
    Over as Over,
    StudyEngine as StudyEngine,
    at_least as at_least,
    cores as cores,
)
from .design_folder import (
    ASKED as ASKED,
    COMPARISON as COMPARISON,
    COMPARISON_PICTURES as COMPARISON_PICTURES,
    DESIGN as DESIGN,
    DESIGN_FILES as DESIGN_FILES,
    MODEL as MODEL,
    REPORTS as REPORTS,
    TOLERANCE as TOLERANCE,
    Folder as Folder,
    is_design_folder as is_design_folder,
)
from .environment import (
    changed_environment as changed_environment,
    clean_environment as clean_environment,
    python_command as python_command,
    set_environment as set_environment,
    spawn_context as spawn_context,
)
from .errors import (
    MISSING as MISSING,
    DesignerError as DesignerError,
    EnvironmentMissing as EnvironmentMissing,
    InputError as InputError,
    InputErrors as InputErrors,
    ResponseNotFound as ResponseNotFound,
    Unreachable as Unreachable,
    problems_in as problems_in,
)
from .eseries import (
    SERIES as SERIES,
    series_values as series_values,
)
from .figure_style import (
    CIRCUIT_COLOUR as CIRCUIT_COLOUR,
    CONTACT as CONTACT,
    GRID as GRID,
    IMPACT_COLOUR as IMPACT_COLOUR,
    INK as INK,
    MODEL_COLOUR as MODEL_COLOUR,
    MUTED as MUTED,
    NGSPICE_COLOUR as NGSPICE_COLOUR,
    ON_DARK as ON_DARK,
    ON_LIGHT as ON_LIGHT,
    axis_limits as axis_limits,
    name_rows as name_rows,
    new_figure as new_figure,
    number_cells as number_cells,
    picture as picture,
    plain_numbers as plain_numbers,
    say as say,
    shade_stops as shade_stops,
    style as style,
    styled as styled,
    to_png as to_png,
    to_svg as to_svg,
)
from .frames import (
    flat_frame as flat_frame,
    frame as frame,
    table_html as table_html,
)
from .guarded_reading import (
    UNREADABLE as UNREADABLE,
    csv_rows as csv_rows,
    decode as decode,
    inside as inside,
    parse_json as parse_json,
    read_bytes as read_bytes,
    read_text as read_text,
    reading as reading,
)
from .html_templates import (
    page_templates as page_templates,
)
from .jit import (
    callee as callee,
    compiled as compiled,
    embedded as embedded,
    inlined as inlined,
    leaf as leaf,
)
from .jit_notice import (
    announced as announced,
)
from .json_schema import (
    DIALECT as DIALECT,
    Json as Json,
    either as either,
    listed as listed,
    of_tables as of_tables,
)
from .keyed_store import (
    DAMAGED as DAMAGED,
    UNSEALED as UNSEALED,
    KeyedStore as KeyedStore,
    Lines as Lines,
    Note as Note,
    Vouch as Vouch,
    nobody as nobody,
    quiet as quiet,
    read_line as read_line,
    sealed_line as sealed_line,
)
from .manifest import (
    MANIFEST as MANIFEST,
    ManifestStage as ManifestStage,
    StageName as StageName,
    Stages as Stages,
    file_hash as file_hash,
    object_hash as object_hash,
    read_json as read_json,
)
from .natural_sort import (
    natural_key as natural_key,
)
from .netlist_guard import (
    RefusedNetlist as RefusedNetlist,
    check_netlist as check_netlist,
)
from .page import (
    Block as Block,
    Columns as Columns,
    FileLinks as FileLinks,
    Gallery as Gallery,
    Items as Items,
    Lead as Lead,
    Page as Page,
    PageSection as PageSection,
    Picture as Picture,
    SmallPrint as SmallPrint,
    Table as Table,
    Verbatim as Verbatim,
    Widget as Widget,
    bullets as bullets,
    markdown as markdown,
    paragraphs as paragraphs,
    table as table,
    table_of as table_of,
)
from .parquet_entry import (
    MOST_BYTES as MOST_BYTES,
    MOST_ROWS as MOST_ROWS,
    ParquetForm as ParquetForm,
    Rows as Rows,
)
from .plain_json import (
    FORMAT as FORMAT,
    dumps as dumps,
    plain as plain,
)
from .printed import (
    printable as printable,
    tell as tell,
)
from .progress import (
    Laps as Laps,
    Progress as Progress,
    best_so_far as best_so_far,
    doing as doing,
    note as note,
    part as part,
    progress_for as progress_for,
    seeking as seeking,
)
from .proportion import (
    mid_p as mid_p,
    wilson as wilson,
)
from .reason import (
    Reason as Reason,
)
from .record_check import (
    checked_record as checked_record,
)
from .report_pieces import (
    CaseStore as CaseStore,
    check_report_folder as check_report_folder,
)
from .schema import (
    FIRST_FORMAT as FIRST_FORMAT,
    Accepts as Accepts,
    FieldProblems as FieldProblems,
    FileTable as FileTable,
    accepts_value as accepts_value,
    check_values as check_values,
    checked as checked,
    choice as choice,
    did_you_mean as did_you_mean,
    expected_of as expected_of,
    flag as flag,
    fraction as fraction,
    keys_of as keys_of,
    line as line,
    lines as lines,
    literal as literal,
    nested_table as nested_table,
    number as number,
    one_of as one_of,
    physical as physical,
    physical_span as physical_span,
    several as several,
    span as span,
    such as such,
    text as text,
    validated as validated,
    whole_number as whole_number,
)
from .script_policy import (
    script_source as script_source,
)
from .seal import (
    BLANK as BLANK,
    sha256 as sha256,
)
from .second_process import (
    Ask as Ask,
    other_process as other_process,
)
from .sexpr import (
    Atom as Atom,
    Contents as Contents,
    Expression as Expression,
    expression as expression,
    expression_text as expression_text,
    lists as lists,
    number_text as number_text,
    read as read,
    word as word,
    write_all as write_all,
)
from .si_unit import (
    DIGITS as DIGITS,
    Unit as Unit,
    drive_text as drive_text,
    is_angular as is_angular,
    prefixed as prefixed,
    quantity_text as quantity_text,
    suffix as suffix,
    value_text as value_text,
)
from .threads import (
    heed as heed,
    interrupt as interrupt,
    parallel as parallel,
)
from .toml_reader import (
    parse_toml as parse_toml,
)
from .toml_writer import (
    toml_text as toml_text,
)
from .units import (
    ACCELERATIONS as ACCELERATIONS,
    VALUE_CODES as VALUE_CODES,
    decode_value as decode_value,
    distinct_texts as distinct_texts,
    encode_value as encode_value,
    format_quantity as format_quantity,
    has_unit as has_unit,
    parse_quantity as parse_quantity,
    restated as restated,
    shortest as shortest,
    spaced_quantity as spaced_quantity,
)
from .version import (
    __version__ as __version__,
)
from .views import (
    View as View,
)
