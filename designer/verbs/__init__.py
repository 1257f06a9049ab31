"""The verbs: each is one module with what it asks, answers and shows."""
