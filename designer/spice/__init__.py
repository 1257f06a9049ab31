"""ngspice: decks, op-amp models, runs behind a numerics gate, the check of the deck's equation.

``SpicePool`` runs decks in worker processes; ``numerics_gate`` says with which step an answer can
be believed.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
