"""The parts of the integrators: the values that make a system's linear coefficients, with a proof.

Compiled joins for two coupled masses, a tree of choices for any other pattern of terms, and the
mixed-integer programs that choose among equals.
"""
