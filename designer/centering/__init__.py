"""Designs that spread cannot spoil: the search for the highest yield, and the cheapest cure.

It calls match, circuit and prediction again and again; nothing below imports it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
