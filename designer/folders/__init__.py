"""What lies in the folder of a design or of a sweep: each file as it is written and read again,
with the JSON answers and where they come from."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
