from . import (
    board_files as board_files,
    design_files as design_files,
    kicad_files as kicad_files,
    origin as origin,
    study_json as study_json,
)
from .curve_store import (
    CurveBlocks as CurveBlocks,
    curves_csv as curves_csv,
)
from .design_files import (
    design_provenance as design_provenance,
    load as load,
)
from .design_source import (
    bills_are_of_old as bills_are_of_old,
    design_answer as design_answer,
    design_inputs as design_inputs,
    design_stage as design_stage,
    grade_inputs as grade_inputs,
    read_design as read_design,
    standing_design as standing_design,
)
from .json_answers import (
    cost_of as cost_of,
    run_json as run_json,
    simulate_json as simulate_json,
)
from .model_source import (
    design_inputs_of as design_inputs_of,
    model_file as model_file,
    source as source,
)
from .origin import (
    provenance as provenance,
)
from .report_sections import (
    BENCHED as BENCHED,
    design_hash as design_hash,
    later_sections as later_sections,
    renew_report as renew_report,
)
from .share_store import (
    ShareBlocks as ShareBlocks,
    shares_csv as shares_csv,
)
from .study_cache import (
    CACHE as CACHE,
    StudyCache as StudyCache,
)
from .study_stores import (
    BLOCK_FOLDERS as BLOCK_FOLDERS,
    BOARDS as BOARDS,
    MAPS as MAPS,
    PIECES as PIECES,
    FolderStores as FolderStores,
    map_files as map_files,
)
from .sweep_store import (
    GridStore as GridStore,
    SweepStore as SweepStore,
    work_hash as work_hash,
    write_sweep as write_sweep,
)
from .sweep_tables import (
    points_csv as points_csv,
    windows_csv as windows_csv,
)
from .work_files import (
    WorkFiles as WorkFiles,
)
