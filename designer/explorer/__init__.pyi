from . import (
    server as server,
)
from .server import (
    explore as explore,
)
