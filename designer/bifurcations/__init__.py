"""How orbits of a piecewise-linear system change with a parameter.

Continuation of stable and unstable branches, bifurcation points, sweeps, maps and basins, of
anything that is a ``Subject``. Usable with ``dynamics`` and ``kernels`` alone.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
