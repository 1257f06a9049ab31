"""Exact motion of piecewise-linear systems with a periodic drive, and the orbits they settle
on.

A system is its modes, guards and drive; nothing here knows of a circuit, a mechanism or a file, so
the package is usable alone with its ``kernels``. ``Flow`` moves a state, ``settle`` finds an
attractor, ``Orbit`` says it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
