"""One response in three engines: the model, the exact circuit, ngspice; and whether to trust it.

``simulate`` answers for one frequency, ``check`` for all wanted responses of a design, ``Trust``
says what rounding, step or missing answers leave open.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
