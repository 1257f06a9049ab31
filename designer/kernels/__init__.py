"""The compiled inner loops of the exact motion: propagators, crossings of guards, orbits, sweeps.

``dynamics`` calls them with its tables. Arrays and numbers only; numba compiles each once.
"""
