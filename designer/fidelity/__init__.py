"""What accuracy costs: time and error of every fidelity on a design, and the cheapest for a
question."""
