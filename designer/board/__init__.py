"""From a circuit to something that can be built: components, bill, drawing, KiCad project.

Everything is written from the circuit's parts and the fittings that a board adds to them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
