"""Design rules on the circuit and on a finished board, each with its limit and source."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
