"""Benchmarks of designer: `python -m benchmarks`."""

import os

# Before anything imports NumPy: one thread of linear algebra, as on the command line.
os.environ.update(OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1", BLIS_NUM_THREADS="1")
