"""Benchmarks of designer: `python -m benchmarks`."""
