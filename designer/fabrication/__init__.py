"""What a maker of boards is sent: Gerbers, holes, positions and bill, packed with their hashes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
