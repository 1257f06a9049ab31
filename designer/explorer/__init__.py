"""A local page on which sliders move the parameters of a model and the response follows at once.

``explore`` serves it; ``ViewMaker`` computes what it shows, and needs no page.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
