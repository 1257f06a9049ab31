"""ngspice: decks, op-amp models, runs behind a numerics gate, the check of the deck's equation.

``SpicePool`` runs decks in worker processes; ``numerics_gate`` says with which step an answer can
be believed.
"""
