"""How boards of one design differ: grades, tracking, temperature, ageing, measured values.

``spread_of`` reads it from a model file and the catalogue, ``draw`` and ``draw_many`` draw boards
from a seed and the samples' indices.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
