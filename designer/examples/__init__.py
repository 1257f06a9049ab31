"""Reports on the systems of ``examples/``: what each shows, and what becomes of it on a board."""
