"""Mechanical models, the model file, and the responses that are wanted.

``Dimensionless`` and ``Mechanical`` are the equations, ``read_model_file`` reads them with
everything else that a user states, ``find`` finds the wanted responses on the model.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
