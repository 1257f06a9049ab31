"""Mechanical models, the model file, and the responses that are wanted.

``Dimensionless`` and ``Mechanical`` are the equations, ``read_model_file`` reads them with
everything else that a user states, ``find`` finds the wanted responses on the model.
"""
