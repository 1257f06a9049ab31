"""What accuracy costs: time and error of every rung on a design, and the cheapest for a
question."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
