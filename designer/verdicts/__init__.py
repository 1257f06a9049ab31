"""What one board answers to one wanted response, and the verdict on it.

``exact_circuit`` asks the exact circuit, ``ngspice_runs`` asks ngspice; ``cross_check`` says which
boards ngspice is asked about. ``judge`` compares an orbit with what is wanted.
"""
