"""What can be bought: part families, op-amps, diodes, references, each figure with its source.

Catalogues are data files; this package reads them, checks them and answers what is sold. The
limits of the design rules are data as well.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
