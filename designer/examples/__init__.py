"""Reports on the systems of ``examples/``: what each shows, and what becomes of it on a board."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
