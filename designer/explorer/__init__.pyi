from . import (
    server as server,
)
from .saved_page import (
    save_page as save_page,
)
