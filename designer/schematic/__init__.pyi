from . import (
    schematic_drawing as schematic_drawing,
)
from .kicad_project import (
    Project as Project,
    files as files,
)
