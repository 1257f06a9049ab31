"""What every package needs and no field owns: errors, units, checks of input, whole-file writes.

Nothing here knows of mechanics, circuits or studies. The design folder, progress, threads and the
style of the figures live here too.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
