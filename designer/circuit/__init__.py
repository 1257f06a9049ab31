"""Parts, pins and nets; the matching conditions as a rule; the way back to a system.

``Circuit`` is the one list of parts that everything else is written from. ``Reduction`` makes a
piecewise-linear system of it by nodal analysis, so that circuit and model can be compared.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
