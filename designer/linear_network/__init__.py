"""The parts of the integrators: the values that make a system's linear coefficients, with a proof.

Compiled joins for two coupled masses, a tree of choices for any other pattern of terms, and the
mixed-integer programs that choose among equals.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
