"""The compiled inner loops of the exact motion: propagators, crossings of guards, orbits, sweeps.

``dynamics`` calls them with its tables. Arrays and numbers only; numba compiles each once.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
