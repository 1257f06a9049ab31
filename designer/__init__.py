"""Op-amp circuits for mechanical models with clearances, and how many boards will work.

The names below are the whole for scripts (docs/python.md). Each is imported when it is first used,
so that worker processes and the command line load only what they need.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
