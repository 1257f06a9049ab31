"""What accuracy costs: time and error of every rung on a design, and the cheapest for a
question."""
